"""Flank compliances belong to a gear body: nothing else computes them again."""

from dataclasses import replace

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain import gear
from nvhchain.chain import steps
from nvhchain.chain.running import Run
from nvhchain.files.result_cache import ResultCache
from nvhchain.scene import Scene


@pytest.fixture
def laws(coarse, tmp_path):
    def made(case, folder="operators"):
        return steps.mesh_laws(Run(Scene(case, coarse), shared=ResultCache(tmp_path / folder)))

    return made


@pytest.fixture
def bodies(monkeypatch):
    """Teeth of the gears whose flanks were computed."""
    computed, own = [], gear.flank_flexibility

    def counted(body, *given, **named):
        computed.append(body.geometry.teeth)
        return own(body, *given, **named)

    monkeypatch.setattr(gear, "flank_flexibility", counted)
    return computed


@pytest.mark.slow
def test_another_torque_or_blank_computes_no_flanks_of_the_same_gear_body_again(laws, bodies, request):
    case = nvh.load_case(request.config.rootpath / "cases" / "small" / "single_stage.toml")
    pinion, wheel = (each.geometry.teeth for each in case.gears)
    (law,) = laws(case)
    assert bodies == [pinion, wheel]
    (harder,) = laws(replace(case, operation=replace(case.operation, input_torque=2.0 * case.operation.input_torque)))
    assert bodies == [pinion, wheel]
    assert harder.deflection[-1] > 1.1 * law.deflection[-1]
    thinner = gear.ThinRim(web_thickness=0.004, hub_radius=0.020, rim_radius=0.032)
    (second,) = laws(replace(case, gears=(case.gears[0], replace(case.gears[1], blank=thinner))))
    assert bodies == [pinion, wheel, wheel]
    (alone,) = laws(replace(case, gears=(case.gears[0], replace(case.gears[1], blank=thinner))), "alone")
    assert np.array_equal(second.force, alone.force)  # kept flanks are the same to the last bit
