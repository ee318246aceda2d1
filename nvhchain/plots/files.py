"""Figures as files that appear whole or not at all."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes

from nvhchain.files.whole import in_memory, write_whole

RESOLUTION = 150
"""Resolution of the figures (dots per inch)."""


def save(axes: Sequence[Axes], path: Path) -> None:
    """Save the figure of `axes` as PNG."""
    figure = axes[0].get_figure(root=True)
    assert figure is not None
    write_whole(path, in_memory(lambda file: figure.savefig(file, dpi=RESOLUTION, format="png")))
