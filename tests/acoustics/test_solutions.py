"""Boundary element solutions against closed forms.

Pulsating sphere: p = jωρ a² v e^{−jk(r−a)} / ((1 + jka) r), Pierce, Acoustics, 4-1.  Rigid sphere in a plane wave:
series of Bowman, Senior & Uslenghi, Electromagnetic and Acoustic Scattering by Simple Shapes, 10.3.  Interior sources:
a point source inside a body of any shape gives the body a normal velocity; outside, its field is that of the source.
"""

from dataclasses import replace

import numpy as np
import pytest

from nvhchain.acoustics import PlaneWave, PointSource, RigidPlane, solve_direct, sphere, surface_pressure
from nvhchain.acoustics.solutions import exterior
from nvhchain.acoustics.solutions import pressure as direct
from nvhchain.acoustics.surfaces.burton_miller import coupling
from nvhchain.acoustics.surfaces.surface import mean_edge
from nvhchain.acoustics.waves.layer_potentials import RULE_BARYCENTRIC, RULE_WEIGHT
from nvhchain.errors import InputError, ResourceError
from nvhchain.handoff import SurfaceVelocity
from nvhchain.testing import bodies
from nvhchain.testing.bodies import pulsating, rigid_sphere

CUBE = bodies.box((0.2, 0.2, 0.2), 0.2 / 12, alike=True)
STRETCHED = bodies.cells((6, 18, 18), (0.3, 0.3, 0.3), alike=True)
LEVELS = {200.0: 114.062, 1000.0: 122.198, 1715.0: 122.912}


@pytest.mark.parametrize(("level", "limit"), [(3, 1e-2), (4, 3e-3)])
def test_pulsating_sphere_complex_pressure_and_level(air, coarse, level, limit):
    frequency = np.array(list(LEVELS))
    body = sphere(0.1, level)
    velocity = SurfaceVelocity(frequency, np.ones((len(frequency), len(body.triangles))), body)
    points = [[1.0, 0.0, 0.0], [0.0, -0.6, 0.8]]
    pressure = solve_direct(velocity, points, air=air, fidelity=coarse).pressure
    exact = pulsating(frequency, 0.1, 1.0, air)[:, None]
    assert np.abs(pressure / exact - 1).max() < limit
    decibel = 20 * np.log10(np.abs(pressure) / np.sqrt(2) / 20e-6)
    assert decibel == pytest.approx(np.array(list(LEVELS.values()))[:, None].repeat(2, axis=1), abs=9 * limit)


def test_low_frequencies_down_to_a_tenth_of_a_hertz_keep_their_accuracy_and_zero_is_silent(air, coarse):
    frequency = np.array([0.0, 0.1, 1.0, 10.0])
    body = sphere(0.1, 2)
    velocity = SurfaceVelocity(frequency, np.ones((4, len(body.triangles))), body)
    pressure = solve_direct(velocity, [[0.0, 0.0, 1.0]], air=air, fidelity=coarse).pressure[:, 0]
    assert pressure[0] == 0
    exact = pulsating(frequency[1:], 0.1, 1.0, air)
    assert np.abs(pressure[1:] / exact - 1).max() < 5e-3
    corners, along = body.vertices[body.triangles], 0.0  # the mean over every face, as a housing gives it
    for barycentric, weight in zip(RULE_BARYCENTRIC, RULE_WEIGHT, strict=True):
        x = np.einsum("i,fij->fj", barycentric, corners)
        along = along + weight * x[:, 2] / np.linalg.norm(x, axis=1)
    swing = SurfaceVelocity(frequency, np.tile(along, (4, 1)), body)
    pressure = solve_direct(swing, [[0.0, 0.0, 1.0]], air=air, fidelity=coarse).pressure[:, 0]
    k, omega = 2 * np.pi * frequency / air.speed_of_sound, 2 * np.pi * frequency
    exact = 1j * omega * air.density * 0.1**3 * (1 + 1j * k) * np.exp(-0.9j * k) / (2 + 0.2j * k - (0.1 * k) ** 2)
    assert np.abs(pressure[1:] / exact[1:] - 1).max() < 5e-3


def test_series_of_the_rigid_sphere_gives_the_published_values():
    assert np.abs(rigid_sphere(1.0, [1, 0, -1])) == pytest.approx([1.41840, 0.97330, 1.06812], abs=1e-5)
    assert np.abs(rigid_sphere(5.0, [1, 0, -1])) == pytest.approx([1.87408, 1.24800, 1.14520], abs=1e-5)


@pytest.mark.parametrize("ka", [1.0, 5.0])
def test_rigid_sphere_in_a_plane_wave(air, coarse, ka):
    body = sphere(0.1, 3)
    frequency = np.array([ka / 0.1 * air.speed_of_sound / (2 * np.pi)])
    still = SurfaceVelocity(frequency, np.zeros((1, len(body.triangles))), body)
    result = surface_pressure(still, air=air, fidelity=coarse, incident=PlaneWave((0.0, 0.0, -2.0)))
    cosine = body.vertices[:, 2] / np.linalg.norm(body.vertices, axis=1)
    exact = rigid_sphere(ka, cosine)
    assert np.abs(result.pressure[0] - exact).max() < 0.02 * np.abs(exact).max()


def test_scattering_equals_radiation_with_the_opposite_velocity(air, coarse):
    """Two formulations that share nothing but the matrices; a wrong sign of α in either breaks them apart."""
    body = sphere(0.1, 3)
    frequency = np.array([0.8 * 343.0 / (2 * np.pi * 0.1), 3.0 * 343.0 / (2 * np.pi * 0.1)])
    source = PointSource((0.0, 0.25, 0.1), strength=2.0 - 1.0j)
    still = SurfaceVelocity(frequency, np.zeros((2, len(body.triangles))), body)
    total = surface_pressure(still, air=air, fidelity=coarse, incident=source).pressure
    for i, f in enumerate(frequency):
        k = 2 * np.pi * f / air.speed_of_sound
        gradient = np.einsum("fj,fj->f", source.pressure_and_gradient(body.centroids, k)[1], body.normals)
        opposite = SurfaceVelocity([f], (gradient / (1j * 2 * np.pi * f * air.density))[None], body)
        scattered = surface_pressure(opposite, air=air, fidelity=coarse).pressure[0]
        expected = scattered + source.pressure_and_gradient(body.vertices, k)[0]
        assert np.abs(total[i] - expected).max() < 0.02 * np.abs(expected).max()


def test_an_incident_field_at_zero_frequency_is_refused(air, coarse):
    body = sphere(0.1, 1)
    with pytest.raises(InputError, match="0 Hz"):
        surface_pressure(
            SurfaceVelocity([0.0], np.zeros((1, 80)), body), air=air, fidelity=coarse, incident=PlaneWave((1, 0, 0))
        )


def test_a_point_source_inside_the_body_on_it_or_behind_the_plane_is_refused_with_the_number(air, coarse):
    body = sphere(0.1, 2)
    still = SurfaceVelocity([500.0], np.zeros((1, 320)), body)
    floor = RigidPlane((0.0, 0.0, -0.15), (0.0, 0.0, 1.0))
    on_face = body.centroids[3] + 1e-4 * body.longest_edges[3] * body.normals[3]
    for position, plane, message in (
        ((0.0, 0.0, 0.05), None, r"point source at .* m lies 1\.\d+ element edges deep inside the body"),
        (tuple(on_face), None, r"lies 0\.0001 element edges from the surface, at least 0\.001 are needed"),
        ((0.3, 0.0, -0.2), floor, r"lies 50 mm behind the rigid plane"),
        ((np.nan, 0.0, 0.3), None, "must be finite"),
    ):
        with pytest.raises(InputError, match=message):
            surface_pressure(still, air=air, fidelity=coarse, incident=PointSource(position), plane=plane)


BRACKET = {"size": (0.2, 0.2, 0.1), "remove": lambda c: c[0] > 0.1 and c[1] > 0.1}


@pytest.mark.parametrize(
    ("body", "source"),
    [
        (bodies.box((0.2, 0.15, 0.1), 0.0125), (0.01, -0.005, 0.008)),
        (bodies.box(edge=0.0125, **BRACKET), (-0.045, -0.05, 0.002)),
        (sphere(0.1, 3), (0.01, -0.015, 0.02)),
        (CUBE, (0.0, 0.0, 0.0)),
        (STRETCHED, (0.01, 0.0, 0.0)),
        (bodies.cylinder(0.1, 0.08, 36), (0.0, 0.02, 0.0)),
    ],
    ids=["box", "bracket", "sphere", "diagonals alike", "three times as long as wide", "short cylinder"],
)
@pytest.mark.parametrize(("per_wavelength", "limit"), [(8, 0.02), (12, 0.01)])
def test_interior_source_at_8_and_12_elements_per_wavelength(air, coarse, body, source, per_wavelength, limit):
    """By the mean edge, with velocities at the middles of the faces."""
    frequency = air.speed_of_sound / (per_wavelength * mean_edge(body))
    velocity = bodies.source_velocity(body, source, frequency, air)
    points = bodies.shell(100, 0.5)
    exact = bodies.source_field(points, source, 2 * np.pi * frequency / air.speed_of_sound)[0]
    pressure = solve_direct(velocity, points, air=air, fidelity=coarse).pressure[0]
    assert np.abs(pressure - exact).max() < limit * np.abs(exact).max()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("meshes", "source"),
    [
        ([sphere(0.1, level) for level in (1, 2, 3)], (0.01, -0.015, 0.02)),
        ([bodies.box((0.2, 0.15, 0.1), edge) for edge in (0.05, 0.025, 0.0125)], (0.01, -0.005, 0.008)),
        ([bodies.box(edge=edge, **BRACKET) for edge in (0.05, 0.025, 0.0125)], (-0.045, -0.05, 0.002)),
        ([bodies.cylinder(0.1, 0.08, around) for around in (12, 24, 48)], (0.0, 0.02, 0.0)),
    ],
    ids=["sphere", "box", "bracket", "short cylinder"],
)
def test_at_a_fixed_frequency_the_error_falls_with_the_square_of_the_element_size(air, coarse, meshes, source):
    points, errors = bodies.shell(100, 0.5), []
    exact = bodies.source_field(points, source, 2 * np.pi * 1200.0 / air.speed_of_sound)[0]
    for body in meshes:
        pressure = solve_direct(
            bodies.source_velocity(body, source, 1200.0, air), points, air=air, fidelity=coarse
        ).pressure[0]
        errors.append(np.abs(pressure - exact).max() / np.abs(exact).max())
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (rates > 1.8).all(), (errors, rates)


def _errors_around(ka, air, fidelity, body, spread):
    source, points = (0.03, -0.02, 0.04), bodies.shell(8, 0.5)
    frequency = ka / 0.1 * air.speed_of_sound / (2 * np.pi) * (1 + spread)
    pressure = solve_direct(
        bodies.source_velocity(body, source, frequency, air), points, air=air, fidelity=fidelity
    ).pressure
    exact = [bodies.source_field(points, source, 2 * np.pi * f / air.speed_of_sound)[0] for f in frequency]
    return np.abs(pressure - exact).max(axis=1) / np.abs(exact).max(axis=1)


@pytest.mark.slow
@pytest.mark.parametrize("ka", [np.pi, 4.49341, 5.76346])
def test_irregular_frequencies_do_not_show_and_would_without_burton_miller(air, coarse, ka, monkeypatch):
    body = sphere(0.1, 2)
    near = np.linspace(-0.01, 0.01, 41)
    away = _errors_around(ka, air, coarse, body, np.array([-0.05, 0.05])).max()
    assert _errors_around(ka, air, coarse, body, near).max() < 2 * away
    monkeypatch.setattr("nvhchain.acoustics.fused.engine.coupling", lambda surface, k: 0j)
    assert _errors_around(ka, air, coarse, body, near).max() > 5 * away


def test_coupling_is_minus_j_over_k_and_bounded():
    body, half_diagonal = sphere(0.1, 2), 0.1 * 3**0.5
    assert coupling(body, 2000.0) == pytest.approx(-1j / 2000.0, rel=1e-3)
    assert coupling(body, 1e-3) == pytest.approx(-10j * half_diagonal, rel=0.02)


def test_provenance_tells_the_knobs_that_took_part_and_how_it_was_solved(air, coarse):
    body = sphere(0.1, 2)
    velocity = SurfaceVelocity([500.0], np.ones((1, 320)), body)
    asked = replace(coarse, radiation="rayleigh")
    for result in (
        solve_direct(velocity, [[0.0, 0.0, 1.0]], air=air, fidelity=asked),
        surface_pressure(velocity, air=air, fidelity=asked),
    ):
        told = result.provenance
        assert not any(word in told["fidelity"] for word in ("radiation", "masters", "interpolation"))
        assert "singular_order=4" in told["fidelity"]
        assert told["solver"] == "direct"
        assert 1e-6 < told["solver_reciprocal_condition"] < 1.0
    iterated = solve_direct(velocity, [[0.0, 0.0, 1.0]], air=air, fidelity=replace(coarse, solver="compressed"))
    told = iterated.provenance
    assert told["solver"] == "compressed"
    assert 0.0 < told["solver_residual"] <= told["solver_tolerance"] < 1.001e-6
    assert "compression_error=1e-05" in told["fidelity"]


def test_field_points_come_in_blocks_and_what_they_take_is_counted(air, coarse, monkeypatch):
    body, points = sphere(0.1, 1), bodies.shell(50, 1.0)
    velocity = SurfaceVelocity([300.0, 500.0], np.ones((2, 80)), body)
    whole = solve_direct(velocity, points, air=air, fidelity=coarse).pressure
    asked, real = [], exterior.check_memory
    monkeypatch.setattr(direct, "workers", lambda frequencies: min(2, frequencies))
    monkeypatch.setattr(exterior, "check_memory", lambda *some: asked.append(some[2] + some[3]) or real(*some))
    monkeypatch.setattr(direct, "_LAYER_BYTES", 7 * 16 * (len(body.vertices) + 80))
    assert np.abs(solve_direct(velocity, points, air=air, fidelity=coarse).pressure - whole).max() < 1e-14
    assert asked == [2 * 7 * 16 * (len(body.vertices) + 80) + 16 * 2 * 50]
    monkeypatch.setattr("psutil.virtual_memory", lambda: type("M", (), {"available": 2**24}))
    many = np.broadcast_to([[0.0, 0.0, 1.0]], (10**6, 3))
    with pytest.raises(ResourceError, match=r"GiB are free: ask for fewer field points"):
        solve_direct(velocity, many, air=air, fidelity=coarse)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ((np.ones(3), np.ones((3, 3))), r"of shapes \(80,\) and \(80, 3\) at 80 points, but \(3,\) and \(3, 3\)"),
        (1.0, "gives no pressures and gradients"),
        ((np.full(80, np.nan), np.ones((80, 3))), r"is not finite on the surface at k = 1\.83"),
    ],
)
def test_incident_fields_that_give_something_else_are_refused(air, coarse, given, said):
    class Wrong:
        def pressure_and_gradient(self, points, wavenumber):
            return given

    still = SurfaceVelocity([100.0], np.zeros((1, 80)), sphere(0.1, 1))
    with pytest.raises(InputError, match=said):
        surface_pressure(still, air=air, fidelity=coarse, incident=Wrong())


def test_plane_waves_and_point_sources_of_no_meaning_are_refused():
    for wrong in (
        lambda: PlaneWave((np.nan, 0, 1)),
        lambda: PlaneWave((0, 0, 1), np.inf),
        lambda: PlaneWave((0, 0, 0)),
    ):
        with pytest.raises(InputError, match=r"plane wave of direction .* needed, and all values finite"):
            wrong()
    with pytest.raises(InputError, match=r"PlaneWave: direction = .* 3 values, each a number"):
        PlaneWave((0.0, 1.0))
    with pytest.raises(InputError, match="PointSource: position = 'abc' is of the wrong kind"):
        PointSource("abc")
    assert PlaneWave(np.array([0.0, 0.0, 1.0]), 1j).amplitude == 1j
