"""Verdict of a comparison: sentences from a summary whose numbers are known."""

import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from nvhchain.error_band import ErrorBand, RunUpBand
from nvhchain.levels import a_weighting
from nvhchain.plots.marks import joined_orders
from nvhchain.report import verdict
from nvhchain.report.page.sections import limits
from nvhchain.report.stored import Stored, StoredRun
from nvhchain.report.summary import _difference


def configuration(levels, limits, *, frequency=1000.0):
    """Summary of one configuration: {order: level at `frequency` times order, dB(A)}."""
    lines = [
        {"order": order, "frequency_hz": order * frequency, "level_db": level - float(a_weighting(order * frequency))}
        for order, level in levels.items()
    ]
    overall = 10 * math.log10(sum(10 ** (level / 10) for level in levels.values()))
    return {"overall_dBA": overall, "error_band_dBA": limits, "orders": lines, "lines": []}


def summary(**configurations):
    return {"field_point": {"name": "microphone"}, "configurations": configurations}


def test_difference_has_the_limits_of_both_levels_added():
    first, second = configuration({1: 60.0}, [59.0, 61.5]), configuration({1: 66.0}, [64.0, 67.0])
    assert verdict(summary(solid=first, slotted=second))[0] == (
        "slotted is 6.0 dB louder than solid at microphone (95 % limits 2.5…8.0 dB if the errors of both levels add up)"
    )
    assert verdict(summary(slotted=second, solid=first))[0] == (
        "solid is 6.0 dB quieter than slotted at microphone "
        "(95 % limits 2.5…8.0 dB if the errors of both levels add up)"
    )


def test_limits_of_the_difference_itself_are_taken_where_the_summary_has_them():
    first, second = configuration({1: 60.0}, [59.0, 61.5]), configuration({1: 66.0}, [64.0, 67.0])
    assert verdict(summary(solid=first, slotted=second | {"difference_limits_db": [5.5, 6.5]}))[0] == (
        "slotted is 6.0 dB louder than solid at microphone (95 % limits 5.5…6.5 dB)"
    )
    assert verdict(summary(slotted=second, solid=first | {"difference_limits_db": [-6.5, None]}))[0] == (
        "solid is 6.0 dB quieter than slotted at microphone (95 % limits at most 6.5 dB, no lower limit)"
        "; within these limits either may be the louder"
    )


def test_limits_that_cross_zero_decide_nothing():
    first, second = configuration({1: 60.0}, [None, 63.0]), configuration({1: 62.0}, [59.0, 64.0])
    assert verdict(summary(a=first, b=second))[0].endswith(
        "(95 % limits at least −4.0 dB, no upper limit if the errors of both levels add up); "
        "within these limits either may be the louder"
    )


def test_an_undecided_comparison_names_the_knobs_that_narrow_the_widest_limits():
    first, second = configuration({1: 60.0}, [58.0, 61.0]), configuration({1: 61.0}, [None, 66.0])
    parts = [[{"source": source, "share": 0.8, "frequency_hz": 1000.0}] for source in ("housing", "gear")]
    first, second = (of | {"limit_parts": part} for of, part in zip((first, second), parts, strict=True))
    (sentence, *_) = verdict(summary(a=first, b=second))
    assert "most of this width is the numerical error of the gear in b: a finer --fidelity" in sentence
    assert sentence.endswith("or knobs of fidelity.gear narrow it")
    assert "∞" not in sentence


def test_lines_that_make_the_difference_are_named_with_their_weighted_levels_and_shares():
    first, second = (
        configuration({1: 60.0, 2: 50.0, 3: 40.0, 4: -8.0}, [59, 61]),  # order 4 is below the threshold of hearing
        configuration({1: 60.0, 2: 60.0, 4: 50.0}, [62, 64]),
    )
    assert verdict(summary(a=first, b=second))[1:] == [
        "  +2.5 dB: order 2 (2000 Hz) rises from 50.0 to 60.0 dB(A)",
        "  +0.3 dB: order 4 (4000 Hz) appears at 50.0 dB(A)",
    ]


@pytest.mark.parametrize("seed", range(5))
def test_parts_of_a_steady_difference_add_up_as_they_are_written(seed):
    rng = np.random.default_rng(seed)
    orders = range(1, 41)
    first, second = (
        configuration(dict(zip(orders, rng.uniform(30, 60, 40), strict=True)), [59, 61], frequency=100.0)
        for _ in range(2)
    )
    lines = verdict(summary(a=first, b=second))
    parts = [float(line.partition(" dB: ")[0].replace("−", "-")) for line in lines if " dB: " in line]
    assert any(line.endswith(" dB: all other lines") for line in lines)
    assert sum(parts) == pytest.approx(round(second["overall_dBA"] - first["overall_dBA"], 1), abs=1e-9)


def test_orders_are_named_after_the_teeth_of_both_designs():
    first = configuration({20: 60.0, 100: 50.0}, [59, 61], frequency=30.0) | {"mesh_orders": {"stage": 20.0}}
    second = configuration({25: 60.0, 100: 70.0}, [59, 61], frequency=30.0) | {"mesh_orders": {"stage": 25.0}}
    text = " ".join(verdict(summary(coarse=first, fine=second)))
    assert "order 100 (3000 Hz, stage × 5 = stage of fine × 4) rises" in text


def test_a_stage_of_another_order_in_another_design_is_named_after_it():
    mesh, slots = joined_orders(
        [
            ("plain", {"low": 20.0, "high": 7.0}, {}),
            ("holed", {"low": 20.0, "high": 7.0}, {"low": 5.0}),
            ("fine", {"low": 25.0, "high": 7.0}, {"low": 4.0}),
        ]
    )
    assert mesh == {"low": 20.0, "high": 7.0, "low of fine": 25.0}
    assert slots == {"low": 5.0, "low of fine": 4.0}


def test_run_ups_are_compared_over_the_speeds_that_they_share():
    def run_up(speeds, levels):
        rows = [{"speed_rpm": speed, "level_dBA": level} for speed, level in zip(speeds, levels, strict=True)]
        return {"overall_dBA": 60.0, "error_band_dBA": [59.0, 61.0], "over_speed": rows}

    first, second = run_up([1000, 2000, 3000], [50, 60, 70]), run_up([3500, 2500, 1500, 1000], [90, 62, 58, 49])
    assert verdict(summary(a=first, b=second))[1] == (
        "  from 1000 to 2500 rpm b is quieter at 2 of 3 speeds: between −3.0 dB at 2500 rpm and +3.0 dB at 1500 rpm"
    )


def test_run_ups_of_different_records_say_so():
    rows = [{"speed_rpm": speed, "level_dBA": 60.0} for speed in (1200.0, 2400.0)]
    of = {"overall_dBA": 60.0, "over_speed": rows, "end_speed_rpm": 2400.0}
    first = of | {"start_speed_rpm": 900.0, "duration_s": 4.0}
    second = of | {"start_speed_rpm": 1200.0, "duration_s": 2.0, "overall_dBA": 61.0}
    assert verdict(summary(a=first, b=second))[2] == (
        "  the records differ: b from 1200 to 2400 rpm in 2 s, a from 900 to 2400 rpm in 4 s; levels are means over "
        "each"
    )
    nearly = first | {"duration_s": 3.9999, "overall_dBA": 61.0}
    for alike in (nearly, of | {"start_speed_rpm": 1200.0}):
        assert not any("the records differ" in line for line in verdict(summary(a=first, b=alike)))


def test_a_quieter_design_names_its_parts_with_their_sign_and_what_moves_less():
    def part(name, before, after):
        return {"name": name, "part_db": -4.0, "pressure_Pa": [before, after]}

    cause = {"order": 100, "frequency_hz": 4000.0, "levels_dBA": [66.0, 55.0], "part_db": -4.6}
    cause |= {"modes": [part("mode 9, 4180 Hz", 2.0, 1.0)], "paths": [part("B2 z", 1.0, 0.5)]}
    first, second = (
        configuration({100: 66.0}, [65, 67], frequency=40),
        configuration({100: 60.9}, [60, 61], frequency=40),
    )
    line, rest = verdict(summary(a=first, b=second | {"causes": [cause]}))[1:]
    assert rest == "  −0.5 dB: all other lines"
    assert line == (
        "  −4.6 dB: order 100 (4000 Hz) falls from 66.0 to 55.0 dB(A), because it excites the housing mode at 4180 Hz "
        "(−4.0 dB) less, mostly through bearing B2 in z"
    )


def reason(part, modes=(), paths=()):
    """Reason of a line that makes `part` dB, from pairs of name and part of its modes and paths."""

    def parts(pairs):
        return [{"name": name, "part_db": db, "pressure_Pa": sorted([1.0, 2.0], reverse=db < 0)} for name, db in pairs]

    cause = {"order": 116, "frequency_hz": 4640.0, "levels_dBA": [50.0, 55.0], "part_db": part}
    cause |= {"modes": parts(modes), "paths": parts(paths)}
    first, second = (configuration({116: level}, [level - 1, level + 1], frequency=40) for level in (60.0, 60 + part))
    (line,) = verdict(summary(a=first, b=second | {"causes": [cause]}))[1:]
    return line.partition("dB(A)")[2]


def test_paths_that_are_named_have_the_sign_and_most_of_their_line():
    cancel = [("A2 x", 0.77), ("A1 x", -1.09), ("B1 x", 0.72)]
    assert reason(0.67, paths=cancel) == (
        ", through bearing A2 in x (+0.8 dB) and B1 in x (+0.7 dB) against A1 in x (−1.1 dB)"
    )
    assert reason(0.67, paths=cancel[:2]) == ""
    assert reason(0.67, paths=[("A2 x", 0.77), ("A1 x", -0.2)]) == ", mostly through bearing A2 in x"
    assert reason(0.67, paths=[(f"{name} x", 0.1) for name in "ABCDEFG"]) == ""


def test_modes_that_are_named_make_most_of_their_line():
    alike = [("mode 47, 5075 Hz", 0.53), ("mode 43, 4899 Hz", 0.46), ("mode 40, 4570 Hz", 0.41)]
    assert reason(1.4, modes=alike) == (
        ", because it excites the housing modes at 5075 Hz (+0.5 dB) and 4899 Hz (+0.5 dB) more"
    )
    assert reason(0.7, modes=alike) == ", because it excites the housing mode at 5075 Hz (+0.5 dB) more"
    assert reason(3.0, modes=alike) == ""
    assert reason(0.7, modes=[("residual", 0.6)]) == (
        ", because it excites motion outside the housing modes (+0.6 dB) more"
    )


def test_a_part_that_rounds_to_nothing_is_not_named():
    first, second = (configuration({116: level}, [level - 1, level + 1], frequency=40) for level in (60.0, 60.02))
    cause = {"order": 116, "frequency_hz": 4640.0, "levels_dBA": [60.0, 60.02], "part_db": 0.02}
    assert len(verdict(summary(a=first, b=second | {"causes": [cause]}))) == 1


def test_modes_that_cancel_are_no_reason():
    assert reason(-0.3, modes=[("mode 3, 3281 Hz", -5.5), ("mode 3, 3293 Hz", 5.0)]) == ""
    many = [(f"mode {number}, 900 Hz", 0.5) for number in range(2, 12)]
    assert reason(-0.5, modes=[("mode 1, 800 Hz", -5.5), *many]) == ""


def test_one_mode_of_two_housings_is_named_once_with_both_frequencies():
    assert reason(-0.3, modes=[("mode 3, 3281 Hz (3293 Hz in thin)", -0.5), ("mode 6, 4396 Hz", 0.2)]) == (
        ", because it excites the housing mode at 3281 Hz (3293 Hz in thin; −0.5 dB) less"
    )


def test_sound_between_orders_stands_before_smaller_parts():
    lines = [{"order": 40, "frequency_hz": None, "levels_dBA": [60.0, 55.0], "part_db": -1.9}]
    near = {"order": None, "speeds_rpm": [1543.0, 1579.0], "lines": None, "part_db": -4.9}
    rows = [{"speed_rpm": speed, "level_dBA": 60.0} for speed in (600.0, 1500.0)]
    first, second = ({"overall_dBA": level, "over_speed": rows} for level in (70.0, 63.2))
    found = verdict(summary(a=first, b=second | {"causes": [*lines, near]}))[2:]
    assert [of.partition(" dB:")[0] for of in found] == ["  −4.9", "  −1.9"]


@pytest.mark.parametrize(
    ("speeds", "parts"), [([1530.0, 1600.0], True), ([1000.0, 1600.0], False), ([None, None], False)]
)
def test_sound_about_a_speed_is_said_to_be_where_flanks_part(speeds, parts):
    near = {"order": None, "speeds_rpm": [1543.0, 1579.0], "lines": None, "part_db": -4.9}
    rows = [{"speed_rpm": speed, "level_dBA": 60.0} for speed in (600.0, 1500.0)]
    first, second = ({"overall_dBA": level, "over_speed": rows} for level in (70.0, 65.1))
    first["contact_loss"] = [{"mesh": "A–B", "seconds": 0.03, "speeds_rpm": speeds}]
    found = verdict(summary(a=first, b=second | {"causes": [near]}))[-1]
    assert found == "  −4.9 dB: sound between the orders at 1543…1579 rpm" + (", where flanks part" if parts else "")


def test_lines_that_move_against_the_difference_are_named_too():
    some = {order: 50.0 for order in (3, 4, 5)}
    first = configuration({1: 60.0, 2: 70.0} | some, [70, 71])
    second = configuration({1: 71.0, 2: 40.0} | {order: 57.0 for order in some}, [70, 72])
    lines = verdict(summary(a=first, b=second))[1:]
    named = {line.partition(" dB: ")[2][:7]: line.lstrip()[0] for line in lines}
    assert named["order 1"] == "+"
    assert named["order 2"] == "−"


def test_silent_or_equal_configurations_name_no_line():
    one, silent = configuration({1: 60.0}, [59.0, 61.0]), configuration({1: -400.0}, [None, None])
    assert verdict(summary(a=one, b=silent)) == ["b and a cannot be compared at microphone: one of them is silent"]
    assert len(verdict(summary(a=one, b=one))) == 1
    assert verdict(summary(a=one)) == []


def test_limits_name_their_largest_parts_and_the_line_to_blame():
    one = configuration({1: 60.0}, [55.0, 63.0])
    parts = [("housing", 0.85, 1000.0), ("masters", 0.12, 2000.0), ("gear.slices", 0.03, 1000.0)]
    one["limit_parts"] = [{"source": source, "share": share, "frequency_hz": f} for source, share, f in parts]
    compared = summary(a=configuration({1: 60.0}, [59.0, 61.0]), b=one)
    assert verdict(compared)[-1] == (
        "Limits of b: 85 % from housing (most at 1000 Hz); 12 % from masters (most at 2000 Hz)"
    )
    one["limit_parts"][1]["frequency_hz"] = 1000.0
    assert verdict(compared)[-1] == "Limits of b: 85 % from housing, 12 % from masters (most at 1000 Hz)"


def test_errors_cancel_in_the_difference_only_where_both_runs_share_their_operators():
    frequency, amplitude = np.array([500.0, 1000.0]), np.array([[1.0], [0.5]])
    band = ErrorBand(frequency, amplitude, {"housing": 0.1 * amplitude})

    def run(housing):
        operator = SimpleNamespace(content_hash=housing)
        return SimpleNamespace(
            case=None,
            error_band=band,
            error_bands={"pressure": band},
            housing=operator,
            transfer_vectors=operator,
            mesh_laws=(),
        )

    assert _difference(run("a"), run("a"))["difference_limits_db"] == pytest.approx([0.0, 0.0])
    low, high = _difference(run("a"), run("b"))["difference_limits_db"]
    assert low < -1.0 < 1.0 < high
    levels = np.repeat(band.level[None], 2, axis=0)
    rising = RunUpBand(np.array([100.0, 200.0]), levels, np.stack([levels - 2, levels + 2], axis=2), (band, band))
    same, other = (
        SimpleNamespace(**vars(run(of)) | {"error_band": rising, "error_bands": {"pressure": rising}}) for of in "ab"
    )
    assert _difference(same, same)["difference_limits_db"] == pytest.approx([0.0, 0.0])
    assert _difference(same, other)["difference_limits_db"] == pytest.approx([low, high])


def test_an_order_that_another_speed_puts_above_the_band_leaves_it():
    first = configuration({20: 60.0, 30: 62.0}, [55.0, 65.0], frequency=50.0) | {"input_speed_rpm": 3000.0}
    second = configuration({20: 60.0}, [55.0, 65.0], frequency=60.0) | {"input_speed_rpm": 3600.0}
    told = verdict(summary(slow=first, fast=second))
    assert ", fast at 3600 rpm and slow at 3000 rpm (95 % limits" in told[0]
    assert any("leaves the band, at 1800 Hz in the other design" in line for line in told)
    assert not any("disappears" in line for line in told)


def test_designs_alike_within_rounding_are_called_alike_and_what_is_open_is_named():
    first, second = configuration({1: 60.0}, [59.0, 61.0]), configuration({1: 60.01}, [59.0, 61.0])
    near = second | {"difference_limits_db": [-0.2, 0.3]}
    assert verdict(summary(a=first, b=near))[0] == (
        "b and a are alike within rounding, 0.0 dB apart at microphone (95 % limits −0.2…0.3 dB); "
        "the limits leave open whether one is louder"
    )
    unlimited = second | {"difference_limits_db": [None, None]}
    assert "95 % limits none, the errors may be as large as the sound" in verdict(summary(a=first, b=unlimited))[0]


def test_the_page_says_what_narrows_the_limits_and_at_which_speed():
    def told(**parts):
        summary = {"error_band_dBA": [50.0, 60.0], "limit_parts": [{"share": 0.9, "frequency_hz": 100.0, **parts}]}
        run = StoredRun("a", Path(), {**summary, "limit_speed_rpm": 1500.0}, {})
        return [str(block) for block in limits.blocks(Stored(Path(), summary, (run,)))]

    numerical, spread, other = (told(source=source) for source in ("gear", "input: friction", "radiation"))
    assert "from gear; a finer --fidelity or knobs of fidelity.gear narrow it." in numerical[-1]
    assert "The parts are those at 1500 rpm" in numerical[-1]
    assert "from input: friction; a narrower [spread] narrows it." in spread[-1]
    assert not any("most of the width" in block for block in other)
