"""Shells, beams, springs, masses and relations of Nastran bulk data."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from nvhchain.errors import InputError, require, required
from nvhchain.fem.structural.model import BeamSection
from nvhchain.fem.structural.relations import rigid_motion
from nvhchain.fem.structural.sections import KINDS, section
from nvhchain.handoff import FloatArray
from nvhchain.interop.solids._model_parts import TRANSLATIONS, Rigid
from nvhchain.interop.solids._structure_parts import ShellSection
from nvhchain.interop.solids.nastran_cards import numbers, real
from nvhchain.interop.solids.nastran_frames import Deck

SHELLS: Mapping[str, tuple[int, int | None, int, int | None]] = {
    "CQUAD4": (4, 8, 11, 10),
    "CQUADR": (4, 8, 11, 10),
    "CQUAD8": (8, 16, 11, 17),
    "CTRIA3": (3, 7, 11, 10),
    "CTRIAR": (3, 7, 11, 10),
    "CTRIA6": (6, 10, 11, 14),
}
"""Card → number of nodes, and fields of the offset, the first thickness at a corner, and the flag of these."""

BEAMS = ("CBAR", "CBEAM", "CROD", "CONROD", "CTUBE")
SECTIONS = ("PSHELL", "PBAR", "PBARL", "PBEAM", "PBEAML", "PROD", "PTUBE", "PBUSH", "PELAS", "PMASS")
OTHERS = (
    "BAROR", "BEAMOR", "CONM2", "CONM1", "CMASS1", "CMASS2", "CELAS1", "CELAS2", "CBUSH", "RBE3", "RBAR", "MPC",
    "MPCADD", "SPOINT",
)  # fmt: skip


def read_structure(deck: Deck, chosen_mpc: int | None) -> None:
    """Read all items into the deck's parts; `chosen_mpc` selects multi-point constraints.

    Raises InputError for what is stated by other means than those read.
    """
    read_shells(deck)
    _shell_sections(deck)
    _beam_sections(deck)
    _beams(deck)
    _masses(deck)
    _springs(deck)
    _bushes(deck)
    _means(deck)
    _bars(deck)
    _sliding(deck)
    _relations(deck, chosen_mpc)


def _number(text: str, default: float = 0.0) -> float:
    return real(text) if text else default


def read_shells(deck: Deck) -> None:
    """Read shells without their sections; InputError for one that lacks nodes."""
    length = deck.system.length
    for name, (count, offset_field, thick, flag) in SHELLS.items():
        for where, card in deck.fields(name):
            members = [int(x) if x else 0 for x in card[3 : 3 + count]]
            corners = 4 if count in (4, 8) else 3
            if count > 4 and not any(members[corners:]):
                members = members[:corners]
            require(
                0 not in members,
                f"{where} has mid-edge nodes on some edges only, or lacks corners: give all or none",
            )
            given = card[offset_field] if offset_field is not None else ""
            offset = length * real(given) if given else None
            corner_thickness = [real(x) for x in card[thick : thick + corners] if x]
            require(
                not corner_thickness or flag is None or not card[flag] or card[flag] == "0",
                f"{where} scales its thickness (TFLAG): write the thickness itself",
            )
            thickness = length * sum(corner_thickness) / len(corner_thickness) if corner_thickness else None
            deck.parts.structure.shells[card[2] or card[1]].add(int(card[1]), members, thickness, offset)


def _shell_sections(deck: Deck) -> None:
    length, system = deck.system.length, deck.system
    for where, card in deck.fields("PSHELL"):
        first, second, third = card[2], card[4], card[6]
        require(bool(first), f"{where} has no membrane (MID1): only shells with one are read")
        material = deck.materials(first, f"PSHELL {card[1]}")
        for other, what in ((second, "MID2"), (third, "MID3")):
            require(
                not other or deck.materials(other, f"PSHELL {card[1]}") == material,
                f"{where} has another material for {what}: write a shell of one material",
            )
        require(not card[11], f"{where} couples membrane and bending (MID4): give an offset instead")
        deck.parts.structure.shell_sections[card[1]] = ShellSection(
            material,
            length * real(card[3]) if card[3] else None,
            _number(card[5], 1.0) if second else 0.0,
            (_number(card[7], 5 / 6) if second else 0.0) if third else 0.0,
            _number(card[8]) * deck.mass * system.mass / length**2,
        )


def _beam_sections(deck: Deck) -> None:
    L, line_mass = deck.system.length, deck.mass * deck.system.mass / deck.system.length
    keep = deck.parts.structure.beam_sections
    for where, card in deck.fields("PBAR"):
        area, z, y, torsion = (_number(x) for x in card[3:7])
        keep[card[1]] = (
            deck.materials(card[2], f"PBAR {card[1]}"),
            BeamSection(
                area * L**2, z * L**4, y * L**4, torsion * L**4, _number(card[19]) * L**4,
                _number(card[17]), _number(card[18]), _number(card[7]) * line_mass,
            ),
        )  # fmt: skip
        require(area > 0, f"{where} has no area")
    for where, card in deck.fields("PBARL", "PBEAML"):
        own = card[9:]
        while own and not own[-1]:
            own.pop()
        stations = "YES" in [x.upper() for x in own] or "NO" in [x.upper() for x in own]
        dimensions = [L * real(x) for x in own if x and x.upper() not in ("YES", "NO")]
        kind, name = card[4].upper(), where.split(": ")[-1]
        count = KINDS.get(kind, 0)
        require(not stations, f"{where} changes along the beam: only constant sections are read")
        extra = dimensions[count] / L if len(dimensions) == count + 1 else 0.0
        try:
            shape = section(kind, dimensions)
        except InputError as error:
            raise InputError(f"{where}: {error}") from None
        shape = BeamSection(**{**shape.__dict__, "extra_mass": extra * line_mass})
        keep[card[1]] = (deck.materials(card[2], name), shape)
    for where, card in deck.fields("PBEAM"):
        keep[card[1]] = (deck.materials(card[2], f"PBEAM {card[1]}"), _tapered(deck, where, card))
    for where, card in deck.fields("PROD"):
        require(bool(card[3]), f"{where} has no area")
        bar = BeamSection(
            real(card[3]) * L**2, 0.0, 0.0, _number(card[4]) * L**4, 0, 0, 0, _number(card[6]) * line_mass
        )
        keep[card[1]] = (deck.materials(card[2], f"PROD {card[1]}"), bar)
    for where, card in deck.fields("PTUBE"):
        outer, wall = real(card[3]) / 2, _number(card[4])
        tube = section("TUBE", [L * outer, L * (outer - wall if wall else 0.0)])
        bar = BeamSection(tube.area, 0.0, 0.0, tube.torsion, 0, 0, 0, _number(card[5]) * line_mass)
        keep[card[1]] = (deck.materials(card[2], where.split(": ")[-1]), bar)


def _tapered(deck: Deck, where: str, card: list[str]) -> BeamSection:
    """Return the section of PBEAM, which must not change along the beam."""
    L, line_mass = deck.system.length, deck.mass * deck.system.mass / deck.system.length
    area, z, y, product, torsion, extra = (_number(x) for x in card[3:9])
    require(area > 0, f"{where} has no area")
    rest, index = card[9:] if card[9].upper() in ("YES", "YESA", "NO") else card[17:], 0
    while index < len(rest) and rest[index].upper() in ("YES", "YESA", "NO"):
        stress = rest[index].upper()
        # A, I1, I2, I12, J, NSM follow the place; blank is as before
        for text, value in zip(rest[index + 2 : index + 8], (area, z, y, product, torsion, extra), strict=True):
            require(
                not text or abs(real(text) - value) <= 0.01 * abs(value),
                f"{where} changes along the beam: only constant sections are read, divide it",
            )
        index += 8 if stress in ("NO", "YESA") else 16
    shear_y, shear_z = (_number(x, 1.0) for x in (rest[index : index + 2] if index < len(rest) else ["", ""]))
    axis = [x for x in rest[index + 8 : index + 16] if x and real(x) != 0.0]
    require(not axis, f"{where} has its centre of gravity or neutral axis off the shear centre: use offsets instead")
    return BeamSection(
        area * L**2, z * L**4, y * L**4, torsion * L**4, product * L**4, shear_y, shear_z, extra * line_mass
    )


def _beams(deck: Deck) -> None:
    usual = {f"C{name.removesuffix('OR')}": card for name in ("BAROR", "BEAMOR") for _, card in deck.fields(name)}
    for name in BEAMS:
        for where, card in deck.fields(name):
            if name in usual:
                card = _fill_defaults(card, usual[name])
            if name in ("CROD", "CTUBE"):
                ends = int(card[3]), int(card[4])
                _append_beam(deck, card[2] or card[1], int(card[1]), ends, normal_to(_axis(deck, ends)), [""] * 8)
            elif name == "CONROD":
                ends, L = (int(card[2]), int(card[3])), deck.system.length
                extra = _number(card[8]) * deck.mass * deck.system.mass / L
                bar = BeamSection(real(card[5]) * L**2, 0.0, 0.0, _number(card[6]) * L**4, extra_mass=extra)
                deck.parts.structure.beam_sections[f"CONROD {card[1]}"] = deck.materials(card[4], where), bar
                _append_beam(deck, f"CONROD {card[1]}", int(card[1]), ends, normal_to(_axis(deck, ends)), [""] * 8)
            else:
                ends = int(card[3]), int(card[4])
                flag = (card[8] or "GGG").upper()
                require(flag == "GGG", f"{where} has offsets and direction by {flag}: write GGG, or leave it blank")
                _append_beam(
                    deck, card[2] or card[1], int(card[1]), ends, _direction(deck, where, card, ends), card[9:17]
                )


def _fill_defaults(card: list[str], usual: list[str]) -> list[str]:
    """Return a bar with section, direction and flag of BAROR or BEAMOR where it has none of its own."""
    whole = list(card)
    whole[2] = card[2] or usual[2]
    if not any(card[5:8]):
        whole[5:8] = usual[5:8]
    whole[8] = card[8] or usual[8]
    return whole


def _axis(deck: Deck, ends: tuple[int, int]) -> FloatArray:
    return deck.place(ends[1]) - deck.place(ends[0])


def normal_to(axis: FloatArray) -> FloatArray:
    """Return a vector normal to an axis (3,), for sections that are alike in all directions."""
    return np.asarray(np.eye(3)[np.abs(axis).argmin()])


def _direction(deck: Deck, where: str, card: list[str], ends: tuple[int, int]) -> FloatArray:
    if card[5] and not card[6] and not card[7] and "." not in card[5]:
        return deck.place(int(card[5])) - deck.place(ends[0])
    require(any(card[5:8]), f"{where} has no direction: give a vector or a grid point")
    return np.asarray(deck.axes(ends[0]) @ np.array([_number(x) for x in card[5:8]]))


def _append_beam(
    deck: Deck, group: str, label: int, ends: tuple[int, int], direction: FloatArray, more: list[str]
) -> None:
    """Add a beam; `more` are its pins at both ends and the offsets of both."""
    released = np.zeros(12, dtype=bool)
    for first, pins in ((0, more[0]), (6, more[1])):
        released[[first + int(c) - 1 for c in pins if c in "123456"]] = True
    arms = np.array([[_number(x) for x in more[start : start + 3]] for start in (2, 5)])
    turned = np.stack([deck.axes(node) @ arm for node, arm in zip(ends, arms, strict=True)])
    deck.parts.structure.beams[group].add(label, ends, direction, deck.system.length * turned, released)


def point_mass(mass: float, arm: FloatArray, inertia: FloatArray) -> FloatArray:
    """Return the matrix (6, 6) about a node of a `mass` (kg) at `arm` (m) with its own `inertia` (3, 3) kg m²."""
    own = np.zeros((6, 6))
    own[:3, :3], own[3:, 3:] = mass * np.eye(3), inertia
    move = rigid_motion(arm[None])[0]
    return np.asarray(move.T @ own @ move)


def _masses(deck: Deck) -> None:
    mass, L = deck.mass * deck.system.mass, deck.system.length
    for where, card in deck.fields("CONM2"):
        node, frame = int(card[2]), int(card[3] or 0)
        place = deck.place(node)
        require(frame in (-1, *deck.frames), f"{where} is in coordinate system {frame}, which is not defined")
        arm = np.array([_number(x) for x in card[5:8]])
        if frame == -1:
            arm, axes = L * arm - place, np.eye(3)
        else:
            axes = deck.frames[frame].axes_at(place / L)
            arm = L * axes @ arm
        i11, i21, i22, i31, i32, i33 = (_number(x) for x in card[9:15])
        inertia = np.array([[i11, -i21, -i31], [-i21, i22, -i32], [-i31, -i32, i33]])
        turned = mass * L**2 * axes @ inertia @ axes.T
        deck.parts.structure.masses.append((int(card[1]), node, point_mass(mass * _number(card[4]), arm, turned)))
    for where, card in deck.fields("CONM1"):
        node = int(card[2])
        require(int(card[3] or 0) in deck.frames, f"{where} is in coordinate system {card[3]}, which is not defined")
        table = np.zeros((6, 6))
        table[np.tril_indices(6)] = [_number(x) for x in card[4:25]]
        table += np.tril(table, -1).T
        table[3:] *= L
        table[:, 3:] *= L
        turn = np.kron(np.eye(2), deck.frames[int(card[3] or 0)].axes_at(deck.place(node) / L))
        deck.parts.structure.masses.append((int(card[1]), node, mass * turn @ table @ turn.T))
    values = {card[1]: real(card[2]) for _, card in deck.fields("PMASS")}
    for name in ("CMASS1", "CMASS2"):
        for where, card in deck.fields(name):
            require(not card[5], f"{where} joins two nodes: only masses at one node are read")
            node = int(card[3])
            component = int(card[4] or 1)
            require(name == "CMASS2" or card[2] in values, f"{where}: PMASS {card[2]} is not defined")
            value = real(card[2]) if name == "CMASS2" else values[card[2]]
            row = deck.motion(node, component) * (L if component > 3 else 1.0)
            deck.parts.structure.masses.append((int(card[1]), node, mass * value * np.outer(row, row)))


def _springs(deck: Deck) -> None:
    values = {}
    for _, card in deck.fields("PELAS"):
        values[card[1]] = real(card[2])
        if card[5]:
            values[card[5]] = real(card[6])
    for name in ("CELAS1", "CELAS2"):
        for where, card in deck.fields(name):
            require(name == "CELAS2" or card[2] in values, f"{where}: PELAS {card[2]} is not defined")
            value = real(card[2]) if name == "CELAS2" else values[card[2]]
            ends: list[int | None] = []
            row = np.zeros(12)
            for first, sign, node, component in ((0, 1.0, card[3], card[4]), (6, -1.0, card[5], card[6])):
                if not node or node == "0":
                    ends.append(None)
                    continue
                require(component not in ("", "0"), f"{where} has no component at node {node}")
                scale = sign * (deck.system.length if int(component) > 3 else 1.0)
                row[first : first + 6] = scale * deck.motion(int(node), int(component))
                ends.append(int(node))
            a, b = ends
            require(a is not None or b is not None, f"{where} has no node")
            stiffness = value * deck.system.force / deck.system.length * np.outer(row, row)
            deck.parts.structure.springs.append((int(card[1]), a, b, stiffness))


def _bushes(deck: Deck) -> None:
    L, force = deck.system.length, deck.system.force
    laws = {}
    for where, card in deck.fields("PBUSH"):
        marked = next((i for i in range(2, len(card)) if card[i].upper() == "K"), None)
        index = required(marked, f"{where} has no stiffness K")
        laws[card[1]] = [_number(x) for x in card[index + 1 : index + 7]]
    units = force / L * np.array([1.0, 1.0, 1.0, L**2, L**2, L**2])
    for where, card in deck.fields("CBUSH"):
        require(card[2] in laws or card[1] in laws, f"{where}: PBUSH {card[2]} is not defined")
        a, b = int(card[3]), int(card[4]) if card[4] else None
        place = deck.place(a)
        other = place if b is None else deck.place(b)
        middle = place + _number(card[9], 0.5) * (other - place)
        if card[10] and card[10] != "-1":
            require(int(card[10]) in deck.frames, f"{where} is in coordinate system {card[10]}, which is not defined")
            middle = L * deck.frames[int(card[10])].place(np.array([_number(x) for x in card[11:14]]))
        axes = _bush_axes(deck, where, card, other - place)
        turn = np.kron(np.eye(2), axes)
        local = turn @ np.diag(np.array(laws.get(card[2] or card[1], [0.0] * 6)) * units) @ turn.T
        reach = np.hstack([rigid_motion((middle - one)[None])[0] for one in (place, other)])
        reach[:, 6:] *= -1
        if b is None:
            reach[:, 6:] = 0.0
        deck.parts.structure.springs.append((int(card[1]), a, b, reach.T @ local @ reach))


def _bush_axes(deck: Deck, where: str, card: list[str], axis: FloatArray) -> FloatArray:
    """Return the axes (3, 3) of a bush as columns: of a system, by its direction, or those of the basic system."""
    if card[8]:
        frame = int(card[8])
        require(frame in deck.frames, f"{where} is in coordinate system {frame}, which is not defined")
        return deck.frames[frame].axes_at(deck.place(int(card[3])) / deck.system.length)
    length = float(np.linalg.norm(axis))
    if length == 0:
        require(not any(card[5:8]), f"{where} has no length and a direction: give it a coordinate system (CID)")
        return np.eye(3)
    if card[5] and not card[6] and not card[7] and "." not in card[5]:
        direction = deck.place(int(card[5])) - deck.place(int(card[3]))
    else:
        direction = deck.axes(int(card[3])) @ np.array([_number(x) for x in card[5:8]])
        if not direction.any():
            direction = normal_to(axis)
    x = axis / length
    z = np.cross(x, direction)
    require(bool(z.any()), f"{where}: its direction lies along its axis")
    z /= np.linalg.norm(z)
    return np.column_stack([x, np.cross(z, x), z])


def _means(deck: Deck) -> None:
    for where, card in deck.fields("RBE3"):
        components = np.zeros(6, dtype=bool)
        components[[int(c) - 1 for c in card[4] if c in "123456"]] = True
        require(bool(card[3]) and bool(components.any()), f"{where} has no reference node or no components")
        if not components.all():
            _basic_only(deck, [int(card[3])], where)
        members: list[int] = []
        weights: list[FloatArray] = []
        row: FloatArray | None = None
        words = [x for x in card[5:] if x]
        index = 0
        while index < len(words):
            word = words[index].upper()
            if word in ("UM", "ALPHA", "TREF"):
                break
            if "." in word:
                require(index + 1 < len(words), f"{where} has a weight without components")
                row = np.zeros(6)
                row[[int(c) - 1 for c in words[index + 1]]] = real(word)
                index += 2
                continue
            row = required(row, f"{where}: its weights must be real numbers, with a decimal point")
            own = (
                numbers([word, *words[index + 1 : index + 3]])
                if words[index + 1 : index + 2] == ["THRU"]
                else [int(word)]
            )
            index += 3 if len(own) > 1 else 1
            if row[:3].min() != row[:3].max() or row[3:].any():
                _basic_only(deck, own, where)
            members += own
            weights += [row] * len(own)
        require(len(members) > 0, f"{where} has no nodes")
        deck.parts.structure.averages.append((card[1], int(card[3]), components, members, np.array(weights)))


def _basic_only(deck: Deck, nodes: list[int], where: str) -> None:
    turned = [n for n in nodes if n in deck.parts.rotated and not np.allclose(deck.axes(n), np.eye(3), atol=1e-6)]
    require(
        not turned,
        f"{where} takes single components of node {(turned or [0])[0]} in a turned coordinate system: write 123",
    )


def _bars(deck: Deck) -> None:
    for where, card in deck.fields("RBAR"):
        whole = [set(x) >= set("123456") for x in card[4:6]]
        require(any(whole), f"{where}: one end must carry all six components (CNA or CNB)")
        reference, other = (card[2], card[3]) if whole[0] else (card[3], card[2])
        carried = set(card[7] if whole[0] else card[6]) or set("123456")
        require(carried >= set("123"), f"{where} couples components {sorted(carried)}: 123 at least are needed")
        deck.parts.rigid.append(Rigid(card[1], int(reference), [int(other)], carried >= set("456")))


def _sliding(deck: Deck) -> None:
    """Read RBE2 of some components: they follow the reference node, the others of their nodes are free."""
    for where, card in deck.fields("RBE2"):
        if set(card[3]) >= TRANSLATIONS:
            continue
        reference = int(card[2])
        deck.parts.notes.append(f"RBE2 {card[1]} couples components {card[3]} only: it slides, and is no bearing seat")
        for node in rigid_members(card):
            follow = rigid_motion((deck.place(node) - deck.place(reference))[None])[0]
            for own in sorted(set(card[3]) & set("123456")):
                component, _ = deck.component(node, int(own), where)
                others = [(reference, c, float(x)) for c, x in enumerate(follow[component]) if x]
                deck.parts.structure.relations.append((where.split(": ")[-1], node, component, others))


def rigid_members(card: list[str]) -> list[int]:
    """Return the dependent nodes of RBE2, whose last field may be a thermal expansion."""
    return numbers([x for x in card[4:] if x and "." not in x])


def _relations(deck: Deck, chosen: int | None) -> None:
    sets: dict[int, list[tuple[str, list[str]]]] = {}
    for where, card in deck.fields("MPC"):
        sets.setdefault(int(card[1]), []).append((where, card))
    for _, card in deck.fields("MPCADD"):
        sets[int(card[1])] = [one for number in numbers(card[2:]) for one in sets.get(number, [])]
    if chosen is None:
        if sets:
            deck.parts.notes.append(
                f"multi-point constraints MPC {', '.join(map(str, sorted(sets)))} excluded: case control selects none"
            )
        return
    require(chosen in sets, f"{deck.parts.source}: MPC = {chosen} is not there; known: {sorted(sets)}")
    L = deck.system.length
    for where, card in sets[chosen]:
        terms = []
        for start in range(2, len(card) - 2, 8):
            for index in (start, start + 3):
                if index + 2 < len(card) and card[index]:
                    node = int(card[index])
                    component, sign = deck.component(node, int(card[index + 1] or 1), where)
                    # a shift is L times that of the file
                    terms.append((node, component, sign * real(card[index + 2]) * (L if component > 2 else 1.0)))
        (node, component, first), *others = terms
        require(first != 0 and bool(others), f"{where} has no other motion, or a first coefficient of 0")
        deck.parts.structure.relations.append(
            (where.split(": ")[-1], node, component, [(n, c, -a / first) for n, c, a in others])
        )
