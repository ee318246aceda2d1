"""Solid elements of a CAD part, with rigid seats and held bolts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from nvhchain.errors import warn_caller
from nvhchain.fem.solid_model import ElementBlock, RigidSet, SolidModel
from nvhchain.fidelity import HousingFidelity
from nvhchain.housing.cad.part import CadPart
from nvhchain.housing.cad.survey import chosen, face_nodes, mesh_part, notes_of, survey


def cad_model(
    part: CadPart,
    folder: Path,
    positions: Mapping[str, Sequence[float]],
    *,
    f_max: float,
    fidelity: HousingFidelity,
) -> tuple[SolidModel, tuple[RigidSet, ...]]:
    """Mesh a CAD part with quadratic tetrahedra.

    positions: bearing → centre of its seat (m).
    f_max: upper limit of the band (Hz), whose bending waves the elements resolve.
    fidelity: size of the elements; thin walls and short waves have smaller ones.
    Returns model: elements, with a held rigid set at every bolt. seats: seats, in the order of `positions`.
    """
    size = survey(part, folder, positions, fidelity).element_size(part, f_max, fidelity)
    made = mesh_part(part, folder, positions, size, fidelity, dimension=3)
    if notes := notes_of(part, made):
        warn_caller(f"{part.file}: {'; '.join(notes)}", kind="repaired CAD part")
    nodes, elements, members = part.placed(made["nodes"]), made["elements"], made["members"]
    seat_cylinders, bolt_cylinders = chosen(part, made["cylinders"], positions)
    label = len(nodes) + 1
    seats = tuple(
        RigidSet(name, np.array(positions[name], dtype=float), face_nodes(members, cylinder), label + number)
        for number, (name, cylinder) in enumerate(seat_cylinders.items())
    )
    bolts = tuple(
        RigidSet(
            f"BOLT{number + 1}",
            cylinder.middle,
            face_nodes(members, cylinder),
            label + len(seats) + number,
            np.ones(6, dtype=bool),
        )
        for number, cylinder in enumerate(bolt_cylinders)
    )
    block = ElementBlock("tet10", elements, part.material, np.arange(1, len(elements) + 1), "CASTING")
    model = SolidModel(
        nodes=nodes,
        labels=np.arange(1, len(nodes) + 1),
        blocks=(block,),
        rigid_sets=bolts,
        held=np.zeros((len(nodes), 3), dtype=bool),
        groups={f"SEAT_{seat.name}": seat.nodes for seat in seats},
        source=part.file,
    )
    return model, seats
