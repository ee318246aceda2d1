"""A mesher in a process of its own, so that nothing of it is loaded into the calling one.

Its job and its mesh go through pipes: no folder is left where either process ends, and no disk runs full.
"""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Callable
from typing import Any
from zipfile import BadZipFile

import numpy as np

from nvhchain.errors import SolverError
from nvhchain.runtime import processes

_LIBRARIES = "libgl1 libglu1-mesa libxcursor1 libxft2 libxinerama1 libgomp1"


def run_mesher(module: str, job: bytes, *, time_limit: float, failure: str, remedy: str) -> dict[str, np.ndarray]:
    """Return the arrays that `python -m module` makes of `job`, by a call of `serve`.

    time_limit: s.  failure: what to say when it fails, "gmsh could not …".  remedy: what helps then, or when it takes
    too long.  Raises SolverError with what the mesher said last, and the remedy: the libraries, where one is missing.
    """
    done = processes.exchange("-m", module, content=job, seconds=time_limit)
    if done is None:
        raise SolverError(f"the mesher did not finish within {time_limit:g} s: {remedy}")
    errors = done.stderr.decode(errors="replace")
    if done.returncode == 0:
        try:
            with np.load(io.BytesIO(done.stdout)) as file:
                return {name: file[name] for name in file.files}
        except (OSError, EOFError, ValueError, BadZipFile):
            errors = errors or "no mesh"
    said = (errors.strip() or "nothing").splitlines()[-1]
    if "cannot open shared object file" in errors:
        remedy = f"install the system libraries gmsh needs: {_LIBRARIES}"
    raise SolverError(f"{failure} (exit code {done.returncode}): {said}; {remedy}")


def serve(make: Callable[[bytes], dict[str, Any]]) -> None:
    """Be the process of `run_mesher`: arrays by name from the bytes of a job; what else is printed goes to stderr."""
    answer = os.dup(1)
    os.dup2(2, 1)
    content = io.BytesIO()
    np.savez(content, **make(sys.stdin.buffer.read()))
    with open(answer, "wb") as pipe:
        pipe.write(content.getbuffer())
