"""Page of an import (Markdown): what was taken, compared, assumed, missing and excluded, each with its value."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import degrees, pi

from nvhchain.bearings.springs import StiffnessMatrix
from nvhchain.case.gearbox import USUAL_DAMPING
from nvhchain.case.rexs.model import ImportedCase, Support
from nvhchain.errors import counted
from nvhchain.interop.rexs import Finding

_TITLES = {
    "differs": (
        "Contradictions",
        "The file contradicts itself, or the gears that were drawn from it. The last column names what was taken.",
    ),
    "assumed": ("Assumed", "Not in the file."),
    "missing": ("Missing", "Nothing was put in its place."),
    "excluded": ("Excluded", "In the file, but without effect on the case."),
}


def import_page(case: ImportedCase, name: str, source: str) -> str:
    """Return the page of an import."""
    unit = case.unit
    blocks = [
        f"# Import of {_cell(source)}",
        f"REXS {unit.version}, written by {_cell(unit.application)}. Case: `{name}`.",
        *_summary(case),
        *_comparison(case),
        *(block for kind in ("differs", "assumed", "missing", "excluded") for block in _findings(case, kind)),
        *_taken(case),
        "## Housing",
        "The file describes no housing. This one was drawn around shafts, gears and bearings; "
        'change it in `[housing]` of the case, or name a file with the real one (`type = "housing_model"`).',
        _table(("quantity", "value", "rule"), case.drawn.rules),
    ]
    return "\n\n".join(blocks) + "\n"


def import_lines(case: ImportedCase) -> list[str]:
    """Return the short form of the page for a terminal."""
    unit, record = case.unit, case.unit.findings
    parts = (
        f"{counted(len(unit.shafts), 'shaft')}, {counted(len(unit.gears), 'gear')}, "
        f"{counted(len(unit.stages), 'stage')}, {counted(len(case.supports) + len(case.links), 'bearing')}"
    )
    load = unit.loads[0]
    where = f"load case {load.name} of {len(unit.loads)}: " if load.name else ""
    lines = [
        f"REXS {unit.version} of {unit.application}: {parts}",
        f"{where}{30 / pi * case.speed:.6g} rpm and {case.torque:.6g} N m at {unit.input_shaft}",
    ]
    agree = [line for line in case.comparisons if line.agrees]
    if case.comparisons:
        lines.append(f"compared: {len(agree)} of {len(case.comparisons)} results of the file reproduced to 1e-4")
    for kind in ("differs", "assumed", "missing", "excluded"):
        found = record.select(kind)
        if kind == "differs":
            lines += [f"differs: {line.part}, {line.quantity}: {line.value} ({line.source})" for line in found[:6]]
            lines += [f"differs: {len(found) - 6} more in import.md"] if len(found) > 6 else []
        elif found:
            counts: dict[str, int] = {}
            for line in found:
                word = line.part if kind == "excluded" and line.quantity == "component" else line.quantity
                counts[word] = counts.get(word, 0) + 1
            lines.append(f"{kind}: " + ", ".join(f"{q} ({n})" if n > 1 else q for q, n in counts.items()))
    lines.append(f"assumed: housing, drawn by rule, walls of {1e3 * case.drawn.casting.wall:g} mm")
    return lines


def _cell(text: object) -> str:
    """Return a text that is one cell of a table and no markup."""
    plain = " ".join(str(text).split())
    for mark in "\\`*_<>|[]":
        plain = plain.replace(mark, f"\\{mark}")
    return plain


def _table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    lines = [f"| {' | '.join(header)} |", f"|{'---|' * len(header)}"]
    lines += [f"| {' | '.join(map(_cell, row))} |" for row in rows]
    return "\n".join(lines)


def _summary(case: ImportedCase) -> list[str]:
    rows = []
    for number, load in enumerate(case.unit.loads):
        rows.append(
            (
                load.name or "-",
                "-" if load.speed is None else f"{30 / pi * load.speed:.6g}",
                "-" if load.torque is None else f"{load.torque:.6g}",
                "-" if load.share is None else f"{100 * load.share:.4g} %",
                "taken" if number == 0 else "turns the other way" if load.reversed else "",
            )
        )
    intro = (
        f"Power enters at {_cell(case.unit.input_shaft)} and leaves at {_cell(case.unit.output_shaft)}. "
        f"The case runs at {30 / pi * case.speed:.6g} rpm and {case.torque:.6g} N m of the input. "
        "Another load case: `nvhchain import … --load-case NUMBER`."
    )
    return [
        "## Load",
        intro,
        _table(("load case", "input speed, rpm", "input torque, N m", "share of time", ""), rows),
    ]


def _comparison(case: ImportedCase) -> list[str]:
    if not case.comparisons:
        return ["## Comparison", "The file states no contact ratio, working pressure angle or centre distance."]
    rows = [
        (
            line.stage,
            line.quantity,
            f"{line.stated:.7g} {line.unit}",
            f"{line.found:.7g} {line.unit}",
            f"{line.found - line.stated:+.1e}",
            "yes" if line.agrees else "NO",
        )
        for line in case.comparisons
    ]
    return [
        "## Comparison",
        "Results in the file beside those of the drawn gears; they agree within 1e-4 of the value.",
        _table(("stage", "quantity", "file", "drawn", "difference", "agrees"), rows),
    ]


def _findings(case: ImportedCase, kind: str) -> list[str]:
    found: list[Finding] = case.unit.findings.select(kind)  # type: ignore[arg-type]
    title, intro = _TITLES[kind]
    rows = [(line.part, line.quantity, line.value, line.source) for line in found]
    if kind == "assumed":
        count = len(case.supports) + len(case.links)
        source = "E. Krämer, Dynamics of Rotors and Foundations, 1993: (0.25…2.5)e-5 s"
        rows.append((counted(count, "bearing"), "damping over stiffness", f"{USUAL_DAMPING:g} s", source))
    if not rows:
        return []
    return [f"## {title}", intro, _table(("part", "quantity", "value", "why"), rows)]


def _stiffness(support: Support) -> tuple[str, str]:
    """Return radial and axial stiffness (N/m) of a bearing; that of rolling elements follows the load."""
    own = support.estimate
    if isinstance(own.model, StiffnessMatrix):
        return "matrix at the operating point", f"{own.axial_stiffness:.3g}"
    if own.model is not None:
        return own.model.title, "by load"
    return f"{own.radial_stiffness:.3g}", f"{own.axial_stiffness:.3g}"


def _taken(case: ImportedCase) -> list[str]:
    unit, places = case.unit, case.arrangement
    gears = [
        (
            gear.name,
            gear.shaft,
            f"{1e3 * places.planes[gear.name]:.5g}",
            gear.teeth,
            f"{1e3 * gear.module:.6g}",
            f"{degrees(gear.pressure_angle):.6g}",
            f"{degrees(gear.helix_angle):.6g}",
            f"{1e3 * gear.face_width:.5g}",
            f"{case.gears[gear.name].profile_shift:.6g}",
            f"{2e3 * case.gears[gear.name].tip_circle_radius:.6g}",
            f"{2e3 * case.gears[gear.name].root_radius:.6g}",
        )
        for gear in unit.gears
    ]
    stages = [(s.name, s.pinion, s.wheel, f"{1e3 * places.distances[s.name]:.7g}") for s in unit.stages]
    shafts = [
        (
            shaft.name,
            f"{1e3 * places.axes[shaft.name][0]:.6g}, {1e3 * places.axes[shaft.name][1]:.6g}",
            f"{1e3 * min(p.start for p in case.pieces[shaft.name]):.5g}…"
            f"{1e3 * max(p.end for p in case.pieces[shaft.name]):.5g}",
            len(shaft.sections),
            f"{1e3 * max(piece.outer for piece in case.pieces[shaft.name]):.5g}",
        )
        for shaft in unit.shafts
    ]
    bearings = [
        (
            s.bearing.name,
            s.bearing.kind,
            s.bearing.shaft,
            s.bearing.outer_shaft or "housing",
            f"{1e3 * s.z:.5g}",
            *_stiffness(s),
            "; ".join(f"{key} = {value}" for key, value in s.bearing.catalogue.items()),
        )
        for s in (*case.supports, *case.links)
    ]
    pulls = [
        (load.shaft, f"{1e3 * load.z:.5g}", *(f"{value + 0.0:.6g}" for value in (*load.force, *load.moment)))
        for load in unit.side_loads
    ]
    others = [(line.part, line.quantity, line.value, line.source) for line in unit.findings.select("taken")]
    blocks = [
        "## Taken",
        "z is u of the file, in mm.",
        _table(
            ("gear", "shaft", "z", "teeth", "module, mm", "α, °", "β, °", "width, mm", "x", "d tip, mm", "d root, mm"),
            gears,
        ),
        _table(("stage", "pinion", "wheel", "centre distance, mm"), stages),
        _table(("shaft", "axis, mm", "z, mm", "sections", "largest diameter, mm"), shafts),
        _table(
            ("bearing", "type", "shaft", "in", "z", "k radial, N/m", "k axial, N/m", "further data, kept as a comment"),
            bearings,
        ),
    ]
    if pulls:
        head = ("side load on", "z", "F x, N", "F y, N", "F z, N", "M x, N m", "M y, N m")
        blocks.append(_table(head, pulls))
    return [*blocks, _table(("part", "quantity", "value", "source"), others)] if others else blocks
