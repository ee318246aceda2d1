"""Gears meshed elsewhere: the same compliance as an own mesh, refusals in one sentence."""

import dataclasses
from functools import cache

import meshio
import numpy as np
import pytest

from benchmarks.gear.reference import coarse_gear
from nvhchain.errors import FileFormatError, InputError
from nvhchain.fem.elements import HEX20_EDGES, HEX_CORNERS, hex20_shape
from nvhchain.fidelity import DRAFT
from nvhchain.gear import (
    WHEEL,
    Engagement,
    GearBody,
    GearGeometry,
    GearPair,
    Slots,
    StrainGauge,
    flank_compliance,
    loaded_mesh,
    mass_properties,
    nodal_force_strain,
    nominal_centre_distance,
    read_gear_mesh,
    root_strain_modes,
    whole_mesh,
    write_gear_mesh,
)

FIDELITY = dataclasses.replace(
    DRAFT.gear.even_layers(2),
    profile_elements=2,
    load_pattern_tolerance=1e-12,
    far_pattern_tolerance=0.0,
    row_aspect=2.0,
    slices=4,
)
GEOMETRY = GearGeometry(18, 3e-3, np.radians(20.0), 0.0, 12e-3, 6e-3, profile_shift=0.1, thickness_allowance=20e-6)
BODY = GearBody(GEOMETRY, Slots(3, 9e-3, 14.5e-3, np.radians(70.0), 1e-3, phase=0.2))
"""Its rim is thick enough for the own mesh to hold the tooth as deep as the foreign one."""

FACES = np.array([[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])
EDGES = np.array([[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]])


@cache
def own_mesh():
    return whole_mesh(BODY, FIDELITY)


@pytest.fixture
def changed(tmp_path):
    """A file with the own mesh, changed."""

    def write(**changes):
        mesh = own_mesh()
        data = {
            "points": mesh.nodes,
            "cells": [("hexahedron20", mesh.elements)],
            "point_sets": {"bore": mesh.bore, "flanks": mesh.flanks},
        }
        path = tmp_path / "gear.inp"
        meshio.Mesh(**(data | changes)).write(path)
        return path

    return write


@pytest.mark.slow
def test_own_mesh_written_and_read_gives_the_same_compliance(tmp_path):
    own = flank_compliance(BODY, FIDELITY, reach=1, friction=True)
    path = tmp_path / "gear.vtu"
    write_gear_mesh(path, own_mesh())
    body = dataclasses.replace(BODY, blank=read_gear_mesh(path, order=3))
    assert body.sector == BODY.sector == 6
    done = []
    foreign = flank_compliance(body, FIDELITY, reach=1, friction=True, progress=lambda *step: done.append(step))
    assert done == [(i, 6) for i in range(1, 7)]
    np.testing.assert_allclose(foreign.radius, own.radius, rtol=1e-12)
    np.testing.assert_allclose(foreign.axial, own.axial, atol=1e-15)
    np.testing.assert_allclose(foreign.blocks, own.blocks, atol=1e-10 * np.abs(own.blocks).max())
    np.testing.assert_allclose(foreign.friction, own.friction, atol=1e-10 * np.abs(own.friction).max())


def test_tags_are_read_from_sets_and_arrays_in_any_unit(changed, tmp_path):
    mesh = own_mesh()
    sets = read_gear_mesh(changed())
    arrays = tmp_path / "gear.vtu"
    write_gear_mesh(arrays, mesh)
    for found in (sets, read_gear_mesh(arrays), read_gear_mesh(changed(points=1e3 * mesh.nodes), scale=1e-3)):
        np.testing.assert_allclose(found.nodes, mesh.nodes, atol=1e-15)
        np.testing.assert_array_equal(found.bore, mesh.bore)
        np.testing.assert_array_equal(found.flanks, mesh.flanks)
    np.testing.assert_array_equal(sets.elements, mesh.elements)


def faces_of(nodes):
    """(k, 8) faces of the own mesh's bricks with all corners among `nodes`, edges after corners."""
    middle = {frozenset(edge): 8 + i for i, edge in enumerate(HEX20_EDGES)}
    around = [[*f, *(middle[frozenset(side)] for side in zip(f, np.roll(f, -1), strict=True))] for f in FACES.tolist()]
    faces = own_mesh().elements[:, around].reshape(-1, 8)
    return faces[np.isin(faces[:, :4], nodes).all(axis=1)]


def grouped(path, form):
    """A file of the own mesh with groups of the cells of its bore and flanks, as `form` has them."""
    mesh = own_mesh()
    bore, flanks = faces_of(mesh.bore), faces_of(mesh.flanks)
    cells = [("quad8", bore), ("quad8", flanks), ("hexahedron20", mesh.elements)]
    physical = [np.full(len(block), tag) for (_, block), tag in zip(cells, (7, 8, 7), strict=True)]
    none = np.empty(0, dtype=int)
    if form == "abaqus":
        sets = {"BORE": [np.arange(len(bore)), none, none], "FLANKS": [none, np.arange(len(flanks)), none]}
        meshio.Mesh(mesh.nodes, cells, cell_sets=sets).write(path, file_format=form)
    elif form == "gmsh22":  # numbers are those of a dimension: 7 is a surface and a volume
        names = {"Bore": np.array([7, 2]), "Flanks": np.array([8, 2]), "gear": np.array([7, 3])}
        data = {"gmsh:physical": physical, "gmsh:geometrical": physical}
        meshio.Mesh(mesh.nodes, cells, field_data=names, cell_data=data).write(path, file_format=form)
    else:  # nodes seen from the other side
        bricks = mesh.elements[:, [0, 3, 2, 1, 4, 7, 6, 5, 11, 10, 9, 8, 15, 14, 13, 12, 16, 19, 18, 17]]
        file = meshio.Mesh(mesh.nodes, [("quad8", np.vstack([bore, flanks])), ("hexahedron20", bricks)])
        tags = np.repeat([-7, -8], [len(bore), len(flanks)])
        file.cell_data["cell_tags"] = [tags, np.full(len(mesh.elements), -9)]
        file.cell_tags = {-7: ["held", "Bore"], -8: ["Flanks"], -9: ["gear"]}
        file.write(path, file_format=form)
    return path


@pytest.mark.parametrize(("form", "ending"), [("abaqus", "inp"), ("gmsh22", "msh"), ("med", "med")])
def test_tags_are_read_from_groups_of_surface_cells(form, ending, tmp_path):
    path, mesh = grouped(tmp_path / f"gear.{ending}", form), own_mesh()
    found = read_gear_mesh(path)
    np.testing.assert_array_equal(found.bore, mesh.bore)
    np.testing.assert_array_equal(found.flanks, mesh.flanks)
    np.testing.assert_array_equal(found.elements, mesh.elements)
    if form != "abaqus":
        with pytest.raises(InputError, match="the group 'gear' has no surface cells: put those of the surface into it"):
            read_gear_mesh(path, tags=("bore", "gear"))


def test_bricks_with_nodes_in_the_middle_of_faces_are_those_without(changed):
    mesh = own_mesh()
    middles = len(mesh.nodes) + np.arange(7 * len(mesh.elements)).reshape(-1, 7)
    points = np.vstack([mesh.nodes, np.repeat(mesh.nodes[mesh.elements[:, :8]].mean(axis=1), 7, axis=0)])
    tags = {"bore": np.append(mesh.bore, middles[0]), "flanks": np.append(mesh.flanks, middles[1])}
    file = meshio.Mesh(points, [("hexahedron27", np.hstack([mesh.elements, middles]))])
    file.point_data = {name: np.isin(np.arange(len(points)), numbers).astype(int) for name, numbers in tags.items()}
    path = changed().with_suffix(".vtu")
    file.write(path)
    found = read_gear_mesh(path)
    assert found.kind == "hex20"
    for name in ("nodes", "elements", "bore", "flanks"):
        np.testing.assert_array_equal(getattr(found, name), getattr(mesh, name))


def test_flanks_tagged_at_their_corners_alone_are_refused(changed):
    mesh = own_mesh()
    path = changed(point_sets={"bore": mesh.bore, "flanks": np.unique(faces_of(mesh.flanks)[:, :4])})
    body = dataclasses.replace(BODY, blank=read_gear_mesh(path, order=3))
    with pytest.raises(
        InputError, match=r"no element has a whole face among .* tag the nodes in the middle of edges too"
    ):
        flank_compliance(body, FIDELITY, reach=1)


def test_mass_of_the_mesh_is_that_of_the_drawing():
    drawn, meshed = mass_properties(BODY), mass_properties(dataclasses.replace(BODY, blank=own_mesh()))
    np.testing.assert_allclose(meshed[:3], drawn[:3], rtol=2e-3)
    assert meshed.centre == pytest.approx(0.0, abs=1e-9)


def tetrahedra(mesh):
    """The same gear in 10-node tetrahedra, twelve about the middle of each brick: nodes, elements, flanks, bore."""
    nodes, middles, elements = list(mesh.nodes), {}, []
    for edge, at in zip(HEX20_EDGES, mesh.elements[:, 8:].T, strict=True):
        middles |= {frozenset(pair): int(n) for pair, n in zip(mesh.elements[:, edge].tolist(), at, strict=True)}
    for brick in mesh.elements:
        inside = hex20_shape(np.vstack([np.zeros(3), HEX_CORNERS / 2]))[0] @ mesh.nodes[brick]
        centre = len(nodes)
        middles |= {frozenset((int(n), centre)): centre + 1 + i for i, n in enumerate(brick[:8])}
        nodes.extend(inside)
        for face in brick[FACES]:
            a, b, c, d = (int(n) for n in np.roll(face, -int(np.argmin(face))))  # neighbours cut a face alike
            if frozenset((a, c)) not in middles:
                middles[frozenset((a, c))] = len(nodes)
                sides = [middles[frozenset(side)] for side in ((a, b), (b, c), (c, d), (d, a))]
                nodes.append(mesh.nodes[sides].sum(axis=0) / 2 - mesh.nodes[face].sum(axis=0) / 4)
            for corners in ((a, b, c, centre), (a, c, d, centre)):
                place = np.array([nodes[n] for n in corners])
                if np.linalg.det(place[1:] - place[0]) < 0:
                    corners = (corners[1], corners[0], *corners[2:])
                ends = [frozenset((int(corners[i]), int(corners[j]))) for i, j in EDGES]
                elements.append([*corners, *(middles[pair] for pair in ends)])
    tagged = []
    for numbers in (mesh.flanks, mesh.bore):
        on = set(numbers.tolist())
        tagged.append(np.array(sorted(on | {n for pair, n in middles.items() if pair <= on})))
    return np.array(nodes), np.array(elements, dtype=np.int64), *tagged


@pytest.mark.slow
def test_helical_gear_of_tetrahedra_runs_in_the_hybrid_contact_with_the_transmission_error_of_bricks(changed):
    left, right = (dataclasses.replace(GEOMETRY, helix_angle=np.radians(side * 10.0)) for side in (-1, 1))
    drawn = dataclasses.replace(BODY, geometry=left)
    nodes, elements, flanks, bore = tetrahedra(whole_mesh(drawn, FIDELITY))
    path = changed(points=nodes, cells=[("tetra10", elements)], point_sets={"bore": bore, "flanks": flanks})
    foreign = dataclasses.replace(drawn, blank=read_gear_mesh(path, order=3))
    solid = GearBody(right)
    pair = GearPair(solid, drawn, nominal_centre_distance(left, right))
    other = flank_compliance(solid, FIDELITY, reach=1)
    found = []
    for wheel in (drawn, foreign):
        both = (other, flank_compliance(wheel, FIDELITY, reach=1))
        engagement = Engagement(dataclasses.replace(pair, wheel=wheel), both, FIDELITY)
        found.append(
            [loaded_mesh(engagement, a * pair.mesh_period, 2000.0, guess=1e-5).deflection for a in (0.0, 0.3, 0.6, 2.2)]
        )
    np.testing.assert_allclose(found[1], found[0], rtol=0.03)


def test_what_meshes_a_drawn_blank_does_not_take_a_mesh_for_a_solid_gear():
    foreign = dataclasses.replace(BODY, blank=own_mesh())
    pair = GearPair(GearBody(GEOMETRY), foreign, nominal_centre_distance(GEOMETRY, GEOMETRY))
    gauge = [StrainGauge(0)]
    for make in (
        lambda: root_strain_modes(pair, WHEEL, gauge, (0,), FIDELITY),
        lambda: nodal_force_strain(pair, WHEEL, gauge, (0,), (), FIDELITY),
        lambda: whole_mesh(foreign, FIDELITY),
        lambda: coarse_gear(foreign, FIDELITY),
    ):
        with pytest.raises(InputError, match="the gear of 18 teeth has a mesh of its own, which is not meshed again"):
            make()


def test_a_symmetry_that_the_mesh_does_not_have_is_refused():
    """Three slots: whole turns and thirds only; of a solid gear any."""
    for order in (1, 3):
        dataclasses.replace(BODY, blank=dataclasses.replace(own_mesh(), order=order))
    for order in (2, 9):
        with pytest.raises(InputError, match=rf"order = {order} .* % of its polar .* 3-fold pattern: give the order"):
            dataclasses.replace(BODY, blank=dataclasses.replace(own_mesh(), order=order))


def flipped():
    elements = own_mesh().elements.copy()
    elements[5] = elements[5, [4, 5, 6, 7, 0, 1, 2, 3, 12, 13, 14, 15, 8, 9, 10, 11, 16, 17, 18, 19]]
    return elements


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"cells": lambda m: [("hexahedron20", flipped())]},
            r"1 of \d+ elements are inverted or without volume, first 5",
        ),
        ({"point_sets": lambda m: {"bore": m.bore}}, r"no tag 'flanks' among bore: name the nodes"),
        ({"point_sets": lambda m: {"flanks": m.flanks}}, r"no tag 'bore' among flanks"),
        (
            {"cells": lambda m: [("hexahedron", m.elements[:, :8])]},
            r"solid cells are hexahedron, one kind of tetra10 or hex",
        ),
        (
            {"points": lambda m: 1e3 * m.nodes},
            r"reaches to r = 30.* m, the drawn tip circle to 0.03.* scale = 0.001 or so",
        ),
        (
            {"points": lambda m: m.nodes[:, [1, 0, 2]] * [1, -1, 1]},
            r"flank nodes lie up to .* put tooth 0 on the x axis",
        ),
        (
            {"point_sets": lambda m: {"bore": m.flanks, "flanks": m.flanks}},
            r"bore nodes lie at r = .* tag the bore alone",
        ),
    ],
)
def test_meshes_that_cannot_be_used_are_refused(changed, changes, message):
    mesh = own_mesh()
    with pytest.raises(InputError, match=message):
        dataclasses.replace(
            BODY, blank=read_gear_mesh(changed(**{name: change(mesh) for name, change in changes.items()}))
        )


@pytest.mark.parametrize("ending", ["vtu", "bdf", "inp", "msh", "med", "unv", "step"])
def test_files_that_are_no_meshes_are_refused(ending, tmp_path):
    path = tmp_path / f"gear.{ending}"
    path.write_text("not a mesh\n*ELEMENT, TYPE=C3D20\n1, 2\n")
    with pytest.raises(FileFormatError, match=r"not a mesh in the|are not read: convert it"):
        read_gear_mesh(path)
