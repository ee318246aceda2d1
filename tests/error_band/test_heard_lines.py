"""Errors by vectors and housing are computed at the lines that are heard; silence has none."""

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.acoustics import radiate
from nvhchain.error_band import COVERAGE, Origin, error_band, quantities
from nvhchain.fidelity import DRAFT
from nvhchain.handoff import SoundAccuracy
from nvhchain.housing import respond
from nvhchain.testing.ball_with_modes import LINES
from nvhchain.testing.hand_offs import mesh_law

pytestmark = pytest.mark.filterwarnings(
    "ignore:interpolation between master frequencies:nvhchain.errors.AccuracyWarning"
)


def band(case, housing, parts, laws=()):
    pressure, velocity, vectors, forces = parts
    origin = Origin(case, DRAFT, housing=housing, force_spectrum=forces, mesh_laws=laws)
    return error_band(origin, pressure, velocity, transfer_vectors=vectors)


def test_lines_that_nobody_hears_take_no_vectors_and_change_no_other_line(case, housing, parts, monkeypatch):
    """Also where a microphone that hears others stands in a null; their own gear errors are computed."""
    _, _, vectors, forces = parts
    loud = np.arange(len(LINES)) % 3 != 1
    forces = forces.replace(force=forces.force * np.where(loud, 1.0, 1e-6)[:, None, None])  # 120 dB
    velocity = respond(housing, forces)
    pressure = radiate(vectors, velocity, fidelity=DRAFT.acoustics)
    quiet = pressure.pressure.copy()
    quiet[0, 1] = 1e-14
    pressure, laws = pressure.replace(pressure=quiet, input_speed=2 * np.pi * 10.0), [mesh_law([1e-6, 1e-6])]
    computed, estimate = [], nvh.acoustics.interpolation_error

    def counting(vectors, velocity, *, fidelity):
        computed.append(velocity.frequency.tolist())
        return estimate(vectors, velocity, fidelity=fidelity)

    monkeypatch.setattr(nvh.acoustics, "interpolation_error", counting)
    made = band(case, housing, (pressure, velocity, vectors, forces), laws)
    monkeypatch.setattr(quantities, "_HEARD_SHARE", 0.0)
    whole = band(case, housing, (pressure, velocity, vectors, forces), laws)
    assert computed == [LINES[loud].tolist(), LINES.tolist()]
    assert made.overall == pytest.approx(whole.overall, abs=1e-3)
    assert {*made.sources} == {*whole.sources}
    for name, error in made.sources.items():
        assert error[loud] == pytest.approx(whole.sources[name][loud], rel=1e-9), name
    own = estimate(vectors, velocity.select(loud), fidelity=DRAFT.acoustics)
    assert made.sources["masters"][loud] == pytest.approx(quantities.MASTER_MARGIN * own / COVERAGE, rel=1e-9)
    for name in ("gear", "settling", "time step"):
        assert made.sources[name] == pytest.approx(whole.sources[name], rel=1e-9)
    assert (made.sources["housing"][~loud] < 10.0 * made.amplitude[~loud]).all()


@pytest.mark.parametrize("lines", [[0.0], [300.0], [0.0, 300.0]])
def test_silence_and_what_stands_still_have_no_audible_lines(case, housing, parts, lines):
    _, _, vectors, forces = parts
    stated = vectors.replace(accuracy=SoundAccuracy(elements_per_wavelength=6.0, expected_error_db=0.3))
    still = forces.replace(frequency=lines, force=np.zeros((len(lines), *forces.force.shape[1:])))
    velocity = respond(housing, still)
    pressure = radiate(stated, velocity, fidelity=DRAFT.acoustics)
    assert pressure.accuracy.cancellation_error_db is None
    if lines == [300.0]:
        assert (band(case, housing, (pressure, velocity, stated, still)).error == 0).all()


@pytest.mark.parametrize("lines", [slice(1, 3), np.array([0, 4]), LINES > 950.0])
def test_selected_lines_have_their_own_velocity_in_either_form(parts, lines):
    velocity = parts[1]
    given = velocity.replace(normal_velocity=velocity.normal_velocity)
    for form in (velocity, given):
        chosen = form.select(lines)
        assert (chosen.frequency == LINES[lines]).all()
        assert chosen.normal_velocity == pytest.approx(velocity.normal_velocity[lines], rel=1e-12)
    assert (velocity.coordinates is None, given.coordinates) == (False, None)
