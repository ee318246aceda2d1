"""Results that a study computes, counted and in seconds, before it begins."""

from dataclasses import replace

import pytest

import nvhchain as nvh
from nvhchain.study import Parameter, Study, costs
from nvhchain.testing.coarse_runs import SMALL


@pytest.mark.slow
def test_the_plan_counts_the_contact_pressure_of_every_gearbox():
    """It took 1.4 s over 60 meshes of the single stage, and 0.12 s as drawn."""
    seed = Parameter("seed", ("gears.pinion.deviations.seed",), draw=True)
    of = {
        name: Study(
            SMALL.with_name(f"{name}.toml"), (seed,), plan="monte_carlo", designs=7, speeds_rpm=(1500.0, 1800.0)
        )
        for name in ("class_6", "single_stage")
    }
    assert not [cost for cost in costs(of["class_6"], nvh.DRAFT) if "pressure stage" in cost.name]
    for name, seconds in (("class_6", 1.4), ("single_stage", 0.12)):
        found = costs(replace(of[name], responses=("contact_pressure",)), nvh.DRAFT)
        (cost,) = (cost for cost in found if cost.name == "contact pressure stage")
        assert cost.times == 7
        assert cost.seconds == pytest.approx(seconds, rel=0.3)


def test_torques_of_one_load_share_the_mesh_law_and_nothing_else_of_the_gears():
    """60 and 80 N m press the flanks with 2.4 and 3.2 kN; both take the law of 4.1 kN."""
    seed = Parameter("seed", ("gears.pinion.deviations.seed",), values=(1,))
    study = Study(SMALL.with_name("class_6.toml"), (seed,), torques=(60.0, 80.0), responses=("contact_pressure",))
    times = {cost.name: cost.times for cost in costs(study, nvh.DRAFT)}
    assert times["mesh law stage"] == 1
    assert times["deviated law stage"] == times["contact pressure stage"] == 2
