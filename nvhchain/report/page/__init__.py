"""Page of a run, comparison or trade-off: one HTML file without links to the network."""

from __future__ import annotations

from os.path import isfile
from pathlib import Path

from nvhchain.errors import InputError
from nvhchain.files.hdf5 import write_text
from nvhchain.report.page.sections import SECTIONS
from nvhchain.report.page.stored import stored_results
from nvhchain.report.page.tradeoff import FILE as TRADEOFF
from nvhchain.report.page.tradeoff import tradeoff_sections


def write_page(folder: str | Path) -> Path:
    """Write `report.html` to the folder of a run, comparison or trade-off.

    folder: folder that `run`, `compare` or `tradeoff` filled, completely or in part.
    """
    from nvhchain.report.page._jinja import rendered  # jinja2 and plotly are imported for pages only

    folder = Path(folder)
    if isfile(folder / TRADEOFF) and not isfile(folder / "summary.json"):
        write_text(folder / "report.html", rendered(f"{folder.resolve().name}: trade-off", tradeoff_sections(folder)))
        return folder / "report.html"
    stored = stored_results(folder)
    try:
        sections = [(module.__name__.rpartition(".")[2], module.TITLE, module.blocks(stored)) for module in SECTIONS]
    except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            f"{folder}: summary.json or case.json is not what `nvhchain run` or `compare` leaves ({error!r:.100}): "
            "run it again"
        ) from None
    title = " and ".join(run.name for run in stored.runs) + ": sound"
    page = rendered(title, [section for section in sections if section[2]])
    write_text(stored.folder / "report.html", page)
    return stored.folder / "report.html"
