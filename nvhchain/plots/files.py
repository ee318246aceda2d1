"""Figures as files that appear whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes

RESOLUTION = 150
"""Dots per inch of the figures."""


def save(axes: Sequence[Axes], path: Path) -> None:
    """The figure of `axes` as PNG."""
    figure = axes[0].get_figure(root=True)
    assert figure is not None
    part = path.with_suffix(".part")
    figure.savefig(part, dpi=RESOLUTION, format="png")
    os.replace(part, path)
