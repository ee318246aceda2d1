"""Compiled functions whose cache on disk follows changes of the code that they inline from other modules.

Numba keeps a function's machine code as long as the content of the function's own file is the same. Code inlined or
linked from other files may have changed. The cache is filed under the function's name. A digest of those files in the
name therefore excludes old code.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import TypeVar

F = TypeVar("F", bound=Callable)


def inlines(*modules: ModuleType) -> Callable[[F], F]:
    """Decorate below `njit`: name the function after the source of `modules`, whose compiled functions it calls.

    Include modules that those call in turn. Every function that calls them, directly or not, needs the decorator.
    """
    source = hashlib.sha256()
    for module in modules:
        assert module.__file__ is not None
        source.update(Path(module.__file__).read_bytes())
    digest = source.hexdigest()[:12]

    def named(function: F) -> F:
        function.__qualname__ = f"{function.__qualname__}_{digest}"
        return function

    return named
