"""The same sound by either sparse solver, on the whole chain of the small single stage."""

import numpy as np
import pytest

import nvhchain as nvh
import nvhchain.fem._sparse as door
from nvhchain.errors import ResourceError
from nvhchain.scene import preflight
from nvhchain.testing.coarse_runs import TINY, small_gearbox


@pytest.mark.slow
def test_levels_by_cholmod_are_those_by_pardiso_to_1e_9(monkeypatch):
    """SuperLU is given nothing, so that the modes of the housing come without a count."""
    found = {}
    for engine in ("pardiso", "cholmod"):
        monkeypatch.setenv(door.VARIABLE, engine)
        monkeypatch.setattr(door, "SUPERLU_UNKNOWNS", 0)
        found[engine] = nvh.run(small_gearbox(), fidelity=TINY)
    first, second = (found[engine].pressure.pressure for engine in ("pardiso", "cholmod"))
    assert not np.array_equal(first, second)  # two solvers
    assert np.abs(second - first).max() < 1e-8 * np.abs(first).max()
    levels = [nvh.levels.overall(of.pressure.frequency, of.pressure.pressure[:, 0]) for of in found.values()]
    assert levels[1] == pytest.approx(levels[0], rel=1e-9)


def test_a_housing_that_no_solver_here_can_carry_is_refused_before_any_work(request, monkeypatch):
    case = nvh.load_case(request.config.rootpath / "cases" / "gearbox" / "solid.toml")
    for name in ("_has_pardiso", "_has_cholmod"):
        monkeypatch.setattr(door, name, lambda: False)
    with pytest.raises(ResourceError, match=r"\d{6} unknowns are too many for SuperLU \(limit 40000\): install"):
        preflight(case, nvh.DRAFT)
