"""Cylinders of an imported shaft: overlapping sections joined, tapers in steps, thick parts cut to gear bores."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from nvhchain.interop.rexs import Findings, ImportedShaft, Section

_STEPS = 4
"""Cylinders in place of a tapered section."""

_SHORTEST = 1e-5
"""Shortest cylinder (m)."""


@dataclass(frozen=True)
class Piece:
    """Cylinder of a shaft.

    start, end : ends (m).
    outer, inner : diameters (m).
    young, poisson, density : material (Pa; kg/m³).
    """

    start: float
    end: float
    outer: float
    inner: float
    young: float
    poisson: float
    density: float


def pieces(
    shaft: ImportedShaft,
    shift: float,
    bores: Sequence[tuple[float, float, float]],
    places: Sequence[float],
    findings: Findings,
) -> list[Piece]:
    """Return the cylinders of a shaft.

    shift : length (m) to be added to z.
    bores : ends (m) and bore diameter (m) of the gears on it: the shaft inside is no thicker.
    places : planes (m) of gears and bearings, which the shaft must reach.
    """
    parts = [part for section in shaft.sections for part in _steps(shaft, section, shift, findings)]
    cuts = sorted({cut for part in parts for cut in (part.start, part.end)} | {c for b in bores for c in b[:2]})
    found: list[Piece] = []
    for low, high in pairwise(cuts):
        middle = 0.5 * (low + high)
        if high - low < _SHORTEST:
            continue
        for ring in _rings([part for part in parts if part.start <= middle <= part.end]):
            piece = replace(ring, start=low, end=high)
            for start, end, bore in bores:
                if start <= middle <= end and piece.outer > bore + 1e-9 and piece.inner < bore:
                    where = f"z = {1e3 * low:.5g}…{1e3 * high:.5g} mm"
                    findings.add(
                        "assumed",
                        shaft.name,
                        "outer diameter",
                        f"{1e3 * bore:.5g} for {1e3 * piece.outer:.5g} mm at {where}",
                        "inside a gear, whose body carries the rest",
                    )
                    piece = replace(piece, outer=bore)
            found = _joined(found, piece)
    return _fill_gaps(shaft, found, places, findings)


def _rings(parts: list[Piece]) -> list[Piece]:
    """Return the pieces of one cross-section, those that touch as one of the thickest's material."""
    found: list[Piece] = []
    for part in sorted(parts, key=lambda part: part.inner):
        if found and part.inner < found[-1].outer - 1e-9:
            last = found[-1]
            found[-1] = replace(max(last, part, key=lambda one: one.outer), inner=last.inner)
        else:
            found.append(part)
    return found


def _fill_gaps(shaft: ImportedShaft, found: list[Piece], places: Sequence[float], findings: Findings) -> list[Piece]:
    """Return the cylinders with gaps filled, and ends that reach all places."""
    if not found:
        return []
    found = sorted(found, key=lambda piece: piece.start)
    filled, reached = found[:1], found[0].end
    for piece in found[1:]:
        if piece.start - reached > 1e-9:
            thin = min(filled[-1], piece, key=lambda one: one.outer)
            where = f"{1e3 * reached:.5g}…{1e3 * piece.start:.5g} mm"
            findings.add("assumed", shaft.name, "gap", where, f"filled with {1e3 * thin.outer:.5g} mm")
            filled.append(replace(thin, start=reached, end=piece.start))
        filled.append(piece)
        reached = max(reached, piece.end)
    low, high = min((*places, filled[0].start)), max((*places, reached))
    if low < filled[0].start - 1e-9 or high > reached + 1e-9:
        where = f"{1e3 * low:.5g}…{1e3 * high:.5g} mm"
        findings.add("assumed", shaft.name, "ends", where, "lengthened to its outermost gear or bearing")
        filled[0] = replace(filled[0], start=low)
        last = max(range(len(filled)), key=lambda number: filled[number].end)
        filled[last] = replace(filled[last], end=high)
    return filled


def _steps(shaft: ImportedShaft, section: Section, shift: float, findings: Findings) -> list[Piece]:
    taper = section.outer[0] != section.outer[1] or section.inner[0] != section.inner[1]
    if taper:
        where = f"{1e3 * (section.start + shift):.5g}…{1e3 * (section.end + shift):.5g} mm"
        findings.add("assumed", shaft.name, "tapered section", where, f"{_STEPS} cylinders of mean diameters")
    count = _STEPS if taper else 1
    found = []
    for step in range(count):
        low, high, middle = step / count, (step + 1) / count, (step + 0.5) / count
        length = section.end - section.start
        outer, inner = (ends[0] + middle * (ends[1] - ends[0]) for ends in (section.outer, section.inner))
        place = section.start + shift
        material = section.young, section.poisson, section.density
        found.append(Piece(place + low * length, place + high * length, outer, inner, *material))
    return found


def _joined(found: list[Piece], piece: Piece) -> list[Piece]:
    """Return the cylinders with one more, which lengthens the same one before it."""
    for number, last in enumerate(found):
        same = replace(last, start=0.0, end=0.0) == replace(piece, start=0.0, end=0.0)
        if same and abs(last.end - piece.start) < 1e-9:
            return [*found[:number], replace(last, end=piece.end), *found[number + 1 :]]
    return [*found, piece]


def bore_radius(
    shaft: ImportedShaft, shift: float, plane: float, given: float | None, largest: float, findings: Findings, gear: str
) -> float:
    """Return the bore radius (m) of a gear: given, or that of its shaft, at most the largest that leaves a rim.

    shift : length (m) to be added to z on the shaft.
    plane : mid-plane of the gear (m).
    given : radius in the file (m).
    largest : largest radius (m).
    """
    shaft_radius = 0.5 * shaft.diameter_at(plane - shift)
    bore = max(given or 0.0, shaft_radius)
    if bore <= 0.0:
        bore = 0.3 * largest
        findings.add("assumed", gear, "bore", f"{2e3 * bore:.5g} mm", "no shaft section at the gear")
    if bore > largest:
        findings.add(
            "assumed", gear, "bore", f"{2e3 * largest:.5g} mm", "cut with its shaft; a rim of one module is drawn"
        )
        return largest
    if given is None or given < bore - 1e-9:
        findings.add("assumed", gear, "bore", f"{2e3 * bore:.5g} mm", "outer diameter of its shaft")
    return bore
