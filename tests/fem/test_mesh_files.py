"""Mesh files of other programs: read alike from every format, refused in one line where damaged."""

import random
import re
import subprocess
import sys
import time
from pathlib import Path

import gmsh
import h5py
import numpy as np
import pytest

from benchmarks.hostile.damage import damaged
from benchmarks.hostile.valid_files import BY_MESHIO, POINTS, TRIANGLES, write_meshes
from nvhchain.case import SurfaceFile
from nvhchain.errors import AccuracyWarning, FileFormatError, InputError
from nvhchain.fem.elements import reference_element
from nvhchain.fem.mesh_files import FORMATS, med, read_mesh
from nvhchain.interop.solids.nastran_faces import NASTRAN_ENDINGS, read_nastran_faces


def _by_gmsh(path, *, bricks=False):
    """A box of quadratic solids with the groups `bore` and `flanks`."""
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        for name, value in {"General.Terminal": 0, "Mesh.SecondOrderIncomplete": 1, "Mesh.MeshSizeMax": 0.6}.items():
            gmsh.option.setNumber(name, value)
        occ = gmsh.model.occ
        if bricks:
            base = occ.addRectangle(0, 0, 0, 1, 1)
            occ.synchronize()
            gmsh.model.mesh.setTransfiniteSurface(base)
            gmsh.model.mesh.setRecombine(2, base)
            occ.extrude([(2, base)], 0, 0, 1, numElements=[2], recombine=True)
        else:
            occ.addBox(0, 0, 0, 1, 1, 1)
        occ.synchronize()
        gmsh.model.addPhysicalGroup(2, [1], name="bore")
        gmsh.model.addPhysicalGroup(2, [2, 3, 4, 5, 6], name="flanks")
        gmsh.model.addPhysicalGroup(3, [1], name="gear")
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(2)
        gmsh.write(str(path))
    finally:
        gmsh.finalize()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The ball in every format."""
    folder = tmp_path_factory.mktemp("valid")
    write_meshes(folder)
    return folder


def test_a_ball_is_the_same_from_every_format(folder):
    files = sorted(folder.iterdir())
    assert len(files) == len(BY_MESHIO) + 5
    wanted = np.sort(POINTS[TRIANGLES].mean(axis=1), axis=0)
    for path in files:
        surface = SurfaceFile(path.name).read(folder)
        assert surface.triangles.shape == TRIANGLES.shape, path.name
        np.testing.assert_allclose(np.sort(surface.centroids, axis=0), wanted, atol=2e-8, err_msg=path.name)
        if path.suffix in (".vtk", ".vtu") and path.name in BY_MESHIO:
            np.testing.assert_array_equal(read_mesh(path).tagged["bore"], np.flatnonzero(POINTS[:, 2] > 0))


@pytest.mark.parametrize("ending", ["msh", "med", "inp"])
@pytest.mark.parametrize(("bricks", "kind", "theirs"), [(False, "tet10", "tetra10"), (True, "hex20", "hexahedron20")])
def test_quadratic_solids_of_gmsh_have_their_volume_and_groups(tmp_path, ending, bricks, kind, theirs):
    path = tmp_path / f"box.{ending}"
    _by_gmsh(path, bricks=bricks)
    mesh = read_mesh(path)
    reference = reference_element(kind)
    cells = np.vstack([nodes for name, nodes in mesh.cells if name == theirs])
    jacobian = np.einsum("mna,qnb->mqab", mesh.points[cells], reference.mass_gradient)
    volume = np.linalg.det(jacobian) * reference.mass_weight
    assert (np.sign(volume) == (-1 if ending == "med" else 1)).all()  # MED counts from the other side
    assert abs(volume.sum()) == pytest.approx(1.0, rel=1e-9)
    groups = {name.lower(): at for name, at in mesh.groups.items()}
    assert len(groups["gear"]) == 0
    on = mesh.points[groups["bore"]]
    assert (np.ptp(on, axis=0) < 1e-12).sum() == 1
    assert len(np.union1d(groups["bore"], groups["flanks"])) == (np.isin(mesh.points, (0, 1)).any(axis=1)).sum()


def _cube(faces):
    corners = [f"v {x} {y} {z}" for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    return "\n".join(corners + faces) + "\n"


QUADS = ["f 1 3 4 2", "f 5 6 8 7", "f 1/1/1 2/2 6//3 5", "f -6 -2 -1 -5", "f 1 5 7 \\\n 3", "f 2 4 8 6"]


def test_quads_corners_counted_backwards_and_broken_lines_of_obj_are_read(tmp_path):
    (tmp_path / "a.obj").write_text("mtllib a.mtl\no cube\n" + _cube(["vn 0 0 1", "s off", *QUADS]))
    surface = SurfaceFile("a.obj", 1e-3).read(tmp_path)
    assert surface.triangles.shape == (12, 3)
    assert surface.areas.sum() == pytest.approx(6e-6)


def test_a_hexagon_is_divided_about_a_corner_and_a_hollow_star_is_refused(tmp_path):
    def prism(radius):
        angle = np.arange(len(radius)) * 2 * np.pi / len(radius)
        ring = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
        n = len(ring)
        lines = [f"v {x} {y} {z}" for z in (0, 1) for x, y in ring]
        lines.append("f " + " ".join(str(i) for i in range(n, 0, -1)))
        lines.append("f " + " ".join(str(n + i) for i in range(1, n + 1)))
        lines += [f"f {i + 1} {(i + 1) % n + 1} {n + (i + 1) % n + 1} {n + i + 1}" for i in range(n)]
        (tmp_path / "a.obj").write_text("\n".join(lines))
        return SurfaceFile("a.obj").read(tmp_path)

    surface = prism(np.ones(6))
    assert surface.areas.sum() == pytest.approx(6 + 2 * 1.5 * 3**0.5)
    with pytest.raises(InputError, match=r"2 faces of 12 corners cannot be divided about a corner: triangulate"):
        prism(np.tile([1.0, 0.2], 6))


def _stl(triangles):
    lines = ["SOLID Part"]
    for triangle in triangles:
        lines += ["FACET NORMAL 0 0 0", "OUTER LOOP"]
        lines += ["VERTEX " + " ".join(repr(float(x)) for x in corner) for corner in triangle]
        lines += ["ENDLOOP", "ENDFACET"]
    return "\n".join([*lines, "ENDSOLID Part"]) + "\n"


def test_stl_in_capitals_whose_corners_differ_in_the_last_bits_is_closed(tmp_path):
    rng = np.random.default_rng(1)
    corners = (POINTS[TRIANGLES] + 0.7) * (1 + 1e-7 * rng.uniform(-1, 1, (len(TRIANGLES), 3, 1)))
    (tmp_path / "a.stl").write_text(_stl(corners))
    surface = SurfaceFile("a.stl").read(tmp_path)
    assert surface.vertices.shape == POINTS.shape


def test_stl_with_a_byte_order_mark_or_spare_bytes_is_read_and_a_short_one_refused(tmp_path):
    path = tmp_path / "a.stl"
    path.write_text("\ufeff" + _stl(POINTS[TRIANGLES]), encoding="utf-8")
    np.testing.assert_array_equal(read_mesh(path).points, POINTS[TRIANGLES].reshape(-1, 3))
    facets = np.zeros(len(TRIANGLES), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
    facets["corners"] = POINTS[TRIANGLES]
    data = b"solid".ljust(80) + len(TRIANGLES).to_bytes(4, "little") + facets.tobytes()
    for spare in (0, 2, 80):
        path.write_bytes(data + bytes(spare))
        assert SurfaceFile("a.stl").read(tmp_path).triangles.shape == TRIANGLES.shape
    for wrong in (data[:-1], data + bytes(81)):
        path.write_bytes(wrong)
        with pytest.raises(FileFormatError, match=rf"has {len(wrong)} bytes; .* has {len(data)} and at most 80 more"):
            read_mesh(path)


def test_the_refusal_of_an_ending_of_a_surface_lists_all_that_are_read(tmp_path):
    (tmp_path / "a.step").write_text("")
    with pytest.raises(FileFormatError, match=r"convert it to one of ") as error:
        SurfaceFile("a.step").read(tmp_path)
    assert str(error.value).rpartition("one of ")[2].split(", ") == [*FORMATS, *NASTRAN_ENDINGS]


def test_triangles_with_two_corners_in_one_place_are_left_out_and_counted(tmp_path):
    flat = POINTS[TRIANGLES[:3, [0, 1, 1]]]
    (tmp_path / "a.stl").write_text(_stl(np.concatenate([POINTS[TRIANGLES], flat])))
    with pytest.warns(AccuracyWarning, match=r"a\.stl: 3 of 83 triangles have two corners in one place"):
        surface = SurfaceFile("a.stl").read(tmp_path)
    assert surface.triangles.shape == TRIANGLES.shape


def test_damaged_files_end_in_one_line_or_in_a_mesh(folder, tmp_path, capfd):
    """Nothing printed, nothing slow, no other error; indices and coordinates of what is read are sound."""
    rng, refused, slowest = random.Random(7), list[tuple[str, str]](), 0.0
    files = sorted(folder.iterdir())
    for file in files:
        data, read = file.read_bytes(), read_nastran_faces if file.suffix == ".bdf" else read_mesh
        for _ in range(3 if file.suffix == ".med" else 12):
            broken = tmp_path / file.name
            broken.write_bytes(damaged(data, rng))
            start = time.perf_counter()
            try:
                mesh = read(broken)
            except FileFormatError as error:
                refused.append((str(broken), str(error)))
            else:
                assert np.isfinite(mesh.points).all()
                for nodes in [*(nodes for _, nodes in mesh.cells), *mesh.tagged.values(), *mesh.groups.values()]:
                    assert ((nodes >= 0) & (nodes < len(mesh.points))).all()
            slowest = max(slowest, time.perf_counter() - start)
    assert len(refused) > 150
    for path, message in refused:
        assert message.startswith(path)
        assert message.isprintable()
        assert len(message) < len(path) + 400
    assert slowest < 20
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 x\nf 1 2 3\n", r"line 3: coordinates are .* 3 numbers are needed"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", r"refer to points 0…3, but there are 3"),
        (
            "a.stl",
            "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nendloop\n",
            r"line 5: a facet has 1 vertices",
        ),
        ("a.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n", r"does not end with 'endsolid'"),
        ("a.off", "OFF\n30000001 1 0\n", r"line 2: the number of points is 30000001, 0…30000000"),
        ("a.off", "OFF\n3 1 0\n0 0 0\n1 0 nan\n0 1 0\n3 0 1 2\n", r"1 point not finite, first point 2"),
        ("a.inp", "*NODE\n1, 0, 0, 0\n1, 1, 0, 0\n*ELEMENT, TYPE=S3\n1, 1, 1, 1\n", r"1 node numbers are given twice"),
        ("a.inp", "*NODE\n1, 0, 0, 0\n*ELEMENT, TYPE=S3\n1, 1, 1, 7\n", r"refer to node 7, which is not in the file"),
        ("a.inp", "*INCLUDE, INPUT=a.inp\n", r"includes itself"),
        ("a.msh", "$MeshFormat\n4 0 8\n$EndMeshFormat\n", r"version '4', .* save it as 4.1 or 2.2"),
        ("a.vtu", '<?xml version="1.0"?><!DOCTYPE a [<!ENTITY b "b">]><VTKFile/>', r"declares entities"),
        ("a.xyz", "0 0 0\n", r"ending '.xyz' are not read: convert it to one of .stl"),
    ],
)
def test_refusals_give_place_and_remedy(tmp_path, name, text, message):
    (tmp_path / name).write_text(text)
    with pytest.raises(FileFormatError, match=message) as error:
        read_mesh(tmp_path / name)
    assert re.search("export it again$|convert it to", str(error.value))


def test_a_med_file_that_announces_more_than_memory_is_refused(folder, tmp_path):
    path = tmp_path / "a.med"
    path.write_bytes((folder / "a.med").read_bytes())
    with h5py.File(path, "a") as file:
        step = next(iter(next(iter(file["ENS_MAA"].values())).values()))
        del step["NOE/COO"]
        step["NOE"].create_dataset("COO", shape=(10**12,), chunks=(1000,), dtype=float)
    with pytest.raises(FileFormatError, match=r"COO announces 1000000000000 numbers"):
        read_mesh(path)


def test_a_reader_that_hangs_or_crashes_is_given_up(folder, tmp_path, monkeypatch):
    script = tmp_path / "reader.py"
    monkeypatch.setattr(med._med, "__file__", str(script))
    monkeypatch.setattr(med, "_TIME_LIMIT", 0.5)
    script.write_text("while True: pass\n")
    with pytest.raises(FileFormatError, match=r"did not end within [01] s"):
        read_mesh(folder / "a.med")
    monkeypatch.setattr(med, "_TIME_LIMIT", 30.0)
    script.write_text("import os, signal\nos.kill(os.getpid(), signal.SIGSEGV)\n")
    with pytest.raises(FileFormatError, match="the HDF5 library fails on it"):
        read_mesh(folder / "a.med")


def test_no_code_of_the_working_directory_is_run_for_a_med_file(folder, tmp_path):
    for name in ("h5py", "numpy", "json"):
        (tmp_path / f"{name}.py").write_text("open('ran', 'w')\nraise ImportError\n")
    code = f"import nvhchain.fem.mesh_files as files; print(len(files.read_mesh({str(folder / 'a.med')!r}).points))"
    done = subprocess.run([sys.executable, "-P", "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.stdout.strip() == str(len(POINTS)), done.stderr
    assert not Path(tmp_path / "ran").exists()


def test_triangles_turned_inward_are_turned_over_and_counted(tmp_path):
    """Some, all, and all of one of two bodies; a cavity inside a body stays refused."""
    rng = np.random.default_rng(2)
    some = np.where(rng.random((len(TRIANGLES), 1)) < 0.3, TRIANGLES[:, ::-1], TRIANGLES)
    turned = int((some != TRIANGLES).any(axis=1).sum())
    (tmp_path / "some.stl").write_text(_stl(POINTS[some]))
    with pytest.warns(AccuracyWarning, match=rf"some\.stl: {turned} of 80 triangles turned over, so that all normals"):
        surface = SurfaceFile("some.stl").read(tmp_path)
    assert np.einsum("ka,ka->k", surface.normals, surface.centroids - POINTS.mean(axis=0)).min() > 0
    beside = POINTS[TRIANGLES[:, ::-1]] + [5 * np.ptp(POINTS[:, 0]), 0.0, 0.0]
    (tmp_path / "two.stl").write_text(_stl(np.concatenate([POINTS[TRIANGLES], beside])))
    with pytest.warns(AccuracyWarning, match="80 of 160 triangles turned over"):
        SurfaceFile("two.stl").read(tmp_path)
    cavity = POINTS.mean(axis=0) + 0.5 * (POINTS[TRIANGLES[:, ::-1]] - POINTS.mean(axis=0))
    (tmp_path / "cavity.stl").write_text(_stl(np.concatenate([POINTS[TRIANGLES], cavity])))
    with pytest.raises(InputError, match=r"cavity\.stl: body 1 of 2 .* its normals point inward"):
        SurfaceFile("cavity.stl").read(tmp_path)


def test_corners_of_six_digits_are_joined_where_that_closes_the_surface(tmp_path):
    rng = np.random.default_rng(3)
    rough = POINTS[TRIANGLES] + 1e-5 * np.ptp(POINTS, axis=0).max() * rng.uniform(-1, 1, (len(TRIANGLES), 3, 3))
    (tmp_path / "a.stl").write_text(_stl(rough))
    with pytest.warns(AccuracyWarning, match=r"a\.stl: corners within 0\.0001 of its extent joined"):
        surface = SurfaceFile("a.stl").read(tmp_path)
    assert surface.vertices.shape == POINTS.shape
    (tmp_path / "open.stl").write_text(_stl(POINTS[TRIANGLES[1:]]))
    with pytest.raises(InputError, match=r"open\.stl: Surface is open: 3 edges .* only, the first at \["):
        SurfaceFile("open.stl").read(tmp_path)


def test_triangles_without_area_are_left_out_and_their_neighbours_divided(tmp_path):
    """One side of the ball is cut at a corner that its neighbour lacks, with a triangle of no area in between."""
    a, b, c = TRIANGLES[0]
    points = np.vstack([POINTS, (POINTS[a] + POINTS[b]) / 2])
    middle = len(POINTS)
    triangles = np.vstack([TRIANGLES[1:], [[a, middle, c], [middle, b, c], [a, b, middle]]])
    (tmp_path / "a.stl").write_text(_stl(points[triangles]))
    with pytest.warns(AccuracyWarning, match=r"a\.stl: 1 triangles without area are excluded"):
        surface = SurfaceFile("a.stl").read(tmp_path)
    assert surface.areas.sum() == pytest.approx(
        np.linalg.norm(np.cross(*(POINTS[TRIANGLES[:, i]] - POINTS[TRIANGLES[:, 0]] for i in (1, 2))), axis=1).sum() / 2
    )
