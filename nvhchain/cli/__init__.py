"""Command line. Exit code 0: complete results; 1: failure of a solver or the system; 2: bad input."""

from __future__ import annotations

import os
import sys
import warnings
from argparse import ArgumentParser
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from nvhchain.cli.arguments import parser
from nvhchain.cli.console import Console, standard_streams
from nvhchain.cli.output import show
from nvhchain.cli.termination import Terminated, termination_interrupts
from nvhchain.cli.warning_lines import warning_lines
from nvhchain.errors import AccuracyWarning, InputError, Mistakes, SolverError

__all__ = ["Console", "main", "parser", "reported"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        Arguments; those of the process by default.

    Returns
    -------
    int
        Exit code.
    """
    return reported(parser(), arguments)


def reported(words: ArgumentParser, arguments: Sequence[str] | None) -> int:
    """Run the action of a parser's options and print a failure as one line, several mistakes as one line each.

    Parameters
    ----------
    words : ArgumentParser
        Parser; its options have an `action`, which takes them and returns an exit code.
    arguments : sequence of str, optional
        Arguments; those of the process by default.

    Returns
    -------
    int
        Exit code.
    """
    with standard_streams():
        return _reported(words, arguments)


def _reported(words: ArgumentParser, arguments: Sequence[str] | None) -> int:
    try:
        try:
            with termination_interrupts():
                return _command(words, arguments)
        finally:
            sys.stdout.flush()  # output that cannot be printed is a failure, too
    except InputError as error:
        for mistake in error.lines if isinstance(error, Mistakes) else [_one_line(error)]:
            show(f"nvhchain: {mistake}", error=True)
        return 2
    except MemoryError as error:
        show(f"nvhchain: out of memory ({_one_line(error)}): choose a lower fidelity", error=True)
        return 2
    except (SolverError, OSError) as error:
        show(f"nvhchain: {_one_line(error)}", error=True)
        return 1
    except KeyboardInterrupt as signal:
        show("nvhchain: interrupted; finished steps are cached", error=True)
        return 143 if isinstance(signal, Terminated) else 130


def _command(words: ArgumentParser, arguments: Sequence[str] | None) -> int:
    options = words.parse_args(arguments)
    _check_environment()
    with _warnings_shown():
        return int(options.action(options))


def _check_environment() -> None:
    """Refuse numbers of threads with which numba cannot be imported; an empty value counts as unset."""
    name = "NUMBA_NUM_THREADS"
    value = os.environ.get(name, "").strip()
    if not value:
        os.environ.pop(name, None)
    elif not (value.isascii() and value.isdigit() and int(value) > 0):
        raise InputError(f"{name} = {value} must be a whole number, 1 or more: correct the variable or unset it")


@contextmanager
def _warnings_shown() -> Iterator[None]:
    """Show warnings as one line each, those of accuracy at the end, one line of each kind (`warning_lines`).

    They are shown despite `python -W error`, which would also stop at those of other packages.
    """
    doubts: list[AccuracyWarning] = []

    def tell(message: Warning | str, *_: Any, **__: Any) -> None:
        if isinstance(message, AccuracyWarning):
            doubts.append(message)
        else:
            _warn(message)

    with warnings.catch_warnings():
        if any(action == "error" for action, *_ in warnings.filters):
            warnings.resetwarnings()
            for category in (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning):
                warnings.simplefilter("ignore", category)
        if not sys.warnoptions:
            warnings.simplefilter("always", AccuracyWarning)
        warnings.showwarning = tell
        try:
            yield
        finally:
            for line in warning_lines(doubts):
                _warn(line)


def _warn(message: Warning | str) -> None:
    """Print a warning in one line."""
    show(f"nvhchain: {' '.join(str(message).split())}", error=True)


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split()) or type(error).__name__
