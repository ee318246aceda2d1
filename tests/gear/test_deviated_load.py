"""Where flanks with deviations carry, and how hard they press: against the contact problem with every flank's gap."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.gear.deviations import kind_deviations
from nvhchain.fidelity import DRAFT
from nvhchain.gear import (
    Engagement,
    Flank,
    GearPair,
    MicroGeometry,
    Misalignment,
    PairDeviations,
    deviated_load_distribution,
    drawn_deviations,
    flank_tolerances,
    largest_contact_pressure,
    load_distribution,
    loaded_mesh,
    mesh_law,
    pair_compliances,
    tooth_pairs,
)
from nvhchain.gear.laws.deviated_load import pair_forces
from nvhchain.gear.laws.deviated_pairs import pairs_as_drawn
from nvhchain.gear.laws.load_distribution import mean_sliding
from nvhchain.handoff import FloatArray, LoadDistribution, ToothPairs
from tests.gear.conftest import stage_pair
from tests.gear.test_deviations import even_flanks, perfect

FIDELITY = replace(DRAFT.gear, slices=8, angles_per_mesh=12, deflections_per_doubling=3, bodies="analytic")
FORCE, TEETH = 3000.0, 20
Drawn = tuple[GearPair, LoadDistribution, ToothPairs]


@pytest.fixture(scope="module")
def drawn() -> Drawn:
    """Pair 20/50 as drawn, where it carries, and its tooth pairs."""
    pair = stage_pair(1, thickness_allowance=80e-6)
    law = mesh_law(pair, nominal_force=FORCE, fidelity=FIDELITY)
    springs = tooth_pairs(pair, law, nominal_force=FORCE, fidelity=FIDELITY)
    return pair, load_distribution(pair, nominal_force=FORCE, fidelity=FIDELITY), springs


def sloped(pair: GearPair, slope: float) -> PairDeviations:
    """Pinion with the same helix slope (m) on every flank."""
    flanks = replace(even_flanks(TEETH), helix_slope=np.full(TEETH, slope))
    return PairDeviations(perfect(pair, 0, drive=flanks, coast=flanks), None)


def of_class(pair: GearPair, kind: str) -> PairDeviations:
    """Pinion with one kind of deviation of class 6."""
    return PairDeviations(kind_deviations(pair.pinion.geometry, kind, 6), None)


def exact(pair: GearPair, deviations: PairDeviations, angles: FloatArray) -> FloatArray:
    """Sliding (1), arm and centre of the load (m), and largest pressure (Pa), by the contact problem (4, n_angle)."""
    contact = Engagement(pair, pair_compliances(pair, FIDELITY), FIDELITY, deviations)
    guess, found = 1e-9 * FORCE, []
    for angle in angles:
        loaded = loaded_mesh(contact, float(angle), FORCE, guess=guess)
        guess, share = loaded.deflection, loaded.force / loaded.force.sum()
        lines = loaded.lines
        sense, distance = mean_sliding(pair, lines.position, lines.length)
        found.append([share @ sense, share @ distance, share @ lines.axial, loaded.pressure.max()])
    return np.array(found).T


def as_made(drawn: Drawn, deviations: PairDeviations) -> LoadDistribution:
    """Load distribution with deviations, of which the contact problem has what all teeth share."""
    pair, plain, springs = drawn
    common, shared = deviations.shared(), None
    if common is not None:
        shared = load_distribution(pair, nominal_force=FORCE, fidelity=FIDELITY, deviations=common)
    return deviated_load_distribution(pair, plain, springs, deviations, shared=shared)


def test_without_deviations_the_load_lies_as_drawn(drawn: Drawn) -> None:
    pair, plain, _ = drawn
    made = as_made(drawn, PairDeviations(perfect(pair, 0), None))
    assert len(made.angle) == TEETH * 12
    for name in ("sliding", "arm", "offset"):
        wanted = np.tile(getattr(plain, name), TEETH)
        assert getattr(made, name) == pytest.approx(wanted, abs=1e-5 * np.ptp(wanted))  # residual of the contact
    assert made.tilt_ratio == plain.tilt_ratio


@pytest.mark.parametrize("kind", ["pitch", "profile slope", "profile form", "helix slope", "all of a class"])
def test_the_load_moves_as_in_the_contact_problem(drawn: Drawn, kind: str) -> None:
    """Class 6, over a turn: within 7 % of the swing, 2 % in the root mean square; as drawn it is off by a fifth."""
    pair, plain, _ = drawn
    made = as_made(drawn, of_class(pair, kind))
    every = np.arange(0, len(made.angle), 5)
    wanted = exact(pair, of_class(pair, kind), made.angle[every])
    for name, true in zip(("sliding", "arm", "offset"), wanted, strict=False):
        error = getattr(made, name)[every] - true
        assert np.abs(error).max() < 0.07 * np.ptp(true)
        assert np.sqrt((error**2).mean()) < 0.02 * np.ptp(true)
    as_drawn = np.tile(plain.sliding, TEETH)[every] - wanted[0]
    assert np.abs(as_drawn).max() > 0.2 * np.ptp(wanted[0])


def test_a_slope_of_all_teeth_moves_the_load_as_the_same_drawn_slope(drawn: Drawn) -> None:
    """30 µm: one end of the face carries, so that sliding changes its sense as in a spur mesh."""
    pair, plain, springs = drawn
    made = as_made(drawn, sloped(pair, 30e-6))
    flank = Flank(lead_slope=-30e-6)
    pinion = replace(pair.pinion, geometry=replace(pair.pinion.geometry, micro=MicroGeometry(flank, flank)))
    wanted = load_distribution(replace(pair, pinion=pinion), nominal_force=FORCE, fidelity=FIDELITY)
    first = slice(len(wanted.angle))
    for name in ("sliding", "arm", "offset"):
        assert getattr(made, name)[first] == pytest.approx(getattr(wanted, name), abs=0.005 * np.ptp(wanted.sliding))
    assert np.ptp(wanted.sliding) > 1.5 * np.ptp(plain.sliding)
    assert (wanted.offset - plain.offset).mean() > 0.2 * pair.face_width
    # the springs alone
    rough = deviated_load_distribution(pair, plain, springs, sloped(pair, 30e-6))
    assert np.abs(rough.sliding[first] - wanted.sliding).max() < 0.06 * np.ptp(wanted.sliding)
    assert np.abs(rough.offset[first] - wanted.offset).max() < 0.1 * pair.face_width


def test_a_drawn_misalignment_moves_the_load_as_the_same_stated_one(drawn: Drawn) -> None:
    """0.6 mrad across and 0.03 mrad along: springs alone put the centre of the load off by 30 % of its swing."""
    pair = drawn[0]
    angles = Misalignment(0.6e-3, 0.03e-3)
    wanted = load_distribution(replace(pair, misalignment=angles), nominal_force=FORCE, fidelity=FIDELITY)
    made = as_made(drawn, PairDeviations(None, None, angles))
    assert len(made.angle) == len(wanted.angle)
    assert made.sliding == pytest.approx(wanted.sliding, abs=2e-3)
    assert made.offset == pytest.approx(wanted.offset, abs=2e-5)


@pytest.mark.parametrize("kind", ["pitch", "all of a class"])
def test_the_largest_pressure_is_that_of_the_worst_place_of_all_turns(drawn: Drawn, kind: str) -> None:
    """The contact problem at all 240 angles has the same; as drawn it is lower."""
    pair, deviations = drawn[0], of_class(drawn[0], kind)
    found = largest_contact_pressure(pair, nominal_force=FORCE, fidelity=FIDELITY, deviations=deviations)
    angles = np.arange(TEETH * 12) * pair.mesh_period / 12
    assert found == pytest.approx(exact(pair, deviations, angles)[3].max(), rel=1e-3)
    assert found > 1.05 * largest_contact_pressure(pair, nominal_force=FORCE, fidelity=FIDELITY)


def test_the_pressure_of_a_slope_of_all_teeth_is_that_of_the_same_drawn_slope(drawn: Drawn) -> None:
    pair = drawn[0]
    flank = Flank(lead_slope=-30e-6)
    pinion = replace(pair.pinion, geometry=replace(pair.pinion.geometry, micro=MicroGeometry(flank, flank)))
    wanted = largest_contact_pressure(replace(pair, pinion=pinion), nominal_force=FORCE, fidelity=FIDELITY)
    found = largest_contact_pressure(pair, nominal_force=FORCE, fidelity=FIDELITY, deviations=sloped(pair, 30e-6))
    assert found == pytest.approx(wanted, rel=0.01)


def test_flanks_that_lie_ahead_by_more_than_the_deflection_have_a_pressure(drawn: Drawn) -> None:
    """Class 9 under a tenth of the load: the deflection that carries it is below 0 in places, such as -6 µm."""
    pair, force = drawn[0], 0.1 * FORCE
    plain = largest_contact_pressure(pair, nominal_force=force, fidelity=FIDELITY)
    for seed in range(4):
        made = drawn_deviations(pair.pinion.geometry, flank_tolerances(pair.pinion.geometry, 9), seed=seed)
        found = largest_contact_pressure(
            pair, nominal_force=force, fidelity=FIDELITY, deviations=PairDeviations(made, None)
        )
        assert found > plain


@pytest.mark.parametrize("load", [10.0, FORCE, 3.0 * FORCE, 6.0 * FORCE])
def test_the_pairs_carry_any_load_of_the_law_together(drawn: Drawn, load: float) -> None:
    """Also at the first position, which no neighbour helps to find the approach."""
    springs = drawn[2]
    forces = pair_forces(springs, pairs_as_drawn(springs, 0), load)
    assert forces.sum(axis=-1) == pytest.approx(load, rel=1e-4)
    assert (forces >= 0.0).all()
