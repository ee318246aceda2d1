"""The page of a study in a browser: on paper and on a phone."""

import pytest

from nvhchain.study import Parameter, Row, Study, write_study
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
