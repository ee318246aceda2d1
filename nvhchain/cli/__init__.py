"""Command line.  Exit code 0: everything asked for is there; 2: bad input."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

from nvhchain.cli.arguments import parser
from nvhchain.cli.console import Console
from nvhchain.cli.output import show
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
        show(f"nvhchain: {_one_line(error)}", error=True)
        return 2
    except MemoryError as error:
        show(f"nvhchain: out of memory ({_one_line(error)}): choose a lower fidelity", error=True)
        return 2
    except (SolverError, OSError) as error:
        show(f"nvhchain: {_one_line(error)}", error=True)
        return 1
    except KeyboardInterrupt as signal:
        show("nvhchain: interrupted; finished stages are kept and will be found again", error=True)
        return 143 if isinstance(signal, Terminated) else 130


def _warn(message: Warning | str, *_: Any, **__: Any) -> None:
    """What may be wrong with a result, in one line."""
    show(f"nvhchain: {' '.join(str(message).split())}", error=True)


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split()) or type(error).__name__
