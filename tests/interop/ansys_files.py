"""Archives as CDWRITE writes them, from a model of solids."""

import numpy as np

from nvhchain.fem.structural.relations import rigid_motion
from nvhchain.interop.notation.units import unit_system

# corners and mid-edge nodes of a brick of 20 nodes from those of our kinds; a wedge and a tetrahedron are collapsed
BRICK = {
    "hex": [*range(20)],
    "wedge": [0, 1, 2, 2, 3, 4, 5, 5, 6, 7, 2, 8, 9, 10, 5, 11, 12, 13, 14, 14],
    "tet": [0, 1, 2, 2, 3, 3, 3, 3, 4, 5, 2, 6, 3, 3, 3, 3, 7, 8, 9, 9],
}
FREEDOMS = ("UX", "UY", "UZ", "ROTX", "ROTY", "ROTZ")


def nodes_block(labels, points):
    lines = [f"NBLOCK,6,SOLID,{max(labels):10d},{len(labels):10d}", "(3i9,6e21.13e3)"]
    for label, (x, y, z) in zip(labels, points, strict=True):
        lines.append(f"{label:9d}{0:9d}{0:9d}{x:20.13E}{y:20.13E}{z:20.13E}".replace("E+", "E+0").replace("E-", "E-0"))
    return [*lines, "N,R5.3,LOC,       -1,"]


def elements_block(rows):
    """Write rows of label, type, material, constants, section and nodes."""
    lines = [f"EBLOCK,19,SOLID,{max(row[0] for row in rows):10d},{len(rows):10d}", "(19i9)"]
    for label, kind, material, constants, section, nodes in rows:
        cells = [material, kind, constants, section, 0, 0, 0, 0, len(nodes), 0, label, *nodes]
        lines += ["".join(f"{cell:9d}" for cell in part) for part in (cells[:19], cells[19:]) if part]
    return [*lines, f"{-1:9d}"]


def material(law, system, number=1):
    values = {"EX": law.young / system.stress, "NUXY": law.poisson, "DENS": law.density / system.density}
    return [f"MPDATA,R5.0, 1,{label:4},{number:8d}, 1, {value!r},    " for label, value in values.items()]


def archive(model, path, *, units, joint="CE", types=None):
    """Write the model; `joint` is CE, MPC184, or a contact pair with a pilot node: `rigid` or `deformable`."""
    system, labels = unit_system(units), model.labels.tolist()
    points = [*(model.nodes / system.length), *[rigid.reference / system.length for rigid in model.rigid_sets]]
    lines = ["/COM,ANSYS RELEASE 2024 R1", "/PREP7", "/NOPR", "DOF,DELETE"]
    rows, tail, types = [], [], types or {"hex": 186, "wedge": 186, "tet": 187}
    for number, block in enumerate(model.blocks, start=1):
        lines.append(f"ET, {number:8d},{types[block.shape]}")
        for label, members in zip(block.labels.tolist(), model.labels[block.nodes].tolist(), strict=True):
            if types[block.shape] not in (187, 285):
                members = [members[i] if i < len(members) else 0 for i in BRICK[block.shape]]
                members = members[: 20 if block.quadratic else 8]
            rows.append((label, number, number, 0, 0, members))
        tail += material(block.material, system, number)
    count = max(row[0] for row in rows)
    lines += ["ET, 7,184", "KEYOP, 7, 1, 1", "ET, 8,170", "ET, 9,174"]
    lines += ["KEYOP, 9, 2, 2", f"KEYOP, 9, 4, {1 if joint == 'deformable' else 2}", "KEYOP, 9, 12, 5"]
    for place, rigid in enumerate(model.rigid_sets):
        arms = (model.nodes[rigid.nodes] - rigid.reference) / system.length
        if joint == "CE":
            for node, motion in zip(model.labels[rigid.nodes].tolist(), rigid_motion(arms), strict=True):
                for axis in range(3):
                    terms = [(node, FREEDOMS[axis], 1.0)]
                    terms += [(rigid.label, FREEDOMS[i], -float(motion[axis, i])) for i in range(6) if motion[axis, i]]
                    tail.append(f"CE,R5.0,DEFI,{len(terms):8d},{10 * node + axis:8d},  0.00000000")
                    for start in range(0, len(terms), 2):
                        pair = [f"{n:10d},{label:4},{value!r}" for n, label, value in terms[start : start + 2]]
                        tail.append("CE,R5.0,NODE," + ",".join(pair))
        elif joint == "MPC184":
            for node in model.labels[rigid.nodes].tolist():
                count += 1
                rows.append((count, 7, 1, 1, 1, [node, rigid.label]))
        else:
            rows.append((count + 1, 8, 1, 50 + place, 1, [rigid.label]))
            own = set(rigid.nodes.tolist())
            count += 2
            for face in _faces(model, own):
                rows.append((count, 9, 1, 50 + place, 1, model.labels[face].tolist()))
                count += 1
        held = [label for label, fixed in zip(FREEDOMS, rigid.held, strict=True) if fixed]
        tail += [f"D,{rigid.label:10d},{label:4},  0.00000000    ,  0.00000000" for label in held]
    for row, fixed in zip(labels, model.held, strict=True):
        tail += [
            f"D,{row:10d},{label:4},  0.0,  0.0" for label, one in zip(("UX", "UY", "UZ"), fixed, strict=True) if one
        ]
    for name, members in model.groups.items():
        own = model.labels[members].tolist()
        tail += [f"CMBLOCK,{name:8},NODE,{len(own):8d}  ! users node component definition", "(8i10)"]
        tail += ["".join(f"{n:10d}" for n in own[i : i + 8]) for i in range(0, len(own), 8)]
    lines += nodes_block([*labels, *[rigid.label for rigid in model.rigid_sets]], points)
    lines += [*elements_block(rows), *tail, "/GO", "FINISH", ""]
    path.write_text("\n".join(lines))
    return path


def _faces(model, own):
    """Yield faces of bricks, with their mid-edge nodes, all of whose nodes are among `own`."""
    from nvhchain.fem.solid_model import CORNERS, EDGES, FACES

    for block in model.blocks:
        edges = [frozenset(edge) for edge in EDGES[block.shape]]
        for members in block.nodes.tolist():
            for face in FACES[block.shape]:
                places = list(face)
                if block.quadratic:
                    pairs = [frozenset((a, face[i - len(face) + 1])) for i, a in enumerate(face)]
                    places += [CORNERS[block.shape] + edges.index(pair) for pair in pairs]
                nodes = [members[i] for i in places]
                if own.issuperset(nodes):
                    yield np.array(nodes)
