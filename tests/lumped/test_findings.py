"""The findings of the thesis's chapter 3: four pairs, and the study of STE_av, STE_m and STE_h.

S. Shweiki, Analysis of Static and Dynamic Meshing Behaviour of Lightweight Gears, ch. 3.
"""

from dataclasses import replace

import numpy as np
import pytest

from nvhchain.errors import InputError
from nvhchain.lumped import (
    THESIS_PAIRS,
    order_lines,
    pair_from_error,
    static_transmission_error,
    steady_motion,
    steady_sweep,
    thesis_pair,
)

JUMP = 1.5e-6
"""m between neighbouring speeds; without contact loss the curves rise by less than 0.5 µm in 10 Hz."""


def both_ways(pairs, frequency):
    """Response swept up, and RMS swept down, both in the order of rising `frequency`."""
    return steady_sweep(pairs, frequency), steady_sweep(pairs, frequency[::-1]).rms[::-1]


def jumps(frequency, rms):
    """Speeds (Hz) beyond which the response jumps."""
    rise = np.abs(np.diff(rms))
    peak = (rise > JUMP) & (rise >= np.roll(rise, 1)) & (rise >= np.roll(rise, -1))
    return frequency[:-1][peak]


@pytest.fixture(scope="module")
def four_pairs():
    frequency = np.arange(1800.0, 4200.0, 10.0)
    up, falling = both_ways([thesis_pair(name) for name in "abcd"], frequency)
    return frequency, up, falling


def test_pairs_a_b_c_jump_and_pair_d_does_not(four_pairs):
    frequency, up, falling = four_pairs
    for i in range(3):
        assert len(jumps(frequency, up.rms[:, i])) == len(jumps(frequency, falling[:, i])) == 1
        assert up.loses_contact[:, i].any()
    assert len(jumps(frequency, up.rms[:, 3])) == len(jumps(frequency, falling[:, 3])) == 0
    assert (up.lowest > -up.half_backlash).all(), "no pair reaches its back flanks"


def test_pairs_with_a_jump_answer_differently_up_and_down_and_pair_d_does_not(four_pairs):
    frequency, up, falling = four_pairs
    apart = np.abs(up.rms - falling)
    assert (apart[:, [0, 2]].max(axis=0) > 8e-6).all()
    assert apart[:, 1].max() > 1e-6
    assert apart[:, 3].max() < 1e-11
    for i in range(3):
        assert jumps(frequency, up.rms[:, i])[0] > jumps(frequency, falling[:, i])[0]


def test_backlash_of_the_thesis_gears_gives_the_motion_of_the_narrower_one_of_the_model():
    """0.1 mm in the model, 1.2855 mm by the data of the gears."""
    frequency = np.arange(2600.0, 3200.0, 50.0)
    narrow = [thesis_pair(name) for name in "abcd"]
    wide = [replace(pair, half_backlash=0.5 * 1.2855e-3) for pair in narrow]
    rms, of_wide = (steady_sweep(pairs, frequency) for pairs in (narrow, wide))
    assert rms.loses_contact.any()
    np.testing.assert_allclose(of_wide.rms, rms.rms, rtol=1e-9)


def test_resonances_rank_as_root_of_stiffness_and_lie_below_the_natural_frequency(four_pairs):
    frequency, up, _ = four_pairs
    peak = frequency[up.cycle_rms.argmax(axis=0)]
    natural = np.array([thesis_pair(name).natural_frequency for name in "abcd"])
    assert list(np.argsort(natural)) == [3, 1, 2, 0]
    # contact loss softens: every peak of the three that jump lies below
    assert (peak[:3] < 0.96 * natural[:3]).all()


def test_implied_masses_give_natural_frequencies_in_the_ratios_of_the_table():
    natural = [thesis_pair(name).natural_frequency for name in THESIS_PAIRS]
    # √(k_av/m)/2π of table 3.2; the mean of F/STE lies up to 4.2 % above k_av
    np.testing.assert_allclose(natural, [3258.2, 2963.0, 3029.3, 2344.7], rtol=0.022)


@pytest.mark.parametrize("name", THESIS_PAIRS)
def test_mean_stiffness_is_near_the_tabulated_one(name):
    pair = thesis_pair(name)
    assert 1.0 < pair.mean_stiffness / THESIS_PAIRS[name].average_stiffness < 1.045
    assert pair.mesh_cycles == 57


def test_more_average_error_lowers_the_resonance_and_narrows_contact_loss_and_raises_the_peak(study_pair):
    averages = (18.0, 22.0, 28.0, 33.0, 38.0)
    pairs = [study_pair(average, 4) for average in averages]
    frequency = np.arange(2000.0, 4000.0, 12.5)
    up = steady_sweep(pairs, frequency)
    assert (np.diff([pair.natural_frequency for pair in pairs]) < 0).all()
    assert (np.diff(frequency[up.rms.argmax(axis=0)]) < 0).all()
    lost = up.loses_contact.sum(axis=0) * 12.5
    assert (np.diff(lost) < 0).all()
    assert lost[0] > 600.0
    assert lost[-1] == 0.0
    peak = up.rms.max(axis=0)
    # rising speed; from 28 µm on contact loss is too short to hold the peak below the linear one, STE_m/(2ζ)/√2
    assert peak[0] < 0.95 * peak[1] < 0.95 * peak[2]
    np.testing.assert_allclose(peak[2:], 4e-6 / (2 * 0.06) / np.sqrt(2), rtol=1.5e-2)


def test_more_mesh_amplitude_leaves_the_resonance_scales_the_linear_part_and_widens_contact_loss(study_pair):
    amplitudes = np.array([2.0, 3.0, 4.0, 5.0, 6.0])
    pairs = [study_pair(28, amplitude) for amplitude in amplitudes]
    frequency = np.arange(1500.0, 4500.0, 12.5)
    up = steady_sweep(pairs, frequency)
    natural = np.array([pair.natural_frequency for pair in pairs])
    assert np.ptp(natural) < 0.012 * natural[0]
    far = (frequency < 0.65 * natural[0]) | (frequency > 1.4 * natural[0])
    per_amplitude = up.rms[far] / amplitudes
    np.testing.assert_allclose(per_amplitude, np.tile(per_amplitude[:, :1], 5), rtol=0.08)
    lost = up.loses_contact.sum(axis=0)
    assert lost[0] == lost[1] == 0
    assert (np.diff(lost[1:]) > 0).all()


def test_blank_amplitude_moves_the_main_jump_little_rising_and_upwards_falling(study_pair):
    """Left in place, as the thesis says, within 1.5 % for rising speed; for falling speed 6 % higher at 10 µm."""
    frequency = np.arange(2700.0, 3200.0, 10.0)
    up, falling = both_ways([study_pair(18, 4, blank) for blank in (0.0, 2.5, 5.0, 7.5, 10.0)], frequency)
    for rms, moved in ((up.rms, (0.0, -0.7, -1.3, -1.0, 1.3)), (falling, (0.0, 0.3, 1.0, 2.8, 6.3))):
        at = np.array([jumps(frequency, curve)[-1] for curve in rms.T])
        np.testing.assert_allclose(100.0 * (at / at[0] - 1.0), moved, atol=0.4)


def test_blank_amplitude_adds_a_jump_where_a_sideband_meets_the_resonance(study_pair):
    frequency = np.arange(2800.0, 4000.0, 10.0)
    pairs = [study_pair(18, 4, blank) for blank in (0.0, 10.0)]
    up, falling = both_ways(pairs, frequency)
    for rms in (up.rms, falling):
        plain, blank = (jumps(frequency, rms[:, i]) for i in range(2))
        assert len(plain) == 1
        assert len(blank) == 2
        # order 57 − 8 at the second jump has the frequency that order 57 has at the first
        assert blank[1] * 49 / 57 == pytest.approx(blank[0], rel=0.02)


def test_blank_amplitude_lifts_the_response_where_sidebands_meet_the_resonance(study_pair):
    plain, blank = (study_pair(22, 4, amplitude) for amplitude in (0.0, 7.5))
    at = plain.natural_frequency * np.array([57 / 65, 57 / 49])
    between = plain.natural_frequency * np.array([0.6, 1.03])
    rms = steady_sweep([plain, blank], np.sort(np.concatenate((at, between)))).cycle_rms
    order = np.argsort(np.concatenate((at, between)))
    gain = np.empty(4)
    gain[order] = rms[:, 1] / rms[:, 0]
    assert gain[0] > 1.15
    assert gain[1] > 1.7
    assert (gain[2:] < 1.15).all()


def test_sidebands_of_the_stiffness_follow_from_an_error_without_any(study_pair):
    average, mesh, blank = 28e-6, 0.4e-6, 0.5e-6
    error, cycles = static_transmission_error(average=average, mesh=mesh, blank=blank, teeth=57, blank_order=8)
    pair = pair_from_error(error, force=5e3, mass=0.65, mesh_cycles=cycles, damping_ratio=0.06, half_backlash=0.0)
    orders, of_error = order_lines(error, cycles, 57)
    _, of_stiffness = order_lines(pair.stiffness, cycles, 57)
    line = {round(order): i for i, order in enumerate(orders)}
    for side in (49, 65):
        assert of_error[line[side]] < 1e-9 * average
        # second order term of 1/(a + h + m): 2 h m / a³, half of it on each side
        assert of_stiffness[line[side]] == pytest.approx(5e3 * mesh * blank / average**3, rel=1e-2)
    assert of_error[line[57]] == pytest.approx(mesh)
    assert of_error[line[8]] == pytest.approx(blank)
    # next pair, N_t ± 2 N_h, of third order
    assert 0 < of_stiffness[line[41]] < 0.05 * of_stiffness[line[49]]


def test_spectrum_just_below_resonance_shows_the_sidebands(study_pair):
    pair = study_pair(22, 4, 2.5)
    motion = steady_motion([pair], 2700.0)
    orders, lines = order_lines(motion.error[:, 0], motion.mesh_cycles, 57)
    found = {round(order): value for order, value in zip(orders, lines, strict=True)}
    assert found[57] > 8e-6
    for side in (49, 65):
        assert found[side] > 0.05 * found[57]
        assert found[side] > 20 * found[side + 1]


def test_error_curve_states_what_it_cannot_use():
    with pytest.raises(InputError, match="infinite"):
        static_transmission_error(average=4.5e-6, mesh=3e-6, blank=2e-6, teeth=57, blank_order=8)
    with pytest.raises(InputError, match="positive under load"):
        pair_from_error(
            np.array([1e-6, 0.0, 1e-6, 2e-6]), force=1.0, mass=1.0, mesh_cycles=1, damping_ratio=0.1, half_backlash=0.0
        )
    with pytest.raises(InputError, match="without load"):
        pair_from_error(np.full(4, 1e-6), force=0.0, mass=1.0, mesh_cycles=1, damping_ratio=0.1, half_backlash=0.0)
    with pytest.raises(InputError, match="not in table"):
        thesis_pair("e")
    pair = pair_from_error(np.full(4, 1e-6), force=1.0, mass=1.0, mesh_cycles=1, damping_ratio=0.1, half_backlash=0.0)
    with pytest.raises(InputError, match=r"mesh_cycles = 1\.5: a whole number"):
        replace(pair, mesh_cycles=1.5)


def test_error_curve_with_fewer_than_four_samples_a_wave_is_refused():
    """Order 57 · 64 − 3 in 64 samples per mesh would come out as order 3."""
    curve = {"average": 18e-6, "mesh": 0.0, "blank": 1e-6, "teeth": 57}
    with pytest.raises(InputError, match=r"order 3645 fewer than 4 samples: use a whole number of 256 or more"):
        static_transmission_error(**curve, blank_order=3645)
    error, cycles = static_transmission_error(**curve, blank_order=3645, samples_per_mesh=256)
    orders, lines = order_lines(error, cycles, 57)
    assert orders[1:][np.argmax(lines[1:])] == 3645
    with pytest.raises(InputError, match="samples_per_mesh = 3 "):
        static_transmission_error(**curve, samples_per_mesh=3)
