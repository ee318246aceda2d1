"""`SolidModel` → Nastran bulk data or Abaqus input, in the unit system asked for; nodes keep 12 digits or all."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from nvhchain.conventions import Material
from nvhchain.fem.solid_model import ElementBlock, SolidModel
from nvhchain.handoff import IntArray
from nvhchain.interop.nastran import GROUP_MARK, SOLIDS
from nvhchain.interop.records import whole
from nvhchain.interop.units import UnitSystem, unit_system

_CARDS = {kind: (name, place) for name, (*kinds, place) in SOLIDS.items() for kind in kinds}
_ABAQUS = {
    "tet4": "C3D4",
    "tet10": "C3D10",
    "wedge6": "C3D6",
    "wedge15": "C3D15",
    "hex8": "C3D8",
    "hex20": "C3D20",
}
_SPC = 1
"""Number of the constraint set that is written."""


def write_nastran(model: SolidModel, path: str | Path, *, units: str) -> Path:
    """Bulk data with GRID*, solids, PSOLID, MAT1*, RBE2, SPC1 and SET1 for the groups."""
    system = unit_system(units)
    lines = ["SOL 103", "CEND", f"SPC = {_SPC}", "BEGIN BULK", *_nastran(model, system), "ENDDATA"]
    return _written(lines, Path(path))


def _nastran(model: SolidModel, system: UnitSystem) -> Iterator[str]:
    labels, references = model.labels, _references(model)
    for label, point in [*zip(labels.tolist(), model.nodes, strict=True), *references]:
        x, y, z = (real16(value / system.length) for value in point)
        yield f"{'GRID*':8}{label:16d}{'':16}{x:>16}{y:>16}"
        yield f"{'*':8}{z:>16}"
    for number, (group, material) in enumerate(_materials(model).items(), start=1):
        young, poisson, density = _constants(material, system)
        yield f"$ {group}"
        yield f"{'PSOLID':8}{number:8d}{number:8d}"
        yield f"{'MAT1*':8}{number:16d}{real16(young):>16}{'':16}{real16(poisson):>16}"
        yield f"{'*':8}{real16(density):>16}"
    numbers = {group: number for number, group in enumerate(_materials(model), start=1)}
    for block in model.blocks:
        name, place = _CARDS[block.kind]
        order = np.argsort(place) if block.quadratic else slice(None)
        for label, members in zip(block.labels.tolist(), labels[block.nodes][:, order].tolist(), strict=True):
            yield from _small(name, [label, numbers[_group(block)], *members])
    taken = int(max(block.labels.max() for block in model.blocks))
    for number, rigid in enumerate(model.rigid_sets, start=taken + 1):
        yield f"$ rigid set {rigid.name}"
        yield from _small("RBE2", [number, rigid.label, "123456", *labels[rigid.nodes].tolist()])
        if rigid.held.any():
            yield from _small("SPC1", [_SPC, "".join(str(c + 1) for c in np.flatnonzero(rigid.held)), rigid.label])
    for components, nodes in _held(model):
        yield from _small("SPC1", [_SPC, components, *labels[nodes].tolist()])
    for number, (name, nodes) in enumerate(model.groups.items(), start=1):
        yield f"{GROUP_MARK} {number} {name}"
        yield from _small("SET1", [number, *labels[nodes].tolist()])


def _small(name: str, values: Iterable[object]) -> Iterator[str]:
    fields = [str(value) for value in values]
    for start in range(0, len(fields), 8):
        yield f"{name if start == 0 else '+':8}" + "".join(f"{field:>8}" for field in fields[start : start + 8])


def real16(value: float) -> str:
    """The number with as many digits as 16 characters hold; an exponent goes without its letter (Nastran reads it)."""
    for digits in range(17, 4, -1):
        plain = f"{value:.{digits}g}"
        mantissa, mark, exponent = plain.partition("e")
        if not mark:
            text = plain if "." in plain else plain + "."
            text = (
                text.replace("0.", ".", 1) if text.lstrip("-").startswith("0.") and len(text.lstrip("-")) > 2 else text
            )
        else:
            text = (mantissa if "." in mantissa else mantissa + ".") + f"{int(exponent):+d}"
        if len(text) <= 16:
            return text
    raise AssertionError(value)


def write_abaqus(model: SolidModel, path: str | Path, *, units: str) -> Path:
    """Flat input file with *NODE, *ELEMENT, *NSET, *SURFACE of nodes, *COUPLING and *BOUNDARY."""
    return _written(list(_abaqus(model, unit_system(units))), Path(path))


def _abaqus(model: SolidModel, system: UnitSystem) -> Iterator[str]:
    yield "*HEADING"
    yield f"units {system.name}"
    yield "*NODE"
    for label, point in [*zip(model.labels.tolist(), model.nodes, strict=True), *_references(model)]:
        yield f"{label}, " + ", ".join(repr(float(value / system.length)) for value in point)
    for block in model.blocks:
        yield f"*ELEMENT, TYPE={_ABAQUS[block.kind]}, ELSET={_group(block)}"
        for label, members in zip(block.labels.tolist(), model.labels[block.nodes].tolist(), strict=True):
            yield from _rows([label, *members])
    for group, material in _materials(model).items():
        young, poisson, density = _constants(material, system)
        yield f"*MATERIAL, NAME={group}_MATERIAL"
        yield "*ELASTIC"
        yield f"{young!r}, {poisson!r}"
        yield "*DENSITY"
        yield f"{density!r}"
        yield f"*SOLID SECTION, ELSET={group}, MATERIAL={group}_MATERIAL"
    for name, nodes in model.groups.items():
        yield f"*NSET, NSET={name}"
        yield from _rows(model.labels[nodes].tolist())
    for rigid in model.rigid_sets:
        yield f"*NSET, NSET=_{rigid.name}_NODES"
        yield from _rows(model.labels[rigid.nodes].tolist())
        yield f"*SURFACE, NAME=_{rigid.name}_SURFACE, TYPE=NODE"
        yield f"_{rigid.name}_NODES"
        yield f"*COUPLING, CONSTRAINT NAME={rigid.name}, REF NODE={rigid.label}, SURFACE=_{rigid.name}_SURFACE"
        yield "*KINEMATIC"
    yield "*BOUNDARY"
    for rigid in model.rigid_sets:
        yield from (f"{rigid.label}, {c + 1}, {c + 1}" for c in np.flatnonzero(rigid.held))
    for components, nodes in _held(model):
        for label in model.labels[nodes].tolist():
            yield from (f"{label}, {c}, {c}" for c in components)


def _rows(values: list[int]) -> Iterator[str]:
    """At most ten numbers a line; a comma at the end of all but the last."""
    for start in range(0, len(values), 10):
        last = start + 10 >= len(values)
        yield ", ".join(map(str, values[start : start + 10])) + ("" if last else ",")


def _references(model: SolidModel) -> list[tuple[int, np.ndarray]]:
    """Reference nodes that are no nodes of the model."""
    known = set(model.labels.tolist())
    return [(rigid.label, rigid.reference) for rigid in model.rigid_sets if rigid.label not in known]


def _group(block: ElementBlock) -> str:
    return block.group or "SOLID"


def _materials(model: SolidModel) -> dict[str, Material]:
    return {_group(block): block.material for block in model.blocks}


def _constants(material: Material, system: UnitSystem) -> tuple[float, float, float]:
    return material.young / system.stress, material.poisson, material.density / system.density


def _held(model: SolidModel) -> Iterator[tuple[str, IntArray]]:
    """Nodes by the translations that are held."""
    code = model.held @ np.array([1, 2, 4])
    for value in np.unique(code[code > 0]):
        yield "".join(str(axis + 1) for axis in range(3) if value >> axis & 1), np.flatnonzero(code == value)


def _written(lines: list[str], path: Path) -> Path:
    def write(part: Path) -> None:
        part.write_text("\n".join([*lines, ""]), encoding="utf-8")

    return whole(path, write)
