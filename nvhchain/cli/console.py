"""Output of the command line during its work, on any stream."""

from __future__ import annotations

import codecs
import os
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any, TextIO, cast

from nvhchain.cli.output import show
from nvhchain.names import printable

_PLAIN = {
    "…": "...", "–": "-", "−": "-", "·": "*", "×": "x", "±": "+-", "≤": "<=", "≥": ">=", "→": "->",
    "µ": "u", "°": " deg", "²": "^2", "³": "^3", "½": "1/2",
}  # fmt: skip
"""Spelling of characters that a terminal cannot display."""


def _spelt_out(error: UnicodeError) -> tuple[str, int]:
    """Handle encoding errors: characters of `_PLAIN` in ASCII, others by their number."""
    assert isinstance(error, UnicodeEncodeError)
    lacking = error.object[error.start : error.end]
    spelt = [_PLAIN.get(character) or character.encode("ascii", "backslashreplace").decode() for character in lacking]
    return "".join(spelt), error.end


codecs.register_error("nvhchain.spelt_out", _spelt_out)


class _Stream:
    """Standard stream that spells out characters missing in its encoding, and ignores a reader that has left.

    optional : True if other failures, such as a full disk under a log, are ignored as well.
    """

    def __init__(self, stream: TextIO, *, optional: bool) -> None:
        self._stream, self._optional = stream, optional
        self._error: OSError | None = None

    def write(self, text: str) -> int:
        """Write a text."""
        encoding = self._stream.encoding or "utf-8"
        plain = text.encode(encoding, "nvhchain.spelt_out").decode(encoding)
        try:
            self._stream.write(plain)
        except OSError as error:
            self._discard_output(error)
        return len(text)

    def flush(self) -> None:
        """Write buffered text; raise earlier failures too, as argparse ignores them."""
        if self._error is not None:
            raise self._error
        try:
            self._stream.flush()
        except OSError as error:
            self._discard_output(error)

    def _discard_output(self, error: OSError) -> None:
        """Send buffered and later text to the null device, as Python itself would try again at its end."""
        with suppress(OSError), open(os.devnull, "wb") as nobody:
            os.dup2(nobody.fileno(), self._stream.fileno())
        if not (self._optional or isinstance(error, BrokenPipeError)):
            why = error.strerror or str(error)
            self._error = OSError(f"output cannot be printed: {why}: redirect it to where there is room")
            raise self._error from error

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


@contextmanager
def standard_streams() -> Iterator[None]:
    """Provide standard streams that can be printed on, closed ones included.

    The next file opened would get the number of a closed stream, and a library could then print into it.
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
    """Progress on stderr: bars with remaining time on a terminal, a line at the begin of each step elsewhere.

    The end of every step has a line too. Lines that belong to a case are indented below its name.
    """

    def __init__(self) -> None:
        self._bar: Any = None
        self._started = 0.0
        self._indent = self._case = ""
        self._ahead: Callable[[], Mapping[tuple[str, str], float]] = dict

    def begin_case(self, name: str) -> None:
        """Print the name of the case that is run."""
        show(f"{name}:", error=True)
        self._indent, self._case = "  ", name

    def unchanged(self, folder: Path) -> None:
        """Print that a comparison stands in its folder already."""
        show(f"nothing has changed since {folder} was written: nothing is computed", error=True)

    def ahead(self, finished: Callable[[], Mapping[tuple[str, str], float]]) -> None:
        """Receive a function that returns (case, step) → seconds of the steps that another process has computed."""
        self._ahead = finished

    def begin(self, step: str) -> None:
        """Begin a step."""
        self._started = time.perf_counter()
        if sys.stderr.isatty():
            from tqdm import tqdm

            self._bar = tqdm(
                desc=self._indent + printable(step),
                total=1,
                leave=False,
                bar_format="{desc}: {percentage:3.0f}% |{bar}| {remaining}",
            )
        else:
            show(f"{self._indent}{step} …", error=True)

    def step(self, step: str, done: int, total: int) -> None:
        """Advance the bar of the step to `done` of `total`."""
        if self._bar is not None:
            self._bar.total, self._bar.n = total, done
            self._bar.refresh()

    def end(self, step: str, outcome: str) -> None:
        """End the step; `outcome` is its outcome, such as "computed"."""
        if self._bar is not None:
            self._bar.close()
            self._bar = None
        ahead_seconds = self._ahead().get((self._case, step)) if outcome == "cached" else None
        seconds = f" in {time.perf_counter() - self._started:.1f} s" if outcome == "computed" else ""
        if ahead_seconds is not None:
            outcome, seconds = "computed", f" in {ahead_seconds:.1f} s, beside other steps"
        show(f"{self._indent}{step}: {outcome}{seconds}", error=True)
