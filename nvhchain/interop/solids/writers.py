"""Export of a `SolidModel` as Nastran bulk data or Abaqus input, in any unit system; nodes keep 12 digits or all."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from nvhchain.conventions import Material
from nvhchain.errors import require
from nvhchain.fem.solid_model import ElementBlock, RigidSet, SolidModel
from nvhchain.files.atomic_write import write_output
from nvhchain.handoff import IntArray
from nvhchain.interop.notation._names import abaqus_names, changed, mark, renumbered, short_labels
from nvhchain.interop.notation.units import UnitSystem, unit_system
from nvhchain.interop.solids.abaqus_sets import HIDDEN
from nvhchain.interop.solids.nastran import SOLIDS

_CARDS = {kind: (name, place) for name, (*kinds, place) in SOLIDS.items() for kind in kinds}
_ABAQUS = {kind: f"C3D{kind.lstrip('tewdghx')}" for kind in _CARDS}
_SPC = 1
"""Number of the written constraint set."""


def write_nastran(model: SolidModel, path: str | Path, *, units: str) -> Path:
    """Write bulk data with GRID*, solids, PSOLID, MAT1*, RBE2, SPC1 and SET1 for the groups.

    units: units of the file, a key of `UNIT_SYSTEMS`.

    Labels of more than eight digits do not fit: such nodes and elements get new numbers above the largest that fits.
    Comments hold the original labels and the names behind the numbers; `read_nastran` restores both.
    """
    _solids_only(model)
    system = unit_system(units)
    lines = ["SOL 103", "CEND", f"SPC = {_SPC}", "BEGIN BULK", *_nastran(model, system), "ENDDATA"]
    return _written(lines, Path(path))


def _nastran(model: SolidModel, system: UnitSystem) -> Iterator[str]:
    long = model
    nodes = _shortened(np.concatenate([long.labels, [r.label for r in long.rigid_sets]]).astype(np.int64))
    elements = _shortened(np.concatenate([block.labels for block in long.blocks]))
    yield from changed("$", "node", nodes.keys(), nodes.values())
    yield from changed("$", "element", elements.keys(), elements.values())
    model = renumbered(long, nodes, elements)
    labels, references = model.labels, _references(model)
    for label, point in [*zip(labels.tolist(), model.nodes, strict=True), *references]:
        x, y, z = (real16(value / system.length) for value in point)
        yield f"{'GRID*':8}{label:16d}{'':16}{x:>16}{y:>16}"
        yield f"{'*':8}{z:>16}"
    numbers = {section: number for number, section in enumerate(_sections(model), start=1)}
    for (group, material), number in numbers.items():
        young, poisson, density = _constants(material, system)
        yield mark("$", "property", number, group)
        yield f"{'PSOLID':8}{number:8d}{number:8d}"
        yield f"{'MAT1*':8}{number:16d}{real16(young):>16}{'':16}{real16(poisson):>16}"
        yield f"{'*':8}{real16(density):>16}"
    for block in model.blocks:
        name, place = _CARDS[block.kind]
        order = np.argsort(place) if block.quadratic else slice(None)
        section = numbers[_section(block)]
        for label, members in zip(block.labels.tolist(), labels[block.nodes][:, order].tolist(), strict=True):
            yield from _small(name, [label, section, *members])
    taken = np.concatenate([block.labels for block in model.blocks])
    bodies = short_labels(np.concatenate([taken, taken.max() + 1 + np.arange(len(model.rigid_sets))]))[len(taken) :]
    for number, rigid in zip(bodies.tolist(), model.rigid_sets, strict=True):
        yield mark("$", "rigid", number, rigid.name)
        yield from _small("RBE2", [number, rigid.label, "123456", *_followers(model, rigid)])
        if rigid.held.any():
            yield from _small("SPC1", [_SPC, "".join(str(c + 1) for c in np.flatnonzero(rigid.held)), rigid.label])
    for components, held in _held(model):
        yield from _small("SPC1", [_SPC, components, *labels[held].tolist()])
    for number, (name, members) in enumerate(model.groups.items(), start=1):
        yield mark("$", "group", number, name)
        yield from _small("SET1", [number, *labels[members].tolist()])


def _shortened(labels: IntArray) -> dict[int, int]:
    """Return label → label of at most eight digits."""
    unique = np.unique(labels)
    return dict(zip(unique.tolist(), short_labels(unique).tolist(), strict=True))


def _small(name: str, values: Iterable[object]) -> Iterator[str]:
    fields = [str(value) for value in values]
    for start in range(0, len(fields), 8):
        yield f"{name if start == 0 else '+':8}" + "".join(f"{field:>8}" for field in fields[start : start + 8])


def real16(value: float) -> str:
    """Return the number with as many digits as fit into 16 characters; Nastran reads an exponent without its letter."""
    for digits in range(17, 4, -1):
        plain = f"{value:.{digits}g}"
        mantissa, mark, exponent = plain.partition("e")
        if not mark:
            text = re.sub(r"^(-?)0\.(?=.)", r"\1.", plain if "." in plain else plain + ".")
        else:
            text = (mantissa if "." in mantissa else mantissa + ".") + f"{int(exponent):+d}"
        if len(text) <= 16:
            return text
    raise AssertionError(value)


def real20(value: float) -> str:
    """Return the number in at most 20 characters; CalculiX would cut off the rest with the exponent."""
    text = repr(float(value))
    return text if len(text) <= 20 else f"{value:.13g}"


def write_abaqus(model: SolidModel, path: str | Path, *, units: str) -> Path:
    """Write a flat input file with *NODE, *ELEMENT, *NSET, *SURFACE of nodes, *COUPLING and *BOUNDARY.

    Parameters
    ----------
    model, path, units
        As in `write_nastran`.

    Returns
    -------
    Path
        Path of the file.

    Raises
    ------
    InputError
        For a model with other items than solids and rigid sets.

    Notes
    -----
    Names that Abaqus does not accept are changed. Comments hold the original names; `read_abaqus` restores them.
    CalculiX accepts the file as well. A step must be added.
    """
    _solids_only(model)
    return _written(list(_abaqus(model, unit_system(units))), Path(path))


def _solids_only(model: SolidModel) -> None:
    require(
        model.structure.empty,
        f"{model.source}: shells, beams, springs and means are read, but not written: use the deck that they come from",
    )


def _abaqus(model: SolidModel, system: UnitSystem) -> Iterator[str]:
    yield "*HEADING"
    yield f"units {system.name}"
    names = {
        "property": [group for group, _ in _sections(model)],
        "group": list(model.groups),
        "rigid": [rigid.name for rigid in model.rigid_sets],
    }
    plain = {kind: abaqus_names(before) for kind, before in names.items()}
    for kind, before in names.items():
        yield from changed("**", kind, before, plain[kind])
    sections = dict(zip(_sections(model), plain["property"], strict=True))
    yield "*NODE"
    for label, point in [*zip(model.labels.tolist(), model.nodes, strict=True), *_references(model)]:
        yield f"{label}, " + ", ".join(real20(value / system.length) for value in point)
    for block in model.blocks:
        yield f"*ELEMENT, TYPE={_ABAQUS[block.kind]}, ELSET={sections[_section(block)]}"
        for label, members in zip(block.labels.tolist(), model.labels[block.nodes].tolist(), strict=True):
            yield from _rows([label, *members])
    for (_, material), section in sections.items():
        young, poisson, density = _constants(material, system)
        yield f"*MATERIAL, NAME={section}_MATERIAL"
        yield "*ELASTIC"
        yield f"{real20(young)}, {real20(poisson)}"
        yield "*DENSITY"
        yield real20(density)
        yield f"*SOLID SECTION, ELSET={section}, MATERIAL={section}_MATERIAL"
    for name, nodes in zip(plain["group"], model.groups.values(), strict=True):
        yield f"*NSET, NSET={name}"
        yield from _rows(model.labels[nodes].tolist())
    for name, rigid in zip(plain["rigid"], model.rigid_sets, strict=True):
        yield f"*NSET, NSET={HIDDEN}{name}"
        yield from _rows(_followers(model, rigid))
        yield f"*SURFACE, NAME={HIDDEN}{name}, TYPE=NODE"
        yield f"{HIDDEN}{name}"
        yield f"*COUPLING, CONSTRAINT NAME={name}, REF NODE={rigid.label}, SURFACE={HIDDEN}{name}"
        yield "*KINEMATIC"
        yield "1, 3"  # CalculiX couples nothing without; the nodes of solids have no rotations
    held = [f"{r.label}, {c + 1}, {c + 1}" for r in model.rigid_sets for c in np.flatnonzero(r.held)]
    for components, nodes in _held(model):
        held += [f"{label}, {c}, {c}" for label in model.labels[nodes].tolist() for c in components]
    if held:
        yield "*BOUNDARY"
        yield from held


def _rows(values: list[int]) -> Iterator[str]:
    """Yield at most ten numbers per line, with a comma at the end of all but the last."""
    for start in range(0, len(values), 10):
        last = start + 10 >= len(values)
        yield ", ".join(map(str, values[start : start + 10])) + ("" if last else ",")


def _references(model: SolidModel) -> list[tuple[int, np.ndarray]]:
    """Return reference nodes that are no nodes of the model."""
    known = set(model.labels.tolist())
    return [(rigid.label, rigid.reference) for rigid in model.rigid_sets if rigid.label not in known]


def _followers(model: SolidModel, rigid: RigidSet) -> list[int]:
    """Return nodes that follow the reference node, which may be one of the model's own."""
    return [label for label in model.labels[rigid.nodes].tolist() if label != rigid.label]


def _section(block: ElementBlock) -> tuple[str, Material]:
    return block.group or "SOLID", block.material


def _sections(model: SolidModel) -> list[tuple[str, Material]]:
    """Return groups with their materials, each once."""
    return list(dict.fromkeys(_section(block) for block in model.blocks))


def _constants(material: Material, system: UnitSystem) -> tuple[float, float, float]:
    return material.young / system.stress, material.poisson, material.density / system.density


def _held(model: SolidModel) -> Iterator[tuple[str, IntArray]]:
    """Yield nodes by their held translations."""
    code = model.held @ np.array([1, 2, 4])
    for value in np.unique(code[code > 0]):
        yield "".join(str(axis + 1) for axis in range(3) if value >> axis & 1), np.flatnonzero(code == value)


def _written(lines: list[str], path: Path) -> Path:
    return write_output(path, (f"{line}\n".encode() for line in lines))
