"""Damping of a case's housing: a curve over frequency, structural instead of viscous, from the file to the sound."""

from dataclasses import replace

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.acoustics import modal_pressure, modal_transfer_vectors, radiate
from nvhchain.case import Options, housing_model
from nvhchain.case import housing as case_housing
from nvhchain.conventions import Air
from nvhchain.errors import InputError
from nvhchain.files import hdf5
from nvhchain.handoff import ForceSpectrum, TransferVectors
from nvhchain.housing import DampingCurve, respond
from nvhchain.housing.modes.damping import damping_of_modes

pytestmark = pytest.mark.filterwarnings("ignore:housing elements of")  # models are coarse on purpose

CURVE = "modal_damping = { frequency = [2000, 4000], ratio = [0.01, 0.03] }"


@pytest.fixture
def small(request, tmp_path):
    """The small gearbox with other lines in its `housing`."""

    def load(*lines):
        base = request.config.rootpath / "cases/small/single_stage.toml"
        file = tmp_path / "case.toml"
        file.write_text(f'base = "{base}"\nquantities = ["surface_velocity"]\n[housing]\n' + "\n".join(lines))
        return nvh.load_case(file)

    return load


@pytest.fixture(scope="module")
def load():
    rng = np.random.default_rng(4)
    names = ("A1", "A2", "B1", "B2")
    lines = np.array([200.0, 1900.0, 2300.0, 3000.0])
    force = rng.standard_normal((4, 4, 3)) + 1j * rng.standard_normal((4, 4, 3))
    return ForceSpectrum(lines, force, names)


@pytest.fixture(scope="module")
def fidelity(coarse):
    """Modes well beyond the band, which the mesh need not carry."""
    return replace(coarse, housing=replace(coarse.housing, mode_ratio=3.0))


@pytest.fixture(scope="module")
def plain(request, load, fidelity):
    """The small gearbox's housing, moved by forces that are given."""
    case = nvh.load_case(request.config.rootpath / "cases/small/single_stage.toml")
    case = replace(case, band=replace(case.band, high=1500.0), quantities=("surface_velocity",))
    return case, nvh.run(case, fidelity=fidelity, force_spectrum=load)


@pytest.mark.slow
def test_curve_and_structural_damping_reach_every_mode_and_line(small, plain, load, fidelity, tmp_path):
    case = small(CURVE, "structural_damping = true")
    assert case.housing.modal_damping == DampingCurve((2000.0, 4000.0), (0.01, 0.03))
    result = nvh.run(replace(case, band=plain[0].band), fidelity=fidelity, force_spectrum=load, out=tmp_path / "out")
    housing = result.housing
    exact = np.clip(0.01 + 0.01 * (housing.natural_frequency - 2000.0) / 1000.0, 0.01, 0.03)
    assert housing.modal_damping == pytest.approx(exact, rel=1e-12)
    assert len(set(housing.modal_damping.round(6))) > 3
    assert housing.natural_frequency == pytest.approx(plain[1].housing.natural_frequency, rel=1e-9)
    # by hand, loss factor and all
    force = load.force.reshape(4, -1)
    shapes = housing.seat_shapes.reshape(len(exact), -1)
    omega, natural = 2 * np.pi * load.frequency[:, None], 2 * np.pi * housing.natural_frequency
    modal = (force @ shapes.T) / (natural**2 * (1 + 2j * exact) - omega**2)
    rest = (force / (1 + 2j * exact[-1])) @ housing.face_residual.reshape(force.shape[1], -1)
    velocity = 1j * omega * (modal @ housing.normal_shapes + rest)
    got = result.surface_velocity.normal_velocity
    assert np.abs(got - velocity).max() < 1e-12 * np.abs(velocity).max()
    (file,) = (tmp_path / "out").glob("housing-*.h5")
    kept = hdf5.load(file)
    assert kept.structural_damping is True
    assert kept.content_hash == housing.content_hash


def test_sound_of_structural_damping_is_the_same_by_modes_and_by_faces(plain, load):
    housing = plain[1].housing.replace(structural_damping=True)
    surface, points = housing.surface, np.array([[1.0, 0.2, 0.3]])
    distance = np.linalg.norm(points[:, None] - surface.centroids, axis=2)
    k = 2 * np.pi * load.frequency[:, None, None] / Air().speed_of_sound
    green = 1j * k * Air().impedance * np.exp(-1j * k * distance) / (4 * np.pi * distance)
    vectors = TransferVectors(load.frequency, points, green * surface.areas, surface, Air())
    modal = modal_transfer_vectors(vectors, housing, load.frequency)
    exact = radiate(vectors, respond(housing, load)).pressure
    assert np.abs(modal_pressure(modal, housing, load).pressure - exact).max() < 1e-12 * np.abs(exact).max()
    viscous = plain[1].housing
    other = modal_pressure(modal_transfer_vectors(vectors, viscous, load.frequency), viscous, load).pressure
    assert np.abs(other / exact - 1).max() > 0.01


def test_damping_of_a_line_and_of_a_mode_agree_near_resonances(plain, load):
    """At a lightly damped mode's resonance the line has its frequency, elsewhere damping hardly matters."""
    housing, curve = plain[1].housing, DampingCurve((2000.0, 4000.0), (0.01, 0.03))
    by_mode = housing.replace(modal_damping=damping_of_modes(curve, housing.natural_frequency))
    lines = np.linspace(100.0, 4000.0, 400)
    force = np.random.default_rng(1).standard_normal((400, 4, 3)) + 0j
    of = ForceSpectrum(lines, force, load.names)
    level = [
        10 * np.log10((np.abs(v.normal_velocity) ** 2 @ housing.surface.areas).sum())
        for v in (respond(by_mode, of), respond(housing, of, damping=curve))
    ]
    assert level[0] == pytest.approx(level[1], abs=0.1)


def test_curve_and_structural_damping_of_a_housing_from_a_file_reach_its_reduction(small, plain, monkeypatch):
    text = 'type = "housing_model"\nfile = "h.bdf"\nunits = "mm-t-s"'
    case = small(*text.split("\n"), CURVE, "structural_damping = true")
    asked = {}
    monkeypatch.setattr(housing_model.housing, "bearing_seats", lambda *_: ())
    monkeypatch.setattr(case_housing, "reduce_model", lambda *_, **how: asked.update(how) or plain[1].housing)
    made = case.housing.reduce(case, (None, case.seats), 0.02, nvh.DRAFT.housing, None)
    assert asked["modal_damping"] == DampingCurve((2000.0, 4000.0), (0.01, 0.03))
    assert made.structural_damping is True


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("modal_damping = { frequency = [500, 400], ratio = [0.01, 0.02] }", "increase strictly"),
        ("modal_damping = { frequency = [500], ratio = [0.01, 0.02] }", "give as many"),
        ("modal_damping = { frequency = [500, 900], ratio = [0.01, 0.7] }", r"0\.01, 0\.7 must lie in 0 … 0\.5"),
        ("modal_damping = { frequency = [500], ratio = [0.0] }", r"must lie in 0 … 0\.5"),
        ("modal_damping = { frequency = [500], damping = [0.01] }", "unknown field"),
        ("modal_damping = { frequency = [500] }", "'ratio' is missing"),
        ('modal_damping = "light"', "must be a finite number"),
        ("modal_damping = 0.6", r"must lie in 0 … 0\.5"),
        ("structural_damping = 1", "must be of type bool"),
    ],
)
def test_bad_damping_is_refused_with_its_value(small, line, message):
    with pytest.raises(InputError, match=message):
        small(line)


@pytest.mark.slow
def test_options_are_not_decided_where_the_forces_are_supplied(plain, load, fidelity):
    case, given = plain
    result = nvh.run(replace(case, options=Options()), fidelity=fidelity, force_spectrum=load, housing=given.housing)
    assert result.decision is None
    assert result.modelling is None
    assert not result.case.options.undecided
    assert np.array_equal(result.surface_velocity.normal_velocity, given.surface_velocity.normal_velocity)
