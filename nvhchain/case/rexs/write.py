"""Import of a REXS file as a case folder."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from nvhchain.case.gearbox import GearboxCase
from nvhchain.case.rexs.model import ImportedCase, imported_case
from nvhchain.case.rexs.page import import_lines, import_page
from nvhchain.case.rexs.text import case_text
from nvhchain.case.toml.load import load_case
from nvhchain.dynamics.model.assembly import assemble
from nvhchain.errors import InputError, Mistakes, SolverError, mistakes, require
from nvhchain.fidelity import DRAFT
from nvhchain.files.atomic_write import write_output
from nvhchain.interop.rexs import read_rexs
from nvhchain.names import safe_names
from nvhchain.runtime.folder_lock import temporary_folder

PAGE = "import.md"
"""Name of the page beside the case."""


@dataclass(frozen=True)
class ImportResult:
    """Files of an import, and its short record.

    case, page: case file and page.
    lines: short form of the page.
    """

    case: Path
    page: Path
    lines: tuple[str, ...]


def import_rexs(
    path: str | Path,
    out: str | Path,
    *,
    load: str | None = None,
    housing: Literal["casting", "rigid"] = "casting",
) -> ImportResult:
    """Write the case of a REXS file into a folder, with a page of what was taken, assumed and excluded.

    path: REXS file, version 1.0 to 2.0.
    out: folder; made if needed.
    load: load case, by its number; the first by default.
    housing {'casting', 'rigid'}: `casting`: the drawn casting radiates. `rigid`: bearing forces on fixed seats.
    """
    source, folder = Path(path), Path(out)
    name = safe_names([re.sub(r"\.(rexs[jz]?|xml|json|zip)$", "", source.name, flags=re.IGNORECASE) or "unit"])[0]
    name = "unit" if name.casefold() == "operators" else name
    target, page = folder / f"{name}.toml", folder / PAGE
    for file in (target, page):
        require(not file.exists(), f"{file} exists: name another folder, or remove it")
    case, text = _tried(source, target.name, load, rigid=housing == "rigid")
    folder.mkdir(parents=True, exist_ok=True)
    write_output(target, text.encode())
    write_output(page, import_page(case, target.name, source.name).encode())
    return ImportResult(target, page, tuple(import_lines(case)))


def _tried(source: Path, name: str, load: str | None, *, rigid: bool) -> tuple[ImportedCase, str]:
    """Return case and text of a file; bearings get constant stiffness where rolling elements do not carry the load.

    A bearing that the refusal names gets it alone, and otherwise all of them.
    """
    reasons: dict[str, str] = {}
    constant: set[str] = set()
    while True:
        case = imported_case(read_rexs(source, load_case=load), str(source), constant=constant)
        for bearing, why in reasons.items():
            case.unit.findings.add("assumed", bearing, "elements or matrix", "constant stiffness in place of them", why)
        text = case_text(case, Path(name).stem, source.name, rigid=rigid)
        refusal = _refused(text, name, source)
        if refusal is None:
            return case, text
        names = {bearing.name for bearing in case.unit.bearings}
        named = {one for one in names - constant if refusal.startswith(f"bearing {one}: ")}
        constant |= named or names
        reasons |= dict.fromkeys(named or ("bearings",), refusal)


def _refused(text: str, name: str, source: Path) -> str | None:
    """Return why rolling bearings do not carry the load of a case; None where they do, or where it has none.

    Raises Mistakes if the case cannot be loaded, all mistakes at once.
    """
    with temporary_folder("import") as trial:
        tried = trial / name
        write_output(tried, text.encode())
        try:
            made = load_case(tried)
            assert isinstance(made, GearboxCase)
            try:
                assemble(made.gearbox_on_rigid_seats, made.straight_laws, None, fidelity=DRAFT.dynamics)
            except (InputError, SolverError) as error:
                if made.load_dependent:
                    return str(error)
                raise
        except InputError as error:
            raise Mistakes(
                [f"{source}: {re.sub(rf'{re.escape(str(tried))}(:[0-9]+)?: ', '', one)}" for one in mistakes(error)]
            ) from None
    return None
