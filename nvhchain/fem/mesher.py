"""A mesher in a process of its own, so that nothing of it is loaded into the calling one."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from nvhchain.errors import SolverError

_LIBRARIES = "libgl1 libglu1-mesa libxcursor1 libxft2 libxinerama1 libgomp1"


def run_mesher(module: str, job: Path, result: Path, *, time_limit: float, failure: str, remedy: str) -> None:
    """Run `python -m module job result`, which reads the file `job` and writes the file `result`.

    time_limit: s.  failure: what to say when it fails, "gmsh could not …".  remedy: what helps then, or when it takes
    too long.  Raises SolverError with what the mesher said last, and the remedy: the libraries, where one is missing.
    """
    command = [sys.executable, "-m", module, str(job), str(result)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=time_limit, check=False)
    except subprocess.TimeoutExpired:
        raise SolverError(f"the mesher did not finish within {time_limit:g} s: {remedy}") from None
    if done.returncode != 0 or not result.exists():
        said = (done.stderr.strip() or done.stdout.strip() or "nothing").splitlines()[-1]
        if "cannot open shared object file" in done.stderr:
            remedy = f"install the system libraries gmsh needs: {_LIBRARIES}"
        raise SolverError(f"{failure} (exit code {done.returncode}): {said}; {remedy}")
