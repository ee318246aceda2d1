"""Output of the command line, in one place: names from outside must not steer a terminal."""

from __future__ import annotations

import sys

from nvhchain.names import printable


def show(text: object, *, error: bool = False, end: str = "\n") -> None:
    """Print at once, control characters escaped, on stdout, or on stderr for an `error` or a remark."""
    print(printable(str(text)), file=sys.stderr if error else sys.stdout, end=end, flush=True)
