"""numba takes no settings from the working directory.

It reads `.numba_config.yaml` there when it is imported and before every compilation. Such a file may name the folder
of compiled code, which is unpickled and run.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType

_MODULE = "numba.core.config"


class _WithoutFile(MetaPathFinder):
    """Finder of numba's settings, which then are those of the environment alone."""

    def find_spec(self, name: str, path: Sequence[str] | None, target: ModuleType | None = None) -> ModuleSpec | None:
        """Return the specification of numba's settings; None for all other modules."""
        if name != _MODULE:
            return None
        spec = PathFinder.find_spec(name, path, target)
        if spec is not None and spec.loader is not None:
            execute = spec.loader.exec_module

            def execute_alone(module: ModuleType) -> None:
                kept = sys.modules.get("yaml")
                sys.modules["yaml"] = None  # type: ignore[assignment]
                try:
                    with warnings.catch_warnings():
                        warnings.filterwarnings("ignore", "A Numba config file is found")
                        execute(module)
                finally:
                    del sys.modules["yaml"]
                    if kept is not None:
                        sys.modules["yaml"] = kept
                module._config_fname = ""  # type: ignore[attr-defined]

            spec.loader.exec_module = execute_alone  # type: ignore[method-assign]
        return spec


def ignore_settings_file() -> None:
    """Keep numba, if it is not yet imported, from reading settings from the working directory."""
    if _MODULE not in sys.modules:
        sys.meta_path.insert(0, _WithoutFile())
