"""Shells radiate from their faces, half the thickness in front of the middle surface, as solids of such walls do."""

import numpy as np
import pytest

from nvhchain.conventions import STEEL
from nvhchain.fem.solid_model import ElementBlock, RigidSet, SolidModel
from nvhchain.fem.structural.model import ShellBlock, Structure
from nvhchain.fidelity import DRAFT
from nvhchain.housing.imported.solid_model import reduce_model
from nvhchain.housing.modes.mounting_plane import MountingPlane
from nvhchain.housing.modes.response import face_displacement
from nvhchain.housing.skin.envelope import RadiatingFaces, outer_envelope
from nvhchain.housing.skin.mapping_error import source_power
from nvhchain.housing.skin.skin import model_skin
from nvhchain.levels import a_weighting
from nvhchain.testing.elements import grid

OUTSIDE, WALL = np.array([0.4, 0.3, 0.2]), 0.02
SIDES = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])


def shells_of(nodes, quads, thickness, offset=0.0, rigid=()):
    """Model of shells; every third is numbered the other way round, and so is its offset."""
    quads = quads.copy()
    quads[::3] = quads[::3, ::-1]
    offsets = np.full(len(quads), offset)
    offsets[::3] *= -1
    block = ShellBlock(quads, STEEL, np.arange(1, len(quads) + 1), np.full(len(quads), thickness), offsets)
    held = np.zeros((len(nodes), 3), dtype=bool)
    return SolidModel(nodes, np.arange(1, len(nodes) + 1), (), tuple(rigid), held, structure=Structure(shells=(block,)))


def bricks_on(axes):
    """Nodes and bricks of a box with planes at the values of `axes` (three arrays, m)."""
    counts = [len(axis) - 1 for axis in axes]
    nodes, bricks = grid(counts, counts)
    place = np.rint(nodes).astype(int)
    return np.column_stack([np.asarray(axis)[place[:, i]] for i, axis in enumerate(axes)]), bricks


def outer_quads(*axes):
    """Nodes and outward faces of a box with planes at the values of `axes`."""
    nodes, bricks = bricks_on(axes)
    quads = bricks[:, SIDES].reshape(-1, 4)
    _, first, count = np.unique(np.sort(quads, axis=1), axis=0, return_index=True, return_counts=True)
    used, members = np.unique(quads[first[count == 1]], return_inverse=True)
    return nodes[used], members.reshape(-1, 4)


def even(low, high):
    """Planes of a box between two corners."""
    return [np.linspace(*ends, n) for *ends, n in zip(low, high, (21, 16, 11), strict=True)]


def envelope(model, **options):
    skin, sides = model_skin(model)
    size = options.pop("face", 0.025)
    made = outer_envelope(skin, [], RadiatingFaces(size, **options), voxels_per_face=5, shells=sides)
    a, b, c = made.outer.nodes[made.outer.facets[:, :3]].transpose(1, 0, 2)
    return made, np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


def corners(made):
    """Corners of the exposed facets (m), and the nodes of the model that move them."""
    places = np.unique(made.outer.facets[:, :3])
    return made.outer.nodes[places], np.asarray(made.outer.interpolation[places].argmax(axis=1)).ravel()


@pytest.mark.parametrize("offset", [0.0, -WALL / 2, WALL / 2])
def test_nodes_on_any_surface_of_the_wall_give_the_same_outside(offset):
    """Nodes on the middle surface, on the outer faces and on the inner ones, with the offset that belongs to it."""
    inward = WALL / 2 + offset
    made, area = envelope(shells_of(*outer_quads(*even([inward] * 3, OUTSIDE - inward)), WALL, offset))
    assert corners(made)[0].min(axis=0) == pytest.approx([0, 0, 0], abs=2e-4)
    assert corners(made)[0].max(axis=0) == pytest.approx(OUTSIDE, abs=2e-4)
    a, b, c = OUTSIDE
    assert area == pytest.approx(2 * (a * b + b * c + c * a), rel=2e-3)
    assert made.surface.volume == pytest.approx(a * b * c, rel=0.03)


def test_walls_on_the_mounting_plane_stay_on_it():
    nodes, quads = outer_quads(*even([WALL / 2, WALL / 2, 0.0], OUTSIDE - WALL / 2))
    open_below = quads[nodes[quads, 2].max(axis=1) > 0]
    floor = MountingPlane((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    made, area = envelope(shells_of(nodes, open_below, WALL), mounting_plane=floor)
    a, b, c = OUTSIDE
    assert corners(made)[0].min(axis=0) == pytest.approx([0, 0, 0], abs=2e-4)
    assert area == pytest.approx(a * b + 2 * (b + a) * c, rel=2e-3)
    assert made.surface.volume == pytest.approx(a * b * c, rel=0.03)


@pytest.mark.slow
def test_a_hole_takes_nothing_from_the_outside_of_the_other_walls():
    nodes, quads = outer_quads(*even([WALL / 2] * 3, OUTSIDE - WALL / 2))
    middle = nodes[quads].mean(axis=1)
    hole = (middle[:, 2] > OUTSIDE[2] - 0.51 * WALL) & (np.abs(middle[:, :2] - OUTSIDE[:2] / 2) < 0.05).all(axis=1)
    whole, _ = envelope(shells_of(nodes, quads, WALL), opening=0.16)
    made, _ = envelope(shells_of(nodes, quads[~hole], WALL), opening=0.16)
    assert hole.sum() >= 20
    assert made.surface.volume == pytest.approx(whole.surface.volume, rel=0.01)
    assert made.surface.areas.sum() == pytest.approx(whole.surface.areas.sum(), rel=0.02)


def test_notes_tell_no_cavity_in_the_material_of_shells():
    nodes, quads = outer_quads(np.linspace(0, 0.4, 21), np.linspace(0, 0.3, 16), [0.0, 1.0])
    used, members = np.unique(quads[nodes[quads, 2].max(axis=1) == 0], return_inverse=True)
    made, _ = envelope(shells_of(nodes[used], members.reshape(-1, 4), 0.06), face=0.02)
    assert "cavity" not in " ".join(made.notes)


def test_a_plate_in_air_has_its_thickness_on_both_sides():
    """Each side moves outward with the nodes in the middle; the plate is a body of its volume."""
    nodes, quads = outer_quads(np.linspace(0, 0.4, 21), np.linspace(0, 0.3, 16), [0.0, 1.0])
    plate = quads[nodes[quads, 2].max(axis=1) == 0]
    used, members = np.unique(plate, return_inverse=True)
    made, area = envelope(shells_of(nodes[used], members.reshape(-1, 4), 0.06), face=0.02)
    places, moved_by = corners(made)
    assert sorted(set(np.round(places[:, 2], 6))) == pytest.approx([-0.03, 0.03])
    assert np.bincount(moved_by).tolist() == [2] * len(used)
    assert area == pytest.approx(2 * 0.4 * 0.3)
    assert made.surface.volume == pytest.approx(0.4 * 0.3 * 0.06, rel=0.05)


def test_a_bottom_whose_thickness_reaches_the_plane_is_silent_and_nothing_lies_below():
    nodes, quads = outer_quads(*even([WALL / 2, WALL / 2, 0.004], OUTSIDE - WALL / 2))
    floor = MountingPlane((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    made, area = envelope(shells_of(nodes, quads, WALL), mounting_plane=floor)
    a, b, c = OUTSIDE
    assert corners(made)[0].min() == pytest.approx(0.0, abs=5e-3)
    assert corners(made)[0][:, 2].min() >= -1e-12
    assert area == pytest.approx(a * b + 2 * (a + b) * (c - 0.004), rel=0.03)


def with_rib(nodes, quads, at, height=0.03):
    """A rib on the wall z = top, along y at x nearest to `at`; and its numbers at the foot and above."""
    top = nodes[:, 2].max()
    x = nodes[np.abs(nodes[:, 0] - at).argmin(), 0]
    foot = np.flatnonzero((np.abs(nodes[:, 0] - x) < 1e-9) & (nodes[:, 2] > top - 1e-9))
    foot = foot[np.argsort(nodes[foot, 1])]
    rib = len(nodes) + np.arange(len(foot))
    more = np.column_stack([foot[:-1], foot[1:], rib[1:], rib[:-1]])
    return np.vstack([nodes, nodes[foot] + [0.0, 0.0, height]]), np.vstack([quads, more]), foot, rib


def test_a_rib_on_a_wall_is_as_thick_as_stated_from_its_foot_on():
    nodes, quads, foot, rib = with_rib(*outer_quads(*even([WALL / 2] * 3, OUTSIDE - WALL / 2)), 0.2)
    made, _ = envelope(shells_of(nodes, quads, WALL))
    places, moved_by = corners(made)
    top = OUTSIDE[2] - WALL / 2
    for numbers, height in ((rib, top + 0.03), (foot[1:-1], top + WALL / 2)):
        x, _, z = places[np.isin(moved_by, numbers)].T
        assert np.abs(x - nodes[foot[0], 0]) == pytest.approx(np.full(2 * len(numbers), WALL / 2), abs=2e-4)
        assert z == pytest.approx(np.full(2 * len(numbers), height), abs=2e-4)


def test_a_plate_with_a_rib_in_air_keeps_its_thickness_at_the_foot():
    """Three walls with air on all their sides meet: each of the three airs has corners of its own."""
    nodes, quads = outer_quads(np.linspace(0, 0.4, 21), np.linspace(0, 0.3, 16), [0.0, 1.0])
    plate = quads[nodes[quads, 2].max(axis=1) == 0]
    used, members = np.unique(plate, return_inverse=True)
    nodes, quads, foot, _ = with_rib(nodes[used], members.reshape(-1, 4), 0.2, 0.06)
    made, _ = envelope(shells_of(nodes, quads, 0.04), face=0.02)
    places, moved_by = corners(made)
    x, _, z = places[np.isin(moved_by, foot[1:-1])].T
    assert z == pytest.approx(np.where(np.abs(x - nodes[foot[0], 0]) > 1e-3, 0.02, -0.02), abs=5e-4)
    assert (z < 0).sum() == len(foot) - 2


def test_a_neck_that_its_walls_close_leaves_nothing_inside_in_the_air():
    """Box with a tube of 40 mm between middle surfaces: with walls of 20 mm a way in remains, with 36 mm none."""
    x, y, z = np.linspace(0, 0.2, 11), np.linspace(0, 0.2, 11), np.linspace(0, 0.12, 7)
    nodes, quads = outer_quads(x, y, z)
    middle = nodes[quads].mean(axis=1)
    hole = (middle[:, 2] > 0.119) & (np.abs(middle[:, :2] - 0.1) < 0.02).all(axis=1)
    tube_nodes, tube = outer_quads([0.08, 0.1, 0.12], [0.08, 0.1, 0.12], [0.12, 0.14, 0.16, 0.18])
    tube = tube[np.abs(np.ptp(tube_nodes[tube][:, :, 2], axis=1)) > 0]
    every = np.vstack([nodes, tube_nodes])
    _, first, same = np.unique(np.round(every, 9), axis=0, return_index=True, return_inverse=True)
    joined = same.ravel()[np.vstack([quads[~hole], tube + len(nodes)])]
    made, area = envelope(shells_of(every[first], joined, 0.02), opening=0.024)
    assert made.exposed.all()
    assert made.surface.volume == pytest.approx(0.02 * (2 * 0.2 * 0.2 + 4 * 0.2 * 0.12 + 4 * 0.04 * 0.06), rel=0.1)
    made, area = envelope(shells_of(every[first], joined, 0.036), opening=0.024)
    a, b = 0.236, 0.076  # outside of box and tube
    assert area == pytest.approx(2 * a * a + 4 * a * 0.156 + 4 * b * 0.042 - b * b, rel=0.01)
    assert made.surface.volume == pytest.approx(a * a * 0.156 + b * b * 0.042, rel=0.02)


HOUSING, THIN = np.array([0.2, 0.16, 0.1]), 0.005


def held_and_loaded(nodes, on):
    """Three held patches below and two seats above: rigid sets of the nodes near their centres."""
    sets = []
    for name, x, y, z, radius in [
        *((f"bolt{i}", x, y, 0.0, 0.016) for i, (x, y) in enumerate([(0.025, 0.02), (0.175, 0.02), (0.1, 0.14)])),
        ("A", 0.06, 0.08, HOUSING[2], 0.022),
        ("B", 0.14, 0.08, HOUSING[2], 0.022),
    ]:
        near = (np.hypot(nodes[:, 0] - x, nodes[:, 1] - y) < radius) & (np.abs(nodes[:, 2] - z) < on)
        place = np.array([x, y, z + (THIN / 2 if z == 0 else -THIN / 2)])
        sets.append(RigidSet(name, place, np.flatnonzero(near), held=np.full(6, name.startswith("bolt"))))
    return sets[:-2], sets[-2:]


def powers(model, seats, lines):
    faces = RadiatingFaces(0.022)
    made = reduce_model(model, seats, f_max=3000.0, faces=faces, modal_damping=0.02, fidelity=DRAFT.housing)
    load = np.eye(3 * len(made.names), dtype=complex)
    flux = (2j * np.pi * f * face_displacement(made, np.full(len(load), f), load) * made.surface.areas for f in lines)
    return np.array([source_power(q.T, made.surface.centroids, f).sum() for q, f in zip(flux, lines, strict=True)])


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*linear elements raised to quadratic")
def test_a_closed_box_of_shells_sounds_as_one_of_solids():
    """Forces of equal strength in every direction at both seats and at all lines, A-weighted power to 3 kHz.

    Natural frequencies are those of longer spans, by 2 to 5 %: single lines near a resonance differ by decibels.
    """
    lines = np.arange(200.0, 3000.0, 20.0)
    inner = [np.linspace(THIN, side - THIN, n) for side, n in zip(HOUSING, (25, 21, 13), strict=True)]
    nodes, bricks = bricks_on([[0.0, *of, side] for of, side in zip(inner, HOUSING, strict=True)])
    cell = np.stack(np.unravel_index(np.arange(len(bricks)), [len(of) + 1 for of in inner]), axis=1)
    walls = bricks[((cell == 0) | (cell == [len(of) for of in inner])).any(axis=1)]
    used, members = np.unique(walls, return_inverse=True)
    held, seats = held_and_loaded(nodes[used], 1.01 * THIN)
    block = ElementBlock("hex8", members.reshape(-1, 8), STEEL, np.arange(1, len(walls) + 1), "WALL")
    free = np.zeros((len(used), 3), dtype=bool)
    solid = powers(SolidModel(nodes[used], np.arange(1, len(used) + 1), (block,), tuple(held), free), seats, lines)
    middle = [[THIN / 2, *of[1:-1], side - THIN / 2] for of, side in zip(inner, HOUSING, strict=True)]
    nodes, quads = outer_quads(*middle)
    held, seats = held_and_loaded(nodes, 0.51 * THIN)
    shell = powers(shells_of(nodes, quads, THIN, rigid=held), seats, lines)
    weight = 10 ** (a_weighting(lines) / 10)
    assert 10 * np.log10((shell @ weight) / (solid @ weight)) == pytest.approx(0.0, abs=0.25)
