"""Modes through universal files and HDF5 and back: a reduced housing, groups, units, parabolic elements."""

from dataclasses import replace

import numpy as np
import pytest

from nvhchain.errors import FileFormatError, InputError
from nvhchain.fem.faces import boundary_faces
from nvhchain.fem.solid_model import CORNERS
from nvhchain.handoff import HousingAccuracy
from nvhchain.housing import MountingPlane, RadiatingFaces, exported_modes, housing_from_modes
from nvhchain.housing.imported.modal_results import modal_skin
from nvhchain.housing.imported.repair import sound_mesh
from nvhchain.interop import read_modal_hdf5, read_modal_uff, write_modal_hdf5, write_modal_uff
from nvhchain.interop.notation.surface_motion import vertex_motion
from nvhchain.testing.elements import held_box

ENGINE = MountingPlane((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
F_MAX = 4000.0


@pytest.fixture(scope="module")
def exported(reduced):
    return exported_modes(reduced)


def by_uff(model, folder, **options):
    return read_modal_uff(write_modal_uff(model, folder / "modes.unv", **options))


def by_hdf5(model, folder):
    return read_modal_hdf5(write_modal_hdf5(model, folder / "modes.h5"))


@pytest.mark.parametrize(("through", "digits"), [(by_uff, 1e-5), (by_hdf5, 1e-9)])
def test_reduced_housing_comes_back_from_a_file(through, digits, exported, reduced, fidelity, tmp_path):
    """Modes, residual flexibility and faces, on the same surface, to the digits of the format."""
    found = housing_from_modes(
        through(exported, tmp_path),
        dict(zip(reduced.names, reduced.positions, strict=True)),
        f_max=F_MAX,
        faces=RadiatingFaces(0.022, mounting_plane=ENGINE, surface=reduced.surface),
        fidelity=fidelity,
        residual_vectors=True,
    )
    for name in (
        "natural_frequency", "modal_damping", "seat_shapes", "normal_shapes", "seat_residual", "face_residual",
    ):  # fmt: skip
        own, back = getattr(reduced, name), getattr(found, name)
        assert back.shape == own.shape
        assert np.abs(back - own).max() < digits * np.abs(own).max(), name
    assert found.ritz_vectors == reduced.ritz_vectors


def test_a_housing_of_flexibility_alone_is_written_without_damping(reduced):
    still = reduced.drop_ritz_vectors()
    none = {name: getattr(still, name)[:0] for name in ("natural_frequency", "modal_damping", "seat_shapes")}
    still = still.replace(**none, normal_shapes=still.normal_shapes[:0], accuracy=HousingAccuracy())
    model = exported_modes(still)
    assert (model.damping == 0).all()
    share = (
        model.shapes[:, -len(reduced.names) :].reshape(len(model.frequency), -1)
        / (2 * np.pi * model.frequency)[:, None]
    )
    assert (
        np.abs(share.T @ share - still.seat_residual.reshape(share.shape[1], -1)).max()
        < 1e-9 * still.seat_residual.max()
    )


def test_vertices_of_a_housing_that_moves_rigidly_keep_its_motion(reduced):
    """Across edges too, where the mean of the faces around them, which turns the motion, is off by a third."""
    motion = np.array([0.3, -0.5, 0.8])
    rigid = replace(
        reduced,
        natural_frequency=np.zeros(1),
        modal_damping=np.zeros(1),
        seat_shapes=np.tile(motion, (1, len(reduced.names), 1)),
        normal_shapes=(reduced.surface.normals @ motion)[None],
        seat_residual=np.zeros_like(reduced.seat_residual),
        face_residual=np.zeros_like(reduced.face_residual),
        ritz_vectors=None,
        accuracy=HousingAccuracy(),
    )
    model = exported_modes(rigid)
    assert len(model.frequency) == 1
    vertices = model.shapes[0, : len(reduced.surface.vertices)]
    weight, exact = reduced.surface.areas, rigid.normal_shapes[0]

    def missed(vectors):
        found = np.einsum("fci,fi->f", vectors[reduced.surface.triangles], reduced.surface.normals) / 3
        return np.sqrt((found - exact) ** 2 @ weight / (exact**2 @ weight))

    assert missed(vertices) < 0.06 < 0.2 < missed(vertex_motion(reduced.surface, exact))


def test_housing_without_modes_and_residual_is_not_written(reduced):
    nothing = replace(
        reduced,
        natural_frequency=np.zeros(0),
        modal_damping=np.zeros(0),
        seat_shapes=reduced.seat_shapes[:0],
        normal_shapes=reduced.normal_shapes[:0],
        seat_residual=np.zeros_like(reduced.seat_residual),
        face_residual=np.zeros_like(reduced.face_residual),
        ritz_vectors=None,
        accuracy=HousingAccuracy(),
    )
    with pytest.raises(InputError, match="neither modes nor residual flexibility"):
        exported_modes(nothing)


@pytest.mark.parametrize("units", ["m-kg-s", "mm-t-s", "in-lbf-s"])
def test_units_and_groups_survive_a_universal_file(exported, units, tmp_path):
    model = replace(exported, groups={**exported.groups, "rear wall": np.array([4, 2, 9])})
    back = by_uff(model, tmp_path, units=units)
    assert np.abs(back.nodes - model.nodes).max() < 1e-14
    assert np.abs(back.shapes - model.shapes).max() < 6e-6 * np.abs(model.shapes).max()
    assert {name: members.tolist() for name, members in back.groups.items()} == {
        "seats": model.groups["seats"].tolist(),
        "rear wall": [2, 4, 9],
    }
    assert {name: m.tolist() for name, m in by_hdf5(model, tmp_path).groups.items()} == {
        name: m.tolist() for name, m in model.groups.items()
    }


def test_unit_systems_without_seconds_do_not_fit_into_dataset_164(exported, tmp_path):
    with pytest.raises(InputError, match="dataset 164 is in seconds, mm-kg-ms is not"):
        write_modal_uff(exported, tmp_path / "modes.unv", units="mm-kg-ms")


LAYERS = {  # as the manual numbers them: round the lower layer, middles between, round the upper layer
    "tet4": (118, [0, 4, 1, 5, 2, 6, 7, 8, 9, 3]),
    "wedge6": (113, [0, 6, 1, 7, 2, 8, 12, 13, 14, 3, 9, 4, 10, 5, 11]),
    "hex8": (116, [0, 8, 1, 9, 2, 10, 3, 11, 16, 17, 18, 19, 4, 12, 5, 13, 6, 14, 7, 15]),
}


def universal_file(path, kind, moving=None, group=""):
    """A box of parabolic solids, one mode of which the displacement is the place; labels ten times the row and one."""
    model = sound_mesh(held_box(kind, counts=(2, 2, 1), lengths=(0.3, 0.2, 0.1)))[0]
    descriptor, order = LAYERS[kind]
    lines = ["    -1", "  2411"]
    for row, (x, y, z) in enumerate(model.nodes):
        lines += [f"{10 * row + 1:10d}{0:10d}{0:10d}{11:10d}", f"{x:25.16E}{y:25.16E}{z:25.16E}"]
    lines += ["    -1", "    -1", "  2412"]
    for number, element in enumerate(model.blocks[0].nodes[:, order], start=1):
        lines.append(f"{number:10d}{descriptor:10d}{1:10d}{1:10d}{7:10d}{len(order):10d}")
        labels = [f"{10 * node + 1:10d}" for node in element]
        lines += ["".join(labels[i : i + 8]) for i in range(0, len(labels), 8)]
    lines += ["    -1", "    -1", "    55", *["NONE"] * 5]
    lines += [
        "         1         2         2         8         2         3",
        "         2         4         1         1",
    ]
    lines.append("  1.00000E+02  1.00000E+00  1.00000E-02  0.00000E+00")
    for row in range(len(model.nodes)) if moving is None else moving(model):
        lines += [f"{10 * row + 1:10d}", "".join(f"{value:13.5E}" for value in model.nodes[row])]
    path.write_text("\n".join([*lines, "    -1", *group.splitlines(), ""]))
    return model


def measured(model):
    """Area and volume that the triangles enclose."""
    a, b, c = (model.nodes[model.triangles[:, i]] for i in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2, np.einsum("ij,ij->", a, np.cross(b, c)) / 6


def corners_of(solid):
    """Nodes at the corners of the elements."""
    return np.unique(solid.blocks[0].nodes[:, : CORNERS[solid.blocks[0].shape]])


@pytest.mark.parametrize("kind", list(LAYERS))
def test_parabolic_solids_keep_the_middles_of_their_edges(kind, tmp_path):
    solid = universal_file(tmp_path / "box.unv", kind)
    model = read_modal_uff(tmp_path / "box.unv")
    assert measured(model) == pytest.approx((0.22, 0.006), rel=1e-12)
    outside = (np.isclose(solid.nodes, 0.0) | np.isclose(solid.nodes, [0.3, 0.2, 0.1])).any(axis=1)
    assert set(np.unique(model.triangles[:, :3])) == set(np.flatnonzero(outside)) & set(corners_of(solid))
    own = model.triangles[:, 3:]
    assert set(own[own < len(solid.nodes)]) == set(np.flatnonzero(outside)) - set(corners_of(solid))
    ends = model.nodes[model.triangles[:, [[0, 1], [1, 2], [2, 0]]]]
    assert model.nodes[own] == pytest.approx(ends.mean(axis=2))
    assert model.shapes[0] == pytest.approx(model.nodes, abs=2e-6)  # the displacement is the place


def test_parabolic_elements_without_displacements_at_their_middles_are_cut_at_the_corners(tmp_path):
    corners = universal_file(tmp_path / "box.unv", "hex8", corners_of)
    model = read_modal_uff(tmp_path / "box.unv")
    assert set(np.unique(model.triangles)) <= {-1, *corners_of(corners)}
    assert measured(model) == pytest.approx((0.22, 0.006), rel=1e-12)


def test_empty_blocks_of_universal_files_are_passed_over(tmp_path):
    universal_file(tmp_path / "box.unv", "hex8")
    text = (tmp_path / "box.unv").read_text()
    (tmp_path / "more.unv").write_text("    -1\n    -1\n    -1\n\n    -1\n" + text)
    own, more = (read_modal_uff(tmp_path / name) for name in ("box.unv", "more.unv"))
    assert np.array_equal(own.shapes, more.shapes)


PLATE = """\
    -1
  2411
{nodes}    -1
    -1
  2412
         1        95         1         1         7         8
         1         2         3         4         5         6         7         8
         2        92         1         1         7         6
         3         9        10        11         5         4
    -1
"""


def test_parabolic_shells_keep_the_middles_of_their_edges(tmp_path):
    """A square of eight nodes and a triangle of six beside it."""
    places = [(0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2), (0, 1), (3, 0), (4, 0), (3, 1)]
    nodes = "".join(
        f"{i:10d}{0:10d}{0:10d}{11:10d}\n{x:25.16E}{y:25.16E}{0.0:25.16E}\n" for i, (x, y) in enumerate(places, 1)
    )
    mode = ["    -1", "    55", *["NONE"] * 5]
    mode += ["         1         2         2         8         2         3", "         2         4         1         1"]
    mode.append("  1.00000E+02  1.00000E+00  1.00000E-02  0.00000E+00")
    mode += [line for i in range(1, 12) for line in (f"{i:10d}", f"{0.0:13.5E}{0.0:13.5E}{1.0:13.5E}")]
    (tmp_path / "plate.unv").write_text(PLATE.format(nodes=nodes) + "\n".join([*mode, "    -1", ""]))
    model = read_modal_uff(tmp_path / "plate.unv")
    assert model.two_sided.all()
    assert len(model.triangles) == 2 + 1
    assert measured(model)[0] == pytest.approx(6.0)
    assert np.unique(model.triangles).tolist() == list(range(12))
    assert model.nodes[11] == pytest.approx([1.0, 1.0, 0.0])


GROUP = """\
    -1
  2452
         3         0         0         0         0         0         0         3
END OF THE BOX
         7         1         0         0         7        11         0         0
         8         1         0         0
    -1
"""


def test_groups_hold_nodes_and_the_nodes_of_elements(tmp_path):
    solid = universal_file(tmp_path / "box.unv", "tet4", group=GROUP)
    model = read_modal_uff(tmp_path / "box.unv")
    assert set(model.groups["END OF THE BOX"]) == {0, 1, *solid.blocks[0].nodes[0]}
    universal_file(tmp_path / "box.unv", "tet4", group=GROUP.replace("         8         1", "         8       999"))
    with pytest.raises(FileFormatError, match="group END OF THE BOX: element 999 is not defined"):
        read_modal_uff(tmp_path / "box.unv")


def test_labels_beyond_63_bits_are_refused(tmp_path):
    path = tmp_path / "box.unv"
    universal_file(path, "tet4")
    path.write_text(path.read_text().replace("        1 ", f" {2**63} ", 1))
    with pytest.raises(FileFormatError, match="label 9223372036854775808 has more than 63 bits"):
        read_modal_uff(path)


def shells_on_top(solid, height=0.1):
    """Elements 1000 … of linear quadrilaterals on the top of the upper bricks, cut at the height of the nodes."""
    upper = [element for element in solid.blocks[0].nodes[:, 4:8] if (solid.nodes[element, 2] == height).all()]
    return [
        f"{1000 + i:10d}{94:10d}{1:10d}{1:10d}{7:10d}{4:10d}\n" + "".join(f"{10 * node + 1:10d}" for node in element)
        for i, element in enumerate(upper)
    ]


def with_elements(path, lines):
    text = path.read_text()
    end = text.index("    -1\n    -1\n    55")
    path.write_text(text[:end] + "".join(f"{line}\n" for line in lines) + text[end:])


def test_shells_on_part_of_the_solids_skin_leave_the_whole_skin_and_are_told(tmp_path):
    path = tmp_path / "box.unv"
    solid = universal_file(path, "hex8")
    shells = shells_on_top(solid)
    assert len(shells) == 4
    with_elements(path, shells)
    model = read_modal_uff(path)
    assert not model.two_sided.any()
    assert measured(model) == pytest.approx((0.22, 0.006), rel=1e-12)
    assert model.notes == ("shells cover 27.3 % of the solids' skin: the whole of it is taken",)


def coat(solid, moved):
    """Nodes, elements 2000 … and displacements (the place) of shells of their own nodes on the outside at `moved`."""
    faces = boundary_faces([("hex", solid.blocks[0].nodes)], solid.labels, "box")
    faces = faces[moved(solid.nodes[faces[:, :4]].mean(axis=1))]
    used, rows = np.unique(faces[:, :4], return_inverse=True)
    labels, rows = 5001 + np.arange(len(used)), 5001 + rows.reshape(-1, 4)
    rows[::2] = rows[::2, ::-1]  # every second one looks inward
    points, motion = [], []
    for label, place in zip(labels, solid.nodes[used], strict=True):
        points += [f"{label:10d}{0:10d}{0:10d}{11:10d}", "".join(f"{x:25.16E}" for x in place)]
        motion += [f"{label:10d}", "".join(f"{x:13.5E}" for x in place)]
    elements = [
        f"{2000 + i:10d}{94:10d}{1:10d}{1:10d}{7:10d}{4:10d}\n" + "".join(f"{label:10d}" for label in row)
        for i, row in enumerate(rows)
    ]
    return points, elements, motion


@pytest.mark.parametrize(("height", "share"), [(0.05, "27.3"), (-1.0, "100")])
def test_shells_take_the_place_of_what_they_cover_of_solids_without_displacements(height, share, tmp_path):
    """The top of a box, or all of it: the body stays closed, its inside is no cavity and its skin no sheet."""
    path = tmp_path / "box.unv"
    solid = universal_file(path, "hex8", lambda solid: [int(np.linalg.norm(solid.nodes, axis=1).argmin())])
    points, elements, motion = coat(solid, lambda middle: middle[:, 2] > (0.1 - 1e-9 if height > 0 else height))
    with_elements(path, elements)
    text = path.read_text().replace("    -1\n    -1\n  2412", "\n".join([*points, "    -1\n    -1\n  2412"]))
    path.write_text(text.rstrip()[: -len("    -1")].rstrip() + "\n" + "\n".join([*motion, "    -1", ""]))
    model = read_modal_uff(path)
    assert measured(model) == pytest.approx((0.22, 0.006), rel=1e-12)
    assert not model.two_sided.any()
    assert f"shells cover {share} % of the solids' skin" in model.notes[0]
    assert model.notes[0].endswith(
        f"0 % of it have displacements of their own, {share} % the shells': the shells are taken there"
    )
    coated = np.unique(model.triangles[(model.labels[model.triangles[:, :3]] > 5000).all(axis=1), :3])
    assert model.shapes[0, coated] == pytest.approx(model.nodes[coated], abs=2e-6)


def test_solids_that_move_where_shells_on_the_same_nodes_do_keep_their_skin(tmp_path):
    path = tmp_path / "box.unv"
    solid = universal_file(path, "hex8", lambda solid: np.flatnonzero(solid.nodes[:, 2] == 0.1))
    with_elements(path, shells_on_top(solid))
    model = read_modal_uff(path)
    assert not model.two_sided.any()
    assert measured(model) == pytest.approx((0.22, 0.006), rel=1e-12)
    assert model.notes == (
        "shells cover 27.3 % of the solids' skin; 27.3 % of it have displacements of their own, 27.3 % the "
        "shells': the solids' skin is taken",
        "9 of 18 corners of the skin have no displacements: they stand still",
    )


def test_corner_without_displacements_does_not_leave_the_solids_skin_to_a_small_coat(tmp_path):
    path = tmp_path / "box.unv"
    solid = universal_file(path, "hex8", lambda solid: np.flatnonzero(solid.nodes.any(axis=1)))  # all but the origin
    with_elements(path, shells_on_top(solid))
    model = read_modal_uff(path)
    assert not model.two_sided.any()
    assert measured(model) == pytest.approx((0.22, 0.006), rel=1e-12)
    lost = (0.15 * 0.1 + 0.15 * 0.1 + 0.1 * 0.1) / 0.22  # three faces of the brick at the origin
    assert model.notes == (
        f"shells cover 27.3 % of the solids' skin; {100 * (1 - lost):.3g} % of it have displacements of their own, "
        "27.3 % the shells': the solids' skin is taken",
        "1 of 18 corners of the skin have no displacements: they stand still",
    )


def test_shells_beside_the_skin_of_solids_radiate_from_both_sides_and_coats_once(tmp_path):
    path = tmp_path / "box.unv"
    solid = universal_file(path, "hex8")
    sheet = [10 * int(np.linalg.norm(solid.nodes - at, axis=1).argmin()) + 1 for at in INSIDE]
    wall = f"{999:10d}{94:10d}{1:10d}{1:10d}{7:10d}{4:10d}\n" + "".join(f"{label:10d}" for label in sheet)
    with_elements(path, [wall, *shells_on_top(solid)])
    model = read_modal_uff(path)
    assert model.notes == (
        "shells cover 27.3 % of the solids' skin: the whole of it is taken",
        "1 shells that are not on the skin of the solids radiate from both sides",
    )
    assert model.two_sided.sum() == 2
    assert measured(model)[0] == pytest.approx(0.22 + 0.01, rel=1e-12)
    back = by_hdf5(model, tmp_path)
    assert np.array_equal(back.two_sided, model.two_sided)
    skin, shells, _ = modal_skin(model)
    assert shells.sum() == 4
    assert len(skin.facets) == len(model.triangles) + 2


def test_corners_of_the_skin_without_displacements_are_told(tmp_path):
    path = tmp_path / "box.unv"
    solid = universal_file(path, "hex8", lambda solid: np.flatnonzero(solid.nodes[:, 0] < 0.2))
    corners = corners_of(solid)
    model = read_modal_uff(path)
    still = int((solid.nodes[corners, 0] > 0.2).sum())
    assert model.notes == (f"{still} of {len(corners)} corners of the skin have no displacements: they stand still",)
    universal_file(
        path, "hex8", lambda solid: np.flatnonzero((np.abs(solid.nodes - [0.15, 0.1, 0.05]) < 0.01).all(axis=1))
    )
    with pytest.raises(InputError, match="no node of the skin has displacements in every mode"):
        read_modal_uff(path)


def test_element_with_another_number_of_nodes_than_its_type_has_is_refused(tmp_path):
    path = tmp_path / "box.unv"
    universal_file(path, "tet4")
    path.write_text(
        path.read_text().replace(
            "       118         1         1         7        10",
            "       116         1         1         7        10",
            1,
        )
    )
    with pytest.raises(FileFormatError, match="an element of type 116 has 10 nodes, not 20"):
        read_modal_uff(path)


INSIDE = np.array([[0.15, 0, 0], [0.15, 0.1, 0], [0.15, 0.1, 0.1], [0.15, 0, 0.1]])


def test_solids_that_overlap_are_refused():
    rows = np.hstack([[[0, 1, 2, 3], [0, 2, 1, 4], [0, 2, 1, 5]], np.full((3, 6), -1)])
    match = r"box: 1 face shared by more than two elements, first at nodes \[ 0 10 20\]: elements overlap"
    with pytest.raises(InputError, match=match):
        boundary_faces([("tet", rows)], 10 * np.arange(6), "box")


def test_solids_given_twice_count_once(tmp_path):
    path = tmp_path / "box.unv"
    universal_file(path, "tet4")
    text = path.read_text()
    first = text[text.index("         1       118") : text.index("         2       118")]
    with_elements(path, [first.replace("         1       118", "      1001       118", 1).rstrip("\n")])
    model = read_modal_uff(path)
    assert measured(model) == pytest.approx((0.22, 0.006), rel=1e-12)
    assert model.notes == ("1 solids on the nodes of others excluded",)


def test_element_given_twice_is_refused(tmp_path):
    universal_file(tmp_path / "box.unv", "tet4")
    text = (tmp_path / "box.unv").read_text()
    (tmp_path / "box.unv").write_text(text.replace("         2       118", "         1       118"))
    with pytest.raises(FileFormatError, match="element 1 is defined twice"):
        read_modal_uff(tmp_path / "box.unv")
