"""Compiled functions whose cache on disk notices changes of the code that they inline from other modules.

Numba keeps a function's machine code as long as the file of the function has not changed, by its content; what it has
inlined or linked from other files may have. The cache is filed under the function's name: with a digest of those
files in it, old code is not found any more.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import TypeVar

F = TypeVar("F", bound=Callable)


def inlines(*modules: ModuleType) -> Callable[[F], F]:
    """Put below `njit`: name the function after the source of `modules`, from which it calls compiled functions, those
    that they call in turn included. Of functions in one file all that do, directly or not, need it."""
    source = hashlib.sha256()
    for module in modules:
        assert module.__file__ is not None
        source.update(Path(module.__file__).read_bytes())
    digest = source.hexdigest()[:12]

    def named(function: F) -> F:
        function.__qualname__ = f"{function.__qualname__}_{digest}"
        return function

    return named
