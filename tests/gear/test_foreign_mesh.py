"""Gears meshed elsewhere: the same compliance as an own mesh, refusals in one sentence."""

import dataclasses
from functools import cache

import meshio
import numpy as np
import pytest

from nvhchain.errors import FileFormatError, InputError
from nvhchain.fem.elements import HEX20_EDGES, HEX_CORNERS, hex20_shape
from nvhchain.fidelity import DRAFT
from nvhchain.gear import (
    Engagement,
    GearBody,
    GearGeometry,
    GearPair,
    Slots,
    flank_compliance,
    loaded_mesh,
    mass_properties,
    nominal_centre_distance,
    read_gear_mesh,
    whole_mesh,
    write_gear_mesh,
)

FIDELITY = dataclasses.replace(
    DRAFT.gear,
    profile_elements=2,
    width_layers=2,
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


def test_tags_are_read_from_sets_arrays_and_surface_cells_in_any_unit(changed, tmp_path):
    mesh = own_mesh()
    sets = read_gear_mesh(changed())
    arrays = tmp_path / "gear.vtu"
    write_gear_mesh(arrays, mesh)
    for found in (sets, read_gear_mesh(arrays), read_gear_mesh(changed(points=1e3 * mesh.nodes), scale=1e-3)):
        np.testing.assert_allclose(found.nodes, mesh.nodes, atol=1e-15)
        np.testing.assert_array_equal(found.bore, mesh.bore)
        np.testing.assert_array_equal(found.flanks, mesh.flanks)
    np.testing.assert_array_equal(sets.elements, mesh.elements)


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


def test_gear_of_tetrahedra_runs_in_the_hybrid_contact_with_the_transmission_error_of_bricks(changed):
    nodes, elements, flanks, bore = tetrahedra(own_mesh())
    path = changed(points=nodes, cells=[("tetra10", elements)], point_sets={"bore": bore, "flanks": flanks})
    foreign = dataclasses.replace(BODY, blank=read_gear_mesh(path, order=3))
    solid = GearBody(GEOMETRY)
    pair = GearPair(solid, BODY, nominal_centre_distance(GEOMETRY, GEOMETRY))
    other = flank_compliance(solid, FIDELITY, reach=1)
    found = []
    for wheel in (BODY, foreign):
        both = (other, flank_compliance(wheel, FIDELITY, reach=1))
        engagement = Engagement(dataclasses.replace(pair, wheel=wheel), both, FIDELITY)
        found.append(
            [loaded_mesh(engagement, a * pair.mesh_period, 2000.0, guess=1e-5).deflection for a in (0.0, 0.3, 0.6, 2.2)]
        )
    np.testing.assert_allclose(found[1], found[0], rtol=0.03)


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
        ({"cells": lambda m: [("hexahedron", m.elements[:, :8])]}, r"solid cells are hexahedron, one kind of tetra10"),
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


def test_files_that_are_no_meshes_are_refused(tmp_path):
    path = tmp_path / "gear.vtu"
    path.write_text("not a mesh")
    with pytest.raises(FileFormatError, match="not a mesh that meshio reads"):
        read_gear_mesh(path)
