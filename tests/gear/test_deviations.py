"""Manufacturing deviations: classes, draws, and what they do to the loaded transmission error."""

from __future__ import annotations

from dataclasses import replace
from math import cos, pi, radians

import numpy as np
import pytest

from benchmarks.gear.deviations import KINDS, Errors, errors, kind_deviations
from nvhchain.errors import InputError
from nvhchain.fidelity import DRAFT
from nvhchain.gear.contact.engagement import Engagement
from nvhchain.gear.deviations.drawn import drawn_deviations, eccentric_pitch
from nvhchain.gear.deviations.flanks import GearDeviations, Ghost, ToothFlanks
from nvhchain.gear.deviations.pairs import PairDeviations
from nvhchain.gear.deviations.tolerances import flank_tolerances, standard_tolerance
from nvhchain.gear.drawing.geometry import GearGeometry
from nvhchain.gear.drawing.pair import GearPair
from nvhchain.gear.laws.deviated_law import deviated_mesh_law
from nvhchain.gear.laws.mesh_law import mesh_law, pair_compliances
from nvhchain.gear.laws.tooth_pairs import tooth_pairs
from nvhchain.gear.laws.transmission_error import deflection_at_force, loaded_mesh
from nvhchain.handoff import FloatArray, MeshLaw, ToothPairs
from tests.gear.conftest import stage_pair

FIDELITY = replace(DRAFT.gear, slices=8, angles_per_mesh=12, deflections_per_doubling=3, bodies="analytic")
FORCE = 3000.0
Drawn = tuple[GearPair, MeshLaw, ToothPairs]


@pytest.fixture(scope="module")
def drawn() -> Drawn:
    """Pair 20/50 as drawn, its law and its tooth pairs."""
    pair = stage_pair(1, thickness_allowance=80e-6)
    law = mesh_law(pair, nominal_force=FORCE, fidelity=FIDELITY)
    return pair, law, tooth_pairs(pair, law, nominal_force=FORCE, fidelity=FIDELITY)


def even_flanks(teeth: int) -> ToothFlanks:
    """Flanks without deviations."""
    none = np.zeros(teeth)
    return ToothFlanks(none, none, none, none, none)


def pitch_deviations(
    geometry: GearGeometry, deviations: GearDeviations, *, drives: bool = True
) -> tuple[FloatArray, FloatArray]:
    """Single and cumulative pitch deviations (n_tooth,) m of the drive flanks, as a measurement finds them."""
    eccentric = eccentric_pitch(geometry, deviations.eccentricity, deviations.eccentricity_angle, drives=drives)
    place = deviations.drive.pitch + eccentric
    return np.roll(place, -1) - place, place - place[0]


def perfect(pair: GearPair, gear: int, **changes: object) -> GearDeviations:
    """Gear without deviations but those in `changes`."""
    flanks = even_flanks(pair.geometries[gear].teeth)
    return GearDeviations(**({"drive": flanks, "coast": flanks} | changes))  # type: ignore[arg-type]


def loaded(drawn: Drawn, deviations: PairDeviations, force: float = FORCE) -> tuple[FloatArray, FloatArray]:
    """Deflections (m) with deviations and as drawn over the same turns."""
    law = deviated_mesh_law(*drawn, deviations)
    plain = deflection_at_force(drawn[1], force)
    return deflection_at_force(law, force), np.tile(plain, len(law.angle) // len(plain))


def test_classes_follow_the_formulas_of_the_standard() -> None:
    """Spur gear d = 200 mm, by hand: 7.2, 23.68, 6.2, 7.75, 6.92, 7.84, 21.3 µm before rounding."""
    gear = GearGeometry(40, 5e-3, radians(20), 0.0, 40e-3, bore_radius=30e-3)
    found = flank_tolerances(gear, 5)
    assert [round(1e6 * value, 3) for value in vars(found).values()] == [7.0, 24, 6.0, 8.0, 7.0, 8.0, 21]
    coarser = flank_tolerances(gear, 7)
    assert coarser.single_pitch == pytest.approx(14e-6)
    assert [round(1e6 * standard_tolerance(0.1, it)) for it in (6, 7, 8)] == [22, 35, 54]
    with pytest.raises(InputError, match=r"tolerance class 12 is not a whole number of 1…11"):
        flank_tolerances(gear, 12)


@pytest.mark.parametrize("drives", [True, False])
def test_a_drawn_gear_fills_its_class_and_sums_to_the_cumulative_pitch(drives: bool) -> None:
    """A gear at its limits: the worse pitch deviation is at its tolerance; steps sum to zero over a turn."""
    gear = GearGeometry(31, 2.7e-3, radians(20), radians(10), 16e-3, bore_radius=12e-3)
    limits = flank_tolerances(gear, 6)
    for seed in range(8):
        made = drawn_deviations(gear, limits, seed=seed, drives=drives)
        single, cumulative = pitch_deviations(gear, made, drives=drives)
        assert np.cumsum(single)[:-1] == pytest.approx(cumulative[1:], abs=1e-15)
        assert single.sum() == pytest.approx(0.0, abs=1e-15)
        worst = np.abs(single).max() / limits.single_pitch, np.ptp(cumulative) / limits.cumulative_pitch
        assert max(worst) == pytest.approx(1.0, rel=1e-6)
        assert min(worst) > 0.9
        assert 2 * made.eccentricity <= limits.run_out * (1 + 1e-9)
        assert np.abs(made.drive.helix_slope).max() == pytest.approx(limits.helix_slope)
    half = drawn_deviations(gear, limits.scaled(0.5), seed=7, drives=drives)
    assert half.drive.pitch == pytest.approx(0.5 * made.drive.pitch, rel=1e-6)


def test_without_deviations_the_law_is_the_one_as_drawn(drawn: Drawn) -> None:
    """Both gears perfect, over one turn of the pinion."""
    found, plain = loaded(drawn, PairDeviations(perfect(drawn[0], 0), None))
    assert len(found) == 20 * 12
    assert found == pytest.approx(plain, abs=1e-3 * np.ptp(plain))


def test_run_out_adds_one_line_to_the_error_and_sidebands_to_the_force(drawn: Drawn) -> None:
    """The axis beside that of rotation shifts all flanks alike: the TE gains ε cos β_b once a turn.

    A displacement e under a stiffness k(θ) gives lines at mesh order ± 1 of half the harmonic of k times that of e.
    """
    pair = drawn[0]
    eccentricity, angle = 2e-6, 0.4
    deviations = PairDeviations(perfect(pair, 0, eccentricity=eccentricity, eccentricity_angle=angle), None)
    found, plain = loaded(drawn, deviations)
    turn = np.arange(len(found)) * (2 * pi / len(found))
    added = -eccentricity * np.sin(turn + angle + pair.working_pressure_angle) * cos(pair.base_helix_angle)
    assert found - plain == pytest.approx(added, abs=1e-3 * eccentricity)

    law = deviated_mesh_law(*drawn, deviations)
    level = float(plain.mean())
    force = np.array([np.interp(level, law.deflection, row) for row in law.force])
    step = 1e-6
    stiffness = np.tile(
        [
            float(np.diff(np.interp([level - step, level + step], drawn[1].deflection, row))[0]) / (2 * step)
            for row in drawn[1].force
        ],
        20,
    )
    lines, harmonic = np.fft.rfft(force) / len(force), np.fft.fft(stiffness) / len(stiffness)
    shaft = (np.fft.fft(added) / len(added))[1]
    for side, part in ((1, shaft), (-1, np.conj(shaft))):
        assert abs(lines[20 + side]) == pytest.approx(abs(harmonic[20] * part), rel=0.1)


def test_one_tooth_out_of_place_is_a_pulse_of_its_load_share(drawn: Drawn) -> None:
    """A small pitch error e of one tooth moves the TE by its share in the load, at every order of the shaft."""
    pair, law, _ = drawn
    place = np.zeros(20)
    place[3] = 0.2e-6
    flanks = replace(even_flanks(20), pitch=place)
    found, _ = loaded(drawn, PairDeviations(perfect(pair, 0, drive=flanks), None))
    plain, _ = loaded(drawn, PairDeviations(perfect(pair, 0), None))
    engagement = Engagement(pair, pair_compliances(pair, FIDELITY), FIDELITY)
    share = []
    for row in range(len(found)):
        meshes, at = divmod(row, 12)
        mesh = loaded_mesh(engagement, float(law.angle[at]), FORCE, guess=float(plain[0]))
        share.append(mesh.load_share().get(pair.sense * (3 - meshes), 0.0))
    normal = 0.2e-6 * cos(pair.pinion.geometry.transverse_pressure_angle) * cos(pair.base_helix_angle)
    closed = np.fft.rfft(-normal * np.array(share)) / len(share)
    assert np.fft.rfft(found - plain) / len(share) == pytest.approx(closed, abs=0.03 * np.abs(closed).max())


def against_contact(drawn: Drawn, deviations: PairDeviations) -> tuple[Errors, float]:
    """Errors of the loaded transmission error against the contact problem, and how far that is from the drawing (m)."""
    pair = drawn[0]
    mine, plain = (values[::3] for values in loaded(drawn, deviations))
    law = deviated_mesh_law(*drawn, deviations)
    engagement = Engagement(pair, pair_compliances(pair, FIDELITY), FIDELITY, deviations)
    guess, exact = float(mine[0]), []
    for angle in law.angle[::3]:
        guess = loaded_mesh(engagement, float(angle), FORCE, guess=guess).deflection
        exact.append(guess)
    return errors(mine, np.array(exact), deviations.meshes(pair)), float(np.abs(exact - plain).max())


@pytest.mark.slow
@pytest.mark.parametrize("grade", [4, 6])
def test_pairs_meet_the_contact_problem_with_every_flank_of_its_own(drawn: Drawn, grade: int) -> None:
    """Drawn gears, over one meeting of all teeth: within 1 % of the swing, sidebands within 0.5 dB."""
    pair = drawn[0]
    deviations = PairDeviations(
        drawn_deviations(pair.pinion.geometry, flank_tolerances(pair.pinion.geometry, grade), seed=1),
        drawn_deviations(pair.wheel.geometry, flank_tolerances(pair.wheel.geometry, grade), seed=2, drives=False),
    )
    met, _ = against_contact(drawn, deviations)
    assert met.largest < 0.01
    assert len(met.sidebands) >= 2
    assert all(abs(error) < 0.5 for _, error in met.sidebands)


@pytest.mark.parametrize(
    ("kind", "grade"), [*((kind, 6) for kind in KINDS if kind != "all of a class"), ("helix slope", 7)]
)
def test_each_kind_of_deviation_meets_the_contact_problem(drawn: Drawn, kind: str, grade: int) -> None:
    """Pinion with one kind alone, over its turn: within 2 % of the swing, sidebands within 0.5 dB.

    Teeth that each have their own helix slope carry on a part of their face.
    """
    met, moved = against_contact(drawn, PairDeviations(kind_deviations(drawn[0].pinion.geometry, kind, grade), None))
    assert met.largest < 0.02
    assert met.mean_square < 0.007
    assert all(abs(error) < 0.5 for _, error in met.sidebands)
    assert moved > 0.03 * met.swing  # gears as drawn do not meet it


def test_a_ghost_and_a_topography_move_the_error_as_they_are(drawn: Drawn) -> None:
    """A sine of order 37 on all flanks, and one grid that is even, shift the deflection by their material."""
    pair = drawn[0]
    deep = replace(even_flanks(20), topography=np.full((1, 3, 2), 1e-6))
    for changes, closing in (
        ({"ghosts": (Ghost(37.0, 0.5e-6, 0.2),)}, lambda turn: 0.5e-6 * np.cos(37.0 * turn + 0.2)),
        ({"drive": deep}, lambda turn: np.full(len(turn), 1e-6)),
    ):
        found, plain = loaded(drawn, PairDeviations(perfect(pair, 0, **changes), None))
        turn = np.arange(len(found)) * (2 * pi / len(found))
        assert plain - found == pytest.approx(closing(turn), abs=2e-8)


def test_flanks_that_jam_are_refused(drawn: Drawn) -> None:
    """Material on both flanks of all teeth beyond the backlash."""
    pair = drawn[0]
    thick = replace(even_flanks(20), topography=np.full((1, 2, 2), 100e-6))
    with pytest.raises(InputError, match=r"deviations close the backlash by .* µm too much, the flanks jam"):
        deviated_mesh_law(*drawn, PairDeviations(perfect(pair, 0, drive=thick, coast=thick), None))
