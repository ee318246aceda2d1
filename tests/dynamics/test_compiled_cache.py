"""The cache of compiled functions follows the code that they inline from other files."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import pytest

from nvhchain.dynamics.time_loop import _correction as _bend
from nvhchain.dynamics.time_loop import _law_step, _march, _newton

INNER = """
from numba import njit

@njit("f8(f8)", cache=True, forceinline=True)
def inner(x):
    return {} * x
"""
OUTER = """
from numba import njit
import inner as source
from inner import inner
from nvhchain.runtime._inlined import inlines

@njit("f8(f8)", cache=True)
@inlines(source)
def outer(x):
    return inner(x) + 1.0

if __name__ == "__main__":
    print(outer(1.0), sum(outer.stats.cache_hits.values()))
"""


@pytest.mark.slow
def test_changed_code_that_is_inlined_is_compiled_anew_and_unchanged_is_not(tmp_path):
    (tmp_path / "outer.py").write_text(OUTER)

    def run(factor):
        (tmp_path / "inner.py").write_text(INNER.format(factor))
        environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": os.pathsep.join(sys.path)}
        found = subprocess.run(
            [sys.executable, "-B", "outer.py"],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        )
        value, hits = found.stdout.split()
        return float(value), int(hits)

    assert run("2.0") == (3.0, 0)
    assert run("2.0") == (3.0, 1)
    assert run("5.0") == (6.0, 0)
    assert run("2.0") == (3.0, 1)  # both are kept


@pytest.mark.parametrize(
    ("file", "modules", "callers"),
    [(_march, (_bend, _law_step, _newton), {"_residual", "_solve_in_cells", "march"}),
     (_bend, (_law_step,), {"flank_force", "store_step", "mean_excess_correction"})],
)  # fmt: skip
def test_every_function_of_the_time_loop_that_calls_others_is_named_after_them(file, modules, callers):
    source = b"".join(Path(module.__file__).read_bytes() for module in modules)
    digest = hashlib.sha256(source).hexdigest()[:12]
    theirs = {name for module in modules for name, of in vars(module).items() if hasattr(of, "py_func")}
    own = {name: of.py_func for name, of in vars(file).items() if hasattr(of, "py_func") and name not in theirs}
    if file is _march:
        own["march"] = _march.march_of(False, False).py_func
    calling, grown = set(theirs), -1
    while grown != len(calling):
        grown = len(calling)
        calling |= {name for name, of in own.items() if calling.intersection(of.__code__.co_names)}
    assert calling - theirs == callers
    for name in callers:
        assert own[name].__qualname__.split(".")[-1] == f"{name}_{digest}"
