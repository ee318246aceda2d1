"""Figures as files that appear whole or not at all."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import BinaryIO

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from nvhchain.errors import require
from nvhchain.files.atomic_write import content_of, write_atomic
from nvhchain.plots._style import figure_of, styled

RESOLUTION = 150
"""Resolution of the figures (dots per inch)."""
COMPRESSION = 4
"""Level of compression of PNG files: the usual 6 takes half as long again for 5 % less."""


FORMATS: dict[str, dict[str, None]] = {".png": {}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
"""Suffix of a figure → what its file leaves out, so that the same figure makes the same file."""


def check_format(path: Path, others: Sequence[str] = ()) -> None:
    """Raise InputError for a suffix of no figure.

    others: further suffixes that the remedy names.
    """
    known = ", ".join([*FORMATS, *others])
    require(
        path.suffix.lower() in FORMATS, f"{path}: suffix {path.suffix!r} is no format of figures: end it in {known}"
    )


@styled
def save(axes: Sequence[Axes], path: Path) -> None:
    """Save the figure of `axes` as PNG, SVG or PDF, by the suffix of `path`."""
    check_format(path)
    suffix, figure = path.suffix.lower(), figure_of(axes[0])
    if suffix == ".png":
        write_atomic(path, content_of(lambda file: _write_png(figure, file)))
        return
    meta = FORMATS[suffix]
    write_atomic(
        path,
        content_of(lambda file: figure.savefig(file, dpi=RESOLUTION, format=suffix[1:], metadata=meta)),
    )


def _write_png(figure: Figure, file: BinaryIO) -> None:
    """Write a figure; the method of matplotlib draws one with a layout engine twice."""
    before, own = figure.dpi, figure.canvas
    try:
        figure.set_dpi(RESOLUTION)
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
    finally:
        figure.set_canvas(own)
        figure.set_dpi(before)
    picture = Image.fromarray(np.asarray(canvas.buffer_rgba()))
    picture.save(file, format="png", dpi=(RESOLUTION, RESOLUTION), compress_level=COMPRESSION)
