"""Gears: size, hand and vanishing slots, on whole finite element laws, as coarse as can be."""

from dataclasses import replace

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.errors import InputError
from nvhchain.fidelity import GearFidelity
from nvhchain.gear import GearBody, GearPair, Slots, mesh_law, quasi_static_transmission_error

COARSE = GearFidelity(
    profile_elements=2, width_layers=2, slices=6, angles_per_mesh=8, deflections_per_doubling=2, row_aspect=1.0,
    load_pattern_tolerance=1e-4, far_pattern_tolerance=1e-4,
)  # fmt: skip
FORCE = 3000.0  # N


def law(pair, force=FORCE, fidelity=COARSE):
    return mesh_law(pair, nominal_force=force, fidelity=fidelity)


@pytest.fixture(scope="module")
def pair(request):
    return nvh.load_case(request.config.rootpath / "cases/small/single_stage.toml").pairs[0]


@pytest.fixture(scope="module")
def solid(pair):
    return law(pair)


def changed(pair, sense, distance, **geometry):
    """The pair at another centre distance (m) with other drawings: name → function of the value."""
    bodies = []
    for body in (pair.pinion, pair.wheel):
        fields = {name: change(getattr(body.geometry, name)) for name, change in geometry.items()}
        bodies.append(GearBody(replace(body.geometry, **fields), body.blank, body.material))
    return GearPair(*bodies, distance, sense=sense)


def test_gears_twice_the_size_carry_four_times_the_force_at_twice_the_deflection(pair, solid):
    """Linear elasticity and Hertz's half width scale alike: the logarithm in δ_loc sees ratios only."""
    lengths = ("normal_module", "face_width", "bore_radius", "thickness_allowance")
    twice = law(
        changed(pair, pair.sense, 2 * pair.centre_distance, **dict.fromkeys(lengths, lambda value: 2 * value)),
        4 * FORCE,
        replace(COARSE, corner_gap=2 * COARSE.corner_gap),
    )
    assert twice.deflection == pytest.approx(2 * solid.deflection, rel=1e-6, abs=1e-12)
    assert np.abs(twice.force - 4 * solid.force).max() < 1e-6 * np.abs(twice.force).max()
    assert twice.period == pytest.approx(solid.period, rel=1e-12)


def test_a_mirrored_pair_that_turns_the_other_way_has_the_same_law(pair, solid):
    mirrored = law(changed(pair, -pair.sense, pair.centre_distance, helix_angle=lambda angle: -angle))
    assert mirrored.deflection == pytest.approx(solid.deflection, rel=1e-6, abs=1e-12)
    assert np.abs(mirrored.force - solid.force).max() < 1e-6 * np.abs(solid.force).max()
    assert mirrored.base_helix_angle == pytest.approx(-solid.base_helix_angle)


def test_a_pair_of_five_times_the_stiffness_carries_five_times_the_force(pair, solid):
    bodies = [
        replace(body, material=replace(body.material, young=5 * body.material.young))
        for body in (pair.pinion, pair.wheel)
    ]
    stiff = law(replace(pair, pinion=bodies[0], wheel=bodies[1]), 5 * FORCE)
    assert stiff.deflection == pytest.approx(solid.deflection, rel=1e-6, abs=1e-12)
    assert np.abs(stiff.force - 5 * solid.force).max() < 1e-6 * np.abs(stiff.force).max()


@pytest.mark.slow
def test_slots_that_vanish_leave_the_solid_gear(pair, solid):
    """What slots add to the transmission error goes to nothing with their area, in proportion; narrower than an
    element they are refused."""
    plain = quasi_static_transmission_error(solid, FORCE)[1]
    added = []
    for inner, outer, width in ((0.025, 0.029, 0.15), (0.025, 0.0265, 0.11)):
        slots = Slots(5, inner, outer, width)
        slotted = law(replace(pair, wheel=replace(pair.wheel, blank=slots)))
        error = quasi_static_transmission_error(slotted, FORCE)[1].reshape(6, -1)
        added.append((np.abs(error).mean() - np.abs(plain).mean()) / (width * (outer**2 - inner**2) / 2))
        worst = np.abs(error - plain).max() / np.abs(plain).mean()
    assert worst < 0.01
    assert added[1] == pytest.approx(added[0], rel=0.15)
    assert added[0] > 0
    with pytest.raises(InputError, match="narrower than one element"):
        law(replace(pair, wheel=replace(pair.wheel, blank=Slots(5, 0.025, 0.0251, 1e-3))))


def test_where_the_slots_are_moves_with_them(pair):
    """Slots turned by one tooth: the same law, one mesh period further."""
    slots = Slots(5, 0.022, 0.031, 0.5, 0.002)
    pitch = pair.wheel.geometry.pitch_angle
    here, there = (
        law(replace(pair, wheel=replace(pair.wheel, blank=replace(slots, phase=phase)))) for phase in (0.0, pitch)
    )
    step = COARSE.angles_per_mesh
    errors = [quasi_static_transmission_error(made, FORCE)[1] for made in (here, there)]
    moved = [np.abs(np.roll(errors[0], way * step) - errors[1]).max() for way in (1, -1)]
    assert min(moved) < 1e-3 * np.ptp(errors[0])
    assert max(moved) > 1e-2 * np.ptp(errors[0])
