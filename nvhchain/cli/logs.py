"""Log of a command: on stderr at the wanted level, and in a file with all details."""

from __future__ import annotations

import logging
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from nvhchain.cli.output import show
from nvhchain.errors import InputError
from nvhchain.names import printable

_LEVELS = (logging.WARNING, logging.INFO, logging.DEBUG)
_FORM = "%(asctime)s %(levelname)s %(name)s: %(message)s"


class _Lines(logging.Formatter):
    """Formatter that escapes control characters."""

    def format(self, record: logging.LogRecord) -> str:
        return printable(super().format(record))


class _File(logging.FileHandler):
    """File of a log; that it cannot be written is said once, and the command goes on."""

    _told = False

    def handleError(self, record: logging.LogRecord) -> None:
        error = sys.exc_info()[1]
        if not self._told:
            self._told = True
            reason = getattr(error, "strerror", None) or error
            show(
                f"{self.baseFilename}: the log cannot be written ({reason}): make room or name another file", error=True
            )


@contextmanager
def logged(verbosity: int, path: Path | None) -> Iterator[None]:
    """Log the package on stderr, from INFO with a `verbosity` of 1 and DEBUG with 2, and all of it in a file."""
    log, printed = logging.getLogger("nvhchain"), logging.getLogger("nvhchain.cli")
    with ExitStack() as stack:
        nothing = logging.NullHandler()  # without it Python prints once more what the command has printed
        printed.addHandler(nothing)
        stack.callback(printed.removeHandler, nothing)
        if verbosity or path is not None:
            lines = logging.StreamHandler(sys.stderr)
            lines.addFilter(lambda record: not record.name.startswith("nvhchain.cli"))  # printed already
            _add(stack, log, lines, _LEVELS[min(verbosity, 2)])
        if path is not None:
            try:
                file = _File(path, encoding="utf-8")
            except OSError as error:
                raise InputError(f"{path}: {error.strerror}: name another file for --log-file") from None
            stack.callback(_closed, file)
            _add(stack, log, file, logging.DEBUG)
        yield


def _closed(file: logging.FileHandler) -> None:
    """Close a file; what could not be written is told already."""
    with suppress(OSError):
        file.close()


def _add(stack: ExitStack, log: logging.Logger, handler: logging.Handler, level: int) -> None:
    before = log.level
    handler.setLevel(level)
    handler.setFormatter(_Lines(_FORM))
    log.addHandler(handler)
    log.setLevel(min(level, before or level))
    stack.callback(log.removeHandler, handler)
    stack.callback(log.setLevel, before)
