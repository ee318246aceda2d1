"""The failures nvhchain reports: bad input (value, limit, remedy) and solvers that did not deliver."""

from __future__ import annotations

from numbers import Real


class InputError(ValueError):
    """Input that cannot be used; the message names the value, the limit and the remedy."""


class FileFormatError(InputError):
    """A file that is truncated, damaged or not what it claims to be."""


class ResourceError(InputError):
    """A job that does not fit into this machine; the message says how large it is and how to shrink it."""


class WriteError(OSError):
    """A file that the system did not take; the message names it, the reason and the remedy."""

    def __init__(self, message: str, number: int | None = None) -> None:
        super().__init__(message)
        self.errno = number


class SolverError(RuntimeError):
    """A numerical method that did not reach its stated residual."""


class AccuracyWarning(UserWarning):
    """A result less accurate than its fidelity asks for; the message says by how much and what would help."""


def require(condition: bool, message: str) -> None:
    """Raise `InputError` with `message` unless `condition` holds."""
    if not condition:
        raise InputError(message)


def is_whole(value: object) -> bool:
    """Whether `value` is a whole number, of whichever numeric type."""
    return isinstance(value, Real) and float(value).is_integer()
