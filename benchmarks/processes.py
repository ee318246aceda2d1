"""A measurement in a process of its own, on as many threads as it is to have."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from typing import Any

THREADS = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
"""Variables of the environment that say how many threads a process may take."""


def measured(command: list[str], threads: int, **environment: str) -> dict[str, Any]:
    """What `command` prints last, as JSON.  What it warns of is seen; where it fails this process ends, too."""
    variables = {**os.environ, **dict.fromkeys(THREADS, str(threads)), **environment}
    done = subprocess.run(command, env=variables, stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"failed: {' '.join(command)}")
    return dict(json.loads(done.stdout.splitlines()[-1]))
