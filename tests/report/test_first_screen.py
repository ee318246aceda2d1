"""First screen of the page: which design is quieter, by how much, within which limits, and what is assumed."""

import json

import pytest

from nvhchain.files import hdf5
from nvhchain.handoff import FieldPressure
from nvhchain.levels import number_text
from nvhchain.report import write_page
from nvhchain.report.sentences import DOUBTS
from scripts.page_reader import read
from tests.report.stored_pair import case, steady, summary


def test_first_screen_names_the_quieter_design_by_how_much_and_why(pair):
    page = read(write_page(pair))
    assert "plain is 20.0 dB quieter than holed at 3000 rpm" in page.texts
    assert "Why holed is louder:" in page.texts
    text = " ".join(page.texts)
    assert "dB: order 20 (1000 Hz, stage1 × 1) rises from 60.0 to 80.0 dB(A)" in text
    assert "Not decided" not in text
    (levels,) = (of["data"] for name, of in page.figures.items() if name.endswith("levels"))
    assert [of["x"] for of in levels] == [[60.0], [80.0]]
    assert levels[0]["error_x"]["array"] == [3.0]


def test_a_level_without_a_lower_limit_is_written_inside_its_figure(pair):
    """The axis then reaches 25 dB below the level: "71.4 (below 79.2)" on its right was cut after "below"."""
    told = summary({"plain": 60.0, "holed": 61.0})
    for of in told["configurations"].values():
        of["error_band_dBA"] = [None, of["overall_dBA"] + 8.0]
    (pair / "summary.json").write_text(json.dumps(told))
    figures = read(write_page(pair)).figures
    (levels,) = (of["data"] for name, of in figures.items() if name.endswith("levels"))
    assert {of["textposition"] for of in levels} == {"top left"}


def test_limits_that_overlap_are_said_not_to_decide(pair):
    (pair / "summary.json").write_text(json.dumps(summary({"plain": 60.0, "holed": 61.0})))
    assert "Not decided: within the confidence limits either may be the louder." in read(write_page(pair)).texts


@pytest.mark.parametrize(("level", "limits"), [(80.0, [15.0, 24.0]), (61.0, [-2.0, 4.0]), (60.01, [-0.2, 0.3])])
def test_limits_of_the_difference_have_a_sentence_and_doubt_a_note(pair, level, limits):
    told = summary({"plain": 60.0, "holed": level})
    told["configurations"]["holed"]["difference_limits_db"] = limits
    (pair / "summary.json").write_text(json.dumps(told))
    text = " ".join(read(write_page(pair)).texts)
    low, high = (number_text(end) for end in limits)
    assert f"At rear and 3000 rpm. 95 % limits of this difference: {low}…{high} dB" in text
    assert ("Not decided: within the confidence limits either may be the louder." in text) is (limits[0] < 0)
    assert ("plain and holed are alike within rounding" in text) is (level < 60.05)
    assert "0.0 dB quieter" not in text.replace("20.0 dB", "")
    assert not any(words in text for words in DOUBTS)


def test_of_three_designs_the_sentence_of_each_says_whether_it_is_decided(pair):
    case(pair / "third", "third")
    steady(pair / "third", 1.0)
    (pair / "summary.json").write_text(json.dumps(summary({"plain": 60.0, "holed": 80.0, "third": 61.0})))
    told = [text for text in read(write_page(pair)).texts if " than plain at " in text]
    assert [DOUBTS[0] in text for text in told] == [False, True]


@pytest.mark.parametrize("limits", [[-1.0, 3.0], [0.5, 1.5], [None, 3.0]])
@pytest.mark.parametrize("quiet", ["plain", "holed"])
def test_the_quietest_of_three_is_decided_against_the_next_quietest(pair, quiet, limits):
    case(pair / "third", "third")
    steady(pair / "third", 1.0)
    levels = {"plain": 80.0, "holed": 80.0, "third": 61.0, quiet: 60.0}
    told = summary(levels) | {"quietest": {"names": [quiet, "third"], "difference_limits_db": limits}}
    (pair / "summary.json").write_text(json.dumps(told))
    text = " ".join(read(write_page(pair)).texts)
    assert f"{quiet} is the quietest of 3, 1.0 dB below third at 3000 rpm" in text
    undecided = f"Not decided between {quiet} and third: either may be the quieter."
    assert (undecided in text) == (limits[0] is None or limits[0] < 0)
    assert (f"of the level of third less that of {quiet}" in text) == (quiet != "plain")


def test_three_designs_alike_within_rounding_are_called_alike(pair):
    case(pair / "third", "third")
    steady(pair / "third", 1.0)
    (pair / "summary.json").write_text(json.dumps(summary({"plain": 60.01, "holed": 80.0, "third": 60.0})))
    page = read(write_page(pair))
    assert "third and plain are alike within rounding at 3000 rpm, the quietest of 3" in page.texts


def test_headline_says_at_how_many_other_speeds_the_quieter_design_is_louder(pair):
    told = summary({"plain": 60.0, "holed": 80.0})
    for name, level in (("plain", [60.0, 70.0, 72.0]), ("holed", [80.0, 65.0, 71.0])):
        states = {"torque_Nm": [100.0], "speed_rpm": [3000.0, 4000.0, 5000.0], "level_dBA": [level]}
        told["configurations"][name]["steady_states"] = states
    (pair / "summary.json").write_text(json.dumps(told))
    page = read(write_page(pair))
    assert "plain is 20.0 dB quieter than holed at 3000 rpm, but louder at 2 of 3 speeds" in page.texts


@pytest.mark.parametrize(("end", "records"), [(3000.0, ""), (2000.0, " over unlike records")])
def test_headline_of_run_ups_says_at_how_many_speeds_it_is_the_other_way_round(pair, end, records):
    told = summary({"plain": 60.0, "holed": 80.0})
    for name, levels, last in (("plain", [60.0, 70.0, 72.0], 3000.0), ("holed", [80.0, 65.0, 71.0], end)):
        rows = [
            {"speed_rpm": speed, "level_dBA": level, "limits_dBA": [level - 2.0, level + 2.0]}
            for speed, level in zip((1000.0, 1500.0, 2000.0), levels, strict=True)
        ]
        record = {"start_speed_rpm": 1000.0, "end_speed_rpm": last, "duration_s": 4.0}
        told["configurations"][name] |= {"over_speed": rows, "input_speed_rpm": None, "highest": {}} | record
    (pair / "summary.json").write_text(json.dumps(told))
    page = read(write_page(pair))
    assert f"plain is 20.0 dB quieter than holed{records}, but louder at 2 of 3 speeds" in page.texts


def test_without_a_player_no_link_leads_to_it(pair):
    assert 'href="#sound">Listen' in write_page(pair).read_text()
    for run in ("plain", "holed"):
        path = pair / run / "pressure.h5"
        pressure = hdf5.load(path, FieldPressure)
        hdf5.save(pressure.replace(pressure=0 * pressure.pressure), path)
    assert 'href="#sound"' not in write_page(pair).read_text()


def test_a_level_of_0_dB_has_its_figure(pair):
    told = summary({"plain": 0.0, "holed": 0.0})
    for of in told["configurations"].values():
        of["error_band_dBA"] = [None, 0.0]
    (pair / "summary.json").write_text(json.dumps(told))
    assert any(name.endswith("levels") for name in read(write_page(pair)).figures)


def test_assumptions_of_a_case_stand_on_the_first_screen(pair):
    told = summary({"plain": 60.0, "holed": 80.0}) | {"assumptions": {"plain": ["The housing is <drawn> by rule."]}}
    (pair / "summary.json").write_text(json.dumps(told))
    assert "plain: The housing is &lt;drawn&gt; by rule." in write_page(pair).read_text()
