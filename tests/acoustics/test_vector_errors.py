"""What interpolation between masters makes of transfer vectors themselves is stated where they are made and used."""

import re
import warnings

import numpy as np
import pytest

from nvhchain.acoustics import (
    Adaptive,
    convolution_lines,
    decay_time,
    interpolate_vectors,
    modal_pressure,
    modal_transfer_vectors,
    noise_transfer_functions,
    radiate,
    run_up_pressure,
    transfer_pressure,
    transfer_vectors,
)
from nvhchain.acoustics.accuracy.interpolation_error import vector_errors
from nvhchain.acoustics.interpolation.nodes import interpolant
from nvhchain.errors import AccuracyWarning
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.files import hdf5
from nvhchain.handoff import BearingForces, RigidPlane, SoundAccuracy, SurfaceVelocity
from nvhchain.testing import bodies
from nvhchain.testing import hand_offs as cases

POINTS = np.array([[0.4, 0.1, 0.2], [0.0, -2.0, 0.3], [0.02, 0.01, 0.07]])
LINES = np.linspace(100.0, 2400.0, 93)
FEW = np.linspace(LINES[0], LINES[-1], 4)
RATE = 10000.0
PLANE = RigidPlane((0.0, 0.0, -0.2), (0.0, 0.0, 1.0))
WARNED = r"errs by an estimated [\d.]+ dB at [\d.]+ Hz, 0\.1 dB asked: take more masters"


def knobs(**changes):
    return AcousticsFidelity(elements_per_wavelength=2.0, coarsest_elements_per_wavelength=1.5, masters=60, **changes)


def vectors(masters, air, plane=None):
    box = bodies.box((0.15, 0.1, 0.1), 0.025)
    return transfer_vectors(box, POINTS, masters, air=air, fidelity=knobs(), plane=plane)


def told(call, *arguments, **options):
    """What a call returns, and the accuracy warnings it gives."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = call(*arguments, **options)
    return found, [str(one.message) for one in caught if issubclass(one.category, AccuracyWarning)]


def moving_at_random(surface, modes):
    return cases.housing(modes, low=200.0, damping=0.2).replace(
        surface=surface,
        normal_shapes=np.random.default_rng(4).standard_normal((modes, len(surface.triangles))),
        face_residual=np.zeros((3, 3, len(surface.triangles))),
    )


@pytest.fixture(scope="module", params=[None, PLANE], ids=["free", "plane"])
def truth(air, request):
    return vectors(LINES, air, request.param)


@pytest.mark.slow
@pytest.mark.parametrize("count", [2, 3, 4, 5])
def test_the_stated_error_is_that_of_vectors_and_of_modes_that_move_at_random(truth, count, air):
    """Nothing was stated where two to five masters err by 1 to 15 dB.  With a plane the direct and the reflected part
    are what errors are relative to: their sum has gaps."""
    fidelity = knobs()
    atv = vectors(np.linspace(LINES[0], LINES[-1], count), air, truth.plane)
    at, said = told(interpolate_vectors, atv, LINES, fidelity=fidelity)
    stated = at.accuracy.interpolation_error_db
    assert [bool(re.search(WARNED, one)) for one in said] == [True] * (stated > 0.1)

    def decibel(wrong, exact, reflected):
        size = np.hypot(*(np.linalg.norm(part, axis=2) for part in (exact - reflected, reflected)))
        return 20 * np.log10(1 + (np.linalg.norm(wrong - exact, axis=2) / size).max())

    reflected = np.zeros_like(truth.vectors) if truth.image_vectors is None else truth.image_vectors
    assert 0.3 < stated / decibel(at.vectors, truth.vectors, reflected) < 4.0
    housing = moving_at_random(truth.surface, 40)
    modal, said_of_modes = told(modal_transfer_vectors, atv, housing, LINES, fidelity=fidelity)
    assert said_of_modes == said
    assert modal.accuracy.interpolation_error_db == stated
    exact, reflected = (part @ housing.normal_shapes.T for part in (truth.vectors, reflected))
    assert 0.3 < stated / decibel(modal.modes, exact, reflected) < 4.0


def test_the_estimate_is_that_of_both_neighbours_and_of_the_direct_and_the_reflected_part(air):
    atv = vectors(FEW, air, PLANE)
    smooth, lines = interpolant(atv, knobs()), np.linspace(110.0, 2350.0, 23)
    found, _ = vector_errors(smooth, lines, np.array([0, 2]), len(POINTS))
    expected, sides = np.zeros(len(lines)), smooth.error_weights(lines)
    for point in (0, 2):
        parts = [smooth.node_values(end) for end in (point, point + len(POINTS))]
        size = np.hypot(*(np.linalg.norm(smooth.weights(lines) @ part, axis=1) for part in parts))
        wrong = np.hypot(*(np.linalg.norm(sides @ part, axis=2) for part in parts))
        assert 0 < (wrong[0] > wrong[1]).sum() < len(lines)
        expected = np.maximum(expected, wrong.max(axis=0) / size)
    assert found == pytest.approx(expected + smooth.unresolved_echo_error(lines), rel=1e-6)


def test_what_is_made_from_operators_keeps_what_was_stated_of_them(air, tmp_path):
    of_mesh = SoundAccuracy(expected_error_db=0.3)
    atv = vectors(FEW, air)
    atv = atv.replace(accuracy=atv.accuracy | SoundAccuracy(resonance_shift=0.02) | of_mesh)
    housing = moving_at_random(atv.surface, 5)
    lines = convolution_lines(RATE, LINES[-1], decay_time(housing, LINES[-1]))
    lines = lines[lines >= LINES[0]]
    operator, said = told(modal_transfer_vectors, atv, housing, lines, fidelity=knobs())
    assert any(re.search(WARNED, one) for one in said)
    modal = hdf5.load(hdf5.save(operator, tmp_path / "modal.h5"))
    functions, of_functions = told(noise_transfer_functions, modal, housing)
    load = cases.forces(lines)
    time = np.arange(400) / RATE
    force = BearingForces(time, np.zeros((400, 3, 3)), cases.NAMES, housing.positions, np.full(400, 100.0))
    for made in (
        functions,
        modal_pressure(modal, housing, load),
        transfer_pressure(functions, load),
        run_up_pressure(functions, force),
    ):
        assert made.accuracy == operator.accuracy
        assert made.accuracy.interpolation_error_db > 0.1
        assert made.accuracy | of_mesh == made.accuracy
    assert of_functions == []
    still = SurfaceVelocity(lines[:1], np.zeros((1, len(atv.surface.triangles))), atv.surface)
    heard = radiate(atv, still).accuracy
    assert heard | of_mesh == heard


def test_vectors_between_masters_keep_what_was_stated_of_the_masters(air):
    atv = vectors(FEW, air)
    atv = atv.replace(accuracy=atv.accuracy | SoundAccuracy(resonance_shift=0.02))
    at, _ = told(interpolate_vectors, atv, LINES, fidelity=knobs())
    finer = at.accuracy | SoundAccuracy(elements_per_wavelength=atv.accuracy.elements_per_wavelength)
    assert finer | atv.accuracy.cleared("elements_per_wavelength", "upper_frequency") == finer
    assert at.provenance["stage"] == "acoustics.vectors_at"


def test_what_was_stated_of_vectors_between_masters_is_stated_of_all_that_is_made_from_them(air, tmp_path):
    """Interpolated vectors were taken for masters, and 0.0 dB stated."""
    atv = vectors(FEW, air)
    atv = atv.replace(accuracy=atv.accuracy | SoundAccuracy(resonance_shift=0.02))
    at, _ = told(interpolate_vectors, atv, LINES, fidelity=knobs())
    at = hdf5.load(hdf5.save(at, tmp_path / "at.h5"))
    stated = at.accuracy.interpolation_error_db
    assert stated > 0.1
    housing = moving_at_random(atv.surface, 5)
    operator, _ = told(modal_transfer_vectors, at, housing, LINES, fidelity=knobs())
    for again in (told(interpolate_vectors, at, LINES, fidelity=knobs())[0], operator):
        assert again.accuracy.interpolation_error_db == stated
        assert again.accuracy.resonance_error_db >= at.accuracy.resonance_error_db
    velocity = SurfaceVelocity(LINES, np.ones((len(LINES), len(atv.surface.triangles))), atv.surface)
    heard, _ = told(radiate, at, velocity, fidelity=knobs())
    assert 20 * np.log10(1 + np.array(heard.accuracy.interpolation_error)) == pytest.approx(stated)


def test_nothing_is_said_of_vectors_at_their_masters_and_at_0_hz(air):
    atv = vectors(np.linspace(0.0, 2400.0, 3), air)
    for lines in ([0.0], [0.0, 1200.0, 2400.0]):
        at, said = told(interpolate_vectors, atv, lines, fidelity=knobs())
        assert at.accuracy.interpolation_error_db == pytest.approx(0.0, abs=1e-12)
        assert said == []


@pytest.mark.parametrize("plane", [None, PLANE], ids=["free", "plane"])
def test_masters_that_the_engine_chooses_give_no_alarm_at_any_line(air, plane):
    box = bodies.box((0.15, 0.1, 0.1), 0.025)
    atv = transfer_vectors(box, POINTS, Adaptive(100.0, 2400.0), air=air, fidelity=knobs(), plane=plane)
    at, said = told(interpolate_vectors, atv, np.linspace(100.0, 2400.0, 2301), fidelity=knobs())
    assert said == []
    assert 0 < at.accuracy.interpolation_error_db < max(2 * atv.accuracy.estimated_error_db, 0.02)
