"""Abaqus input: instances in their places, and refusals of what would be passed over."""

import numpy as np
import pytest

from benchmarks.hostile.valid_files import POINTS, TRIANGLES
from nvhchain.case import SurfaceFile
from nvhchain.errors import FileFormatError
from nvhchain.fem.mesh_files import read_mesh

NODES = "\n".join(f"{i}, {x!r}, {y!r}, {z!r}" for i, (x, y, z) in enumerate(POINTS.tolist(), 1))
SHELLS = "\n".join(f"{i}, {a}, {b}, {c}" for i, (a, b, c) in enumerate((TRIANGLES + 1).tolist(), 1))
PART = f"*Part, name=Ball\n*Node\n{NODES}\n*Element, type=S3\n{SHELLS}\n*Nset, nset=first\n1\n*End Part\n"
TWO = (
    "*Assembly, name=All\n*Instance, name=One, part=BALL\n*End Instance\n"
    "*Instance, name=Two, part=Ball\n5., 0., 0.,\n1., 2., 0., 1., 2., 3., 90.\n*End Instance\n"
    "*Nset, nset=bore, instance=Two\n2, 3\n*Nset, nset=both\nOne.4, All.Two.4\n*Nset, nset=named\nTwo.first\n"
    "*End Assembly\n"
)


def test_two_instances_of_a_part_are_two_bodies_the_moved_one_in_its_place(tmp_path):
    """Translated by 5 in x, then turned by 90 degrees about the line through (1, 2) along z."""
    (tmp_path / "a.inp").write_text(PART + TWO)
    mesh, count = read_mesh(tmp_path / "a.inp"), len(POINTS)
    x, y, z = (POINTS + np.subtract([5, 0, 0], [1, 2, 0])).T
    np.testing.assert_allclose(mesh.points, np.vstack([POINTS, np.stack([1 - y, 2 + x, z], axis=1)]), atol=1e-12)
    wanted = {"FIRST": [0, count], "BORE": [count + 1, count + 2], "BOTH": [3, count + 3], "NAMED": [count]}
    assert {name: at.tolist() for name, at in mesh.tagged.items()} == wanted
    surface = SurfaceFile("a.inp").read(tmp_path)
    assert surface.triangles.shape == (2 * len(TRIANGLES), 3)
    assert np.ptp(surface.vertices[:, 1]) > 5


def test_a_translated_instance_and_parts_without_an_assembly_are_read(tmp_path):
    moved = "*Assembly, name=A\n*Instance, name=One, part=Ball\n0., 0., -3.\n*End Instance\n*End Assembly\n"
    (tmp_path / "a.inp").write_text(PART + moved)
    np.testing.assert_array_equal(read_mesh(tmp_path / "a.inp").points, POINTS - [0, 0, 3])
    (tmp_path / "b.inp").write_text("\ufeff" + PART + PART.replace("Ball", "Other"), encoding="utf-8")
    assert len(read_mesh(tmp_path / "b.inp").points) == 2 * len(POINTS)


def _instance(lines):
    return PART + "*Assembly, name=A\n*Instance, name=One, part=Ball\n" + lines + "*End Instance\n*End Assembly\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (_instance("1., 2., 3., 4.\n"), r"line \d+: the motion of an instance has 4 numbers there, 3 .* 7 of a rot"),
        (_instance("0., 0., nan\n"), r"the motion of an instance has numbers beyond 1e\+09"),
        (_instance("1., 2., 3., 1., 2., 3., 90.\n"), r"the axis of an instance is between one point and itself"),
        (TWO, r"line 2: instance 'One' is of part 'BALL', which is not before it .*: export a flat file"),
        (PART + TWO.replace("name=Two", "name=one"), r"\*INSTANCE 'one' is in the file twice: rename one"),
        (PART + PART, r"\*PART 'Ball' is in the file twice"),
        (PART + TWO.replace("instance=Two", "instance=Three"), r"instance 'Three' is not in the file"),
        (
            PART + TWO.replace("*Nset, nset=bore", "*Element, type=S3\n1, 1, 2, 3\n*Nset, nset=bore"),
            r"elements of type 'S3' in the assembly: put them in a part",
        ),
        *((f"*NODE\n1, 0, 0\n*{name}\n1, 9, 1\n", rf"line 3: \*{name} is not read: write all")
          for name in ("NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY")),
        ("*NODE, INPUT=n.txt\n", r"line 1: \*NODE, INPUT='n.txt' is not read: put its lines .* \*INCLUDE, INPUT="),
        (f"*NODE\n{NODES}\n*Element, type=S3, Input=e.txt\n", rf"line {len(POINTS) + 2}: \*ELEMENT, INPUT='e.txt' is"),
        ("*NODE\n*ELEMENT, TYPE=S3\n1, 1, 2, 3\n", r"refer to node 1, but the file has no nodes"),
        ("*ELEMENT, TYPE=S3\n1, 1, 2, 3\n", r"its elements have no \*NODE that is read"),
        ("*NODE\n1, 0, 0, 0\n", r"it has no \*NODE or no \*ELEMENT that is read"),
    ],
)  # fmt: skip
def test_what_would_change_the_mesh_is_refused_with_its_line(tmp_path, text, message):
    (tmp_path / "a.inp").write_text(text)
    with pytest.raises(FileFormatError, match=message):
        read_mesh(tmp_path / "a.inp")


def test_the_remedy_for_input_is_read(tmp_path):
    (tmp_path / "n.txt").write_text(NODES)
    (tmp_path / "a.inp").write_text(f"*NODE\n*INCLUDE, INPUT=n.txt\n*ELEMENT, TYPE=S3\n{SHELLS}\n")
    assert SurfaceFile("a.inp").read(tmp_path).triangles.shape == TRIANGLES.shape
