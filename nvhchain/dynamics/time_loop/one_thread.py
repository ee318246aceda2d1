"""Results that do not depend on the number of threads: linear algebra on one thread, which suits small matrices."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

from nvhchain.runtime.threads import blas_threads

P = ParamSpec("P")
R = TypeVar("R")


def one_blas_thread(function: Callable[P, R]) -> Callable[P, R]:
    """Decorate `function` to run with the linear algebra of the process on one thread."""

    @wraps(function)
    def limited(*args: P.args, **kwargs: P.kwargs) -> R:
        with blas_threads(1):
            return function(*args, **kwargs)

    return limited
