"""What the error band knows of mesh laws: slices, angles, bodies, blanks, and what harmonics make together."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

import nvhchain as nvh
from benchmarks.chain.error_band_cases import far
from nvhchain.error_band import COVERAGE
from nvhchain.error_band.gears import (
    AMPLIFICATION,
    FED_MARGIN,
    LAYER_RIPPLE,
    SLICE_ERROR,
    UNKNOWN,
    _compliance_ratio,
    _table_error,
    folded,
    force_error,
    law_error,
    layer_ripple,
)
from nvhchain.fidelity import DRAFT, REFERENCE, STANDARD
from nvhchain.gear import Flank, MicroGeometry, quasi_static_transmission_error
from nvhchain.gear import mesh_law as gear_mesh_law
from nvhchain.testing.hand_offs import mesh_law


@pytest.fixture(scope="module")
def case(request):
    return nvh.load_case(request.config.rootpath / "cases" / "small" / "single_stage.toml")


def test_what_two_harmonics_make_together_is_known_as_well_as_they_are():
    """A spectrum folded with itself: 2 m² of power at its own line and m⁴ at twice it, beside twice h² of its own."""
    one, h = 0.03, 1e-5
    harmonics = np.array([1.0, one, h])
    made = folded([(Fraction(20), harmonics, np.array([0.0, 0.01 * one, 0.0]))], 60.0)
    relative = made.relative(np.array([20.0, 40.0]))
    assert np.sqrt(made.power[1]) == pytest.approx(2**0.5 * one, rel=0.02)
    assert relative[0] == pytest.approx(AMPLIFICATION * 0.01, rel=0.05)
    assert relative[1] == pytest.approx(AMPLIFICATION * 0.01, rel=0.5)
    assert made.relative(np.array([30.0]))[0] == 1.0
    assert made.relative(np.array([30.0]), 11.0)[0] < 0.03


def test_sidebands_of_two_stages_are_known_as_well_as_their_mesh_harmonics():
    spectra = [(Fraction(20), np.array([1.0, 0.05]), np.array([0.0, 1e-3]))]
    spectra += [(Fraction(12), np.array([1.0, 0.04]), np.array([0.0, 4e-4]))]
    made = folded(spectra, 40.0)
    own, other, beside = made.relative(np.array([20.0, 12.0, 32.0]))
    assert own == pytest.approx(AMPLIFICATION * 0.02, rel=0.1)
    assert other == pytest.approx(AMPLIFICATION * 0.01, rel=0.1)
    assert beside == pytest.approx(np.hypot(own, other), rel=0.1)


def test_sidebands_of_a_resonant_line_err_as_that_line_and_not_as_their_own_tiny_excitation():
    """Line 100 at a resonance feeds 98 through the modulation at order 2; a sideband as quiet as its own excitation
    gains nothing."""
    harmonics, errors = np.zeros(51), np.zeros(51)
    harmonics[[0, 1, 49, 50]], errors[[1, 49, 50]] = (1.0, 1e-2, 1e-9, 1e-4), (1e-4, 1e-5, 5e-6)
    made, orders = folded([(Fraction(2), harmonics, errors)], 100.0), np.array([98.0, 100.0])
    alone = made.relative(orders)
    assert alone[0] > 2.0
    own, other = made.relative(np.array([2.0]))[0], alone[1]
    loud = made.relative_of(orders, np.array([0.5, 1.0]), 20.0)
    assert loud[1] == alone[1]
    floor = FED_MARGIN * alone[0] * np.sqrt(made.power[49] / made.power[50]) / 0.5
    assert loud[0] == pytest.approx(np.sqrt(own**2 + other**2 + floor**2), rel=1e-4)
    assert loud[0] < alone[0]
    quiet = np.array([np.sqrt(made.power[49] / made.power[50]), 1.0])
    assert made.relative_of(orders, quiet, 20.0) == pytest.approx(alone)
    assert made.relative_of(orders, np.array([0.5, 1.0]), 1.0) == pytest.approx(alone)


def test_analytic_gear_bodies_leave_all_of_the_mesh_harmonics_open(case):
    """Of the first one all; of a third one of a tenth of it, three times as much as there is."""
    rigid, laws = replace(DRAFT.gear, bodies="analytic"), [mesh_law([1e-6, 0.0, 1e-7])]
    first, third = force_error(case, laws, rigid, 80.0).relative(np.array([20.0, 60.0]))
    assert first == pytest.approx(AMPLIFICATION, rel=0.05)
    assert third == pytest.approx(AMPLIFICATION * 10 / 3, rel=0.1)
    assert force_error(case, laws, DRAFT.gear, 80.0).relative(np.array([20.0]))[0] < 0.01


def test_errors_of_the_compliance_remain_where_relief_cancels_its_harmonic():
    """E = F (c₀ + c₁ cos) − m cos: the harmonic that is left is F c₁ − m, its error that of F c₁."""
    law, force, left = mesh_law([1e-6]), 1000.0, 0.2
    teeth = round(law.period * law.teeth[1] / (2 * np.pi))
    wave = np.cos(2 * np.pi * teeth * law.angle / law.period)[:, None]
    deflection, mean = np.linspace(0.0, 40e-6, 200), 1e-8
    relieved = (deflection + (1 - left) * 0.1 * mean * force * wave) / (mean * (1 + 0.1 * wave))
    made = law.replace(deflection=deflection, force=np.maximum(relieved, 0.0))
    _, error = quasi_static_transmission_error(made, force)
    harmonics = np.abs(np.fft.rfft(error)) / len(error)
    assert _compliance_ratio(made, force, harmonics, teeth) == pytest.approx(1 / left, rel=0.02)
    even = law.replace(deflection=deflection, force=deflection / (mean * (1 + 0.1 * wave)))
    _, error = quasi_static_transmission_error(even, force)
    assert _compliance_ratio(even, force, np.abs(np.fft.rfft(error)) / len(error), teeth) == pytest.approx(1, rel=0.01)


def test_limits_of_forces_count_what_relief_cancels_only_where_a_gear_has_micro_geometry(case, monkeypatch):
    relief = MicroGeometry(drive=Flank(profile_crowning=5e-6))
    gear = case.gears[1]
    relieved = replace(case, gears=(case.gears[0], replace(gear, geometry=replace(gear.geometry, micro=relief))))
    monkeypatch.setattr("nvhchain.error_band.gears._compliance_ratio", lambda *_: 5.0)
    plain, more = (
        force_error(of, [mesh_law([1e-6])], REFERENCE.gear, 80.0).relative(np.array([20.0]))[0]
        for of in (case, relieved)
    )
    assert 2.0 * plain < more < 5.0 * plain + 1e-12


def test_slices_err_with_the_square_of_the_overlap_and_spur_gears_not_at_all(case):
    """A sum over S slices in the place of the integral over the face: harmonic n is (π n ε/S)/sin(π n ε/S) of it."""
    wheel = case.gears[1].geometry
    spur, steep = replace(wheel, helix_angle=0.0), replace(wheel, helix_angle=np.radians(25.0))
    few, many = (replace(REFERENCE.gear, slices=count) for count in (8, 16))
    rest = law_error(spur, few)
    assert law_error(spur, many) == rest
    found = [np.sqrt(law_error(steep, fidelity) ** 2 - rest**2) for fidelity in (few, many)]
    assert found[0] == pytest.approx(4 * found[1])
    share = np.pi * 0.016 * np.sin(np.radians(25.0)) / (np.pi * 2.7e-3) / 8
    assert share / np.sin(share) - 1 < found[0] < 10 * (share / np.sin(share) - 1)
    # of a face wider than an axial pitch every pitch is cut into so many
    flat, wide = (replace(gear, face_width=3 * gear.face_width) for gear in (spur, steep))
    assert np.hypot(law_error(flat, few), SLICE_ERROR / 8**2) == pytest.approx(law_error(wide, few))


def test_load_patterns_and_elements_of_the_profile_err_at_the_first_harmonics_and_layers_at_all(case):
    """Body and profile move smoothly as teeth roll: their part falls with the square of the harmonic's number."""
    wheel = case.gears[1].geometry
    finer = replace(DRAFT.gear, load_pattern_tolerance=3e-4, profile_elements=40)
    first, second, far = law_error(wheel, DRAFT.gear, [1, 2, 1000]) ** 2 - law_error(wheel, finer, [1, 2, 1000]) ** 2
    assert first == pytest.approx(0.99 * (0.7 * 3e-3) ** 2 + 0.9999 * 2.5e-3**2)
    assert second == pytest.approx(first / 16)
    assert abs(far) < 1e-9 * first
    few, many = (law_error(wheel, replace(finer, width_layers=count), [1, 8]) ** 2 for count in (4, 8))
    layers = 5e-4 * (wheel.face_width / wheel.normal_module / 4) ** 4
    assert few - many == pytest.approx((1 - 1 / 256) * layers**2)


def test_a_contact_line_rises_and_falls_with_the_layers_that_it_passes(case, monkeypatch):
    """12 layers under 3 axial pitches: 4 of them pass in a mesh period. Spur gears have no such ripple."""
    wheel = case.gears[1].geometry
    pitch = np.pi * wheel.normal_module / np.sin(abs(wheel.helix_angle))
    wide, many = replace(wheel, face_width=3.0 * pitch), replace(DRAFT.gear, width_layers=12)
    found = layer_ripple(wide, many, 9)
    assert found[[3, 7]] == pytest.approx(LAYER_RIPPLE / 16 * np.array([1.0, 0.5]))
    assert not found[[0, 1, 2, 4, 5, 6, 8]].any()
    between = layer_ripple(wide, replace(many, width_layers=10), 4)  # 3.3 in a period
    assert between == pytest.approx(LAYER_RIPPLE * 0.09 * np.array([0.0, 0.0, 2 / 3, 1 / 3]))
    assert not layer_ripple(replace(wide, helix_angle=0.0), many, 9).any()
    # three layers under a third of a pitch: the ninth harmonic of a law has the ripple, 5e-5 of the deflection
    laws, order = [mesh_law([1e-7, *(7 * [1e-12]), 1e-8])], np.array([180.0])
    coarse = replace(REFERENCE.gear, width_layers=3)
    with_it = force_error(case, laws, coarse, 200.0).relative(order)[0]
    monkeypatch.setattr("nvhchain.error_band.gears.LAYER_RIPPLE", 0.0)
    assert with_it > 1.2 * force_error(case, laws, coarse, 200.0).relative(order)[0]


@pytest.mark.slow
def test_the_ripple_of_a_wide_helical_gear_is_where_and_as_large_as_stated():
    """17 modules wide, overlap 2.9: six layers put the second harmonic off by 20e-4 of the deflection, others less."""
    (wide,) = (of for of in far() if of.name == "helix 33 wide 30 mm 1700")
    (pair,), (force,) = wide.pairs, wide.mesh_forces
    found = []
    for layers in (6, 12):
        knobs = replace(DRAFT.gear, width_layers=layers)
        law = gear_mesh_law(pair, nominal_force=force, fidelity=knobs)
        error = quasi_static_transmission_error(law, force)[1]
        found.append(np.fft.rfft(error)[:9] / np.fft.rfft(error)[0].real)
    off, stated = np.abs(found[0] - found[1])[1:], layer_ripple(pair.wheel.geometry, DRAFT.gear, 8)
    assert off.argmax() == stated.argmax() == 1
    assert off[1] == pytest.approx(stated[1], rel=0.3)
    assert off[1] > 4 * np.delete(off, 1).max()


def test_every_second_angle_of_a_law_tells_what_its_angles_leave_open(case):
    """64 angles in a mesh: the 30th harmonic lies on the second one where every other angle is excluded, and the 62nd
    one, (30/62)² of it at kinks, where none is."""
    amplitudes = np.zeros(30)
    amplitudes[[0, 1, 29]] = 1e-6, 1e-7, 1e-8
    second = force_error(case, [mesh_law(amplitudes)], REFERENCE.gear, 80.0).relative(np.array([40.0]))[0]
    without = force_error(case, [mesh_law(amplitudes[:2])], REFERENCE.gear, 80.0).relative(np.array([40.0]))[0]
    assert np.sqrt(second**2 - without**2) == pytest.approx(AMPLIFICATION * (30 / 62) ** 2 * 0.1, rel=0.02)


def test_harmonics_beyond_half_the_angles_of_a_law_are_unknown_and_those_it_holds_as_well_known_as_before(case):
    """Of 64 angles: 24.6 dB too quiet, and no more, though nothing else excites the 36th but products of small ones."""
    laws, orders = [mesh_law([1e-6, 1e-7])], np.array([20.0, 40.0, 640.0, 700.0, 720.0])
    wide, narrow = (force_error(case, laws, REFERENCE.gear, top).relative(orders) for top in (740.0, 640.0))
    assert wide[:2] == pytest.approx(narrow[:2], rel=1e-3)
    assert wide[3:] == pytest.approx(UNKNOWN, rel=0.02)
    assert 20 * np.log10(1 + COVERAGE * UNKNOWN) == pytest.approx(24.6, abs=0.05)


def test_tip_edges_that_are_not_looked_for_leave_half_of_the_strongest_harmonic_open(case):
    """Falling with the number of the harmonic; a gap too small for the load is widened, and leaves nothing open."""
    found = {}
    for gap in (60e-6, 1e-9, 0.0):
        made = force_error(case, [mesh_law([1e-6, 0.0, 1e-7])], replace(REFERENCE.gear, corner_gap=gap), 80.0)
        found[gap] = made.relative(np.array([20.0, 60.0]))
    assert found[0.0] == pytest.approx(AMPLIFICATION * np.array([0.5, 10 / 6]), rel=0.1)
    assert np.array_equal(found[1e-9], found[60e-6])
    assert found[60e-6].max() < 0.02


def test_slow_lines_of_a_blank_are_known_to_a_percent_of_their_mean_with_the_strongest(case):
    """Slots that turn with 30 teeth: the fourth line 1, the sixteenth 0.01, by a mesh with four elements per flank."""
    period, count = 2 * np.pi, 30 * 64
    angle = np.arange(count) * period / count
    error = 1e-6 * (np.cos(30 * angle) + np.cos(4 * angle) + 0.01 * np.cos(16 * angle))
    grid = np.linspace(-2e-5, 8e-5, 201)
    slotted = mesh_law([1e-6]).replace(angle=angle, period=period, deflection=grid, force=1e8 * (grid - error[:, None]))
    lines = np.array([4.0, 16.0]) * 20 / 30
    strong, weak = force_error(case, [slotted], replace(STANDARD.gear, far_pattern_tolerance=0.0), 30.0).relative(lines)
    assert strong == pytest.approx(AMPLIFICATION * 0.012, rel=0.1)
    assert weak == pytest.approx(AMPLIFICATION * 0.12, rel=0.1)


@pytest.mark.parametrize("deflections", [12, 17, 24])
def test_errors_of_wide_steps_of_the_deflection_are_those_against_narrow_ones(case, deflections):
    """Force c(θ) δ² between steps of 4 to 8 µm, against δ = √(F/c): held, by at most ten times the error."""
    law, force = mesh_law([0.0]), 1000.0
    stiffness = 1e12 * (1 + 0.2 * np.cos(30 * law.angle))[:, None]

    def errors(count):
        grid = np.linspace(0.0, 9e-5, count)
        of = law.replace(deflection=grid, force=stiffness * grid**2)
        deflection = quasi_static_transmission_error(of, force)[1]
        exact = np.sqrt(force / stiffness[:, 0])
        in_loop = np.array([np.interp(force, row, grid) for row in of.force])
        made = np.abs(np.fft.rfft(in_loop - exact))[1:] / len(exact)
        return made, _table_error(of, force, deflection, 1)[1:], of

    made, stated, _ = errors(deflections)
    assert np.all(made[:6] < COVERAGE * stated[:6])
    assert stated.max() < 10.0 * made.max()
    wide, narrow = (
        force_error(case, [errors(count)[2]], REFERENCE.gear, 40.0).relative(np.array([20.0]))[0] for count in (12, 400)
    )
    assert wide > 1.2 * narrow
