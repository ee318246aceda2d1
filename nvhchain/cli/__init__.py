"""Command line.  Exit code 0: everything asked for is there; 2: bad input."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence
from typing import Any

from nvhchain.cli.arguments import parser
from nvhchain.cli.console import Console
from nvhchain.cli.termination import Terminated, termination_interrupts
from nvhchain.errors import InputError, SolverError

__all__ = ["Console", "main", "parser"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code."""
    options = parser().parse_args(arguments)
    try:
        with termination_interrupts(), warnings.catch_warnings():
            warnings.showwarning = _warn
            return int(options.action(options))
    except InputError as error:
        print(f"nvhchain: {_one_line(error)}", file=sys.stderr)
        return 2
    except MemoryError as error:
        print(f"nvhchain: out of memory ({_one_line(error)}): choose a lower fidelity", file=sys.stderr)
        return 2
    except (SolverError, OSError) as error:
        print(f"nvhchain: {_one_line(error)}", file=sys.stderr)
        return 1
    except KeyboardInterrupt as signal:
        print("nvhchain: interrupted; finished stages are kept and will be found again", file=sys.stderr)
        return 143 if isinstance(signal, Terminated) else 130


def _warn(message: Warning | str, *_: Any, **__: Any) -> None:
    """What may be wrong with a result, in one line."""
    print(f"nvhchain: {' '.join(str(message).split())}", file=sys.stderr, flush=True)


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split()) or type(error).__name__
