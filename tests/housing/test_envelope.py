"""Outer envelope of foreign meshes and the power that the mapping onto it keeps."""

import re
from dataclasses import replace

import numpy as np
import pytest

from nvhchain.conventions import STEEL, Air
from nvhchain.errors import InputError
from nvhchain.fem.modal_model import ModalModel
from nvhchain.fem.solid_model import ElementBlock, SolidModel
from nvhchain.handoff import Surface
from nvhchain.housing.imported.modal_results import modal_skin
from nvhchain.housing.imported.repair import raised, sound_mesh
from nvhchain.housing.modes.mounting_plane import MountingPlane
from nvhchain.housing.skin.envelope import RadiatingFaces, outer_envelope
from nvhchain.housing.skin.mapping_error import facet_flux, gathered, mapping_error, source_power
from nvhchain.housing.skin.normal_motion import normal_motion
from nvhchain.housing.skin.skin import solid_skin
from nvhchain.testing.elements import grid, held_box

SIZE = (0.4, 0.3, 0.2)
CELLS = (20, 15, 10)
WALL = 0.02


def hollow(hole=None, bottom=True):
    """Box with walls of one cell, 20 mm; `hole`: cells (i, j) of the top wall excluded; no bottom: open below."""
    nodes, bricks = grid(CELLS, SIZE)
    i, j, k = np.indices(CELLS).reshape(3, -1)
    wall = (i == 0) | (i == 19) | (j == 0) | (j == 14) | (k == 9) | ((k == 0) & bottom)
    if hole:
        wall &= ~((k == 9) & np.isin(i, hole[0]) & np.isin(j, hole[1]))
    used, members = np.unique(bricks[wall], return_inverse=True)
    block = ElementBlock("hex8", members.reshape(-1, 8), STEEL, np.arange(1, wall.sum() + 1), "BOX")
    held = np.zeros((len(used), 3), dtype=bool)
    model = SolidModel(nodes[used], np.arange(1, len(used) + 1), (block,), (), held, {}, "hollow box")
    return solid_skin(sound_mesh(model)[0])


def envelope(skin, face=0.025, **options):
    shells = options.pop("shells", None)
    return outer_envelope(skin, [], RadiatingFaces(face, **options), voxels_per_face=5, shells=shells)


def area(skin, chosen):
    corners = skin.nodes[skin.facets[chosen, :3]]
    return np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2


OUTSIDE = 2 * (0.4 * 0.3 + 0.4 * 0.2 + 0.3 * 0.2)


def test_solid_box_has_its_own_volume_and_faces_of_the_size_asked_for():
    skin = solid_skin(sound_mesh(held_box("hex8", counts=(8, 6, 4), lengths=SIZE))[0])
    made = envelope(skin)
    assert made.exposed.all()
    assert "cavity" not in made.notes[0]
    assert made.surface.volume == pytest.approx(0.4 * 0.3 * 0.2, rel=0.03)
    assert made.surface.areas.sum() == pytest.approx(OUTSIDE, rel=0.08)  # edges are rounded over about a face
    corners = made.surface.vertices[made.surface.triangles]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    assert edges.mean() == pytest.approx(0.025, rel=0.1)
    assert (edges.max(axis=1) ** 2 / made.surface.areas).max() < 20


def test_cavity_is_closed_off_and_its_walls_do_not_radiate():
    made = envelope(skin := hollow())
    assert made.surface.volume == pytest.approx(0.4 * 0.3 * 0.2, rel=0.03)
    assert area(skin, made.exposed) == pytest.approx(OUTSIDE, rel=1e-9)
    told = re.search(r"with (\S+) litres of cavity closed off", made.notes[0])
    assert float(told[1]) == pytest.approx(0.36 * 0.26 * 0.16 * 1e3, rel=0.1)


def test_closed_shells_tell_of_their_cavity_and_solids_do_not():
    """The same closed skin, once of solids and once of mid-surface shells, behind which there is air."""
    solid = solid_skin(sound_mesh(held_box("hex8", counts=(8, 6, 4), lengths=SIZE))[0])
    model = ModalModel(
        nodes=solid.nodes,
        labels=np.arange(len(solid.nodes)),
        triangles=solid.facets,
        two_sided=False,
        frequency=np.array([100.0]),
        damping=np.array([0.01]),
        shapes=np.ones((1, *solid.nodes.shape)),
    )
    assert "cavity" not in envelope(modal_skin(model)[0]).notes[0]
    made = envelope(modal_skin(replace(model, two_sided=True))[0])
    told = re.search(r"with (\S+) litres of cavity closed off", made.notes[0])
    assert float(told[1]) == pytest.approx(0.4 * 0.3 * 0.2 * 1e3, rel=0.1)
    assert made.exposed.all()


def test_small_hole_is_capped_and_a_large_one_is_not():
    skin = hollow(hole=([9, 10], [7, 8]))  # 40 × 40 mm
    capped = envelope(skin, opening=0.08)
    assert area(skin, capped.exposed) == pytest.approx(OUTSIDE, rel=0.03)
    assert capped.surface.volume == pytest.approx(0.4 * 0.3 * 0.2, rel=0.03)
    opened = envelope(skin, opening=0.02)
    inner = 2 * (0.36 * 0.26 + 0.36 * 0.16 + 0.26 * 0.16)
    assert area(skin, opened.exposed) == pytest.approx(OUTSIDE + inner, rel=0.03)


@pytest.mark.parametrize("opening", [0.16, 0.2])
def test_cavity_narrower_than_the_widest_admitted_hole_does_not_leak(opening):
    """No ball of that size fits into it, 160 mm wide, but smaller ones that do not pass its hole of 40 mm do."""
    made = envelope(skin := hollow(hole=([9, 10], [7, 8])), opening=opening)
    assert area(skin, made.exposed) == pytest.approx(OUTSIDE, rel=1e-6)
    assert made.surface.volume == pytest.approx(0.4 * 0.3 * 0.2, rel=0.03)
    note = re.search(
        r"opening = (\S+) mm is wider than a cavity of (\S+) litres.*narrower than (\S+) mm", made.notes[1]
    )
    assert float(note[1]) == pytest.approx(1e3 * opening)
    assert float(note[2]) == pytest.approx(0.36 * 0.26 * 0.16 * 1e3, rel=0.1)
    assert 40 < float(note[3]) < 160


def test_sheet_that_closes_a_case_of_solids_radiates_on_its_outside_alone():
    case = hollow(bottom=False)
    x, y = np.linspace(0.02, 0.38, 19), np.linspace(0.02, 0.28, 14)
    lid = np.stack([*np.meshgrid(x, y, indexing="ij"), np.zeros((19, 14))], axis=-1).reshape(-1, 3)
    i, j = (a.ravel() for a in np.indices((18, 13)))
    corner = len(case.nodes) + 14 * i + j
    sheet = np.concatenate(
        [np.column_stack([corner, corner + 14, corner + 15]), np.column_stack([corner, corner + 15, corner + 1])]
    )
    nodes = np.vstack([case.nodes, lid])
    triangles = np.concatenate([case.facets, np.hstack([sheet, np.full((len(sheet), 3), -1)])])
    model = ModalModel(
        nodes=nodes,
        labels=np.arange(len(nodes)),
        triangles=triangles,
        two_sided=np.arange(len(triangles)) >= len(case.facets),
        frequency=np.array([100.0]),
        damping=np.array([0.01]),
        shapes=np.ones((1, len(nodes), 3)),
    )
    skin, shells, _ = modal_skin(model)
    made = envelope(skin, shells=shells)
    assert area(skin, made.exposed) == pytest.approx(OUTSIDE, rel=1e-6)
    assert made.surface.volume == pytest.approx(0.4 * 0.3 * 0.2, rel=0.03)
    assert area(case, envelope(case, opening=0.15).exposed) > 1.4 * OUTSIDE  # without it the inside, too


def test_opening_wider_than_the_body_is_refused():
    with pytest.raises(InputError, match="opening = 5000 mm is wider than the whole body, 400 mm"):
        envelope(hollow(), opening=5.0)


def test_walls_of_a_millimetre_are_closed():
    skin = hollow()
    nodes = skin.nodes.copy()
    for axis, length in enumerate(SIZE):  # the inner skin 1 mm from the outer one
        nodes[np.isclose(nodes[:, axis], WALL), axis] = 0.001
        nodes[np.isclose(nodes[:, axis], length - WALL), axis] = length - 0.001
        for end in (0.0, length):
            half = np.isclose(nodes[:, axis], abs(end - WALL / 2))
            nodes[half, axis] = abs(end - 0.0005)
    made = envelope(replace(skin, nodes=nodes))
    assert area(replace(skin, nodes=nodes), made.exposed) == pytest.approx(OUTSIDE, rel=1e-6)
    assert made.surface.volume == pytest.approx(0.4 * 0.3 * 0.2, rel=0.05)


def test_recess_as_wide_as_its_mouth_stays_open():
    made = envelope(skin := hollow(bottom=False), opening=0.15)
    inner = 0.36 * 0.26 + 2 * (0.36 * 0.18 + 0.26 * 0.18)
    rim = 0.4 * 0.3 - 0.36 * 0.26
    assert area(skin, made.exposed) == pytest.approx(OUTSIDE - 0.4 * 0.3 + rim + inner, rel=0.02)


def test_surface_that_lost_the_body_or_has_another_unit_is_refused():
    """A plate of 4 mm with a cube of 40 mm on it: of the plate nothing is left in faces of 25 mm."""
    nodes, bricks = grid((40, 30, 11), (0.4, 0.3, 0.044))
    i, j, k = np.indices((40, 30, 11)).reshape(3, -1)
    used, members = np.unique(bricks[(k == 0) | ((i < 4) & (j < 4))], return_inverse=True)
    block = ElementBlock("hex8", members.reshape(-1, 8), STEEL, np.arange(1, len(members.reshape(-1, 8)) + 1))
    held = np.zeros((len(used), 3), dtype=bool)
    model = SolidModel(nodes[used], np.arange(1, len(used) + 1), (block,), (), held, {}, "plate with a cube")
    with pytest.raises(
        InputError, match=r"encloses 0\.0\d+ litres, the body with its cavities 0\.\d+: use smaller faces"
    ):
        envelope(solid_skin(sound_mesh(model)[0]))
    skin = hollow()
    own = envelope(skin).surface
    with pytest.raises(InputError, match="check the units of a surface that is given"):
        envelope(skin, surface=Surface(1e3 * own.vertices, own.triangles))


def test_mounting_plane_closes_the_open_side_and_is_silent():
    skin = hollow(bottom=False)
    made = envelope(skin, mounting_plane=MountingPlane((0.0, 0.0, 0.0), (0.0, 0.0, -1.0)))
    assert area(skin, made.exposed) == pytest.approx(OUTSIDE - 0.4 * 0.3, rel=1e-9)
    assert made.surface.areas[made.silent].sum() == pytest.approx(0.4 * 0.3, rel=0.03)
    assert np.abs(made.surface.vertices[made.surface.triangles[made.silent], 2]).max() < 1e-12
    assert made.surface.volume == pytest.approx(0.4 * 0.3 * 0.2, rel=0.03)


def test_mounting_plane_may_lie_anyhow():
    skin = hollow(bottom=False)
    turn = np.linalg.qr(np.random.default_rng(4).standard_normal((3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    moved = replace(skin, nodes=skin.nodes @ turn.T + [1.0, -2.0, 0.5])
    made = envelope(moved, mounting_plane=MountingPlane((1.0, -2.0, 0.5), tuple(turn @ [0.0, 0.0, -1.0])))
    assert made.surface.volume == pytest.approx(0.4 * 0.3 * 0.2, rel=0.03)
    assert area(moved, made.exposed) == pytest.approx(OUTSIDE - 0.4 * 0.3, rel=1e-9)


def test_gap_between_two_halves_does_not_let_the_outside_in():
    """A joint all round, 3 mm wide, through which inside and outside are connected."""
    nodes, bricks = grid(CELLS, SIZE)
    i, j, k = np.indices(CELLS).reshape(3, -1)
    wall = (i == 0) | (i == 19) | (j == 0) | (j == 14) | (k == 9) | (k == 0)
    members = bricks[wall] + len(nodes) * (i[wall] >= 10)[:, None]
    used, members = np.unique(members, return_inverse=True)
    both = np.vstack([nodes, nodes + np.array([0.003, 0.0, 0.0])])[used]
    block = ElementBlock("hex8", members.reshape(-1, 8), STEEL, np.arange(1, wall.sum() + 1))
    model = SolidModel(both, np.arange(1, len(used) + 1), (block,), (), np.zeros(both.shape, dtype=bool), {}, "halves")
    skin = solid_skin(raised(model))
    made = envelope(skin)
    assert made.surface.volume == pytest.approx(0.4 * 0.3 * 0.2, rel=0.03)
    assert area(skin, made.exposed) == pytest.approx(OUTSIDE, rel=0.08)  # with the flanks of the joint


@pytest.mark.slow
def test_bodies_apart_have_an_envelope_each_and_keep_their_own_motion():
    """Two boxes that a rigid set joins across a gap wider than a face; a crumb of one is none."""
    one = held_box("hex8", counts=(8, 6, 4), lengths=SIZE, held=False)
    places = [np.zeros(3), [0.5, 0.0, 0.0], [0.0, 0.4, 0.0]]
    scale = [1.0, 0.5, 0.15]  # the last is 60 mm long: less than three faces
    nodes = np.vstack([at + size * one.nodes for at, size in zip(places, scale, strict=True)])
    count = len(one.nodes)
    bricks = np.vstack([one.blocks[0].nodes + count * i for i in range(3)])
    block = replace(one.blocks[0], nodes=bricks, labels=np.arange(1, len(bricks) + 1))
    held = np.zeros(nodes.shape, dtype=bool)
    skin = solid_skin(raised(SolidModel(nodes, np.arange(1, len(nodes) + 1), (block,), (), held, {}, "three boxes")))
    made = envelope(skin)
    assert "around 2 bodies" in made.notes[0]
    assert made.surface.volume == pytest.approx(0.024 * (1 + 1 / 8), rel=0.03)
    motion = normal_motion(skin.nodes, skin.facets, made.surface, made.silent, 6.0)
    second = skin.nodes[:, 0] > 0.45
    moved = motion @ np.repeat(second, 3).astype(float)
    assert not moved[made.surface.centroids[:, 0] < 0.45].any()


def test_body_thinner_than_a_face_is_refused():
    skin = solid_skin(sound_mesh(held_box("hex8", counts=(8, 6, 1), lengths=(0.4, 0.3, 0.004)))[0])
    with pytest.raises(InputError, match="thinner than a radiating face of 25 mm"):
        envelope(skin)


@pytest.mark.slow
def test_volume_velocity_of_any_motion_is_kept():
    skin = hollow(hole=([9, 10], [7, 8]))
    made = envelope(skin, opening=0.08)
    facets = skin.facets[made.exposed]
    motion = normal_motion(skin.nodes, facets, made.surface, made.silent, 6.0)
    u = np.random.default_rng(3).standard_normal(skin.nodes.size)
    flux = facet_flux(skin.nodes, facets) @ u
    assert made.surface.areas @ (motion @ u) == pytest.approx(flux.sum(), abs=1e-12 * np.abs(flux).sum())


def test_power_of_small_sources_is_that_of_monopoles():
    air = Air()
    single = source_power(np.array([[2e-3 + 0j]]), np.zeros((1, 3)), 800.0)
    k = 2 * np.pi * 800.0 / air.speed_of_sound
    exact = air.impedance * k**2 * (2e-3) ** 2 / (8 * np.pi)
    assert single[0] == pytest.approx(exact, rel=1e-12)
    pair = source_power(np.array([[2e-3], [-2e-3]], dtype=complex), np.array([[0, 0, 0], [0.1, 0.2, 0.0]]), 800.0)
    distance = k * np.hypot(0.1, 0.2)
    assert pair[0] == pytest.approx(2 * exact * (1 - np.sin(distance) / distance), rel=1e-9)


@pytest.mark.parametrize("frequency", [300.0, 1500.0])
def test_mapped_power_of_a_bending_box_is_that_of_its_skin(frequency):
    skin = hollow()
    made = envelope(skin)
    facets = skin.facets[made.exposed]
    motion = normal_motion(skin.nodes, facets, made.surface, made.silent, 6.0)
    places, gather = gathered(skin.nodes[facets[:, :3]].mean(axis=1), 0.006)
    x, y, z = skin.nodes.T
    fields = [np.zeros_like(skin.nodes) for _ in range(2)]
    fields[0][:, 2] = np.sin(np.pi * x / 0.4) * np.sin(np.pi * y / 0.3) * (z > 0.1)
    fields[1][:, 0] = np.cos(np.pi * z / 0.2)
    for u in (field.ravel() for field in fields):
        flux = (gather @ (facet_flux(skin.nodes, facets) @ u)).astype(complex)[:, None]
        faces = (motion @ u).astype(complex)[:, None]
        assert abs(mapping_error(flux, places, faces, made.surface, frequency)) < 0.3
