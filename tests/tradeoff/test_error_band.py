"""The error band: what it is made of, and that it holds answers that are known."""

from dataclasses import replace

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.acoustics import radiate, sphere, transfer_vectors
from nvhchain.case import FieldPoint, RadiatorCase, Sphere
from nvhchain.error_band import COVERAGE, ErrorBand, error_band, format_limits
from nvhchain.errors import InputError
from nvhchain.fidelity import DRAFT, STANDARD
from nvhchain.handoff import ForceSpectrum, MeshLaw, ReducedHousing
from nvhchain.housing import respond
from nvhchain.levels import decibel, overall

LINES = np.array([300.0, 900.0, 980.0, 1000.0, 1100.0, 1600.0])
POINTS = np.array([[0.0, 0.2, 0.9], [0.7, 0.0, 0.1]])


def band(**sources):
    pressure = np.array([[1.0], [0.1]])
    return ErrorBand(np.array([1000.0, 2000.0]), pressure, {k: np.array(v) for k, v in sources.items()})


def test_sources_add_in_quadrature_and_cover_two_of_their_estimates():
    made = band(housing=[[0.03], [0.0]], gear=[[0.04], [0.01]])
    assert made.error == pytest.approx(COVERAGE * np.array([[0.05], [0.01]]))
    assert made.upper[0] - decibel(1.0) == pytest.approx(20 * np.log10(1.1))
    assert made.lower[0] - decibel(1.0) == pytest.approx(20 * np.log10(0.9))


def test_an_error_beyond_the_pressure_leaves_no_lower_limit():
    made = band(gear=[[0.01], [0.2]])
    assert made.lower[1] < -1000
    assert made.upper[1, 0] == pytest.approx(decibel(0.5))


def test_errors_of_one_source_add_up_over_the_lines_those_of_the_housing_in_quadrature():
    """Two equal lines, each 10 % off with coverage: both up, or at random √½ of it."""
    frequency, pressure, error = np.array([1000.0, 1000.1]), np.ones((2, 1)), 0.05 * np.ones((2, 1))
    middle = overall(frequency, pressure.astype(complex))[0]
    for name, share in (("surface mesh", 0.1), ("housing", 0.1 / 2**0.5)):
        lower, upper = ErrorBand(frequency, pressure, {name: error}).overall[0] - middle
        assert upper == pytest.approx(10 * np.log10(1 + 2 * share + 0.01), rel=1e-3)
        assert lower == pytest.approx(20 * np.log10(1 - share), rel=1e-3)


def test_an_error_beyond_all_of_the_sound_leaves_no_lower_overall_limit():
    limits = band(gear=[[0.6], [0.05]]).overall[0]
    assert limits[0] == -np.inf
    assert np.isfinite(limits[1])
    assert format_limits(limits) == f"below {limits[1]:.1f}"
    assert format_limits([None, 70.0]) == "below 70.0"
    assert format_limits([60.0, 70.0]) == "60.0…70.0"


@pytest.mark.parametrize("relative", [0.05, 0.2, 0.4])
def test_overall_limits_hold_errors_that_go_the_same_way_at_all_lines(relative):
    frequency, pressure = np.array([900.0, 1000.0, 1100.0]), np.array([[1.0], [0.3], [0.6]])
    band = ErrorBand(frequency, pressure, {"gear": relative / 2 * pressure})
    low, high = (overall(frequency, (1 + way * relative) * pressure.astype(complex))[0] for way in (-1, 1))
    assert band.overall[0] == pytest.approx([low, high], abs=1e-9)


def test_overall_limits_hold_errors_of_one_sign_that_differ_from_line_to_line():
    frequency, pressure = np.array([900.0, 1000.0, 1100.0]), np.array([[1.0], [0.3], [0.6]])
    error = np.array([[0.1], [0.2], [0.3]])
    band = ErrorBand(frequency, pressure, {"gear": error / COVERAGE})
    low, high = (overall(frequency, (pressure + way * error).astype(complex))[0] for way in (-1, 1))
    assert low - 1.0 < band.overall[0, 0] <= low
    assert band.overall[0, 1] == pytest.approx(high, abs=1e-9)


@pytest.fixture(scope="module")
def case(request):
    base = nvh.load_case(request.config.rootpath / "cases" / "small" / "single_stage.toml")
    points = tuple(FieldPoint(f"{i}", tuple(point)) for i, point in enumerate(POINTS))
    return replace(base, field_points=points, band=replace(base.band, high=2000.0))


@pytest.fixture(scope="module")
def housing():
    """A sphere with modes at 500, 1000 and 2400 Hz and a residual."""
    ball = sphere(0.1, 2)
    shapes = np.stack([np.ones(320), ball.normals[:, 2], ball.normals[:, 0]])
    return ReducedHousing(
        natural_frequency=np.array([500.0, 1000.0, 2400.0]),
        modal_damping=np.full(3, 0.01),
        seat_shapes=np.full((3, 1, 3), 0.3),
        normal_shapes=shapes,
        seat_residual=1e-10 * np.eye(3).reshape(1, 3, 1, 3),
        face_residual=np.tile(1e-11 * ball.normals[:, 2], (1, 3, 1)),
        names=("A1",),
        positions=np.zeros((1, 3)),
        surface=ball,
    )


@pytest.fixture(scope="module")
def parts(case, housing):
    """What a run hands to the band: pressure, velocity, vectors, forces."""
    forces = ForceSpectrum(LINES, np.ones((len(LINES), 1, 3), complex), ("A1",), input_speed=188.5)
    velocity = respond(housing, forces)
    vectors = transfer_vectors(
        housing.surface, POINTS, np.linspace(200, 1800, 9), air=case.air, fidelity=DRAFT.acoustics
    )
    return radiate(vectors, velocity, fidelity=DRAFT.acoustics), velocity, vectors, forces


def of(case, fidelity, housing, parts, laws=()):
    pressure, velocity, vectors, forces = parts
    return error_band(
        case, fidelity, pressure, velocity,
        transfer_vectors=vectors, housing=housing, force_spectrum=forces, mesh_laws=laws,
    )  # fmt: skip


def test_a_coarse_housing_is_wrong_at_its_resonances_and_less_so_when_it_is_fine(case, housing, parts):
    coarse = of(case, DRAFT, housing, parts)
    fine = of(case, replace(DRAFT, housing=replace(DRAFT.housing, element_size=0.004)), housing, parts)
    relative = (coarse.sources["housing"] / coarse.pressure).max(axis=1)
    assert relative[LINES == 1000.0] > 5 * relative[LINES == 300.0]
    assert (fine.sources["housing"] < 0.25 * coarse.sources["housing"]).all()


def test_the_sound_of_a_housing_whose_modes_are_off_by_what_its_mesh_leaves_open_lies_in_the_band(case, housing, parts):
    made = of(case, DRAFT, housing, parts)
    _, _, vectors, forces = parts
    for factors in ((1.002, 1.004, 1.008), (0.998, 0.996, 0.992), (1.002, 0.996, 1.0)):
        other = housing.replace(natural_frequency=housing.natural_frequency * np.array(factors))
        level = decibel(radiate(vectors, respond(other, forces), fidelity=DRAFT.acoustics).pressure)
        assert ((made.lower < level) & (level < made.upper)).all()


def test_what_is_not_handed_in_is_exact(case, housing, parts):
    pressure, velocity, vectors, _ = parts
    assert set(error_band(case, DRAFT, pressure, velocity).sources) == {"surface mesh"}
    assert set(error_band(case, DRAFT, pressure, velocity, transfer_vectors=vectors).sources) == {
        "surface mesh",
        "masters",
    }
    assert "gear" not in of(case, DRAFT, housing, parts).sources


def law(amplitudes):
    """A linear law whose transmission error has these mesh harmonics, m."""
    angle = np.arange(64) * 2 * np.pi / 30 / 64
    error = sum(a * np.cos(30 * (n + 1) * angle) for n, a in enumerate(amplitudes))
    grid = np.linspace(-2e-5, 8e-5, 201)
    return MeshLaw(
        angle=angle, deflection=grid, force=1e8 * (grid - error[:, None]), period=2 * np.pi / 30, teeth=(20, 30),
        base_radius=np.array([0.025, 0.038]), base_helix_angle=0.16, working_pressure_angle=0.35,
        centre_distance=0.0685, face_width=0.016,
    )  # fmt: skip


def test_forces_are_uncertain_where_the_transmission_error_is_weak_and_open_where_it_is_none(case, housing, parts):
    turns = 188.5 / (2 * np.pi)
    lines = turns * np.array([20.0, 40.0, 47.0])
    forces = ForceSpectrum(lines, np.ones((3, 1, 3), complex), ("A1",), input_speed=188.5)
    velocity = respond(housing, forces)
    pressure = radiate(parts[2], velocity, fidelity=DRAFT.acoustics).replace(input_speed=188.5)
    made = of(case, DRAFT, housing, (pressure, velocity, parts[2], forces), [law([1e-6, 1e-8])])
    first, weak, none = (made.sources["gear"] / made.pressure)[:, 0]
    assert weak == pytest.approx(first * (1 + 100) / 2, rel=1e-3)
    assert none == 1.0
    finer = of(case, STANDARD, housing, (pressure, velocity, parts[2], forces), [law([1e-6, 1e-8])])
    assert (finer.sources["gear"][:2] < 0.5 * made.sources["gear"][:2]).all()


@pytest.mark.parametrize("fidelity", [DRAFT, STANDARD], ids=lambda preset: preset.name)
def test_the_exact_pressure_of_a_pulsating_sphere_lies_in_the_band(fidelity):
    """ρ c v jka² e^{−jk(r−a)}/(r (1 + jka)) (Morse & Ingard 1968, eq. 7.1.4)."""
    ball = RadiatorCase("ball", Sphere(0.1), (100.0, 700.0, 1900.0), (FieldPoint("p", (0.0, 0.0, 1.0)),), pulsation=1.0)
    result = nvh.run(ball, fidelity=fidelity)
    made = error_band(ball, fidelity, result.pressure, result.surface_velocity)
    ka = 2 * np.pi * made.frequency / 343.0 * 0.1
    exact = decibel(ball.air.impedance * ka * 0.1 / np.sqrt(1 + ka**2))[:, None]
    assert ((made.lower < exact) & (exact < made.upper)).all()
    assert (made.upper - made.lower < 2.5).all()


def test_pressure_and_velocity_of_different_runs_are_refused(case, parts):
    pressure, velocity, _, _ = parts
    with pytest.raises(InputError, match="of one run"):
        error_band(case, DRAFT, pressure.replace(frequency=pressure.frequency + 1.0), velocity)
