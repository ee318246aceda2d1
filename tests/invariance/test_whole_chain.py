"""The chain from gear drawing to sound pressure as one: the scene turned, mirrored, scaled, and its forces changed.

The housing is a formula, so that its mesh is the same wherever it lies.
"""

from dataclasses import replace
from math import cos, sin

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.acoustics import PointSource, modal_transfer_vectors, noise_transfer_functions, surface_pressure
from nvhchain.fidelity import AcousticsFidelity, DynamicsFidelity, Fidelity, GearFidelity, HousingFidelity
from nvhchain.gear import Slots
from nvhchain.handoff import SurfaceVelocity
from nvhchain.levels import decibel
from nvhchain.testing.moved_gearbox import egg_housing, mapped, scaled

TINY = Fidelity(
    "tiny",
    GearFidelity(
        profile_elements=2, width_layers=2, slices=6, angles_per_mesh=16, deflections_per_doubling=2, row_aspect=2.5,
        load_pattern_tolerance=1e-2,
    ),
    DynamicsFidelity(time_step=40e-6),
    HousingFidelity(element_size=0.02),
    AcousticsFidelity(elements_per_wavelength=2.5, masters=64, master_tolerance_db=0.1),
)  # fmt: skip


@pytest.fixture(scope="module")
def case(request):
    base = nvh.load_case(request.config.rootpath / "cases/small/single_stage.toml")
    return replace(base, band=replace(base.band, high=2500.0))


@pytest.fixture(scope="module")
def run(case):
    """The scene as it is."""
    return nvh.run(case, fidelity=TINY, housing=egg_housing(case))


def heard(case, fidelity=TINY, **given):
    return nvh.run(case, fidelity=fidelity, **given).pressure.pressure


def close(found, expected, tolerance):
    return np.abs(found - expected).max() < tolerance * np.abs(expected).max()


def test_a_scene_turned_about_its_shafts_sounds_the_same(case, run):
    """Quadrature of turned triangles differs by 3e-6."""
    matrix = np.array([[cos(0.7), -sin(0.7), 0.0], [sin(0.7), cos(0.7), 0.0], [0.0, 0.0, 1.0]])
    moved = mapped(case, matrix)
    assert close(heard(moved, housing=egg_housing(moved, matrix=matrix)), run.pressure.pressure, 1e-4)


def test_a_mirrored_scene_sounds_the_same(case, run):
    matrix = np.diag([-1.0, 1.0, 1.0])
    moved = mapped(case, matrix)
    assert close(heard(moved, housing=egg_housing(moved, matrix=matrix)), run.pressure.pressure, 1e-4)


def test_a_scene_twice_the_size_at_half_the_speed_has_the_same_pressure_at_half_the_frequencies(case, run):
    moved, knobs = scaled(case, TINY, 2.0)
    pressure = nvh.run(moved, fidelity=knobs, housing=egg_housing(moved, 2.0)).pressure
    assert 2 * pressure.frequency == pytest.approx(run.pressure.frequency)
    assert close(pressure.pressure, run.pressure.pressure, 1e-4)


@pytest.mark.filterwarnings("ignore:bearing forces. on average")
def test_twice_the_force_is_six_point_zero_two_decibels_more(case, run):
    forces = run.bearing_forces
    louder = heard(case, housing=run.housing, bearing_forces=forces.replace(force=2 * forces.force))
    assert decibel(louder) - decibel(run.pressure.pressure) == pytest.approx(6.0206, abs=1e-4)


@pytest.mark.filterwarnings("ignore:bearing forces. on average")
def test_bearings_sound_as_the_sum_of_each_alone(case, run):
    forces, own = run.bearing_forces, dict(housing=run.housing, transfer_vectors=run.transfer_vectors)
    alone = [
        heard(case, bearing_forces=forces.replace(force=forces.force * keep[None, :, None]), **own)
        for keep in np.eye(len(forces.names))
    ]
    assert close(sum(alone), run.pressure.pressure, 1e-9)


def test_forces_that_come_later_turn_every_line_by_its_phase(case, run):
    forces = run.bearing_forces
    later = forces.replace(force=np.roll(forces.force, 321, axis=0))
    delayed = heard(case, bearing_forces=later, housing=run.housing, transfer_vectors=run.transfer_vectors)
    phase = np.exp(-2j * np.pi * run.pressure.frequency * 321 / forces.sample_rate)
    assert close(delayed, run.pressure.pressure * phase[:, None], 1e-9)


def test_a_seat_is_heard_as_it_would_be_moved_by_a_source_at_the_field_point(case, run):
    """Reciprocity through housing and air (Fahy, J. Acoust. Soc. Am. 97, 1995): pressure per seat force is jωρ times
    the seat's velocity under the pressure that a unit source there has on the body at rest; 3 % on so coarse a mesh."""
    housing, line, knobs = run.housing, 600.0, TINY.acoustics
    modal = modal_transfer_vectors(run.transfer_vectors, housing, [line], fidelity=knobs)
    found = noise_transfer_functions(modal, housing).functions[0, 0]
    source = PointSource(case.field_points[0].position)
    still = SurfaceVelocity([line], np.zeros((1, len(housing.surface.triangles))), housing.surface)
    under = surface_pressure(still, incident=source, fidelity=knobs).pressure[0, housing.surface.triangles].mean(axis=1)
    omega = 2 * np.pi * line
    moved = housing.receptance([line])[0] * (housing.normal_shapes @ (under * housing.surface.areas))
    velocity = 1j * omega * np.einsum("k,kbd->bd", moved, housing.seat_shapes)
    assert close(1j * omega * case.air.density * velocity, found, 0.03)


def test_a_gear_with_slots_of_zero_width_sounds_as_the_solid_gear(case, run):
    pinion, wheel = case.gears
    none = replace(case, gears=(pinion, replace(wheel, blank=Slots(5, 0.022, 0.031, 0.0))))
    assert close(heard(none, housing=run.housing), run.pressure.pressure, 1e-12)
