"""Ties of an Abaqus file: nodes of a slave surface that follow a master surface."""

from __future__ import annotations

from nvhchain.errors import require
from nvhchain.interop.solids._structure_parts import padded
from nvhchain.interop.solids.abaqus_keywords import Block, real
from nvhchain.interop.solids.abaqus_sets import AbaqusFile


def read_tie(file: AbaqusFile, block: Block) -> None:
    """Read pairs of slave and master; InputError for a master without faces."""
    name = block.get("NAME") or "of two surfaces"
    stated = block.get("POSITION TOLERANCE")
    tolerance = file.system.length * real(stated) if stated else None
    adjust = block.get("ADJUST", "YES").upper() == "YES"
    for slave, master in (row[:2] for row in block.data):
        nodes = file.surface_nodes(slave)
        faces = file.faces_of(master)
        require(len(faces) > 0, f"{file.parts.source}: *TIE {name}: master {master} must be a surface of element faces")
        rotations = "NO ROTATION" not in block.parameters
        file.parts.structure.ties.append((name, nodes, [padded(face) for face in faces], tolerance, adjust, rotations))
