"""Solid models through Nastran and Abaqus files: units, groups, rigid sets, constraints, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from box_models import SPLITS, box

from nvhchain.conventions import STEEL
from nvhchain.errors import FileFormatError, InputError
from nvhchain.fem import lowest_modes
from nvhchain.housing.foreign import constrained
from nvhchain.housing.foreign_mesh import sound_mesh
from nvhchain.interop import read_abaqus, read_nastran, read_solid_model, write_abaqus, write_nastran
from nvhchain.interop._model_parts import Parts, Rigid
from nvhchain.interop.abaqus_keywords import blocks
from nvhchain.interop.nastran_cards import cards, split_deck
from nvhchain.interop.units import unit_system

FORMATS = [(write_nastran, read_nastran), (write_abaqus, read_abaqus)]
UNITS = ["m-kg-s", "mm-t-s", "mm-kg-ms", "in-lbf-s"]


def frequencies(model, top=4000.0):
    K, M, _ = constrained(sound_mesh(model)[0])
    return lowest_modes(K, M, top)[0]


@pytest.mark.parametrize("units", UNITS)
@pytest.mark.parametrize(("write", "read"), FORMATS)
def test_units_groups_and_rigid_sets_survive_a_file(write, read, units, tmp_path):
    model = box("hex8")
    back = read(write(model, tmp_path / "model", units=units), units=units)
    assert frequencies(back) == pytest.approx(frequencies(model), rel=1e-10)
    assert np.array_equal(back.labels[back.groups["TOP"]], model.labels[model.groups["TOP"]])
    assert [r.label for r in back.rigid_sets] == [r.label for r in model.rigid_sets]
    assert [r.held.all() for r in back.rigid_sets] == [True, False]
    assert back.blocks[0].material.young == pytest.approx(210e9, rel=1e-12)
    assert back.blocks[0].material.density == pytest.approx(7850.0, rel=1e-12)


@pytest.mark.parametrize("quadratic", [False, True])
@pytest.mark.parametrize("kind", list(SPLITS))
@pytest.mark.parametrize(("write", "read"), FORMATS)
def test_every_kind_of_element_keeps_its_nodes_in_order(write, read, kind, quadratic, tmp_path):
    model = sound_mesh(box(kind))[0] if quadratic else box(kind)
    nodes = model.nodes.copy()
    nodes[:, 1] += 0.02 * nodes[:, 0] ** 2 / 0.2**2  # bent, so that no mid-edge node is at a middle
    model = replace(model, nodes=nodes)
    back = read(write(model, tmp_path / "model", units="mm-t-s"), units="mm-t-s")
    assert back.blocks[0].kind == model.blocks[0].kind
    assert frequencies(back, 3000.0) == pytest.approx(frequencies(model, 3000.0), rel=1e-10)


NASTRAN_EDGES = {
    "wedge6": ["12", "23", "31", "14", "25", "36", "45", "56", "64"],
    "hex8": ["12", "23", "34", "41", "15", "26", "37", "48", "56", "67", "78", "85"],
    "tet4": ["12", "23", "31", "14", "24", "34"],
}
ABAQUS_EDGES = {
    "wedge6": ["12", "23", "31", "45", "56", "64", "14", "25", "36"],
    "hex8": ["12", "23", "34", "41", "56", "67", "78", "85", "15", "26", "37", "48"],
    "tet4": ["12", "23", "31", "14", "24", "34"],
}


@pytest.mark.parametrize("kind", list(SPLITS))
def test_mid_edge_nodes_stand_where_the_manuals_have_them(kind, tmp_path):
    """Quick Reference Guide, CTETRA, CPENTA, CHEXA; Abaqus Elements Guide, node ordering of solid elements."""
    model = sound_mesh(box(kind))[0]
    at = dict(zip(model.labels.tolist(), model.nodes, strict=True))
    corners = int(kind[-1])
    bulk = split_deck(write_nastran(model, tmp_path / "m.bdf", units="m-kg-s"))[1]
    card = next([int(x) for x in card[3:]] for card in cards(bulk) if card[0] in ("CTETRA", "CPENTA", "CHEXA"))
    blocked = blocks(write_abaqus(model, tmp_path / "m.inp", units="m-kg-s"))
    cells = [int(x) for row in next(b for b in blocked if b.name == "ELEMENT").data for x in row if x]
    for nodes, edges in ((card, NASTRAN_EDGES[kind]), (cells[1 : len(card) + 1], ABAQUS_EDGES[kind])):
        for middle, (a, b) in zip(nodes[corners:], edges, strict=True):
            ends = (at[nodes[int(a) - 1]] + at[nodes[int(b) - 1]]) / 2
            assert at[middle] == pytest.approx(ends, abs=1e-12)


@pytest.mark.parametrize(("write", "read"), FORMATS)
def test_held_translations_survive_a_file(write, read, tmp_path):
    model = box("hex8", held=False)
    held = np.zeros_like(model.held)
    held[model.nodes[:, 0] < 1e-9] = [True, False, True]
    back = read(write(replace(model, held=held), tmp_path / "m", units="mm-t-s"), units="mm-t-s")
    keep = np.isin(back.labels, model.labels)
    assert np.array_equal(back.held[keep], held)


NASTRAN = """\
SOL 103
CEND
SPC = 7
BEGIN BULK
PARAM,WTMASS,0.001
CORD2C         5              1.      0.      0.      1.      0.      1.+
+             2.      0.      0.
$ free, small and large fields, a cylindrical system, exponents without E
GRID,1,,0.,0.,0.
GRID           2              1.      0.      0.
GRID*                  3                            1.+0             1.0
*                    0.0
GRID    4               0.      1.      0.
GRID,5,5,1.0,180.,1.0
GRID,6,,1.,0.,1.
GRID*   7                               1.0D0           1.0E+0
*       1.
GRID,8,,0.,1.,1.
GRID,99,,2.,.5,.5
CHEXA          1       3       1       2       3       4       5       6+A
+A             7       8
PSOLID         3       4
MAT1           4  2.1+11             0.3  7.85+6
RBE2,11,99,123456,2,3,6,7
SPC1,7,123,1,4
SPC1,7,123,5,THRU,5
SPC,7,8,13,0.0
SPC1,8,3,2
SET1,1,1,THRU,3
ENDDATA
"""


def test_nastran_fields_systems_sets_and_mass_factor(tmp_path):
    path = tmp_path / "cube.bdf"
    path.write_text(NASTRAN)
    model = read_solid_model(path, units="m-kg-s")
    at = {int(label): point for label, point in zip(model.labels, model.nodes, strict=True)}
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1.0]])
    assert np.allclose([at[i] for i in range(1, 9)], corners, atol=1e-12)
    assert model.blocks[0].material.young == 2.1e11
    assert model.blocks[0].material.density == pytest.approx(7850.0)
    row = {int(label): i for i, label in enumerate(model.labels)}
    assert model.held[[row[i] for i in (1, 4, 5)]].all()
    assert model.held[row[8]].tolist() == [True, False, True]
    assert not model.held[row[2]].any()
    assert model.labels[model.rigid_sets[0].nodes].tolist() == [2, 3, 6, 7]
    assert model.rigid_sets[0].reference.tolist() == [2.0, 0.5, 0.5]
    assert model.labels[model.groups["SET1 1"]].tolist() == [1, 2, 3]
    assert read_nastran(path, units="m-kg-s", spc=8).held.sum() == 1


@pytest.mark.parametrize("last", [12, 99999999])
def test_ranges_take_the_grid_points_that_there_are(tmp_path, last):
    """Quick Reference Guide, SPC1: points in a sequence THRU need not exist."""
    path = tmp_path / "ranges.bdf"
    text = NASTRAN.replace("SPC1,7,123,5,THRU,5", f"SPC1,7,123,4,THRU,{last}")
    path.write_text(
        text.replace("SET1,1,1,THRU,3", f"SET1,1,0,THRU,{last},BY,4")
        .replace("GRID,99,", "GRID,999999999,")
        .replace(",99,", ",999999999,")
    )
    model = read_nastran(path, units="m-kg-s")
    assert model.labels[model.held.all(axis=1)].tolist() == [1, 4, 5, 6, 7, 8]
    assert model.labels[model.groups["SET1 1"]].tolist() == [4, 8]


def test_subcases_held_differently_are_read_by_spc(tmp_path):
    path = tmp_path / "subcases.bdf"
    path.write_text(NASTRAN.replace("SPC = 7", "SUBCASE 1\nSPC = 7\nSUBCASE 2\nSPC = 8"))
    assert read_nastran(path, units="m-kg-s", spc=8).held.sum() == 1
    path.write_text(NASTRAN.replace("SPC = 7", "SUBCASE 1\nSPC = 7\nSUBCASE 2\nSPC = 7"))
    assert read_nastran(path, units="m-kg-s").held.sum() == 11


ABAQUS = """\
*HEADING
*PART, NAME=Case
*NODE
1, 0., 0., 0.
2, 1., 0., 0.
3, 1., 1., 0.
4, 0., 1., 0.
5, 0., 0., 1.
6, 1., 0., 1.
7, 1., 1., 1.
8, 0., 1., 1.
*ELEMENT, TYPE=C3D8R, ELSET=All
1, 1, 2, 3, 4,
5, 6, 7, 8
*NSET, NSET=bottom, GENERATE
1, 4, 1
*SOLID SECTION, ELSET=all, MATERIAL=Steel
,
*END PART
*ASSEMBLY, NAME=Assembly
*INSTANCE, NAME=Case-1, PART=Case
*END INSTANCE
*NODE
1, 2., 0.5, 0.5
*NSET, NSET=Ref
1,
*NSET, NSET=corner, INSTANCE=Case-1
8,
*ELSET, ELSET=seat, INSTANCE=Case-1
1
*SURFACE, TYPE=ELEMENT, NAME=Seat
seat, S4
*COUPLING, CONSTRAINT NAME=A1, REF NODE=Ref, SURFACE=Seat
*KINEMATIC
*END ASSEMBLY
*MATERIAL, NAME=Steel
*DENSITY
7.85e-09,
*ELASTIC
210000., 0.3
*BOUNDARY
bottom, PINNED
Case-1.8, 3, 3
*STEP
*END STEP
"""


def test_abaqus_part_assembly_surface_and_coupling(tmp_path):
    path = tmp_path / "cube.inp"
    path.write_text(ABAQUS)
    model = read_solid_model(path, units="mm-t-s")
    assert model.blocks[0].material.young == pytest.approx(210e9)
    assert model.blocks[0].material.density == pytest.approx(7850.0)
    seat = model.rigid_sets[0]
    assert seat.name == "A1"
    assert seat.reference == pytest.approx([2e-3, 0.5e-3, 0.5e-3])
    # face S4 of C3D8 is 2-3-7-6, at x = 1
    assert model.nodes[seat.nodes, 0] == pytest.approx([1e-3] * 4)
    row = {int(label): i for i, label in enumerate(model.labels)}
    assert model.held[[row[i] for i in (1, 2, 3, 4)]].all()
    assert model.held[row[8]].tolist() == [False, False, True]
    assert model.labels[model.groups["corner"]].tolist() == [8]


def read_changed(tmp_path, *changes):
    """The Abaqus file with some text replaced, read."""
    text = ABAQUS
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    (tmp_path / "changed.inp").write_text(text)
    return read_abaqus(tmp_path / "changed.inp", units="mm-t-s")


TWICE = ("*NSET, NSET=Ref\n1,\n", "*NSET, NSET=Ref\n1,\n*NSET, NSET=BOTTOM, INSTANCE=Case-1\n5, 6\n")
"""The assembly has a set of the name that one of the part has."""


@pytest.mark.parametrize(("name", "held"), [("bottom", [5, 6, 8]), ("Case-1.bottom", [1, 2, 3, 4, 8])])
def test_sets_of_one_name_in_part_and_assembly_are_two(tmp_path, name, held):
    model = read_changed(tmp_path, TWICE, ("bottom, PINNED", f"{name}, PINNED"))
    assert model.labels[model.held[:, 2]].tolist() == held
    groups = {key: model.labels[nodes].tolist() for key, nodes in model.groups.items()}
    assert groups["BOTTOM"] == [5, 6]
    assert groups["CASE-1.bottom"] == [1, 2, 3, 4]


def test_names_inside_the_part_are_the_parts(tmp_path):
    """A rigid body and a boundary that the part defines, though they are applied when all is read."""
    inside = "*RIGID BODY, TIE NSET=bottom, REF NODE=9\n*END PART"
    model = read_changed(tmp_path, TWICE, ("*END PART", inside), ("8, 0., 1., 1.\n", "8, 0., 1., 1.\n9, 0., 0., -1.\n"))
    body = next(rigid for rigid in model.rigid_sets if rigid.label == 9)
    assert model.labels[body.nodes].tolist() == [1, 2, 3, 4]


def test_names_of_sets_have_no_case(tmp_path):
    model = read_changed(tmp_path, ("1, 4, 1\n", "1, 2, 1\n*NSET, NSET=BOTTOM\n3, 4\n"))
    assert model.labels[model.groups["bottom"]].tolist() == [1, 2, 3, 4]
    assert set(model.groups) == {"bottom", "Ref", "corner"}


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("bottom, PINNED", "1, PINNED", "node 1 is in the assembly and in instance CASE-1: write CASE-1.1"),
        (
            "bottom, PINNED",
            "Case-2.bottom, PINNED",
            "'Case-2.bottom' is in 'Case-2', which is not read; there is instance",
        ),
        ("*END INSTANCE", "*NSET, NSET=bottom\n8\n*END INSTANCE", "set bottom is defined in the part and in instance"),
        ("*ASSEMBLY", "*PART, NAME=Lid\n*END PART\n*ASSEMBLY", "part Lid is not the only one"),
        ("PART=Case", "PART=Lid", "instance Case-1 is of part LID, there is CASE"),
        ("*NSET, NSET=Ref", "*ELEMENT, TYPE=C3D4\n9, 1, 2, 3, 4\n*NSET, NSET=Ref", "C3D4 in the assembly"),
        ("*END INSTANCE", "*END INSTANCE\n*INSTANCE, NAME=B, PART=Case\n*END INSTANCE", "several instances"),
    ],
)
def test_ambiguous_names_and_parts_are_refused_with_the_remedy(tmp_path, old, new, message):
    with pytest.raises(InputError, match=message):
        read_changed(tmp_path, (old, new))


def test_calculix_rigid_body_held_at_both_reference_nodes(tmp_path):
    text = ABAQUS[: ABAQUS.index("*SURFACE")].replace("*PART, NAME=Case\n", "").replace("*END PART\n", "")
    text = text[: text.index("*ASSEMBLY")] + "*NODE\n9, 2., .5, .5\n10, 2., .5, .5\n*NSET, NSET=END\n2, 3, 6, 7\n"
    text += "*RIGID BODY, NSET=END, REF NODE=9, ROT NODE=10\n" + ABAQUS[ABAQUS.index("*MATERIAL") :]
    text = text.replace("bottom, PINNED\nCase-1.8, 3, 3", "9, 1, 3\n10, 1, 2")
    path = tmp_path / "rigid.inp"
    path.write_text(text)
    assert read_abaqus(path, units="mm-t-s").rigid_sets[0].held.tolist() == [True, True, True, True, True, False]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("RBE2,11,99,123456,", "RBE3,11,,99,123456,1.,123,", "1 RBE3, which are not read"),
        ("RBE2,11,99,123456,", "RBE2,11,99,12,", "couples components 12 only"),
        ("RBE2,11,99,123456,", "CSEAM,11,99,1,2,", "1 CSEAM, which are not read"),
        ("SPC = 7", "SPC = 7\nK2GG = STIFF", "case control adds matrices, K2GG = STIFF"),
        ("SPC = 7", "", "constraint sets 7, 8"),
        ("SPC = 7", "SPC = 3", "constraint set 3 is not there"),
        ("MAT1           4", "MAT1           5", "is not defined"),
        ("+A             7       8", "+A             7      77", "node 77 is not defined"),
        ("GRID,8,,0.,1.,1.", "GRID,8,,0.,x,1.", "not Nastran bulk data"),
        ("GRID,8,,0.,1.,1.", "CQUAD4,5,3,1,2,3,4", "1 CQUAD4"),
        ("SPC,7,8,13,0.0", "SPC,7,8,13,0.1", "enforces a motion"),
        ("MAT1           4", "MAT1,4,7.+10,,0.3,2.7+6\nMAT1           4", "MAT1 4 is defined twice"),
        ("PSOLID         3", "PSOLID,3,5\nPSOLID         3", "PSOLID 3 is defined twice"),
        ("SPC = 7", "SUBCASE 1\nSPC = 7\nSUBCASE 2\nSPC = 8", "selects constraint sets 7, 8 in turn: say which by spc"),
        ("SPC1,7,123,1,4", "SPC1,7,123,1,9", "a constraint: node 9 is not defined"),
        (
            "SPC = 7\nBEGIN BULK",
            "SPC = 6\nBEGIN BULK\nSPC1,6,123,50,THRU,60",
            "constraint set 6 holds no node that is defined",
        ),
    ],
)
def test_nastran_that_would_change_the_answer_is_refused(tmp_path, old, new, message):
    path = tmp_path / "bad.bdf"
    assert old in NASTRAN
    path.write_text(NASTRAN.replace(old, new, 1))
    with pytest.raises(InputError, match=message):
        read_nastran(path, units="m-kg-s")


HOLD = "*STEP\n*BOUNDARY\nCase-1.8, 1, 1\n"
SECTION = "*SOLID SECTION, ELSET=ALL, MATERIAL=Steel\n,\n"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("*KINEMATIC", "*DISTRIBUTING", r"\*DISTRIBUTING is not read"),
        ("*KINEMATIC", "*KINEMATIC COUPLING", r"\*KINEMATIC COUPLING is not read"),
        ("210000., 0.3", "210000., 0.3, 20.\n70000., 0.3, 400.", r"\*ELASTIC has 2 rows"),
        ("TYPE=C3D8R", "TYPE=S8R", "type S8R are not read"),
        ("*DENSITY\n7.85e-09,\n", "", "needs \\*ELASTIC and \\*DENSITY"),
        ("*SOLID SECTION, ELSET=all", "*SOLID SECTION, ELSET=seat2", "section for set seat2, which is not defined"),
        ("Case-1.8, 3, 3", "Case-1.8, 3, 3, 0.5", "only 0 can be held"),
        ("bottom, PINNED", "bottem, PINNED", "'bottem' is not defined"),
        ("210000., 0.3", "2.1e5, 0.6", "poisson"),
        ("*STEP\n", "*STEP\n*BOUNDARY, OP=NEW\nCase-1.8, 1, 1\n", "OP=NEW takes back what was held before"),
        ("*STEP\n", f"{HOLD}*END STEP\n{HOLD}", r"\*BOUNDARY in steps 1, 2: which of them holds"),
        ("\n,\n*END PART", f"\n,\n{SECTION}*END PART", "element 1 has two sections, of sets all and ALL"),
        ("\n,\n*END PART", f"\n,\n*ELSET, ELSET=Some\n1\n{SECTION}*END PART".replace("=ALL", "=Some"), "all and Some"),
        ("8, 0., 1., 1.\n", "8, 0., 1., 1.\n8, 0., 1., 2.\n", "node 8 is defined twice, at different places"),
        ("5, 6, 7, 8\n", "5, 6, 7, 8\n1, 1, 2, 3, 4, 5, 6, 8, 7\n", "element 1 is defined twice"),
        ("*DENSITY", "*DENSITY\n2.7e-9\n*MATERIAL, NAME=STEEL\n*DENSITY", "material STEEL is defined twice"),
    ],
)
def test_abaqus_that_would_change_the_answer_is_refused(tmp_path, old, new, message):
    path = tmp_path / "bad.inp"
    assert old in ABAQUS
    path.write_text(ABAQUS.replace(old, new, 1))
    with pytest.raises(InputError, match=message):
        read_abaqus(path, units="mm-t-s")


def test_boundary_of_the_model_and_of_one_step_add_up(tmp_path):
    same = ("8, 0., 1., 1.\n", "8, 0., 1., 1.\n8, 0., 1., 1.\n")
    step = ("*STEP\n", "*STEP\n*END STEP\n*STEP\n*BOUNDARY, OP=MOD\nCase-1.8, 1, 1\n")
    model = read_changed(tmp_path, same, step)
    assert model.held[model.labels == 8].tolist() == [[True, False, True]]


def test_wrong_units_are_recognised_by_the_material(tmp_path):
    path = write_nastran(box("hex8"), tmp_path / "box.bdf", units="mm-t-s")
    with pytest.raises(InputError, match=r"read in m-kg-s.*may be in mm-t-s"):
        read_nastran(path, units="m-kg-s")
    with pytest.raises(InputError, match="unit system 'SI' is not known"):
        read_nastran(path, units="SI")


@pytest.mark.parametrize(
    ("name", "young", "density"),
    [
        ("m-kg-s", 210e9, 7850.0),
        ("mm-t-s", 210e3, 7.85e-9),
        ("mm-kg-ms", 210.0, 7.85e-6),
        ("in-lbf-s", 30.458e6, 7.3453e-4),
    ],
)
def test_unit_systems_give_steel_its_handbook_values(name, young, density):
    steel = unit_system(name).material(young, 0.3, density, "steel")
    assert steel.young == pytest.approx(210e9, rel=1e-4)
    assert steel.density == pytest.approx(7850.0, rel=1e-4)


@pytest.mark.parametrize(
    ("text", "cut", "statement", "name"),
    [
        (NASTRAN, "PSOLID", "INCLUDE 'rest.bdf'", "rest.bdf"),
        (ABAQUS, "*MATERIAL", "*INCLUDE, INPUT=rest.inp", "rest.inp"),
    ],
)
def test_included_files_stand_in_their_place(tmp_path, text, cut, statement, name):
    units = "m-kg-s" if name.endswith("bdf") else "mm-t-s"
    at = text.index(cut)
    whole, main = tmp_path / f"whole{name[4:]}", tmp_path / f"main{name[4:]}"
    whole.write_text(text)
    main.write_text(f"{text[:at]}{statement}\n")
    (tmp_path / name).write_text(text[at:])
    one, two = read_solid_model(whole, units=units), read_solid_model(main, units=units)
    assert np.array_equal(one.nodes, two.nodes)
    assert two.blocks[0].material == one.blocks[0].material
    (tmp_path / name).write_text(f"{statement}\n")
    with pytest.raises(FileFormatError, match="includes itself"):
        read_solid_model(main, units=units)


def test_missing_file_and_foreign_ending_are_named(tmp_path):
    with pytest.raises(FileFormatError, match="cannot be read"):
        read_solid_model(tmp_path / "none.bdf", units="mm-t-s")
    with pytest.raises(InputError, match="is not a solid model"):
        read_solid_model(tmp_path / "none.op2", units="mm-t-s")


def parts_of_a_tetrahedron(*rigid):
    """One tetrahedron, two loose nodes, and rigid sets (name, reference, nodes)."""
    corners = {1: (0.0, 0, 0), 2: (1.0, 0, 0), 3: (0.0, 1, 0), 4: (0.0, 0, 1), 5: (2.0, 0, 0), 6: (3.0, 0, 0)}
    parts = Parts("a.bdf", nodes=corners, materials={"1": STEEL}, rigid=[Rigid(*one) for one in rigid])
    parts.elements["tet4", "1"] = ([1], [[1, 2, 3, 4]])
    return parts


def test_rigid_sets_with_one_reference_node_are_one_body():
    (body,) = parts_of_a_tetrahedron(("10", 5, [1, 2]), ("11", 5, [2, 3])).model(1.0).rigid_sets
    assert body.nodes.tolist() == [0, 1, 2]
    assert body.label == 5


def test_a_rigid_set_that_carries_the_reference_of_another_is_refused():
    with pytest.raises(InputError, match="rigid set 11 carries node 5, the reference node of another"):
        parts_of_a_tetrahedron(("10", 5, [1, 2]), ("11", 6, [3, 5])).model(1.0)
