"""Held motions, coupled sets, equations, rigid beams and contact of an archive."""

from __future__ import annotations

from collections import Counter, defaultdict

import numpy as np

from nvhchain.errors import FileFormatError, InputError, require
from nvhchain.fem.structural.relations import rigid_motion
from nvhchain.handoff import FloatArray
from nvhchain.interop.ansys.archive import Command
from nvhchain.interop.ansys.database import Database, Element
from nvhchain.interop.solids._model_parts import Rigid
from nvhchain.interop.solids._structure_parts import face_shares, node_weights, padded
from nvhchain.interop.solids.nastran_frames import basic_component

_FREEDOMS = ("UX", "UY", "UZ", "ROTX", "ROTY", "ROTZ")
RIGID_BEAMS, TARGETS, CONTACTS = (184,), (170,), (173, 174, 175, 177)
_BONDED = (3, 5, 6)
_SAME_ARM = 1e-4
"""Largest difference of a coefficient from that of a rigid motion, over the arm, for equations that make a body."""

Term = tuple[int, int, float]
"""Node, motion 0 … 5 and coefficient."""


def read_couplings(base: Database, found: list[Command]) -> None:
    """Read all items; InputError for those that cannot be imported."""
    for command in found:
        if command.name == "D":
            _held(base, command)
        elif command.name == "CP":
            _coupled(base, command)
    _equations(base, found)
    _rigid_beams(base)
    _contacts(base)


def _component(base: Database, node: int, label: str, where: str) -> tuple[int, float]:
    """Return the motion 0 … 5 of the basic axes, and its sign, behind a freedom of a node."""
    require(label.upper() in _FREEDOMS, f"{where}: {label} of node {node} is no translation or rotation")
    motion = _FREEDOMS.index(label.upper())
    if node not in base.axes:
        return motion, 1.0
    found = basic_component(motion, base.axes[node])
    if found is None:
        raise InputError(f"{where}: {label} of node {node} is along turned axes (NROTAT): use the global ones")
    return found


def _held(base: Database, command: Command) -> None:
    node, label = int(command.get(0)), command.get(1).upper()
    where = f"{base.source}: line {command.line}: D of node {node}"
    value = command.get(2, "0")
    require(not any(float(x or 0) for x in (value, command.get(3, "0"))), f"{where} moves by {value}: only 0 is held")
    wanted = _FREEDOMS if label == "ALL" else (label,)
    for one in wanted:
        require(one in _FREEDOMS, f"{where}: {one} is no translation or rotation")
        motion = _FREEDOMS.index(one)
        found = basic_component(motion, base.axes[node]) if node in base.axes else (motion, 1.0)
        if found is None:
            base.parts.oblique[node] = node
            found = (motion, 1.0)
        base.parts.held[node].add(str(found[0] + 1))


def _coupled(base: Database, command: Command) -> None:
    """Read `CP, set, label, nodes`: motions that are equal."""
    where, label = f"{base.source}: line {command.line}: CP {command.get(0)}", command.get(1).upper()
    labels = [one for one in command.fields[2:] if one] + [c for cells in command.cells() for c in cells if c]
    nodes = [int(one) for one in labels]
    wanted = _FREEDOMS if label == "ALL" else (label,)
    for one in wanted:
        for node in nodes[1:]:
            (own, sign), (other, lead) = (_component(base, n, one, where) for n in (node, nodes[0]))
            base.parts.structure.relations.append((where.split(": ")[-1], node, own, [(nodes[0], other, lead * sign)]))


def _equations(base: Database, found: list[Command]) -> None:
    """Read `CE, DEFI, terms, number, constant` with its `CE, NODE, node, label, coefficient, …`."""
    terms: dict[str, list[Term]] = {}
    name, left = "", 0
    L = base.system.length
    for command in found:
        if command.name != "CE":
            continue
        where, kind = f"{base.source}: line {command.line}: CE", command.get(0).upper()
        if kind == "DEFI":
            require(left == 0, f"{where}: {name} lacks {left} terms")
            name, left = f"CE {command.get(2)}", int(command.get(1))
            require(name not in terms, f"{where}: {name} is defined twice")
            require(float(command.get(3, "0")) == 0.0, f"{where}: {name} has a constant: only 0 is read")
            terms[name] = []
            continue
        require(kind == "NODE" and bool(name), f"{where}, {kind}: DEFI and NODE of an archive are read")
        for place in range(1, len(command.fields) - 2, 3):
            if left and command.get(place):
                node = int(command.get(place))
                motion, sign = _component(base, node, command.get(place + 1), where)
                value = sign * float(command.get(place + 2, "0")) * (L if motion > 2 else 1.0)
                terms[name].append((node, motion, value))
                left -= 1
    if left:
        raise FileFormatError(f"{base.source}: {name} lacks {left} terms: the file is cut off, write it again")
    bodies = _rigid_bodies(base, terms)
    for master, slaves in bodies.items():
        base.parts.rigid.append(Rigid(f"CE {master}", master, list(slaves), all(slaves.values())))
        for name in [one for one, own in terms.items() if own[0][0] in slaves and own[1][0] == master]:
            del terms[name]
    for name, ((node, motion, first), *others) in terms.items():
        require(first != 0 and bool(others), f"{base.source}: {name} has no other motion, or a first coefficient of 0")
        base.parts.structure.relations.append((name, node, motion, [(n, c, -a / first) for n, c, a in others]))


def _rigid_bodies(base: Database, terms: dict[str, list[Term]]) -> dict[int, dict[int, bool]]:
    """Return master → nodes that follow it as a rigid body by equations (CERIG), each with True for its rotations."""
    rows: defaultdict[tuple[int, int], dict[int, FloatArray]] = defaultdict(dict)
    for own in terms.values():
        (node, motion, first), *others = own
        masters = {n for n, _, _ in others}
        if len(masters) == 1 and first != 0 and node not in masters:
            row = np.zeros(6)
            for _, other, value in others:
                row[other] -= value / first
            rows[node, masters.pop()][motion] = row
    bodies: defaultdict[int, dict[int, bool]] = defaultdict(dict)
    for (node, master), given in rows.items():
        arm = base.system.length * (base.place(node) - base.place(master))
        rigid, size = rigid_motion(arm[None])[0], float(np.linalg.norm(arm))
        # CERIG leaves out terms without an arm
        limit = np.array([1e-6] * 3 + [_SAME_ARM * max(size, 1e-9)] * 3)
        if {0, 1, 2} <= set(given) and all((np.abs(row - rigid[i]) <= limit).all() for i, row in given.items()):
            bodies[master][node] = {3, 4, 5} <= set(given)
    leaders = set(bodies)
    return {master: own for master, own in bodies.items() if not leaders & set(own)}


def _rigid_beams(base: Database) -> None:
    """Join rigid links and beams (MPC184) into bodies about their most connected node."""
    links: defaultdict[int, list[int]] = defaultdict(list)
    first: dict[int, int] = {}
    for element in base.elements_by_type(RIGID_BEAMS):
        where = f"{base.source}: element {element.label} (MPC184)"
        option = base.key(element, 1)
        require(option == 1, f"{where} is a joint (KEYOPT(1) = {option}): only rigid beams, 1, are read")
        a, b = element.nodes[:2]
        links[a].append(b)
        links[b].append(a)
        first.setdefault(a, element.label)
    seen: set[int] = set()
    for start in list(links):
        if start in seen:
            continue
        body, waiting = [start], [start]
        seen.add(start)
        while waiting:
            for other in links[waiting.pop()]:
                if other not in seen:
                    seen.add(other)
                    body.append(other)
                    waiting.append(other)
        reference = max(body, key=lambda node: len(links[node]))
        base.parts.rigid.append(Rigid(f"MPC184 {reference}", reference, [n for n in body if n != reference]))


def _contacts(base: Database) -> None:
    """Read pairs of contact and target by their real constants: remote points and bonds."""
    targets: defaultdict[int, list[Element]] = defaultdict(list)
    for element in base.elements_by_type(TARGETS):
        targets[element.constants].append(element)
    pairs: defaultdict[int, list[Element]] = defaultdict(list)
    for element in base.elements_by_type(CONTACTS):
        pairs[element.constants].append(element)
    idle: Counter[str] = Counter()
    tied: list[tuple[set[int], set[int]]] = []
    for number, members in pairs.items():
        faces = [_face(one) for one in members]
        nodes = list(dict.fromkeys(n for face in faces for n in face))
        pilots = {one.nodes[0] for one in targets[number] if len(set(filter(None, one.nodes))) == 1}
        if pilots:
            _remote_point(base, members[0], number, pilots, nodes, faces)
        elif not targets[number]:
            idle["elements of contact without a target"] += len(members)
        elif base.key(members[0], 12) not in _BONDED:
            idle["elements of contact that is not bonded"] += len(members)
        else:
            others = [_face(one) for one in targets[number]]
            there = {n for face in others for n in face}
            odd = sum(len(face) not in (3, 4, 6, 8) for face in others)
            require(odd == 0, f"{base.source}: contact pair {number} has {odd} targets that are no faces")
            if any(set(nodes) <= master and there <= slave for slave, master in tied):
                idle["elements of the second contact of a symmetric bond"] += len(members)
                continue
            held = {n for n in nodes if base.parts.held.get(n, set()) >= set("123")}
            if held:
                idle[f"nodes of bonded contact {number} that are held"] += len(held)
            tied.append((set(nodes), there))
            free = [n for n in nodes if n not in held]
            faces_of_tie = [padded(face) for face in others]
            base.parts.structure.ties.append((f"contact {number}", free, faces_of_tie, None, True, True))
    base.parts.notes += [f"{what}: {count} excluded" for what, count in idle.items()]


def _face(element: Element) -> tuple[int, ...]:
    """Return the nodes of a face without repeats: corners, then mid-edge nodes."""
    nodes = [n for n in element.nodes if n]
    if len(nodes) == 8 and nodes[2] == nodes[3]:
        nodes = [nodes[i] for i in (0, 1, 2, 4, 5, 7)]
    return tuple(dict.fromkeys(nodes))


def _remote_point(
    base: Database, contact: Element, number: int, pilots: set[int], nodes: list[int], faces: list[tuple[int, ...]]
) -> None:
    where = f"{base.source}: contact pair {number}"
    require(len(pilots) == 1, f"{where} has {len(pilots)} pilot nodes: one is needed")
    require(base.key(contact, 2) == 2, f"{where} with a pilot node is no constraint (MPC, KEYOPT(2) = 2)")
    pilot, option = pilots.pop(), base.key(contact, 4)
    nodes = [n for n in nodes if n != pilot]
    if option == 2:
        base.parts.rigid.append(Rigid(f"contact {number}", pilot, nodes))
        return
    require(option == 1, f"{where}: KEYOPT(4) = {option} of the contact is not read: use 1 (deformable) or 2 (rigid)")
    shares = face_shares([face for face in faces if len(face) > 2], base.parts.nodes)
    mean = (f"contact {number}", pilot, np.ones(6, dtype=bool), nodes, node_weights(nodes, shares))
    base.parts.structure.averages.append(mean)
