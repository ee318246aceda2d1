"""Page of a run, comparison or trade-off: one HTML file without links to the network."""

from __future__ import annotations

from collections.abc import Collection
from os.path import isfile
from pathlib import Path
from typing import Any

from nvhchain.errors import InputError
from nvhchain.files.hdf5 import write_text
from nvhchain.report.page.sections import RENEWED, SECTIONS, section_module
from nvhchain.report.page.tradeoff import tradeoff_sections
from nvhchain.report.stored import TRADEOFF, Stored, stored_results


def write_page(folder: str | Path, *, added: Collection[str] = ()) -> Path:
    """Write `report.html` to the folder of a run, comparison or trade-off.

    folder: folder that `run`, `compare` or `tradeoff` filled, completely or in part.
    added: hand-offs of microphones that are new since the page was written; sections that show others are kept.
    """
    from nvhchain.report.page._jinja import rendered, renewed  # jinja2 and plotly are imported for pages only

    folder = Path(folder)
    if isfile(folder / TRADEOFF) and not isfile(folder / "summary.json"):
        write_text(folder / "report.html", rendered(f"{folder.resolve().name}: trade-off", tradeoff_sections(folder)))
        return folder / "report.html"
    stored = stored_results(folder)
    page = stored.folder / "report.html"
    keep = bool(added) and stored.finished and _is_current(page, stored, added)
    try:
        sections = [_section(name, stored) for name in (RENEWED if keep else SECTIONS)]
    except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            f"{folder}: summary.json or case.json is not what `nvhchain run` or `compare` leaves ({error!r:.100}): "
            "run it again"
        ) from None
    sections = [section for section in sections if section[2]]
    if keep:
        text = renewed(page.read_text(encoding="utf-8"), sections, [_id(name) for name in SECTIONS])
    else:
        text = rendered(" and ".join(run.name for run in stored.runs) + ": sound", sections)
    write_text(page, text)
    return page


def _section(name: str, stored: Stored) -> tuple[str, str, list[Any]]:
    """Return id, title and blocks of a section."""
    module = section_module(name)
    title = module.title(stored) if hasattr(module, "title") else module.TITLE
    return _id(name), title, module.blocks(stored)


def _id(name: str) -> str:
    return name.rpartition(".")[2]


def _is_current(page: Path, stored: Stored, added: Collection[str]) -> bool:
    """Return True if a page is newer than all results of a finished run but those added."""
    files = [path for run in stored.runs for path in run.folder.glob("*.json")] + stored.hand_off_files
    files.append(stored.folder / "summary.json")
    return isfile(page) and all(
        path.stat().st_mtime_ns <= page.stat().st_mtime_ns for path in files if path.stem not in added
    )
