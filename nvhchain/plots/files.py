"""Figures as files that appear whole or not at all."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes

from nvhchain.files.atomic_write import content_of, write_atomic
from nvhchain.plots._style import figure_of, styled

RESOLUTION = 150
"""Resolution of the figures (dots per inch)."""


@styled
def save(axes: Sequence[Axes], path: Path) -> None:
    """Save the figure of `axes` as PNG."""
    write_atomic(path, content_of(lambda file: figure_of(axes[0]).savefig(file, dpi=RESOLUTION, format="png")))
