"""Mesher in a process of its own, so that its libraries stay out of the calling process.

Job and mesh go through pipes: neither process leaves a folder behind, and no disk runs full.
"""

from __future__ import annotations

import io
import os
import re
import sys
from collections.abc import Callable
from typing import Any
from zipfile import BadZipFile

import numpy as np

from nvhchain.errors import SolverError
from nvhchain.runtime import processes

_COLOURS = re.compile(r"\x1b\[[0-9;]*m")
"""Marks of colours in a terminal."""

_LIBRARIES = "libgl1 libglu1-mesa libxcursor1 libxft2 libxinerama1 libgomp1"


def run_mesher(module: str, job: bytes, *, time_limit: float, failure: str, remedy: str) -> dict[str, np.ndarray]:
    """Return the arrays that `python -m module` makes of `job`, by a call of `serve`.

    time_limit : longest duration (s).
    failure : begin of the message of a failure, "gmsh could not …".
    remedy : remedy for a failure or a time-out.

    Raises SolverError with the mesher's last message and the remedy: the libraries, if one is missing.
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
    said = (_COLOURS.sub("", errors).strip(" *\n") or "nothing").splitlines()[-1]
    if "cannot open shared object file" in errors:
        remedy = f"install the system libraries gmsh needs: {_LIBRARIES}"
    raise SolverError(f"{failure} (exit code {done.returncode}): {said}; {remedy}")


def serve(make: Callable[[bytes], dict[str, Any]]) -> None:
    """Serve `run_mesher`: write the arrays that `make` makes of the job's bytes; other output goes to stderr."""
    answer = os.dup(1)
    os.dup2(2, 1)
    content = io.BytesIO()
    np.savez(content, **make(sys.stdin.buffer.read()))
    with open(answer, "wb") as pipe:
        pipe.write(content.getbuffer())
