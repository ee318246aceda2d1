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
    CANCELLED,
    FED_MARGIN,
    LAYER_RIPPLE,
    UNKNOWN,
    _compliance_harmonics,
    _kinks,
    _table_error,
    contact_error,
    folded,
    force_error,
    layer_ripple,
    relative_law_error,
)
from nvhchain.fidelity import DRAFT, REFERENCE, STANDARD
from nvhchain.gear import Flank, MicroGeometry, quasi_static_transmission_error
from nvhchain.gear import mesh_law as gear_mesh_law
from nvhchain.testing.hand_offs import mesh_law

EVEN = DRAFT.gear.even_layers(6)
"""`draft` with teeth and blank in the same layers."""


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
    far = made.relative_of(orders, np.array([0.5, 1.0]), 1.0)  # without a line that may feed it
    assert far == pytest.approx([np.hypot(1.0, floor), alone[1]], rel=1e-5)


def test_analytic_gear_bodies_leave_all_of_the_mesh_harmonics_open(case):
    """Of the first one all; of a third one of a tenth of it, three times as much as there is."""
    rigid, laws = replace(DRAFT.gear, bodies="analytic"), [mesh_law([1e-6, 0.0, 1e-7])]
    first, third = force_error(case, laws, rigid, 80.0).relative(np.array([20.0, 60.0]))
    assert first == pytest.approx(AMPLIFICATION, rel=0.05)
    assert third == pytest.approx(AMPLIFICATION * 10 / 3, rel=0.1)
    assert force_error(case, laws, DRAFT.gear, 80.0).relative(np.array([20.0]))[0] < 0.01


def spectrum(law, amplitudes):
    """Harmonics of the angles of a law whose mesh harmonics have these amplitudes."""
    found, teeth = np.zeros(len(law.angle) // 2 + 1), round(law.period * law.teeth[1] / (2 * np.pi))
    found[teeth * np.arange(1, len(amplitudes) + 1)] = 0.5 * np.array(amplitudes)
    return found


def test_errors_of_the_compliance_remain_where_relief_cancels_its_harmonic():
    """E = F (c₀ + c₁ cos) − m cos: the harmonic that is left is F c₁ − m, its error that of F c₁."""
    law, force, left = mesh_law([1e-6]), 1000.0, 0.2
    teeth = round(law.period * law.teeth[1] / (2 * np.pi))
    wave = np.cos(2 * np.pi * teeth * law.angle / law.period)[:, None]
    deflection, mean = np.linspace(0.0, 40e-6, 200), 1e-8
    relieved = (deflection + (1 - left) * 0.1 * mean * force * wave) / (mean * (1 + 0.1 * wave))
    made = law.replace(deflection=deflection, force=np.maximum(relieved, 0.0))
    even = law.replace(deflection=deflection, force=deflection / (mean * (1 + 0.1 * wave)))
    for one, share in ((made, left), (even, 1.0)):
        _, error = quasi_static_transmission_error(one, force)
        harmonic = (np.abs(np.fft.rfft(error)) / len(error))[teeth]
        assert _compliance_harmonics(one, force)[teeth] == pytest.approx(harmonic / share, rel=0.02)


def test_slices_err_by_harmonics_of_the_compliance_where_relief_cancels_those_that_are_seen(case, monkeypatch):
    """The first harmonic cancels to a hundredth: its error stays, and that of the fifth does not rise with it."""
    relief = MicroGeometry(drive=Flank(profile_crowning=5e-6))
    gear = case.gears[1]
    relieved = replace(case, gears=(case.gears[0], replace(gear, geometry=replace(gear.geometry, micro=relief))))
    amplitudes, orders = [1e-6 / n**2 for n in range(1, 31)], 20.0 * np.array([1.0, 5.0])
    coarse = replace(REFERENCE.gear, slices=6)
    plain = mesh_law(amplitudes)
    monkeypatch.setattr("nvhchain.error_band.gears._compliance_harmonics", lambda *_: spectrum(plain, amplitudes))
    whole, cancelled = (
        np.sqrt(error.error[np.rint(orders / error.step).astype(int)])
        for error in (
            force_error(case, [plain], coarse, 200.0),
            force_error(relieved, [mesh_law([1e-8, *amplitudes[1:]])], coarse, 200.0),
        )
    )
    assert cancelled == pytest.approx(whole, rel=0.15)


@pytest.mark.parametrize("teeth", [1, 2, 5])
@pytest.mark.parametrize("angles", [6, 27, 64])
def test_a_law_has_errors_at_all_of_its_lines_whatever_its_angles_and_teeth(case, teeth, angles):
    """Below a low order, too: of 27 angles and 2 teeth the law holds half a harmonic more than whole ones."""
    law = mesh_law([1e-6])
    period = teeth * 2 * np.pi / law.teeth[1]
    angle = np.arange(teeth * angles) * period / (teeth * angles)
    force = np.ones((teeth * angles, 1)) * law.force[:1]
    made = law.replace(angle=angle, period=period, force=force)
    for highest in (20.0, 60.0, 900.0):
        assert np.isfinite(force_error(case, [made], replace(DRAFT.gear, angles_per_mesh=angles), highest).error).all()


def test_limits_of_forces_count_what_relief_cancels_only_where_a_gear_has_micro_geometry(case, monkeypatch):
    relief = MicroGeometry(drive=Flank(profile_crowning=5e-6))
    gear = case.gears[1]
    relieved = replace(case, gears=(case.gears[0], replace(gear, geometry=replace(gear.geometry, micro=relief))))
    monkeypatch.setattr("nvhchain.error_band.gears._compliance_harmonics", lambda law, _: spectrum(law, [5e-6]))
    plain, more = (
        force_error(of, [mesh_law([1e-6])], REFERENCE.gear, 80.0).relative(np.array([20.0]))[0]
        for of in (case, relieved)
    )
    assert 2.0 * plain < more < 5.0 * plain + 1e-12


def test_slices_err_as_the_sum_of_equal_slices_differs_from_its_integral_and_spur_gears_not_at_all(case):
    """A sum over S slices in the place of the integral over the face: harmonic n is (π n ε/S)/sin(π n ε/S) of it."""
    wheel = case.gears[1].geometry
    spur, steep = replace(wheel, helix_angle=0.0), replace(wheel, helix_angle=np.radians(25.0))
    exact = replace(REFERENCE.gear, width_layers=200, profile_elements=100, load_pattern_tolerance=1e-9)
    few, many = (replace(exact, slices=count) for count in (16, 32))
    number, kinks = np.arange(1.0, 13.0), np.linspace(1.0, 0.2, 12)
    assert contact_error(spur, few, kinks)[:4] == pytest.approx(0.0, abs=1e-5)
    share = np.pi * number * 0.016 * np.sin(np.radians(25.0)) / (np.pi * 2.7e-3) / 16
    assert contact_error(steep, few, kinks) == pytest.approx(
        1.2 * (share / np.sin(share) - 1) * kinks / number**2, rel=0.02
    )
    assert contact_error(steep, few, kinks)[0] == pytest.approx(4 * contact_error(steep, many, kinks)[0], rel=0.05)
    # of a face wider than an axial pitch every pitch is cut into so many
    wide = replace(steep, face_width=3 * steep.face_width)
    alone = np.pi / 16 / np.sin(np.pi / 16) - 1
    assert contact_error(wide, few, kinks)[0] == pytest.approx(1.2 * alone, rel=0.05)


def test_slices_that_come_one_after_the_other_err_by_twice_the_harmonic_that_the_law_itself_has(case):
    """16 slices of an axial pitch: from the 12th harmonic on the error is no more known than the harmonic."""
    wide = replace(case.gears[1].geometry, helix_angle=np.radians(25.0), face_width=0.05)
    fidelity = replace(REFERENCE.gear, slices=16, width_layers=200)
    error = contact_error(wide, fidelity, np.ones(30)) * np.arange(1, 31) ** 2
    assert error[12:] == pytest.approx(2.0, rel=0.01)
    assert error[5] < 0.4


def test_kinks_of_a_transmission_error_are_those_of_the_larger_neighbour():
    """Amplitudes that fall with n² have kinks of one size; a harmonic that the face cancels has its neighbours'."""
    even = 1.0 / np.arange(1, 9) ** 2
    even[4] = 0.0
    assert _kinks(even, 10) == pytest.approx(np.ones(10))
    assert _kinks(np.zeros(0), 3) == pytest.approx(np.zeros(3))
    assert _kinks(np.array([1.0, 0.5, 0.0, 0.0, 0.0]), 5) == pytest.approx([2.0, 2.0, 2.0, 0.0, 0.0])


def test_load_patterns_and_elements_of_the_profile_err_at_the_first_harmonics_and_layers_up_to_their_number(case):
    """Body and profile move smoothly as teeth roll: their part falls with the square of the harmonic's number. That of
    layers stays up to the number of layers that a contact line passes in a mesh period, and falls with its cube."""
    wheel = case.gears[1].geometry
    finer = replace(EVEN, load_pattern_tolerance=3e-4, profile_elements=40)
    coarse, fine = (relative_law_error(5.9, 0.3, knobs, [1, 2, 1000]) ** 2 for knobs in (EVEN, finer))
    first, second, far = coarse - fine
    assert first == pytest.approx(0.99 * (0.7 * 3e-3) ** 2 + 0.9999 * 2.5e-3**2)
    assert second == pytest.approx(first / 16)
    assert abs(far) < 1e-9 * first
    width, overlap = wheel.face_width / wheel.normal_module, 0.4
    few, many = (
        relative_law_error(width, overlap, replace(finer, width_layers=count), [1, 8, 20]) ** 2 for count in (4, 8)
    )
    layers = 5e-4 * (width / 4) ** 4 * overlap
    assert (few - many)[:2] == pytest.approx((1 - 1 / 256) * layers**2)
    assert (few - many)[2] == pytest.approx(layers**2 * 0.5**6 - layers**2 / 256)
    straight, steep = (
        relative_law_error(width, overlap, replace(finer, width_layers=2, angles_per_mesh=10_000)) for overlap in (0, 1)
    )
    assert straight == pytest.approx(0.25 * steep, rel=0.05)


def test_a_contact_line_rises_and_falls_with_the_layers_that_it_passes(case, monkeypatch):
    """12 layers under 3 axial pitches: 4 of them pass in a mesh period. Spur gears have no such ripple."""
    wheel = case.gears[1].geometry
    pitch = np.pi * wheel.normal_module / np.sin(abs(wheel.helix_angle))
    wide, many = replace(wheel, face_width=3.0 * pitch), replace(EVEN, width_layers=12)
    found = layer_ripple(wide, many, 9)
    assert found[[3, 7]] == pytest.approx(LAYER_RIPPLE / 16 * np.array([1.0, 0.5]))
    assert not found[[0, 1, 2, 4, 5, 6, 8]].any()
    between = layer_ripple(wide, replace(many, width_layers=10), 4)  # 3.3 in a period
    assert between == pytest.approx(LAYER_RIPPLE * 0.09 * np.array([0.0, 0.0, 2 / 3, 1 / 3]))
    assert not layer_ripple(replace(wide, helix_angle=0.0), many, 9).any()
    # three layers under a third of a pitch: the ninth harmonic of a law has the ripple, 5e-5 of the deflection
    laws, order = [mesh_law([1e-7, *(7 * [1e-12]), 1e-8])], np.array([180.0])
    coarse = REFERENCE.gear.even_layers(3)
    with_it = force_error(case, laws, coarse, 200.0).relative(order)[0]
    monkeypatch.setattr("nvhchain.error_band.gears.LAYER_RIPPLE", 0.0)
    assert with_it > 1.2 * force_error(case, laws, coarse, 200.0).relative(order)[0]


def test_thick_layers_of_a_blank_err_at_the_first_harmonics(case):
    """Layers of 2.7 modules under teeth of half that: 4e-6 · 2.7³ of the deflection, a quarter at the next harmonic."""
    wheel = case.gears[1].geometry
    width = wheel.face_width / wheel.normal_module
    halved, even = replace(EVEN, width_layers=3, layer_thickness=1.5), EVEN
    more = layer_ripple(wheel, halved, 3) ** 2 - layer_ripple(wheel, even, 3) ** 2
    thickness = width / 3
    assert np.sqrt(more) == pytest.approx(4e-6 * thickness**3 / np.array([1.0, 4.0, 9.0]))
    known = [relative_law_error(width, 0.4, knobs) ** 2 for knobs in (halved, even)]
    assert np.sqrt(known[0] - known[1]) == pytest.approx(3e-5 * thickness**3)


@pytest.mark.slow
def test_the_ripple_of_a_wide_helical_gear_is_where_and_as_large_as_stated():
    """17 modules wide, overlap 2.9: six layers put the second harmonic off by 20e-4 of the deflection, others less."""
    (wide,) = (of for of in far() if of.name == "helix 33 wide 30 mm 1700")
    (pair,), (force,) = wide.pairs, wide.mesh_forces
    found = []
    for layers in (6, 12):
        knobs = replace(EVEN, width_layers=layers)
        law = gear_mesh_law(pair, nominal_force=force, fidelity=knobs)
        error = quasi_static_transmission_error(law, force)[1]
        found.append(np.fft.rfft(error)[:9] / np.fft.rfft(error)[0].real)
    off, stated = np.abs(found[0] - found[1])[1:], layer_ripple(pair.wheel.geometry, EVEN, 8)
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
    laws = [mesh_law([1e-6 / n**2 for n in range(1, 32)])]
    orders = np.array([20.0, 40.0, 640.0, 700.0, 720.0])
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


def test_an_error_of_one_mesh_makes_the_force_that_this_mesh_makes_where_another_one_is_louder():
    """Two meshes of which the second makes ten times the force of the same deflection: its error at a line that the
    first one makes is ten times as large as the first one's gain tells."""
    first, second = np.zeros(6), np.zeros(11)
    first[[0, 1, 5]], second[[0, 1, 10]] = (1.0, 1e-3, 1e-4), (1.0, 1e-3, 1e-9)
    wrong = np.zeros(11)
    wrong[10] = 1e-6
    made = folded([(Fraction(20), first, 1e-3 * first), (Fraction(10), second, wrong)], 100.0)
    orders = np.array([10.0, 20.0, 90.0, 100.0, 110.0])
    forces = np.array([10.0, 1.0, 0.0, 0.1, 0.0])
    found = made.relative_of(orders, forces, 100.0)[3]
    gain = np.sqrt((forces[[0]] ** 2).sum() / made.meshes[1, 0][1])
    assert found == pytest.approx(CANCELLED * AMPLIFICATION * gain * np.sqrt(made.meshes[1, 1][10]) / 0.1, rel=0.05)
    assert found > 2.5 * made.relative(orders)[3]


def test_a_mesh_without_lines_of_its_own_leaves_the_others_theirs():
    """A second mesh that excites nothing: what is stated of the first one stays."""
    harmonics, errors = np.zeros(51), np.zeros(51)
    harmonics[[0, 1, 49, 50]], errors[[1, 49, 50]] = (1.0, 1e-2, 1e-9, 1e-4), (1e-4, 1e-5, 5e-6)
    orders, forces = np.array([98.0, 100.0]), np.array([0.5, 1.0])
    silent = (Fraction(7), np.array([1.0, 0.0]), np.zeros(2))
    one, two = (folded([(Fraction(2), harmonics, errors), *more], 100.0) for more in ([], [silent]))
    assert two.relative_of(orders, forces, 20.0) == pytest.approx(one.relative_of(orders, forces, 20.0))
    wrong = np.zeros(15)
    wrong[14] = 1e-3  # at order 98, by the gain of the first mesh at order 100
    more = folded([(Fraction(2), harmonics, errors), (Fraction(7), np.eye(15)[0], wrong)], 100.0)
    gain = forces[1] / np.sqrt(more.power[100])
    made = AMPLIFICATION * gain * np.sqrt(more.error[98]) / forces[0]
    assert more.relative_of(orders, forces, 20.0)[0] == pytest.approx(FED_MARGIN * made, rel=0.05)
