"""Command line.

Exit code 0: complete results; 1: failure of a solver or the system; 2: bad input; 3: a target is failed or not judged
(`--enforce`).
"""

from __future__ import annotations

import logging
import os
import sys
import warnings
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from signal import SIGINT
from typing import Any

import psutil

from nvhchain.cli import answers
from nvhchain.cli.arguments import parser
from nvhchain.cli.console import Console, standard_streams
from nvhchain.cli.logs import logged
from nvhchain.cli.output import show, warning_lines
from nvhchain.cli.termination import termination_interrupts
from nvhchain.errors import AccuracyWarning, InputError, Mistakes, SolverError

_log = logging.getLogger(__name__)

__all__ = ["Console", "main", "parser", "reported"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    arguments: arguments; those of the process by default.
    """
    try:
        words = parser()
    except KeyboardInterrupt:
        show("nvhchain: interrupted", error=True)
        return 130
    return reported(words, arguments)


def reported(words: ArgumentParser, arguments: Sequence[str] | None) -> int:
    """Run the action of a parser's options and print a failure as one line, several mistakes as one line each.

    words: parser; its options have an `action`, which takes them and returns an exit code.
    arguments: arguments; those of the process by default.
    """
    with standard_streams():
        return _reported(words, sys.argv[1:] if arguments is None else arguments)


def _reported(words: ArgumentParser, arguments: Sequence[str]) -> int:
    code, messages = _outcome(words, arguments)
    if messages and answers.requested(arguments):
        answers.print_errors(messages, code)
    for message in messages:
        show(f"nvhchain: {message}", error=True)
    return code


def _outcome(words: ArgumentParser, arguments: Sequence[str]) -> tuple[int, list[str]]:
    """Run the command; return its exit code and the messages of a failure."""
    try:
        try:
            with termination_interrupts():
                return _command(words, arguments)
        finally:
            sys.stdout.flush()  # output that cannot be printed is a failure, too
    except InputError as error:
        return 2, error.lines if isinstance(error, Mistakes) else [_one_line(error)]
    except MemoryError as error:
        return 2, [f"out of memory ({_one_line(error)}): choose a lower fidelity"]
    except (SolverError, OSError) as error:
        return 1, [_one_line(error)]
    except KeyboardInterrupt as signal:
        _remove_locks_of_children()
        return 128 + getattr(signal, "number", SIGINT), ["interrupted; finished steps are cached"]


def _remove_locks_of_children() -> None:
    """Wait for child processes, which end with an interrupted command, and remove the locks that they leave."""
    cache = sys.modules.get("nvhchain.files.result_cache")
    if cache is not None:  # else no lock has been taken
        psutil.wait_procs(psutil.Process().children(recursive=True), timeout=5.0)
        cache.remove_abandoned_locks()


def _command(words: ArgumentParser, arguments: Sequence[str]) -> tuple[int, list[str]]:
    json_asked = answers.requested(arguments)
    options = answers.parsed(words, arguments) if json_asked else words.parse_args(arguments)
    if isinstance(options, str):
        return 2, [options.removeprefix("nvhchain: ")]
    _check_environment()
    _check_outputs(options)
    with logged(getattr(options, "verbose", 0), getattr(options, "log_file", None)), _warnings_shown():
        if json_asked:
            return answers.answered(options.action, options), []
        return int(options.action(options)), []


def _check_outputs(options: Namespace) -> None:
    """Refuse to write a file that the command reads."""
    given = dict(vars(options))
    written = {f"--{name.replace('_', '-')}": given.pop(name, None) for name in ("out", "log_file")}
    read = [each for value in given.values() for each in (value if isinstance(value, list | tuple) else (value,))]
    files = [Path(each) for each in read if isinstance(each, str | Path) and os.path.isfile(each)]
    for name, path in written.items():
        if path is not None and os.path.isfile(path) and any(os.path.samefile(path, file) for file in files):
            raise InputError(f"{name} {path}: the command reads this file: name another one")


def _check_environment() -> None:
    """Refuse numbers of threads with which numba cannot be imported; an empty value counts as unset.

    A backend of matplotlib is ignored: commands open no window, and its import fails with an unknown one.
    """
    os.environ.pop("MPLBACKEND", None)
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
        _log.warning("%s", " ".join(str(message).split()))
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
