"""Superelement of another program as modes: all eigenvectors of its matrices, at its nodes and its recovered skin.

The unknowns x are motions of boundary nodes and modal coordinates. K φ = ω² M φ gives as many modes as unknowns, which
make the whole dynamics of the matrices. Unknowns without mass make modes of endless frequency; they keep their static
flexibility at a frequency far above the others. Motions of the skin are u = R x with the recovery matrix R.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.linalg

from nvhchain.errors import InputError, require, required
from nvhchain.fem.modal_model import ModalModel
from nvhchain.handoff import FloatArray, IntArray
from nvhchain.interop.matrices.abaqus_matrix import read_abaqus_matrices
from nvhchain.interop.matrices.dmig import read_dmig
from nvhchain.interop.matrices.labelled import LabelledMatrix, Unknown
from nvhchain.interop.matrices.op4 import read_op4
from nvhchain.interop.modes.assembled import Geometry, Mode, modal_model
from nvhchain.interop.modes.nastran_geometry import deck_geometry
from nvhchain.interop.notation.units import UnitSystem, unit_system

OP4, ABAQUS, DMIG = (".op4",), (".mtx",), (".pch", ".bdf", ".dat", ".nas", ".fem", ".blk", ".bulk")
_USUAL = {
    "stiffness": ("KAAX", "KHOUSE", "KAA", "KXX", "KJJ", "STIFFNESS", "K"),
    "mass": ("MAAX", "MHOUSE", "MAA", "MXX", "MJJ", "MASS", "M"),
    "damping": ("BAAX", "BAA", "BXX", "VISCOUSDAMPING"),
    "recovery": ("MUG1", "MUG1T", "OTM", "DTM", "RECOVERY"),
}
"""Names of matrices where none is stated: of EXTSEOUT, of our own export, and of Abaqus."""

_PARTS = {"stiffness": "STIF", "mass": "MASS", "damping": "DMPV"}
"""Parts of the names of files of one matrix, as Abaqus calls them."""

_SHIFT = 2 * np.pi * 10.0
"""Angular frequency (rad/s) of the shift that lets a free structure be solved, too."""

_NO_MASS, _NEGATIVE = 1e-13, 1e-9
"""Modal mass over the largest one, per shifted stiffness: below it a mode is massless, or a matrix is indefinite."""

_ASYMMETRY = 1e-5
"""Largest difference from the transpose over the diagonal; files hold six digits at least."""


@dataclass(frozen=True)
class MatrixNames:
    """Names of the matrices of a superelement.

    stiffness, mass: stiffness and mass; by default the usual ones that the file has.
    damping: viscous damping.
    recovery: recovery of the motions of nodes from the unknowns.
    """

    stiffness: str | None = None
    mass: str | None = None
    damping: str | None = None
    recovery: str | None = None


@dataclass(frozen=True)
class SuperelementFiles:
    """Files of a superelement.

    matrices: files of the matrices.
    deck: Nastran deck with the boundary nodes and the elements of the skin.
    nodes: boundary nodes in the order of matrices without names of their unknowns, six motions each.
    """

    matrices: tuple[Path, ...]
    deck: Path | None = None
    nodes: tuple[int, ...] = ()


def read_superelement(files: SuperelementFiles, *, units: str, names: MatrixNames = MatrixNames()) -> ModalModel:
    """Read reduced matrices and return all their modes.

    files: matrices (.op4, .mtx, or DMIG in bulk data) and deck.
    units: units of the files, a key of `UNIT_SYSTEMS`.
    Returns modes in SI units, with the damping of the matrices.
    """
    system, source = unit_system(units), str(files.matrices[0])
    found: dict[str, LabelledMatrix] = {}
    for path in files.matrices:
        for name, matrix in _read(path).items():
            require(name not in found, f"{path}: matrix {name} is in two files: leave one out")
            found[name] = matrix
    stiffness = _named(found, "stiffness", names.stiffness, source)
    assert stiffness is not None
    unknowns = _unknowns(stiffness, files.nodes, source)
    geometry = _geometry(files, system)
    parts = {
        "stiffness": stiffness,
        **{what: _named(found, what, getattr(names, what), source) for what in ("mass", "damping", "recovery")},
    }
    recovery = parts.pop("recovery")
    if recovery is not None and recovery.name == "MUG1T":
        recovery = LabelledMatrix(recovery.name, recovery.columns, recovery.rows, recovery.values.T)
    blank = parts["damping"]  # Nastran writes 1 × 1 in place of a matrix that is not there
    if blank is not None and blank.values.shape == (1, 1) and len(unknowns) > 1 and not blank.values.any():
        parts["damping"] = None
    square = {what: _square(matrix, unknowns, source) for what, matrix in parts.items() if matrix is not None}
    require(
        recovery is not None and bool(geometry.elements),
        f"{source}: {'no recovery matrix' if recovery is None else 'no deck with the elements of the skin'}, thus "
        "sound is impossible: state recovery (motions of the skin's nodes per unknown) and deck; the names of the "
        f"matrices are {', '.join(found)}",
    )
    assert recovery is not None
    free = np.asarray(square["stiffness"].any(axis=1) | square["mass"].any(axis=1))
    if stiffness.rows is not None and recovery.values.shape[1] > len(unknowns):
        recovery = _known_columns(recovery, unknowns)
    if not free.all():  # such as rotations of nodes of solids, and spare scalar points
        recovery = _free_columns(recovery, unknowns, free)
        unknowns = tuple(unknown for unknown, own in zip(unknowns, free, strict=True) if own)
        square = {what: values[np.ix_(free, free)] for what, values in square.items()}
    scale = np.array([1.0 / system.length if 1 <= component <= 3 else 1.0 for _, component in unknowns])
    energy = system.mass * system.length**2
    frequency, damping, vectors = _modes(
        energy / system.time**2 * (scale[:, None] * square["stiffness"] * scale),
        energy * (scale[:, None] * square["mass"] * scale).real,
        energy / system.time * (scale[:, None] * square["damping"] * scale).real if "damping" in square else None,
        source,
    )
    labels, motions = _motions(recovery, unknowns, geometry, source)
    node_shapes = np.einsum("naq,qm->mna", system.length * motions * scale, vectors)
    modes = [
        Mode(float(f), 1.0, float(d), labels, shape)
        for f, d, shape in zip(frequency, damping, node_shapes, strict=True)
    ]
    return modal_model(modes, geometry, unit_system("m-kg-s"), source, mass_normalized=True)


def _known_columns(recovery: LabelledMatrix, unknowns: tuple[Unknown, ...]) -> LabelledMatrix:
    """Return the recovery from the unknowns of the stiffness, which leaves out empty motions of boundary nodes."""
    nodes = list(dict.fromkeys(node for node, _ in unknowns))
    moving = {node for node, component in unknowns if component > 0}
    every = [(node, c) for node in nodes for c in (range(1, 7) if node in moving else (0,))]
    if len(every) != recovery.values.shape[1]:
        return recovery
    place = {unknown: number for number, unknown in enumerate(every)}
    chosen = recovery.values[:, [place[unknown] for unknown in unknowns]]
    return LabelledMatrix(recovery.name, recovery.rows, None, chosen)


def _free_columns(recovery: LabelledMatrix, unknowns: tuple[Unknown, ...], free: np.ndarray) -> LabelledMatrix:
    """Return the recovery from the unknowns that are free; it may have all columns, or leave out empty ones."""
    values, columns = recovery.values, recovery.columns
    if values.shape[1] == len(unknowns):
        return LabelledMatrix(recovery.name, recovery.rows, None, values[:, free])
    known = [unknown for unknown, own in zip(unknowns, free, strict=True) if own]
    if columns is not None and set(columns) <= set(unknowns):
        values = LabelledMatrix(recovery.name, None, columns, values).arranged((), known)
    return LabelledMatrix(recovery.name, recovery.rows, None, values)


def _read(path: Path) -> dict[str, LabelledMatrix]:
    ending = path.suffix.lower()
    if ending in OP4:
        return read_op4(path)
    if ending in ABAQUS:
        return read_abaqus_matrices(path)
    if ending in DMIG:
        return read_dmig(path)
    known = ", ".join(OP4 + ABAQUS + DMIG)
    raise InputError(f"{path}: {ending or 'no ending'} holds no matrices: {known} are read")


def _named(found: Mapping[str, LabelledMatrix], what: str, stated: str | None, source: str) -> LabelledMatrix | None:
    """Return the matrix of a name, or of a usual one; None where damping or recovery is not there."""
    names = list(found)
    if stated is not None:
        require(stated.upper() in found, f"{source}: no matrix {stated} for {what}; there are {', '.join(names)}")
        return found[stated.upper()]
    usual = next((name for name in _USUAL[what] if name in found), None)
    usual = usual or next((name for name in names if _PARTS.get(what, "\n") in name), None)
    if usual is None:
        require(
            what in ("damping", "recovery"),
            f"{source}: no usual name of a {what} matrix among {', '.join(names)}: state it by {what}",
        )
        return None
    return found[usual]


def _unknowns(matrix: LabelledMatrix, nodes: tuple[int, ...], source: str) -> tuple[Unknown, ...]:
    """Return the unknowns of the stiffness; without labels six of each boundary node, then modal coordinates."""
    if matrix.rows is not None:
        return matrix.rows
    n = len(matrix.values)
    require(
        bool(nodes) and 6 * len(nodes) <= n,
        f"{source}: {matrix.name} has {n} unknowns without names, {6 * len(nodes)} belong to boundary_nodes: state the "
        "boundary nodes in the order of the matrix",
    )
    motions = [(node, component) for node in nodes for component in range(1, 7)]
    return (*motions, *((-i, 0) for i in range(1, n - len(motions) + 1)))


def _square(matrix: LabelledMatrix, unknowns: tuple[Unknown, ...], source: str) -> np.ndarray:
    """Return a matrix in the order of the unknowns, made symmetric."""
    values = matrix.arranged(unknowns, unknowns)
    n = len(unknowns)
    require(
        values.shape == (n, n),
        f"{source}: {matrix.name} is of shape {' × '.join(map(str, values.shape))}, the stiffness of {n} × {n}",
    )
    require(bool(np.isfinite(values).all()), f"{source}: {matrix.name} holds a value that is not finite")
    size = np.sqrt(np.abs(np.diagonal(values)))
    scale = np.maximum(np.outer(size, size), 1e-12 * np.abs(values).max(initial=0.0))
    odd = float((np.abs(values - values.T) / np.maximum(scale, 1e-300)).max(initial=0.0))
    require(
        odd <= _ASYMMETRY,
        f"{source}: {matrix.name} is not symmetric, by {odd:.2g} of its diagonal: a passive housing has symmetric "
        "matrices",
    )
    return np.asarray((values + values.T) / 2)


def _geometry(files: SuperelementFiles, system: UnitSystem) -> Geometry:
    """Return nodes and elements in SI of the deck, or of the file of the matrices."""
    deck = files.deck or next((path for path in files.matrices if path.suffix.lower() in DMIG), None)
    missing = f"{files.matrices[0]}: has no places of nodes: state the deck with the boundary nodes by deck"
    found = deck_geometry(required(deck, missing))
    nodes = {label: [system.length * x for x in place] for label, place in found.nodes.items()}
    return Geometry(nodes, found.elements, found.axes, found.subject)


def _modes(
    stiffness: np.ndarray, mass: FloatArray, viscous: FloatArray | None, source: str
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return frequency (m,) Hz, damping (m,) and mass-normalised vectors (n, m) of all modes, rising."""
    real = np.ascontiguousarray(stiffness.real)
    size = np.sqrt(np.maximum(np.abs(np.diagonal(real)) + _SHIFT**2 * np.abs(np.diagonal(mass)), 1e-300))
    shifted = (real + _SHIFT**2 * mass) / size[:, None] / size
    try:
        share, vectors = scipy.linalg.eigh(mass / size[:, None] / size, shifted)
    except np.linalg.LinAlgError:
        raise InputError(
            f"{source}: stiffness and mass are not those of a structure: their sum is not positive definite; check "
            "their names and the order of unknowns"
        ) from None
    largest = float(share[-1])
    require(
        largest > 0 and float(share[0]) >= -_NEGATIVE * largest,
        f"{source}: the mass has a negative eigenvalue, {float(share[0]) / max(largest, 1e-300):.2g} of the largest: "
        "check its name and the order of unknowns",
    )
    share = np.maximum(share, _NO_MASS * largest)[::-1]
    vectors = vectors[:, ::-1] / size[:, None] / np.sqrt(share)
    square = 1.0 / share - _SHIFT**2
    square = np.where(np.abs(square) < 1e-6 * _SHIFT**2, 0.0, square)
    require(
        float(square[0]) >= 0,
        f"{source}: the stiffness has a negative eigenvalue: check its name and the order of unknowns",
    )
    omega = np.sqrt(square)
    loss = np.einsum("qm,qp,pm->m", vectors, stiffness.imag, vectors) if np.iscomplexobj(stiffness) else np.zeros(1)
    damping = np.where(square > 0, loss / np.maximum(square, 1e-300) / 2, 0.0)
    if viscous is not None:
        rate = np.einsum("qm,qp,pm->m", vectors, viscous, vectors)
        damping = damping + np.where(omega > 0, rate / np.maximum(2 * omega, 1e-300), 0.0)
    return omega / (2 * np.pi), np.clip(damping, 0.0, 0.999), vectors


def _motions(
    recovery: LabelledMatrix, unknowns: tuple[Unknown, ...], geometry: Geometry, source: str
) -> tuple[IntArray, FloatArray]:
    """Return labels (n,) of nodes, and their translations per unknown (n, 3, q) in units of the file."""
    labels = np.array(sorted(geometry.nodes), dtype=np.int64)
    values = recovery.values.real
    require(
        values.shape[1] == len(unknowns),
        f"{source}: {recovery.name} has {values.shape[1]} columns for {len(unknowns)} unknowns",
    )
    motions = np.zeros((len(labels), 3, len(unknowns)))
    row = {int(label): i for i, label in enumerate(labels)}
    if recovery.rows is None:
        each = values.shape[0] // len(labels)
        require(
            each in (3, 6) and values.shape[0] == each * len(labels),
            f"{source}: {recovery.name} has {values.shape[0]} rows without names; 3 or 6 of each of the {len(labels)} "
            "nodes of the deck are needed, by rising number",
        )
        motions[:] = values.reshape(len(labels), each, -1)[:, :3]
    else:
        for (node, component), own in zip(recovery.rows, values, strict=True):
            if 1 <= component <= 3 and node in row:
                motions[row[node], component - 1] = own
    for place, (node, component) in enumerate(unknowns):
        if 1 <= component <= 3:
            require(node in row, f"{source}: boundary node {node} has no GRID: state the deck with it")
            motions[row[node], component - 1] = 0.0
            motions[row[node], component - 1, place] = 1.0
    stated = (np.abs(motions).max(axis=(1, 2)) > 0) | (recovery.rows is None)  # DMIG leaves out zeros
    return labels[stated], motions[stated]
