"""Repair of foreign meshes: what is safe is done and reported, the rest is refused by number."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from nvhchain.conventions import ALUMINIUM, STEEL
from nvhchain.errors import InputError
from nvhchain.fem import lowest_modes
from nvhchain.fem.solid_model import CORNERS, ElementBlock, RigidSet, SolidModel
from nvhchain.housing.imported.repair import sound_mesh
from nvhchain.housing.imported.solid_model import constrained
from nvhchain.testing.elements import SPLITS, grid, held_box, positive


def frequencies(model, top=4000.0):
    K, M, _ = constrained(model)
    return lowest_modes(K, M, top)[0]


def changed(model, **block):
    """The model with something else in its only block."""
    return replace(model, blocks=(replace(model.blocks[0], **block),))


@pytest.mark.parametrize("kind", list(SPLITS))
def test_raised_box_bends_as_a_slender_cantilever(kind):
    """First bending frequency of a clamped-free bar; one linear element across would lock and double it."""
    length, height = 0.4, 0.012
    model, notes = sound_mesh(held_box(kind, counts=(8, 1, 1), lengths=(length, height, height)))
    assert "raised to quadratic" in notes[0]
    steel = model.blocks[0].material
    slender = 1.8751**2 / (2 * np.pi) * np.sqrt(steel.young * height**2 / 12 / steel.density) / length**2
    # eight elements along, sections rigid at both ends
    assert frequencies(model, 100.0)[0] == pytest.approx(slender, rel=0.02)


def test_inside_out_elements_are_turned_over_and_reported():
    for kind in SPLITS:
        sound = sound_mesh(held_box(kind))[0]
        members = sound.blocks[0].nodes.copy()
        flipped = {"hex8": [4, 5, 6, 7, 0, 1, 2, 3], "wedge6": [3, 4, 5, 0, 1, 2], "tet4": [0, 2, 1, 3]}[kind]
        linear = held_box(kind)
        wrong = linear.blocks[0].nodes.copy()
        wrong[:2] = wrong[:2][:, flipped]
        repaired, notes = sound_mesh(changed(linear, nodes=wrong))
        assert notes[0] == "2 elements that were numbered inside out turned over"
        assert frequencies(repaired) == pytest.approx(frequencies(sound), rel=1e-9)
        assert members.shape == repaired.blocks[0].nodes.shape


def test_quadratic_elements_inside_out_are_turned_over_with_their_edges():
    sound = sound_mesh(held_box("tet4"))[0]
    members = sound.blocks[0].nodes.copy()
    members[0] = members[0][[0, 2, 1, 3, 6, 5, 4, 7, 9, 8]]
    repaired, notes = sound_mesh(changed(sound, nodes=members))
    assert notes == ("1 elements that were numbered inside out turned over",)
    assert np.array_equal(repaired.blocks[0].nodes, sound.blocks[0].nodes)


def test_collapsed_elements_and_loose_nodes_are_left_out_and_reported():
    sound = held_box("tet4")
    block = sound.blocks[0]
    flat = np.vstack([block.nodes, [[0, 1, 1, 0]]])
    model = replace(
        changed(sound, nodes=flat, labels=np.append(block.labels, 999)),
        nodes=np.vstack([sound.nodes, [[9.0, 9.0, 9.0]]]),
        labels=np.append(sound.labels, 777),
        held=np.vstack([sound.held, [[False] * 3]]),
    )
    repaired, notes = sound_mesh(model)
    assert "1 element collapsed" in notes[0]
    assert "1 node without elements excluded, first 777" in notes[1]
    assert frequencies(repaired) == pytest.approx(frequencies(sound_mesh(sound)[0]), rel=1e-9)


def test_elements_given_twice_are_left_out_and_reported():
    sound = held_box("hex8")
    block = sound.blocks[0]
    twice = replace(block, nodes=block.nodes[:2][:, [4, 5, 6, 7, 0, 1, 2, 3]], labels=block.labels[:2] + 100)
    repaired, notes = sound_mesh(replace(sound, blocks=(block, twice)))
    assert notes[0] == "2 elements on the corners of others excluded, first 101"
    assert frequencies(repaired) == pytest.approx(frequencies(sound_mesh(sound)[0]), rel=1e-9)
    with pytest.raises(InputError, match=r"element \[101\] has the corners of element \[1\] and another material"):
        sound_mesh(replace(sound, blocks=(block, replace(twice, material=ALUMINIUM))))


def test_overlapping_elements_are_refused_by_their_nodes():
    """A wedge within a brick shares the faces of both."""
    sound = held_box("hex8")
    brick = sound.blocks[0].nodes[2]
    wedge = ElementBlock("tet4", brick[[0, 1, 3, 4]][None], sound.blocks[0].material, np.array([900]), "X")
    inner = ElementBlock("tet4", brick[[0, 1, 3, 7]][None], sound.blocks[0].material, np.array([901]), "X")
    third = ElementBlock("tet4", brick[[0, 1, 3, 5]][None], sound.blocks[0].material, np.array([902]), "X")
    model = replace(sound, blocks=(sound.blocks[0], wedge, inner, third))
    with pytest.raises(
        InputError, match=r"1 face shared by more than two elements, first at nodes .*: elements overlap"
    ):
        sound_mesh(model)


@pytest.mark.parametrize("scale", [1e3, 1e-3])
def test_mesh_in_another_unit_of_length_is_refused_by_its_size(scale):
    model = held_box("hex8")
    with pytest.raises(InputError, match=r"the mesh is (200|0\.0002) m long, .* is it in millimetres"):
        sound_mesh(replace(model, nodes=scale * model.nodes))


@pytest.mark.parametrize("kind", ["tet4", "hex8"])
@pytest.mark.parametrize("count", [1, None])
def test_swapped_mid_edge_nodes_are_refused_by_element(kind, count):
    """Of one element, whose nodes its neighbours give for other edges, and of all."""
    sound = sound_mesh(held_box(kind))[0]
    nodes, first = sound.blocks[0].nodes.copy(), CORNERS[sound.blocks[0].shape]
    nodes[:count, [first, first + 1]] = nodes[:count, [first + 1, first]]
    some = "1" if count else str(len(nodes))
    with pytest.raises(
        InputError,
        match=rf"{some} elements have mid-edge nodes off their edges: element \d+, node \d+, lies [\d.]+ edge lengths",
    ):
        sound_mesh(changed(sound, nodes=nodes))


def test_curved_element_that_overlaps_itself_is_straightened_and_reported():
    sound = sound_mesh(held_box("tet4"))[0]
    nodes = sound.nodes.copy()
    middle = sound.blocks[0].nodes[0, 4]
    nodes[middle] += 0.06
    repaired, notes = sound_mesh(replace(sound, nodes=nodes))
    assert "overlapped themselves straightened" in notes[0]
    assert repaired.nodes[middle] == pytest.approx(sound.nodes[middle], abs=1e-15)


def test_degenerate_element_is_refused_with_its_number():
    model = held_box("hex8")
    nodes = model.nodes.copy()
    nodes[model.blocks[0].nodes[3, 6]] = nodes[model.blocks[0].nodes[3, 0]] - 0.01
    with pytest.raises(InputError, match="degenerate or twisted, first 4"):
        sound_mesh(replace(model, nodes=nodes))
    members = model.blocks[0].nodes.copy()
    members[2, 3] = members[2, 2]
    with pytest.raises(InputError, match="repeat a corner"):
        sound_mesh(changed(model, nodes=members))


def test_parts_that_only_touch_are_refused_with_the_number_of_pairs():
    one = held_box("hex8", held=False)
    other = one.nodes + np.array([0.2, 0.0, 0.0])
    both = replace(
        one,
        nodes=np.vstack([one.nodes, other]),
        labels=np.arange(1, 2 * len(other) + 1),
        held=np.zeros((2 * len(other), 3), dtype=bool),
        blocks=(one.blocks[0], replace(one.blocks[0], nodes=one.blocks[0].nodes + len(other))),
        groups={},
    )
    with pytest.raises(InputError, match=r"2 parts of 6, 6 elements: 6 pairs of corners of different parts coincide"):
        sound_mesh(both)
    joint = RigidSet("JOINT", np.array([0.2, 0.0, 0.0]), np.flatnonzero(np.abs(both.nodes[:, 0] - 0.2) < 1e-9), 500)
    assert sound_mesh(replace(both, rigid_sets=(joint,)))[0].elements == 12


def test_nodes_that_are_not_merged_inside_one_part_are_reported_with_number_and_place():
    """Three corners at half the length are there twice: elements on the other side hang on the copies."""
    model = held_box("hex8", counts=(6, 2, 2), lengths=(0.24, 0.06, 0.06))
    assert not any("coincide" in note for note in sound_mesh(model)[1])
    count = len(model.nodes)
    twice = np.flatnonzero(np.isclose(model.nodes[:, 0], 0.12) & (model.nodes[:, 1] < 0.01))
    copy = np.arange(count)
    copy[twice] = count + np.arange(3)
    members = model.blocks[0].nodes.copy()
    beyond = model.nodes[members].mean(axis=1)[:, 0] > 0.12
    members[beyond] = copy[members[beyond]]
    cracked = replace(
        model,
        blocks=(replace(model.blocks[0], nodes=members),),
        nodes=np.vstack([model.nodes, model.nodes[twice]]),
        labels=np.append(model.labels, [1001, 1002, 1003]),
        held=np.zeros((count + 3, 3), dtype=bool),
    )
    (note,) = [note for note in sound_mesh(cracked)[1] if "coincide" in note]
    assert note.startswith("3 pairs of nodes coincide, first 28 and 1001 at (120, 0, 0) mm")
    weld = RigidSet("WELD", model.nodes[twice[0]], np.flatnonzero(np.isclose(cracked.nodes[:, 0], 0.12)), 2000)
    welded = replace(cracked, rigid_sets=(*cracked.rigid_sets, weld))
    assert not any("coincide" in note for note in sound_mesh(welded)[1])


def with_second_box(offset):
    """The held box and another at an offset (m) that shares its nodes where both have one."""
    one = held_box("hex8")
    other, bricks = grid((3, 2, 1), (0.2, 0.06, 0.05))
    distance, nearest = cKDTree(one.nodes).query(other + np.array(offset))
    new = distance > 1e-9
    row = np.where(new, len(one.nodes) + np.cumsum(new) - 1, nearest)
    nodes = np.vstack([one.nodes, (other + np.array(offset))[new]])
    second = ElementBlock("hex8", row[bricks], one.blocks[0].material, 100 + np.arange(len(bricks)), "B")
    return replace(
        one,
        nodes=nodes,
        labels=np.arange(1, len(nodes) + 1),
        blocks=(one.blocks[0], second),
        held=np.zeros((len(nodes), 3), dtype=bool),
        rigid_sets=tuple(replace(r, label=1000 + k) for k, r in enumerate(one.rigid_sets)),
    )


@pytest.mark.parametrize(
    ("offset", "nodes"), [((0.0, 0.06, 0.05), "6, 12, 18, 24"), ((0.2, 0.06, 0.05), "24"), ((0.0, 0.06, 0.0), None)]
)
def test_parts_hinged_along_an_edge_or_at_a_node_are_refused_by_its_nodes(offset, nodes):
    model = with_second_box(offset)
    if nodes is None:  # a common side
        assert sound_mesh(model)[0].elements == 12
        return
    with pytest.raises(InputError, match=f"2 parts of 6, 6 elements: .* an edge or a node only, at nodes {nodes}, ab"):
        sound_mesh(model)


def test_rigid_set_joins_parts_by_nodes_that_are_not_on_a_line():
    model = with_second_box((0.0, 0.06, 0.05))
    hinge = np.flatnonzero(np.isclose(model.nodes[:, 1], 0.06) & np.isclose(model.nodes[:, 2], 0.05))
    ends = model.nodes[:, 0] > 0.2 - 1e-9
    weld = replace(model.rigid_sets[1], nodes=np.flatnonzero(ends))
    assert sound_mesh(replace(model, rigid_sets=(model.rigid_sets[0], weld)))[0].elements == 12
    pin = RigidSet("PIN", model.nodes[hinge[0]], hinge[1:3], 2000, np.ones(6, dtype=bool))
    with pytest.raises(InputError, match="an edge or a node only"):
        sound_mesh(replace(model, rigid_sets=(model.rigid_sets[0], pin)))


def test_brick_against_tetrahedra_on_its_corners_is_one_body():
    """The brick's side has four corners, those of the tetrahedra three: no face is the same."""
    model = with_second_box((0.2, 0.0, 0.0))
    split = positive(model.nodes, model.blocks[1].nodes[:, SPLITS["tet4"]].reshape(-1, 4))
    tetrahedra = ElementBlock("tet4", split, STEEL, 500 + np.arange(len(split)), "B")
    assert sound_mesh(replace(model, blocks=(model.blocks[0], tetrahedra)))[0].elements == 42


def test_linear_elements_share_the_mid_edge_nodes_of_quadratic_neighbours():
    linear = held_box("hex8")
    quadratic = sound_mesh(linear)[0]
    half = linear.nodes[linear.blocks[0].nodes].mean(axis=1)[:, 0] < 0.1
    block = quadratic.blocks[0]
    mixed = replace(
        quadratic,
        blocks=(
            replace(block, nodes=block.nodes[half], labels=block.labels[half]),
            ElementBlock("hex8", block.nodes[~half, :8], block.material, block.labels[~half], "B"),
        ),
    )
    repaired, _ = sound_mesh(mixed)
    assert len(repaired.nodes) == len(quadratic.nodes)
    assert frequencies(repaired) == pytest.approx(frequencies(quadratic), rel=1e-9)


@pytest.mark.parametrize("chosen", [[0], [0, 1], "edge"])
def test_seat_of_one_node_or_of_a_line_is_refused(chosen):
    """Nothing resists its rotation: the stiffness is singular, or nearly."""
    model = held_box("hex8")
    foot, seat = model.rigid_sets
    edge = np.flatnonzero(model.nodes[seat.nodes, 2] == 0.0)
    few = replace(seat, nodes=seat.nodes[edge if chosen == "edge" else chosen])
    with pytest.raises(InputError, match=r"rigid set S is \d node\(s\) on a line: .* three nodes"):
        sound_mesh(replace(model, rigid_sets=(foot, few)))
    bolt = replace(foot, nodes=foot.nodes[:1])  # held in all six: nothing turns
    assert sound_mesh(replace(model, rigid_sets=(bolt, seat)))[0].elements == model.elements


def test_node_both_held_and_rigid_is_refused():
    model = held_box("hex8")
    held = model.held.copy()
    held[model.rigid_sets[1].nodes[0]] = True
    with pytest.raises(InputError, match="is held and belongs to rigid set S"):
        sound_mesh(replace(model, held=held))


def test_rigid_sets_that_share_nodes_are_refused_by_their_names_and_labels():
    model = held_box("hex8")
    third = RigidSet("THIRD", np.zeros(3), model.rigid_sets[1].nodes[[0, 1, 2]], 600)
    with pytest.raises(InputError, match=r"rigid sets S and THIRD share 5 nodes, \[19, 20, 21, "):
        sound_mesh(replace(model, rigid_sets=(*model.rigid_sets, third)))


def test_common_face_that_is_divided_differently_is_reported_with_area_and_place():
    """A brick beside eight, of which it shares four corners: the other nodes hang on its face of 30 cm²."""
    fine, bricks = grid((2, 2, 2), (0.1, 0.06, 0.05))
    coarse = np.array([(x, y, z) for x in (0.1, 0.2) for y in (0, 0.06) for z in (0, 0.05)])
    nodes = np.vstack([fine, coarse[4:]])
    row = [int(np.linalg.norm(nodes - at, axis=1).argmin()) for at in coarse]
    one = np.array([[row[0], row[4], row[6], row[2], row[1], row[5], row[7], row[3]]])
    elements = np.concatenate([bricks, one])
    block = ElementBlock("hex8", elements, STEEL, np.arange(1, 10), "BOX")
    held = np.zeros((len(nodes), 3), dtype=bool)
    model = SolidModel(nodes, np.arange(1, len(nodes) + 1), (block,), (), held, {}, "two meshes")
    (told,) = [note for note in sound_mesh(model)[1] if "lie on skin that faces it" in note]
    assert told.startswith("60 cm² of the skin")
    assert "first at (100, " in told
    split = elements.copy()
    split[0, 7] = len(nodes)  # a corner within the bricks is there twice: the crack does not silence the joint
    cracked = replace(
        model,
        nodes=np.vstack([nodes, nodes[elements[0, 7]]]),
        labels=np.arange(1, len(nodes) + 2),
        held=np.zeros((len(nodes) + 1, 3), dtype=bool),
        blocks=(replace(block, nodes=split),),
    )
    notes = sound_mesh(cracked)[1]
    assert told in notes
    assert sum("coincide" in note for note in notes) == 1
    tied = replace(model, rigid_sets=(RigidSet("joint", np.zeros(3), np.flatnonzero(nodes[:, 0] == 0.1)),))
    for sound in (tied, held_box("hex8"), held_box("tet4", counts=(5, 3, 1), lengths=(0.2, 0.12, 0.001))):
        assert not any("lie on skin" in note for note in sound_mesh(sound)[1])


def ring(inner, outer, height, around, along):
    """Nodes and bricks of a ring about z (m), `around` and `along` it; its chords follow both radii."""
    nodes, bricks = grid((around, 1, along), (2 * np.pi, 1.0, height))
    angle, radius = nodes[:, 0], inner + (outer - inner) * nodes[:, 1]
    first = nodes.reshape(around + 1, -1, 3).shape[1]  # the last section is the first
    bricks = bricks % (around * first)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), nodes[:, 2]])[:-first], bricks


def rings(*parts, kind="hex8"):
    """Rings on a common rigid foot at z = 0, which holds them together."""
    nodes, bricks = zip(*(ring(*part) for part in parts), strict=True)
    start = np.cumsum([0, *map(len, nodes)])
    places = np.vstack(nodes)
    members = np.vstack([b + n for b, n in zip(bricks, start, strict=False)])[:, SPLITS[kind]]
    elements = members.reshape(-1, members.shape[-1])
    elements = positive(places, elements) if kind == "tet4" else elements
    block = ElementBlock(kind, elements, STEEL, np.arange(1, len(elements) + 1), "RINGS")
    foot = RigidSet("FOOT", np.zeros(3), np.flatnonzero(places[:, 2] == 0.0), len(places) + 1)
    held = np.zeros(places.shape, dtype=bool)
    return SolidModel(places, np.arange(1, len(places) + 1), (block,), (foot,), held, {}, "rings")


@pytest.mark.parametrize("kind", ["hex8", "tet4"])
@pytest.mark.parametrize("counts", [(24, 18), (18, 24), (40, 13), (13, 40)])
def test_round_joint_that_is_divided_differently_is_reported_beside_the_nodes_that_coincide(counts, kind):
    """Chords of different arcs stand off one another by up to a millimetre, here out, there in; both sides are told."""
    inner, outer = counts
    model = rings((0.04, 0.05, 0.04, inner, 4), (0.05, 0.06, 0.04, outer, 3), kind=kind)
    notes = sound_mesh(model)[1]
    (cracked,) = [note for note in notes if "coincide" in note]
    assert cracked.startswith(f"{np.gcd(*counts)} pairs")  # at the free end, where both have a node
    (told,) = [note for note in notes if "lie on skin that faces it" in note]
    assert float(told.split()[0]) == pytest.approx(2e4 * 2 * np.pi * 0.05 * 0.04, rel=0.1)


@pytest.mark.parametrize("kind", ["hex8", "tet4"])
def test_round_joint_of_nodes_twice_is_told_once(kind):
    notes = sound_mesh(rings((0.04, 0.05, 0.04, 24, 4), (0.05, 0.06, 0.04, 24, 4), kind=kind))[1]
    assert sum("coincide" in note for note in notes) == 1
    assert not any("lie on skin" in note for note in notes)


@pytest.mark.parametrize("kind", ["hex8", "tet4"])
def test_thin_round_wall_and_gap_of_three_millimetres_are_no_joints(kind):
    """Chords of twelve to the turn stand off their arc by 1.7 mm, more than the wall is thick."""
    for model in (
        rings((0.05, 0.051, 0.04, 12, 3), kind=kind),
        rings((0.04, 0.05, 0.04, 24, 4), (0.053, 0.06, 0.04, 18, 3), kind=kind),
    ):
        assert not any("lie on skin" in note for note in sound_mesh(model)[1])
