"""Steady speeds and torques on the page: curves and maps with their limits, and differences that these decide."""

import json

import numpy as np
import plotly.graph_objects
import pytest

from nvhchain.report import write_page
from nvhchain.report.page.tables import page_tables
from scripts.page_reader import read
from tests.report.stored_pair import summary, unpacked


def steady_figures(pair, torques, states):
    """Figures of steady states at 1000, 2000 and 3000 rpm, without those of the first screen."""
    told = summary({"plain": 60.0, "holed": 80.0})
    for name, of in states.items():
        axes = {"speed_rpm": [1000.0, 2000.0, 3000.0], "torque_Nm": torques}
        told["configurations"][name]["steady_states"] = axes | of
    (pair / "summary.json").write_text(json.dumps(told))
    page = read(write_page(pair))
    return page, [of for name, of in page.figures.items() if name.startswith("plot-steady_states")]


def test_limits_of_steady_states_are_shaded_and_open_ends_are_at_the_edges(pair):
    plain = {"level_dBA": [[57.0, 66.0, 60.0]], "limits_dBA": [[[55.0, 59.0], [None, None], [None, 72.0]]]}
    holed = {
        "level_dBA": [[60.0, 70.0, 61.0]],
        "limits_dBA": [[[58.0, 62.0], [69.0, 71.0], [60.0, 62.0]]],
        "difference_limits_dB": [[[1.0, 5.0], [2.0, None], [None, 3.0]]],
    }
    page, (levels, difference) = steady_figures(pair, [50.0], {"plain": plain, "holed": holed})
    bottom, top = levels["layout"]["yaxis"]["range"]
    first, last, whole = (of["y"] for of in levels["data"] if of.get("fill"))
    assert (first, last) == ([59.0, 55.0], [72.0, bottom]), "no shading over the state without limits"
    assert whole == [62.0, 71.0, 62.0, 60.0, 69.0, 58.0]
    assert top == pytest.approx(75.0)
    (shading,) = (of["y"] for of in difference["data"] if of.get("fill"))
    assert shading == [5.0, 6.0, 3.0, -6.0, 2.0, 1.0]
    assert difference["layout"]["yaxis"]["range"] == [-6.0, 6.0]
    assert any("with 95 % limits" in text for text in page.texts)


def test_differences_that_the_limits_do_not_decide_stand_in_brackets(pair):
    level = [[60.0, 61.0, 62.0], [60.0, 61.0, None]]
    plain = {"level_dBA": level, "limits_dBA": [[[50.0, 70.0]] * 3] * 2}
    holed = {
        "level_dBA": [[63.0, 60.0, 64.0], [61.0, 62.0, 63.0]],
        "limits_dBA": [[[55.0, 75.0]] * 3] * 2,
        "difference_limits_dB": [[[1.0, 5.0], [-3.0, 1.0], [1.0, None]], [[None, 4.0], [0.5, 2.0], [None, None]]],
    }
    page, (_, difference) = steady_figures(pair, [50.0, 100.0], {"plain": plain, "holed": holed})
    (of,) = difference["data"]
    assert of["text"] == [["+3.0", "(−1.0)", "+2.0"], ["(+1.0)", "+1.0", ""]]
    assert of["customdata"] == [
        [" (1.0…5.0)", " (−3.0…1.0)", " (at least 1.0)"],
        [" (below 4.0)", " (0.5…2.0)", ""],
    ]
    assert any("in brackets where the 95 % limits hold 0" in text for text in page.texts)
    del holed["difference_limits_dB"]  # as in folders of earlier versions
    page, (_, difference) = steady_figures(pair, [50.0, 100.0], {"plain": plain, "holed": holed})
    assert difference["data"][0]["text"][0] == ["+3.0", "−1.0", "+2.0"]
    assert not any("in brackets" in text for text in page.texts)


def test_states_over_speed_and_torque_have_a_map_of_each_design_and_of_their_difference(pair):
    told = summary({"plain": 60.0, "holed": 80.0})
    axes = {"speed_rpm": [1000.0, 2000.0], "torque_Nm": [50.0, 100.0]}
    for name, shift in (("plain", 0.0), ("holed", 3.0)):
        level = [[60.0, 61.0], [None, 64.0 + 2 * shift]] if shift else [[57.0, 66.0], [60.0, 64.0]]
        told["configurations"][name]["steady_states"] = axes | {"level_dBA": level}
    (pair / "summary.json").write_text(json.dumps(told))
    page = read(write_page(pair))
    (table, _) = (of.rows for of in page_tables(pair) if of.name.startswith("steady_states"))
    assert table[0] == ["name", "input speed / rpm", "input torque / N m", "dB(A)"]
    assert ["plain", 2000.0, 50.0, 66.0] in table
    assert ["holed", 1000.0, 100.0, None] in table
    both, difference = (of for name, of in page.figures.items() if name.startswith("plot-steady_states"))
    assert len(both["data"]) == 2
    assert any(name.startswith("plot-answer") and of["data"] == difference["data"] for name, of in page.figures.items())
    (of,) = difference["data"]
    assert unpacked(of["z"]) == pytest.approx([3.0, -5.0, np.nan, 6.0], nan_ok=True)
    assert difference["layout"]["coloraxis"]["cmin"] == -difference["layout"]["coloraxis"]["cmax"] == -6.0
    assert of["text"] == [["+3.0", "−5.0"], ["", "+6.0"]]
    lowest, _, highest = difference["layout"]["coloraxis"]["colorscale"]
    assert (lowest[1], highest[1]) == ("#0072b2", "#d55e00")  # blue is quieter
    plotly.graph_objects.Figure(difference["data"], difference["layout"])
