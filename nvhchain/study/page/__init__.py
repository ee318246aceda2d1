"""Page of a study: one HTML file without links to the network."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from nvhchain.files.hdf5 import write_text
from nvhchain.study.definition import Study
from nvhchain.study.page import answer, designs, effects, indices, refused, scatter, search, slopes
from nvhchain.study.page.results import Results
from nvhchain.study.rows import Row

SECTIONS = (answer, search, slopes, scatter, indices, designs, effects, refused)
"""Modules of the sections in their order, each with TITLE and `blocks`."""


def write_study_page(study: Study, rows: Sequence[Row], lines: Sequence[str], out: str | Path) -> Path:
    """Write report.html of a study."""
    from nvhchain.report.page._jinja import rendered  # jinja2 and plotly are imported for pages only

    results = Results(study, tuple(rows), tuple(lines))
    sections = [(module.__name__.rpartition(".")[2], module.TITLE, module.blocks(results)) for module in SECTIONS]
    path = Path(out) / "report.html"
    name = Path(study.case).stem
    write_text(path, rendered(f"{name}: study", [section for section in sections if section[2]]))
    return path
