"""What the command line shows while it works, on whatever takes it."""

from __future__ import annotations

import codecs
import os
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from typing import Any, TextIO, cast

from nvhchain.cli.output import show
from nvhchain.names import printable

_PLAIN = {
    "…": "...", "–": "-", "−": "-", "·": "*", "×": "x", "±": "+-", "≤": "<=", "≥": ">=", "→": "->",
    "µ": "u", "°": " deg", "²": "^2", "³": "^3", "½": "1/2",
}  # fmt: skip
"""Spelling of characters that a terminal cannot show."""


def _spelt_out(error: UnicodeError) -> tuple[str, int]:
    """Handler of encoding errors: characters of `_PLAIN` in ASCII, others by their number."""
    assert isinstance(error, UnicodeEncodeError)
    lacking = error.object[error.start : error.end]
    spelt = [_PLAIN.get(character) or character.encode("ascii", "backslashreplace").decode() for character in lacking]
    return "".join(spelt), error.end


codecs.register_error("nvhchain.spelt_out", _spelt_out)


class _Stream:
    """A standard stream that spells out what its encoding lacks, and takes no notice of a reader that has left.

    optional: whether nothing else that fails matters either, as a full disk under a log.
    """

    def __init__(self, stream: TextIO, *, optional: bool) -> None:
        self._stream, self._optional = stream, optional
        self._error: OSError | None = None

    def write(self, text: str) -> int:
        encoding = self._stream.encoding or "utf-8"
        plain = text.encode(encoding, "nvhchain.spelt_out").decode(encoding)
        try:
            self._stream.write(plain)
        except OSError as error:
            self._give_up(error)
        return len(text)

    def flush(self) -> None:
        """Write what waits; raises what has failed before, too, as argparse takes no notice of it."""
        if self._error is not None:
            raise self._error
        try:
            self._stream.flush()
        except OSError as error:
            self._give_up(error)

    def _give_up(self, error: OSError) -> None:
        """Send what waits, and what follows, to nobody: Python itself would try again at its end."""
        with suppress(OSError), open(os.devnull, "wb") as nobody:
            os.dup2(nobody.fileno(), self._stream.fileno())
        if not (self._optional or isinstance(error, BrokenPipeError)):
            self._error = error
            raise error

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


@contextmanager
def standard_streams() -> Iterator[None]:
    """Standard streams on which printing works, closed ones included.

    The number of a closed stream would be that of the next file opened, into which a library could then print.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free
    before = sys.stdout, sys.stderr
    with ExitStack() as stack:
        out, err = (stream or stack.enter_context(open(os.devnull, "w", encoding="utf-8")) for stream in before)
        sys.stdout = cast(TextIO, _Stream(out, optional=False))
        sys.stderr = cast(TextIO, _Stream(err, optional=True))
        try:
            yield
        finally:
            sys.stderr.flush()
            sys.stdout, sys.stderr = before


class Console:
    """Progress on stderr: bars with remaining time on a terminal, one line per finished stage elsewhere."""

    def __init__(self) -> None:
        self._bar: Any = None
        self._started = 0.0

    def begin(self, stage: str) -> None:
        self._started = time.perf_counter()
        if sys.stderr.isatty():
            from tqdm import tqdm

            self._bar = tqdm(
                desc=printable(stage), total=1, leave=False, bar_format="{desc}: {percentage:3.0f}% |{bar}| {remaining}"
            )

    def step(self, stage: str, done: int, total: int) -> None:
        if self._bar is not None:
            self._bar.total, self._bar.n = total, done
            self._bar.refresh()

    def end(self, stage: str, how: str) -> None:
        if self._bar is not None:
            self._bar.close()
            self._bar = None
        seconds = f" in {time.perf_counter() - self._started:.1f} s" if how == "computed" else ""
        show(f"{stage}: {how}{seconds}", error=True)
