"""Exterior problem: checked once, the same as the functions, with any engine."""

import warnings
from dataclasses import dataclass, replace

import numpy as np
import pytest

from nvhchain.acoustics import (
    Adaptive,
    Bempp,
    ExteriorProblem,
    Fused,
    RigidPlane,
    SurfaceShapes,
    Work,
    radiation_resistance,
    solve_direct,
    sound_power,
    sphere,
    surface_pressure,
    transfer_vectors,
)
from nvhchain.errors import AccuracyWarning, InputError
from nvhchain.handoff import SurfaceVelocity

BODY, POINTS, LINES = sphere(0.1, 1), np.array([[0.0, 0.3, 1.0]]), np.array([200.0, 450.0])
VELOCITY = SurfaceVelocity(LINES, np.ones((2, 1)) * BODY.normals[:, 2], BODY)
SHAPES = SurfaceShapes(BODY, BODY.normals[:, 1:])
FLOOR = RigidPlane((0.0, 0.0, -0.3), (0.0, 0.0, 1.0))


def same(one, other):
    return np.abs(one - other).max() < 1e-12 * np.abs(other).max()


def test_methods_give_what_the_functions_give(air, coarse):
    where = {"air": air, "plane": FLOOR, "fidelity": coarse}
    problem = ExteriorProblem(BODY, **where)
    vectors = transfer_vectors(BODY, POINTS, LINES, **where).vectors
    assert same(problem.transfer_vectors(POINTS, LINES).vectors, vectors)
    assert same(problem.pressure(VELOCITY, POINTS).pressure, solve_direct(VELOCITY, POINTS, **where).pressure)
    assert same(problem.surface_pressure(VELOCITY).pressure, surface_pressure(VELOCITY, **where).pressure)
    assert same(problem.power(VELOCITY).power, sound_power(VELOCITY, **where).power)
    assert same(problem.resistance(SHAPES, LINES).waves, radiation_resistance(SHAPES, LINES, **where).waves)


def test_a_band_chooses_its_masters(air, coarse):
    where, band = {"air": air, "fidelity": coarse}, (100.0, 500.0)
    problem = ExteriorProblem(BODY, **where)
    vectors, resistance = problem.transfer_vectors(POINTS, Adaptive(*band)), problem.resistance(SHAPES, Adaptive(*band))
    assert np.array_equal(vectors.frequency, transfer_vectors(BODY, POINTS, Adaptive(*band), **where).frequency)
    assert np.array_equal(resistance.frequency, radiation_resistance(SHAPES, Adaptive(*band), **where).frequency)


def test_progress_and_checkpoints_reach_every_quantity(air, coarse, tmp_path):
    problem, seen = ExteriorProblem(BODY, air=air, fidelity=coarse), []
    work = Work(progress=lambda done, total: seen.append((done, total)), checkpoints=tmp_path)
    problem.transfer_vectors(POINTS, LINES, work)
    problem.pressure(VELOCITY, POINTS, work)
    problem.surface_pressure(VELOCITY, work)
    problem.power(VELOCITY, work)
    problem.resistance(SHAPES, LINES, work)
    assert seen == [(0, 2), (2, 2)] * 5
    kinds = {"transfer_vectors", "solve_direct", "surface_pressure", "sound_power", "radiation_resistance"}
    assert {path.name.rpartition("-")[0] for path in tmp_path.glob("*.h5")} == kinds


def test_what_the_mesh_lets_expect_is_found_and_warned_of_once(air, coarse):
    problem = ExteriorProblem(BODY, air=air, fidelity=replace(coarse, elements_per_wavelength=60.0))
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        first, again = (problem.transfer_vectors(POINTS, LINES) for _ in range(2))
    told = [str(one.message) for one in said if issubclass(one.category, AccuracyWarning)]
    assert sum("elements per wavelength" in one for one in told) == 1
    assert (first.accuracy, first.provenance) == (again.accuracy, again.provenance)


def test_motions_of_another_surface_are_refused(air, coarse):
    problem, other = ExteriorProblem(BODY, air=air, fidelity=coarse), sphere(0.1, 2)
    moving = SurfaceVelocity(LINES, np.ones((2, len(other.triangles))), other)
    for call in (
        lambda: problem.power(moving),
        lambda: problem.pressure(moving, POINTS),
        lambda: problem.surface_pressure(moving),
        lambda: problem.resistance(SurfaceShapes(other, other.normals), LINES),
    ):
        with pytest.raises(InputError, match=r"another surface \(320 triangles\) than the problem \(80 triangles\)"):
            call()


def test_body_plane_and_engine_are_checked_when_the_problem_is_made():
    with pytest.raises(InputError, match="engine bempp has no reflecting plane: use fused"):
        ExteriorProblem(BODY, plane=FLOOR, engine=Bempp())
    with pytest.raises(InputError, match="plane"):
        ExteriorProblem(BODY, plane=RigidPlane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
    with pytest.raises(InputError, match="engine = 'fused' is of the wrong kind"):
        ExteriorProblem(BODY, engine="fused")


def test_an_engine_of_ones_own_is_asked_for_its_matrices(air, coarse):
    asked = []

    @dataclass(frozen=True)
    class Own(Fused):
        name = "own"

        def matrices(self, surface, wavenumbers, fidelity, plane):
            asked.extend(wavenumbers)
            return super().matrices(surface, wavenumbers, fidelity, plane)

    made = ExteriorProblem(BODY, air=air, engine=Own(), fidelity=coarse).transfer_vectors(POINTS, LINES)
    assert asked == pytest.approx(2 * np.pi * LINES / air.speed_of_sound)
    assert made.provenance["engine"] == "own"
    assert same(made.vectors, transfer_vectors(BODY, POINTS, LINES, air=air, fidelity=coarse).vectors)
