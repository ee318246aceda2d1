"""Survey of a CAD part before it is meshed: its seats, bolts, walls and size."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from nvhchain.errors import InputError, counted, require
from nvhchain.fidelity import HousingFidelity
from nvhchain.handoff import FloatArray, IntArray
from nvhchain.housing.cad import _gmsh
from nvhchain.housing.cad.cylinders import Cylinder, find_bolts, find_seats, holes
from nvhchain.housing.cad.part import CadPart
from nvhchain.housing.skin.shape import HousingShape
from nvhchain.housing.skin.skin import Skin
from nvhchain.housing.skin.thin_walls import LONGEST, bending_wavelength, wall_thickness, worst_quarter

_FITTING = np.array([0.9, 12.0])
"""Least and largest length of a part over the reach of its bearings; outside, the unit of the file is wrong."""

_ANY = np.array([5e-3, 20.0])
"""Least and largest length (m) of a part with a single bearing."""

_USUAL, _USUAL_REACH = 1.8, 0.2
"""Usual length of a part over the reach of its bearings, and that reach (m), for the choice among wrong units."""

_UNITS = {1000.0: "metres", 25.4: "inches", 0.001: "millimetres", 1 / 25.4: "millimetres", 10.0: "centimetres"}
"""Factors that wrong units of a file leave."""

_SMOOTH = 40.0
"""Triangles around a full circle in pictures."""

_UNKNOWNS_PER_TRIANGLE = 9.0
"""Displacement unknowns of quadratic tetrahedra per triangle of the skin, from the meshes in docs/howto/housings.md."""


@dataclass(frozen=True, eq=False)
class Survey:
    """Part as found in its file, in the frame of the case.

    nodes: (n, 3) corners of the skin (m).
    triangles: (k, 3) skin, seen from outside.
    members: (j, 2) pairs of face and node.
    seats: bearing → cylinder.
    bolts: held holes.
    wall: thickness (m) that the thinnest quarter of the skin does not exceed.
    volume, area: of the part (m³, m²).
    notes: what was done to the part.
    """

    nodes: FloatArray
    triangles: IntArray
    members: IntArray
    seats: Mapping[str, Cylinder]
    bolts: tuple[Cylinder, ...]
    wall: float
    volume: float
    area: float
    notes: tuple[str, ...]

    def element_size(self, part: CadPart, f_max: float, fidelity: HousingFidelity) -> float:
        """Return the edge length (m) of the tetrahedra: that of the fidelity, or less for waves and thin walls."""
        wave = bending_wavelength(part.material, self.wall, f_max) / fidelity.elements_per_bending_wavelength
        return min(fidelity.element_size, wave, LONGEST * self.wall)

    def unknowns(self, surveyed: float, size: float) -> float:
        """Estimate the displacement unknowns of elements of `size` (m), from the skin surveyed with another one."""
        return _UNKNOWNS_PER_TRIANGLE * len(self.triangles) * (surveyed / size) ** 2


def survey(
    part: CadPart,
    folder: Path,
    positions: Mapping[str, Sequence[float]],
    fidelity: HousingFidelity,
    *,
    smooth: bool = False,
) -> Survey:
    """Read a part, and find its seats and bolts.

    positions: bearing → centre of its seat (m).
    fidelity: size of the triangles of the skin.
    smooth: True for small triangles on round faces, for pictures.
    """
    made = mesh_part(part, folder, positions, fidelity.element_size, fidelity, dimension=2, smooth=smooth)
    nodes, triangles = part.placed(made["nodes"]), made["elements"]
    seats, bolts = chosen(part, made["cylinders"], positions)
    skin = Skin(nodes, triangles, sp.identity(len(nodes), format="csr"))
    thickness = wall_thickness(skin)
    scale, volume = 1e-3 * part.scale, float(made["volume"])
    thickness = np.where(np.isfinite(thickness), thickness, 2 * volume / float(made["area"]) * scale)
    return Survey(
        nodes=nodes,
        triangles=triangles,
        members=made["members"],
        seats=seats,
        bolts=bolts,
        wall=float(thickness[worst_quarter(skin, 1 / thickness)]),
        volume=volume * scale**3,
        area=float(made["area"]) * scale**2,
        notes=notes_of(part, made),
    )


def notes_of(part: CadPart, made: Mapping[str, Any]) -> tuple[str, ...]:
    """Return what was done to the part."""
    notes = [str(note) for note in made["notes"]]
    removed, solids = int(made["removed"]), int(made["solids"])
    if removed:
        notes.append(f"{counted(removed, 'face')} smaller than {1e3 * part.smallest_feature:g} mm removed")
    if solids > 1:
        notes.append(f"{solids} solids bonded where they touch")
    return tuple(notes)


def mesh_part(
    part: CadPart,
    folder: Path,
    positions: Mapping[str, Sequence[float]],
    size: float,
    fidelity: HousingFidelity,
    *,
    dimension: int,
    smooth: bool = False,
) -> dict[str, Any]:
    """Mesh a part with elements of `size` (m); refuse one much smaller or larger than the reach of its bearings."""
    path = folder / part.file
    require(path.is_file(), f"{path}: no such STEP file")
    unit = 1e3 / part.scale
    needed = float(np.ptp(np.array(list(positions.values()), dtype=float), axis=0).max())
    made = _gmsh.mesh(
        {
            "file": str(path),
            "size": unit * size,
            "smallest": unit * size / (20 if smooth else 2),
            "per_turn": _SMOOTH if smooth else fidelity.elements_per_turn,
            "ignore": unit * part.smallest_feature,
            "lengths": [unit * limit for limit in (_FITTING * needed if needed > 0 else _ANY)],
            "dimension": dimension,
        }
    )
    if "box" in made:
        raise InputError(_other_size(part, part.placed(made["box"]), needed))
    return made


def _other_size(part: CadPart, box: FloatArray, needed: float) -> str:
    """Return the message of a part, box (2, 3) m, that does not fit bearings that lie `needed` (m) apart."""
    size = float(np.ptp(box, axis=0).max())
    expected = _USUAL * (needed or _USUAL_REACH)
    factor = min(_UNITS, key=lambda unit: abs(float(np.log(size / expected * unit))))
    return (
        f"{part.file}: the part is {1e3 * size:.4g} mm long ({_range(box.min(axis=0), box.max(axis=0))}), its bearings "
        f"lie {1e3 * needed:.4g} mm apart: the file's unit of length is wrong: export it in {_UNITS[factor]}, or set "
        f"scale = {part.scale * factor:g}"
    )


def _range(low: FloatArray, high: FloatArray) -> str:
    pairs = zip("xyz", 1e3 * low, 1e3 * high, strict=True)
    return ", ".join(f"{axis} = {a:.4g}…{b:.4g}" for axis, a, b in pairs)


def chosen(
    part: CadPart, rows: FloatArray, positions: Mapping[str, Sequence[float]]
) -> tuple[dict[str, Cylinder], tuple[Cylinder, ...]]:
    """Return seats and bolts among the cylinders of the mesher (c, 12), which are in mm and the file's frame."""
    placed = rows.copy()
    placed[:, 1:4] = part.placed(rows[:, 1:4])
    placed[:, 4:7] = rows[:, 4:7] @ part.rotation.T
    placed[:, 7:10] *= 1e-3 * part.scale
    found = holes(placed)
    seats = find_seats(part, found, positions)
    return seats, find_bolts(part, found, seats.values())


def face_nodes(members: IntArray, cylinder: Cylinder) -> IntArray:
    """Return the nodes on a cylinder; `members` (j, 2) are pairs of face and node."""
    return np.unique(members[np.isin(members[:, 0], cylinder.faces), 1])


def cad_shape(found: Survey) -> HousingShape:
    """Return the surface with seats and bolts for pictures.

    Returns skin, with the nodes of seats and bolts.
    """
    return HousingShape(
        found.nodes,
        found.triangles,
        {name: face_nodes(found.members, seat) for name, seat in found.seats.items()},
        tuple(face_nodes(found.members, bolt) for bolt in found.bolts),
    )
