"""The one place where the command line writes: names from outside may not steer a terminal."""

from __future__ import annotations

import sys

from nvhchain.names import printable


def show(what: object, *, error: bool = False, end: str = "\n") -> None:
    """Print on stdout, or on stderr where it is an `error` or beside the result, with control characters escaped."""
    print(printable(str(what)), file=sys.stderr if error else sys.stdout, end=end, flush=error)
