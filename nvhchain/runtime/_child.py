"""Start of a child process, which ends with its caller in any case and runs `python *arguments`.

It is run by its path, as `_child.py CALLER ARGUMENTS`, so that only modules of Python are loaded.
"""

from __future__ import annotations

import ctypes
import os
import runpy
import signal
import sys

_PR_SET_PDEATHSIG = 1


def _end_with(caller: int) -> None:
    """Let the system kill this process once the thread that started it is gone (Linux only)."""
    if not sys.platform.startswith("linux"):
        return
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, int(signal.SIGKILL))
    if os.getppid() != caller:  # gone before
        sys.exit(1)


def _run(*arguments: str) -> None:
    """Run code (`-c`), a module (`-m`) or a script as Python does."""
    sys.argv = list(arguments)
    if arguments[0] == "-c":
        sys.argv = ["-c", *arguments[2:]]
        exec(compile(arguments[1], "<string>", "exec"), {"__name__": "__main__"})
    elif arguments[0] == "-m":
        sys.argv = list(arguments[1:])
        runpy.run_module(arguments[1], run_name="__main__", alter_sys=True)
    else:
        runpy.run_path(arguments[0], run_name="__main__")


if __name__ == "__main__":
    _end_with(int(sys.argv[1]))
    _run(*sys.argv[2:])
