"""Error of the radiating surface in the limits: what its elements add at the upper frequency, and its shape below."""

from dataclasses import replace

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.acoustics import sphere
from nvhchain.acoustics.accuracy.mesh_error import expected_accuracy
from nvhchain.error_band import COVERAGE
from nvhchain.error_band.radiation import radiation_error
from nvhchain.fidelity import DRAFT
from nvhchain.handoff import SoundAccuracy
from nvhchain.levels import decibel


@pytest.fixture
def case(request):
    return nvh.load_case(request.config.rootpath / "cases" / "small" / "single_stage.toml")


@pytest.mark.filterwarnings("ignore:a field point is")
def test_the_error_of_the_surface_falls_with_the_square_of_the_frequency_to_that_of_its_shape(case):
    """As stated for a result whose upper frequency is that of the line; next to the surface, too."""
    surface, knobs, points = sphere(0.1, 2), DRAFT.acoustics, np.array([[0.0, 0.0, 0.103]])
    lines, top = np.array([100.0, 500.0, 1500.0]), 1500.0
    for place, part in ((None, "expected_error_db"), (points, "expected_error_nearest_db")):
        stated = expected_accuracy(surface, place, top, case.air, knobs)
        (found,) = radiation_error(surface, lines, case, knobs, stated)["surface mesh"].T
        own = [getattr(expected_accuracy(surface, place, line, case.air, knobs), part) for line in lines]
        assert 20 * np.log10(1 + found) == pytest.approx(own, rel=1e-3), part
    plain = radiation_error(surface, lines, case, knobs, SoundAccuracy(expected_error_db=0.5))
    assert np.ptp(plain["surface mesh"]) == 0, "without a stated shape the error is alike"


@pytest.mark.slow
def test_the_surface_of_draft_errs_by_less_than_its_limits_at_every_line(request):
    """Against elements a third as long, under the same forces, at lines within 40 dB of the strongest."""
    path = request.config.rootpath / "cases" / "small" / "single_stage.toml"
    found = nvh.run(nvh.load_case(path, changes=["operation.input_speed_rpm = 1350"]), fidelity=DRAFT)
    knobs = replace(DRAFT.acoustics, elements_per_wavelength=3 * DRAFT.acoustics.elements_per_wavelength)
    finer = replace(DRAFT, acoustics=knobs)
    true = nvh.run(found.case, fidelity=finer, mesh_laws=found.mesh_laws, bearing_forces=found.bearing_forces)
    level, reference = (decibel(of.pressure.pressure) for of in (found, true))
    loud = reference > reference.max() - 40.0
    errors = radiation_error(
        found.housing.surface, found.pressure.frequency, found.case, DRAFT.acoustics, found.transfer_vectors.accuracy
    )
    limit = 20 * np.log10(1 + COVERAGE * errors["surface mesh"])
    assert (np.abs(level - reference) < limit)[loud].all()
    assert limit.min() < 0.3 < limit.max()
