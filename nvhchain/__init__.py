"""nvhchain: from gear geometry to the sound pressure of a gearbox.

The names below are imported at their first use, so that `import nvhchain` is fast.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from nvhchain.fidelity import DRAFT, REFERENCE, STANDARD
from nvhchain.runtime.numba_settings import ignore_settings_file

if TYPE_CHECKING:
    from nvhchain.case import load_case, save_case
    from nvhchain.chain import record, run
    from nvhchain.scene import plan

ignore_settings_file()

__version__ = "0.1.0"
__all__ = ["DRAFT", "REFERENCE", "STANDARD", "load_case", "plan", "record", "run", "save_case"]

_HOMES = {"load_case": "case", "plan": "scene", "record": "chain", "run": "chain", "save_case": "case"}


# fmt: off
_ROOMS = {
    "acoustics", "bearings", "case", "chain", "conventions", "doctor", "dynamics", "error_band", "errors",
    "fem", "fidelity", "files", "gear", "handoff", "housing", "interop", "levels", "lumped", "plots", "report",
    "scene", "sound", "spectrum", "study", "tradeoff",
}
# fmt: on
"""Sub-packages that `nvhchain.NAME` imports at the first use."""


def __getattr__(name: str) -> Any:
    """Import a name of `__all__`, or a sub-package, at its first use."""
    if name in _HOMES:
        return getattr(import_module(f"nvhchain.{_HOMES[name]}"), name)
    if name in _ROOMS:
        return import_module(f"nvhchain.{name}")
    raise AttributeError(f"module 'nvhchain' has no attribute {name!r}")


def __dir__() -> list[str]:
    """Return names for completion, those not yet imported included."""
    return sorted({*globals(), *__all__, *_ROOMS})
