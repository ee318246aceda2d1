"""Figures as files that appear whole or not at all."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes

from nvhchain.errors import require
from nvhchain.files.atomic_write import content_of, write_atomic
from nvhchain.plots._style import figure_of, styled

RESOLUTION = 150
"""Resolution of the figures (dots per inch)."""


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
    suffix = path.suffix.lower()
    write_atomic(
        path,
        content_of(
            lambda file: figure_of(axes[0]).savefig(file, dpi=RESOLUTION, format=suffix[1:], metadata=FORMATS[suffix])
        ),
    )
