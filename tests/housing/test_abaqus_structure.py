"""Shells, beams, springs, ties and couplings in Abaqus decks, against CalculiX, closed forms and one another."""

import numpy as np
import pytest

from nvhchain.errors import InputError
from nvhchain.fem import lowest_modes
from nvhchain.housing.imported.repair import sound_mesh
from nvhchain.housing.imported.seats import bearing_seats
from nvhchain.housing.imported.solid_model import append_seats, constrained
from nvhchain.interop import read_abaqus
from nvhchain.testing.decks import FOLDED


def read(tmp_path, text):
    path = tmp_path / "deck.inp"
    path.write_text(text)
    return read_abaqus(path, units="mm-t-s")


def frequencies(model, top):
    K, M, _ = constrained(sound_mesh(model)[0])
    return lowest_modes(K, M, top)[0]


@pytest.mark.parametrize(
    ("name", "calculix", "error"),
    [
        ("plate S4", [42.84, 184.04, 267.09, 599.23, 749.94, 1151.33], 2e-3),
        ("plate S8R, offset", [107.63, 455.16, 669.14, 1479.26, 1789.77, 1869.11], 7e-3),
        ("channel S8R, mass and spring", [285.71, 537.71, 769.04, 863.44, 1102.74, 1301.9], 8e-3),
    ],
)
def test_shells_vibrate_as_in_calculix(name, calculix, error, tmp_path):
    """Frequencies (Hz) of CalculiX 2.20, by `python -m benchmarks calculix_shells`."""
    found = frequencies(read(tmp_path, FOLDED[name]), 1.1 * calculix[-1])
    assert found[: len(calculix)] == pytest.approx(calculix, rel=error)


def brick(name, first, counts, start, sides):
    """Lines of nodes and C3D8 of a box from `start` with `sides` (mm); labels from `first`."""
    nx, ny, nz = counts
    place = [(i, j, k) for i in range(nx + 1) for j in range(ny + 1) for k in range(nz + 1)]
    label = {at: first + n for n, at in enumerate(place)}
    lines = ["*NODE"]
    for at in place:
        xyz = (s + side * n / count for s, side, n, count in zip(start, sides, at, counts, strict=True))
        lines.append(", ".join([str(label[at]), *(f"{value:.9g}" for value in xyz)]))
    lines.append(f"*ELEMENT, TYPE=C3D8, ELSET={name}")
    around = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    cells = [(i, j, k) for i in range(nx) for j in range(ny) for k in range(nz)]
    for number, (i, j, k) in enumerate(cells, start=first):
        lines.append(", ".join(map(str, [number, *(label[i + a, j + b, k + c] for a, b, c in around)])))
    return lines, label


STEEL = ["*MATERIAL, NAME=STEEL", "*ELASTIC", "200000., 0.3", "*DENSITY", "8.e-9"]


def test_tied_blocks_of_different_meshes_move_as_one(tmp_path):
    one, at = brick("LEFT", 1, (6, 3, 3), (0, 0, 0), (60.0, 30.0, 30.0))
    other, there = brick("RIGHT", 1001, (6, 4, 4), (60.2, 0, 0), (60.0, 30.0, 30.0))
    left = [f"{number}, S4" for number in range(1, 6 * 9 + 1) if number > 45]  # + x: nodes 2 3 7 6
    tied = [
        *one, *other, *STEEL,
        "*SOLID SECTION, ELSET=LEFT, MATERIAL=STEEL", "*SOLID SECTION, ELSET=RIGHT, MATERIAL=STEEL",
        "*SURFACE, NAME=MASTER", *left, "*NSET, NSET=FACE", *(f"{n}," for (i, _, _), n in there.items() if i == 0),
        "*SURFACE, NAME=SLAVE, TYPE=NODE", "FACE", "*TIE, NAME=JOINT", "SLAVE, MASTER",
        "*NSET, NSET=END", *(f"{n}," for (i, _, _), n in at.items() if i == 0), "*BOUNDARY", "END, 1, 3", "",
    ]  # fmt: skip
    whole, at = brick("LEFT", 1, (12, 4, 4), (0, 0, 0), (120.2, 30.0, 30.0))
    whole = [
        *whole, *STEEL, "*SOLID SECTION, ELSET=LEFT, MATERIAL=STEEL",
        "*NSET, NSET=END", *(f"{n}," for (i, _, _), n in at.items() if i == 0), "*BOUNDARY", "END, 1, 3", "",
    ]  # fmt: skip
    found, sought = (frequencies(read(tmp_path, "\n".join(lines)), 2e4) for lines in (tied, whole))
    assert found[:4] == pytest.approx(sought[:4], rel=0.01)
    with pytest.raises(InputError, match="tie JOINT ties nothing"):
        sound_mesh(read(tmp_path, "\n".join(tied).replace("NAME=JOINT", "NAME=JOINT, POSITION TOLERANCE=0.1")))


BEAMS = """*NODE
{nodes}
*ELEMENT, TYPE={kind}, ELSET=BAR
{cells}
{section}
*MATERIAL, NAME=STEEL
*ELASTIC
200000., 0.3
*DENSITY
8.e-9
*BOUNDARY
1, ENCASTRE
*SHELL SECTION, ELSET=PATCH, MATERIAL=STEEL
0.001
*ELEMENT, TYPE=S3, ELSET=PATCH
901, 21, 900, 899
"""


@pytest.mark.parametrize(
    ("section", "second"),
    [
        ("*BEAM SECTION, SECTION=RECT, ELSET=BAR, MATERIAL=STEEL\n10., 20.\n0., 1., 0.",
         (20 * 10**3 / 12, 10 * 20**3 / 12)),
        ("*BEAM SECTION, SECTION=BOX, ELSET=BAR, MATERIAL=STEEL\n10., 20., 1., 1., 1., 1.\n0., 1., 0.",
         ((20 * 10**3 - 18 * 8**3) / 12, (10 * 20**3 - 8 * 18**3) / 12)),
        ("*BEAM GENERAL SECTION, SECTION=GENERAL, ELSET=BAR, DENSITY=8.e-9\n200., 6000., 0., 1500., 4500.\n0., 1., 0.\n"
         "200000., 76923.", (1500.0, 6000.0)),
    ],
)  # fmt: skip
@pytest.mark.parametrize("kind", ["B31", "B32"])
def test_beam_sections_bend_along_their_own_axes(tmp_path, kind, section, second):
    """Deflections at the end by a unit force along y and z of an axis along x: L³/(3 E I)."""
    nodes = [f"{i + 1}, {50.0 * i}, 0., 0." for i in range(21)] + ["899, 1000.1, 0., 0.", "900, 1000., 0.1, 0."]
    cells = [(i, i + 1) for i in range(1, 21)] if kind == "B31" else [(i, i + 1, i + 2) for i in range(1, 20, 2)]
    text = BEAMS.format(
        kind=kind,
        nodes="\n".join(nodes),
        cells="\n".join(", ".join(map(str, (100 + n, *cell))) for n, cell in enumerate(cells)),
        section=section,
    )
    K, _, T = constrained(sound_mesh(read(tmp_path, text))[0])
    end = np.asarray(T[3 * 20 : 3 * 21].todense())
    moved = end @ np.linalg.solve(K.toarray(), end.T)
    for axis, inertia in ((1, second[0]), (2, second[1])):
        assert moved[axis, axis] == pytest.approx(1.0 / (3 * 200e9 * inertia * 1e-12), rel=3e-3)


def test_a_distributing_coupling_carries_a_seat_with_shares_of_area(tmp_path):
    """Corners of faces share their area; the seat moves by the mean of the nodes that it weighs."""
    lines, at = brick("ALL", 1, (4, 4, 2), (0, 0, 0), (80.0, 80.0, 20.0))
    top = [f"{n}, S2" for n in range(1, 33) if n % 2 == 0]
    text = [
        *lines, *STEEL, "*SOLID SECTION, ELSET=ALL, MATERIAL=STEEL", "*NODE", "900, 40., 40., 50.",
        "*SURFACE, NAME=TOP", *top, "*COUPLING, CONSTRAINT NAME=SEAT, REF NODE=900, SURFACE=TOP", "*DISTRIBUTING",
        "*NSET, NSET=FOOT", *(f"{n}," for (_, _, k), n in at.items() if k == 0), "*BOUNDARY", "FOOT, 3, 3",
        f"{at[0, 0, 0]}, 1, 2", f"{at[4, 0, 0]}, 2, 2", "",
    ]  # fmt: skip
    model = read(tmp_path, "\n".join(text))
    mean = model.structure.averages[0]
    assert mean.weights[:, 0].sum() == pytest.approx(80.0 * 80.0)
    assert np.ptp(mean.weights[:, 0]) == pytest.approx(400.0 - 100.0)
    seats = bearing_seats(model, {"A": (0.04, 0.04, 0.05)})
    K, _, T = constrained(sound_mesh(append_seats(model, seats))[0])
    load = np.zeros(K.shape[0])
    load[-4] = 1.0
    moved = np.linalg.solve(K.toarray(), load)
    # work: the seat's motion is the mean of its nodes' motions by area
    rows = np.searchsorted(model.labels, [model.labels[n] for n in mean.nodes])
    nodal = (T[: 3 * len(model.nodes)] @ moved).reshape(-1, 3)[rows]
    assert moved[-4] == pytest.approx(nodal[:, 2] @ mean.weights[:, 0] / 6400.0, rel=1e-9)


def test_transforms_equations_and_equal_motions(tmp_path):
    """A cantilever clamped in turned axes, cut in the middle and joined again by *EQUATION and *MPC."""
    text = FOLDED["plate S4"].replace("CLAMPED, 1, 6", "CLAMPED, 1, 2\nCLAMPED, 3, 6")
    whole = frequencies(read(tmp_path, text), 700.0)
    turned = text.replace("*BOUNDARY", "*TRANSFORM, NSET=CLAMPED\n0., 1., 0., -1., 0., 0.\n*BOUNDARY")
    assert frequencies(read(tmp_path, turned), 700.0) == pytest.approx(whole, rel=1e-9)
    head, rest = text.split("*ELEMENT", 1)
    nodes = {int(row.split(",")[0]): row.split(",")[1:] for row in head.splitlines()[1:]}
    middle = [n for n, place in nodes.items() if float(place[0]) == 100.0]
    lines = rest.splitlines()
    for i, row in enumerate(lines):
        cells = row.split(", ")
        if len(cells) == 5 and cells[0].isdigit() and max(float(nodes[int(n)][0]) for n in cells[1:]) > 100.0:
            lines[i] = ", ".join([cells[0], *(str(int(n) + 5000) if int(n) in middle else n for n in cells[1:])])
    twins = "\n".join(f"{n + 5000},{','.join(nodes[n])}" for n in middle)
    joined = "\n".join(
        f"*MPC\nTIE, {n + 5000}, {n}"
        if n % 2
        else "*EQUATION\n" + "\n".join(f"2\n{n + 5000}, {c}, 1., {n}, {c}, -1." for c in range(1, 7))
        for n in middle
    )
    cut = f"{head}{twins}\n*ELEMENT" + "\n".join(lines) + f"\n{joined}\n"
    assert frequencies(read(tmp_path, cut), 700.0) == pytest.approx(whole, rel=1e-6)


MOUNT = """*NODE
{foot}, {x}, {y}, 0.
*ELEMENT, TYPE=CONN3D2, ELSET=M{foot}
{foot}, {foot}, {node}
*CONNECTOR SECTION, ELSET=M{foot}, BEHAVIOR=RUBBER
BUSHING,
TURNED,
*BOUNDARY
{foot}, 1, 6
"""
RUBBER = """*ORIENTATION, NAME=TURNED, SYSTEM=RECTANGULAR
0., 1., 0., 0., 0., 1.
*CONNECTOR BEHAVIOR, NAME=RUBBER
*CONNECTOR ELASTICITY, COMPONENT=1
900.,
*CONNECTOR ELASTICITY, COMPONENT=2
2.,
*CONNECTOR ELASTICITY, COMPONENT=3
900.,
"""


def test_a_block_on_connectors_bounces_along_their_soft_axis(tmp_path):
    lines, at = brick("ALL", 1, (2, 2, 2), (0, 0, 0), (80.0, 80.0, 20.0))
    feet = [(at[i, j, 0], 40 * i, 40 * j) for i in (0, 2) for j in (0, 2)]
    mounts = "".join(MOUNT.format(foot=901 + n, node=node, x=x, y=y) for n, (node, x, y) in enumerate(feet))
    text = "\n".join([*lines, *STEEL, "*SOLID SECTION, ELSET=ALL, MATERIAL=STEEL", RUBBER + mounts])
    mass = 0.08 * 0.08 * 0.02 * 8000.0
    found = frequencies(read(tmp_path, text), 3000.0)
    assert found[0] == pytest.approx(np.sqrt(4 * 2000.0 / mass) / (2 * np.pi), rel=1e-3)


def test_faces_and_edges_that_meshers_leave_are_noted(tmp_path):
    lines, at = brick("ALL", 1, (2, 2, 2), (0, 0, 0), (80.0, 80.0, 20.0))
    faces = f"*ELEMENT, TYPE=CPS4, ELSET=Surface1\n901, {at[0, 0, 0]}, {at[1, 0, 0]}, {at[1, 1, 0]}, {at[0, 1, 0]}"
    edges = f"*ELEMENT, TYPE=T3D2, ELSET=Line1\n902, {at[0, 0, 0]}, {at[1, 0, 0]}"
    text = "\n".join([*lines, faces, edges, *STEEL, "*SOLID SECTION, ELSET=ALL, MATERIAL=STEEL", ""])
    assert any("2 faces or edges on solids excluded, first 901" in note for note in sound_mesh(read(tmp_path, text))[1])
    with pytest.raises(InputError, match=r"1 elements of type C3D5 are not read \(the first is 903, 1"):
        read(tmp_path, text + "*ELEMENT, TYPE=C3D5\n903, 1, 2, 3, 4, 5\n")


def test_a_range_without_end_is_refused_at_once(tmp_path):
    lines, _ = brick("ALL", 1, (1, 1, 1), (0, 0, 0), (80.0, 80.0, 20.0))
    text = "\n".join([*lines, *STEEL, "*SOLID SECTION, ELSET=ALL, MATERIAL=STEEL"])
    with pytest.raises(InputError, match=r"deck\.inp: .*degrees of freedom 1 to 99999999"):
        read(tmp_path, f"{text}\n*BOUNDARY\n1, 1, 99999999\n")
    with pytest.raises(InputError, match="GENERATE makes 99999999 numbers"):
        read(tmp_path, f"{text}\n*NSET, NSET=FAR, GENERATE\n1, 99999999\n*BOUNDARY\nFAR, 1, 3\n")
