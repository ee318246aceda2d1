"""Files of figures hold what their suffix names."""

import numpy as np
import pytest
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.image import imread

from nvhchain.cli import main
from nvhchain.files import hdf5
from nvhchain.handoff import FieldPressure
from nvhchain.plots._style import STYLE
from nvhchain.plots.files import RESOLUTION, save


@pytest.fixture
def stored(tmp_path):
    """Stored pressure at two lines."""
    pressure = FieldPressure(np.array([500.0, 1000.0]), [[0, 0, 1]], np.array([[0.1], [0.2j]]), 80.0)
    return hdf5.save(pressure, tmp_path / "pressure.h5")


@pytest.mark.parametrize(
    ("suffix", "begin", "content"),
    [
        (".png", b"\x89PNG", b"IEND"),
        (".svg", b"<?xml", b"</svg>"),
        (".pdf", b"%PDF", b"%%EOF"),
        (".SVG", b"<?xml", b""),
    ],
)
def test_a_figure_is_what_its_suffix_names(stored, suffix, begin, content):
    picture = stored.with_suffix(suffix)
    assert main(["plot", str(stored), "--out", str(picture)]) == 0
    written = picture.read_bytes()
    assert written.startswith(begin)
    assert content in written


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_equal_figures_give_equal_files(stored, suffix):
    pictures = [stored.with_name(f"{name}{suffix}") for name in "ab"]
    for picture in pictures:
        assert main(["plot", str(stored), "--out", str(picture)]) == 0
    first, second = (picture.read_bytes() for picture in pictures)
    assert first == second
    assert b"dc:date" not in first


@pytest.mark.parametrize("name", ["a.usd", "a.xyz", "a.jpg", "shape"])
def test_a_suffix_of_no_figure_is_refused_in_one_line(stored, capsys, name):
    picture = stored.parent / name
    assert main(["plot", str(stored), "--out", str(picture)]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert "end it in .png, .svg, .pdf" in line
    assert not picture.exists()


def test_a_figure_is_drawn_once_with_the_layout_that_matplotlib_gives(tmp_path, monkeypatch):
    """The same pixels as `savefig` of the figure, which draws twice; the figure keeps canvas and resolution."""

    def figure():
        made = Figure(figsize=(4.0, 3.0), layout="constrained")
        axes = made.subplots(1, 2)
        for ax in axes:
            ax.plot([1, 2, 3], [1e-3, 2e5, 3])
            ax.set_ylabel("a long\nlabel")
        return made

    usual, own = figure(), figure()
    with rc_context(STYLE):
        usual.savefig(tmp_path / "usual.png", dpi=RESOLUTION)
    drawn, canvas = [], own.canvas
    draw = Figure.draw
    monkeypatch.setattr(Figure, "draw", lambda self, renderer: (drawn.append(1), draw(self, renderer)))
    save(own.axes, tmp_path / "own.png")
    assert len(drawn) == 1
    assert own.canvas is canvas
    assert own.dpi == usual.dpi
    first, second = (np.asarray(imread(tmp_path / name)) for name in ("usual.png", "own.png"))
    assert np.array_equal(first, second)
