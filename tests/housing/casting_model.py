"""Parametric casting in the form of an imported model, for export to other codes."""

from __future__ import annotations

import numpy as np

from nvhchain.fem.solid_model import ElementBlock, RigidSet, SolidModel
from nvhchain.housing.casting.casting import Casting
from nvhchain.housing.casting.mesh import HousingMesh


def casting_model(mesh: HousingMesh, casting: Casting) -> SolidModel:
    """Return the meshed casting as a solid model: RBE2 at seats and at held bolts, groups `SEAT_…`, `SKIN`."""
    count = len(mesh.nodes)
    labels = np.arange(1, count + 1)
    seats = [
        RigidSet(bore.name, np.array(bore.centre), nodes, count + 1 + i)
        for i, (bore, nodes) in enumerate(zip(casting.bores, mesh.seats, strict=True))
    ]
    bolts = [
        RigidSet(
            f"BOLT{i + 1}", mesh.nodes[nodes].mean(axis=0), nodes, count + 1 + len(seats) + i, np.ones(6, dtype=bool)
        )
        for i, nodes in enumerate(mesh.bolts)
    ]
    block = ElementBlock("tet10", mesh.elements, casting.material, np.arange(1, len(mesh.elements) + 1), "CASTING")
    return SolidModel(
        nodes=mesh.nodes,
        labels=labels,
        blocks=(block,),
        rigid_sets=(*seats, *bolts),
        held=np.zeros((count, 3), dtype=bool),
        groups={**{f"SEAT_{r.name}": r.nodes for r in seats}, "SKIN": np.unique(mesh.skin)},
        source="casting",
    )
