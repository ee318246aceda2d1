"""The page of a study in a browser: on paper and on a phone."""

import pytest

from nvhchain.study import Parameter, Row, Study, write_study
from nvhchain.study.page.answer import OPEN, blocks, response_curves
from nvhchain.study.page.results import Results
from scripts.browser import CHROMIUM, Browser


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: apt install chromium")
def test_the_page_of_a_study_fits_paper_and_phones(tmp_path):
    """Sixteen responses with limits at two speeds: tables that paper holds, and names beside figures that phones do."""
    study = Study("case.toml", (Parameter("wheel body", ("a.x",), ("solid", "5 slots")),), speeds_rpm=(1500.0, 1800.0))
    names = ("level", *(f"order stage x {harmonic}" for harmonic in range(1, 11)), *(f"level at {n}" for n in range(5)))
    rows = [
        Row(
            number,
            {"wheel body": body},
            speed,
            responses={name: 60.0 + number for name in names},
            limits=dict.fromkeys(names, (57.0, 64.0)),
        )
        for number, body in enumerate(("solid", "5 slots"))
        for speed in study.speeds_rpm
    ]
    write_study(study, rows, tmp_path)
    with Browser(tmp_path / "report.html", (1280, 900)) as browser:
        browser.run("document.querySelectorAll('details').forEach((of) => of.open = true)")
        browser.wait("document.querySelectorAll('#answer .js-plotly-plot').length >= 1")
        browser.paper(8.27, 11.69)
        assert browser.run("document.documentElement.scrollWidth") <= 717
        browser._call("Emulation.setEmulatedMedia", media="screen")
        browser._call("Emulation.setDeviceMetricsOverride", width=390, height=900, deviceScaleFactor=1, mobile=True)
        browser.run("new Promise((done) => setTimeout(done, 600))")
        assert browser.run("document.documentElement.scrollWidth") == 390
        left = "[...document.querySelectorAll('#answer .ytick text')].map((of) => of.getBoundingClientRect().left)"
        assert browser.run(f"Math.min(...{left})") > 0
        assert browser.errors == []


def test_curves_over_speed_are_at_the_torque_by_which_designs_are_ranked():
    """The loudest torque of every speed: at the first one the louder design would be the quieter."""
    study = Study("c.toml", (Parameter("x", ("a.x",), (1, 2)),), speeds_rpm=(1.0, 2.0, 3.0), torques=(10.0, 20.0))
    levels = {(1, 10.0): 50.0, (1, 20.0): 60.0, (2, 10.0): 55.0, (2, 20.0): 52.0}
    rows = [
        Row(x - 1, {"x": x}, speed, torque, responses={"level": level + speed})
        for (x, torque), level in levels.items()
        for speed in study.speeds_rpm
    ]
    figure = response_curves(Results(study, tuple(rows)))
    assert figure is not None
    assert "at the worst torque of every speed" in figure.caption
    curves = {trace["name"][0]: list(trace["y"]) for trace in figure.data}
    assert curves == {"0": [61.0, 62.0, 63.0], "1": [56.0, 57.0, 58.0]}


def test_an_error_bar_without_an_end_is_long():
    """A bar of no length would mean that the level is certain downwards."""
    study = Study("c.toml", (Parameter("x", ("a.x",), (1, 2)),))
    rows = [
        Row(x - 1, {"x": x}, responses={"level": 50.0 + x}, limits={"level": (None if x == 1 else 48.0, 55.0)})
        for x in (1, 2)
    ]
    (trace,) = (
        trace
        for block in blocks(Results(study, tuple(rows)))
        for figure in (block.levels, block.where)
        for trace in (figure.data if figure is not None else ())
        if "error_x" in trace
    )
    assert sorted(trace["error_x"]["arrayminus"]) == [4.0, 4.0 * OPEN]
