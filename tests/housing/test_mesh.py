"""Casting mesh and radiating envelope."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.housing.random_castings import COARSE, random_casting
from nvhchain.errors import InputError, SolverError
from nvhchain.fem import mesher, stiffness_and_mass
from nvhchain.housing import InnerWall
from nvhchain.housing.casting import _gmsh
from nvhchain.housing.casting import mesh as mesh_module
from nvhchain.housing.casting.mesh import (
    boundary_faces,
    mesh_casting,
    mounting_plane_faces,
    radiating_surface,
    straightened,
)
from nvhchain.housing.casting.solids import casting_recipe, outline_at

UNIT_TET = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])


def test_gmsh_stays_out_of_this_process():
    code = "import sys, nvhchain.housing, nvhchain.housing.casting._gmsh; assert 'gmsh' not in sys.modules"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.slow
def test_meshing_twice_gives_the_same_bytes(casting, fidelity, mesh):
    again = mesh_casting(casting, fidelity)
    assert again.nodes.tobytes() == mesh.nodes.tobytes()
    assert again.elements.tobytes() == mesh.elements.tobytes()


def test_every_element_is_right_handed_and_the_volume_is_that_of_the_skin(mesh):
    corners = mesh.nodes[mesh.elements[:, :4]]
    volumes = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6
    assert volumes.min() > 0
    faces = mesh.nodes[boundary_faces(mesh.elements)[:, :3]]
    enclosed = np.einsum("ij,ij->", faces[:, 0], np.cross(faces[:, 1], faces[:, 2])) / 6
    assert enclosed == pytest.approx(volumes.sum(), rel=1e-10)


def test_seat_nodes_lie_on_their_bore_and_bolts_on_theirs(casting, mesh):
    for bore, members in zip(casting.bores, mesh.seats, strict=True):
        arm = mesh.nodes[members] - bore.centre
        # mid-edge nodes may lie on the chord where the arc would have spoiled an element
        distance = np.hypot(arm[:, 0], arm[:, 1])
        assert distance.max() < bore.radius * (1 + 1e-6)
        assert distance.min() > bore.radius * np.cos(np.pi / 4.5)
        assert np.ptp(arm[:, 2]) == pytest.approx(bore.length, rel=1e-3)
        angles = np.sort(np.arctan2(arm[:, 1], arm[:, 0]))
        assert np.diff(angles, append=angles[0] + 2 * np.pi).max() < np.pi / 2
    assert len(mesh.bolts) == casting.bolts
    everyone = np.concatenate([*mesh.seats, *mesh.bolts])
    assert len(np.unique(everyone)) == len(everyone)


def test_skin_is_the_outside_only(casting, mesh):
    corners = mesh.nodes[mesh.skin[:, :3]]
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    centre = corners.mean(axis=1)
    assert not (centre[:, 2] < 1e-6).any()
    rear = centre[:, 2] > casting.depth + 1e-3
    assert rear.any()
    # closed up to the mounting plane: the projected areas cancel in x and y, and in z the covered plane is missing
    total = outward.sum(axis=0) / 2
    area = np.linalg.norm(outward, axis=1).sum() / 2
    covered = stadium_area(casting)
    assert np.abs(total[:2]).max() < 0.02 * area
    assert total[2] == pytest.approx(covered, rel=0.05)


def stadium_area(casting):
    from nvhchain.housing.casting.outline import stations

    x, y = stations(outline_at(casting, casting.wall + casting.draft + casting.flange_width), 2000)[0].T
    return 0.5 * abs(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def test_radiating_surface_has_well_shaped_triangles_of_the_size_asked_for(casting, surface):
    size = 0.022
    assert np.median(surface.longest_edges) == pytest.approx(size, rel=0.25)
    assert surface.longest_edges.max() < 1.6 * size
    quality = 4 * np.sqrt(3) * surface.areas
    corners = surface.vertices[surface.triangles]
    squares = ((corners - np.roll(corners, 1, axis=1)) ** 2).sum(axis=(1, 2))
    assert (quality / squares).min() > 0.2
    assert np.median(quality / squares) > 0.9
    plane = mounting_plane_faces(surface)
    assert surface.areas[plane].sum() == pytest.approx(stadium_area(casting), rel=0.02)


def test_radiating_surface_gets_finer_with_the_size(casting, surface):
    finer = radiating_surface(casting, 0.011)
    assert 3.0 < len(finer.triangles) / len(surface.triangles) < 5.0
    assert finer.volume == pytest.approx(surface.volume, rel=0.02)


def test_element_bent_too_far_is_straightened():
    middle = (UNIT_TET[[0, 1, 0, 0, 1, 2]] + UNIT_TET[[1, 2, 2, 3, 3, 3]]) / 2
    nodes = np.vstack([UNIT_TET, middle])
    elements = np.arange(10)[None]
    slightly = nodes.copy()
    slightly[4] += [0.0, -0.05, 0.0]
    assert np.array_equal(straightened(slightly, elements), slightly)
    badly = nodes.copy()
    badly[4] += [0.0, 0.4, 0.0]
    assert np.array_equal(straightened(badly, elements), nodes)


def test_casting_mesh_is_accepted_by_the_element_routine(casting, mesh):
    _, M = stiffness_and_mass(mesh.nodes, mesh.elements, "tet10", casting.material)
    corners = mesh.nodes[mesh.elements[:, :4]]
    volume = np.linalg.det(corners[:, 1:] - corners[:, :1]).sum() / 6
    assert M.sum() / 3 == pytest.approx(casting.material.density * volume, rel=0.02)


def test_failing_mesher_is_reported_with_what_it_said(casting):
    recipe = casting_recipe(casting, 0.03, 6.0)
    apart = {"kind": "cylinder", "base": [1.0, 0.0, 0.0], "axis": [0.0, 0.0, 0.01], "radius": 0.01}
    recipe["steps"].append({"op": "fuse", "solids": [apart]})
    with pytest.raises(SolverError, match="falls apart into 2 pieces"):
        _gmsh.mesh(recipe)


def test_missing_system_library_is_named(monkeypatch):
    class Done:
        returncode, stdout = 1, b""
        stderr = b"OSError: libGLU.so.1: cannot open shared object file: No such file or directory"

    monkeypatch.setattr(mesher.processes, "exchange", lambda *args, **kwargs: Done)
    with pytest.raises(SolverError, match=r"libGLU\.so\.1.*libglu1-mesa"):
        _gmsh.mesh({})


def test_seat_without_nodes_is_refused(casting, fidelity, monkeypatch):
    raw = _gmsh.mesh(casting_recipe(casting, 0.03, 6.0))
    monkeypatch.setattr("nvhchain.housing.casting._gmsh.mesh", lambda recipe: {**raw, "nodes": raw["nodes"] * 1.01})
    with pytest.raises(InputError, match="seat A1 got 0 mesh nodes"):
        mesh_casting(casting, fidelity)


def test_lug_that_just_touches_the_side_wall_is_part_of_the_casting(casting):
    """At its top, 17.5 mm above the foot, with a draft of 8 mm over 140 mm."""
    rear = tuple(replace(bore, centre=(*bore.centre[:2], min(bore.centre[2], 0.137))) for bore in casting.bores)
    touching = replace(casting, bores=rear, depth=0.14, draft=0.008, flange_width=0.012)
    made = _gmsh.mesh(casting_recipe(touching, 0.03, 6.0) | {"dimension": 2})
    assert made["nodes"][:, 2].max() > touching.depth


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 56, 90, 139])
def test_random_castings_are_meshed(seed):
    """A common one, and a boss beside the wall, two bosses that touch, and ribs that end at the wall.

    More of them: python -m benchmarks random_castings COUNT.
    """
    made = random_casting(seed)
    assert len(mesh_casting(made, COARSE).seats) == len(made.bores)


@pytest.mark.parametrize(("wrong", "message"), [("spokes", "spokes = 6"), ("inner_walls", "inner_walls")])
def test_a_casting_that_has_no_mesh_is_refused_by_the_field_to_change(casting, fidelity, monkeypatch, wrong, message):
    """Which castings these are depends on the last digit of a length: "use another element size" helped nobody."""
    made = replace(casting, spokes=6, inner_walls=(InnerWall(0.08, 0.006),))

    def meshed(tried, knobs):
        if getattr(tried, wrong):
            raise SolverError("the casting falls apart into 5 pieces")
        return "a mesh"

    monkeypatch.setattr(mesh_module, "_meshed", meshed)
    with pytest.raises(InputError, match=rf"no mesh with {message}, .*: change {wrong}"):
        mesh_casting(made, fidelity)
    assert mesh_casting(replace(made, **{wrong: type(getattr(made, wrong))()}), fidelity) == "a mesh"
