"""Solid models through Nastran and Abaqus files: units, groups, rigid sets, constraints, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from nvhchain.conventions import STEEL
from nvhchain.errors import FileFormatError, InputError
from nvhchain.fem import lowest_modes
from nvhchain.housing.imported.repair import sound_mesh
from nvhchain.housing.imported.solid_model import constrained
from nvhchain.interop import read_abaqus, read_nastran, read_solid_model, write_abaqus, write_nastran
from nvhchain.interop.notation.units import unit_system
from nvhchain.interop.solids._model_parts import Parts, Rigid
from nvhchain.interop.solids.abaqus_keywords import blocks
from nvhchain.interop.solids.nastran_cards import cards, split_deck
from nvhchain.testing.elements import SPLITS, held_box
from tests.housing.abaqus_input import ABAQUS

FORMATS = [(write_nastran, read_nastran), (write_abaqus, read_abaqus)]
UNITS = ["m-kg-s", "mm-t-s", "mm-kg-ms", "in-lbf-s"]


def frequencies(model, top=4000.0):
    K, M, _ = constrained(sound_mesh(model)[0])
    return lowest_modes(K, M, top)[0]


@pytest.mark.parametrize("units", UNITS)
@pytest.mark.parametrize(("write", "read"), FORMATS)
def test_units_groups_and_rigid_sets_survive_a_file(write, read, units, tmp_path):
    model = held_box("hex8")
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
    model = sound_mesh(held_box(kind))[0] if quadratic else held_box(kind)
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
    model = sound_mesh(held_box(kind))[0]
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
    model = held_box("hex8", held=False)
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


def test_blank_numbers_of_a_coordinate_system_are_zero(tmp_path):
    path = tmp_path / "blank.bdf"
    system = NASTRAN[NASTRAN.index("CORD2C") : NASTRAN.index("$ free")]
    path.write_text(NASTRAN.replace(system, "CORD2C,5,,1.,,,1.,,1.\n+,2.\n"))
    assert read_nastran(path, units="m-kg-s").nodes[4] == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)


def test_subcases_held_differently_are_read_by_spc(tmp_path):
    path = tmp_path / "subcases.bdf"
    path.write_text(NASTRAN.replace("SPC = 7", "SUBCASE 1\nSPC = 7\nSUBCASE 2\nSPC = 8"))
    assert read_nastran(path, units="m-kg-s", spc=8).held.sum() == 1
    path.write_text(NASTRAN.replace("SPC = 7", "SUBCASE 1\nSPC = 7\nSUBCASE 2\nSPC = 7"))
    assert read_nastran(path, units="m-kg-s").held.sum() == 11


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("RBE2,11,99,123456,", "RSPLINE,11,,99,2,3,", "1 RSPLINE, which are not read .the first is RSPLINE, 11, 99, 2"),
        ("RBE2,11,99,123456,", "CSEAM,11,99,1,2,", "1 CSEAM, which are not read"),
        ("SPC = 7", "SPC = 7\nK2GG = STIFF", "case control adds matrices, K2GG = STIFF"),
        ("SPC = 7", "", "constraint sets 7, 8"),
        ("SPC = 7", "SPC = 3", "constraint set 3 is not there"),
        ("MAT1           4", "MAT1           5", "is not defined"),
        ("+A             7       8", "+A             7      77", "node 77 is not defined"),
        ("GRID,8,,0.,1.,1.", "GRID,8,,0.,x,1.", "not Nastran bulk data"),
        ("GRID,8,,0.,1.,1.", "GRID,8,6,0.,1.,1.", "GRID 8 is in coordinate system 6, which is not defined"),
        ("GRID,8,,0.,1.,1.", "CSHEAR,5,3,1,2,3,4", "1 CSHEAR"),
        ("SPC,7,8,13,0.0", "SPC,7,8,13,0.1", "enforces a motion"),
        ("MAT1           4", "MAT1,4,7.+10,,0.3,2.7+6\nMAT1           4", "MAT1 4 is defined twice"),
        ("PSOLID         3", "PSOLID,3,5\nPSOLID         3", "PSOLID 3 is defined twice"),
        ("PSOLID         3       4", "PSOLID,3,4,,,,,PFLUID", "PSOLID 3 is PFLUID, not structure"),
        ("PSOLID         3", "CTETRA,1,3,1,2,3,5\nPSOLID         3", "element 1 is defined twice"),
        ("SPC1,7,123,1,4", "RBE2,11,99,123456,6\nSPC1,7,123,1,4", "element 11 is defined twice"),
        (
            "SPC = 7",
            "SUBCASE 1\nSPC = 7\nSUBCASE 2\nSPC = 8",
            "selects constraint sets 7, 8 in turn: choose one by spc",
        ),
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


def test_lines_for_plots_only_change_nothing(tmp_path):
    path = tmp_path / "lines.bdf"
    path.write_text(NASTRAN.replace("PSOLID ", "PLOTEL,900,1,2\nPSOLID ", 1))
    assert read_nastran(path, units="m-kg-s").elements == 1


def test_wrong_units_are_recognised_by_the_material(tmp_path):
    path = write_nastran(held_box("hex8"), tmp_path / "box.bdf", units="mm-t-s")
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
        ("mm-kg-s", 210e6, 7.85e-6),
        ("in-lbf-s", 30.458e6, 7.3453e-4),
    ],
)
def test_unit_systems_give_steel_its_handbook_values(name, young, density):
    steel = unit_system(name).material(young, 0.3, density, "steel")
    assert steel.young == pytest.approx(210e9, rel=1e-4)
    assert steel.density == pytest.approx(7850.0, rel=1e-4)


@pytest.mark.parametrize(
    ("young", "density", "units", "message"),
    [
        (210e3, 0.0, "mm-t-s", "without mass nothing vibrates: give the density"),
        (30e6, 0.283, "in-lbf-s", r"as weight per volume it makes 783\d kg/m³: divide it by g = 386.089"),
        (210e6, 7.85e-6, "mm-t-s", "the file may be in mm-kg-s$"),
        (210.0, 785.0, "m-kg-s", "no unit system makes sense of both"),
        (210e3, 7.7e-5, "mm-t-s", r"as weight per volume it makes 785\d kg/m³: divide it by g = 9806"),
        (70e3, 2.65e-5, "mm-t-s", r"as weight per volume it makes 270\d kg/m³"),
        (210e3, 7.85e-6, "mm-t-s", "E fits mm-t-s, the density is that of mm-kg-ms or mm-kg-s: correct it"),
        (2.5e9, 1.2e-9, "mm-t-s", "no unit system"),
        (2500.0, 1.2e3, "mm-t-s", "no unit system"),
    ],
)
def test_a_material_that_makes_no_sense_is_named_for_its_fault(young, density, units, message):
    with pytest.raises(InputError, match=message):
        unit_system(units).material(young, 0.3, density, "steel")


@pytest.mark.parametrize(
    ("text", "cut", "statement", "name"),
    [
        (NASTRAN, "PSOLID", "INCLUDE 'rest.bdf'", "rest.bdf"),
        (NASTRAN, "PSOLID", "INCLUDE\n  'rest.bdf'", "rest.bdf"),
        (NASTRAN, "PSOLID", "  include './\n  rest.bdf'", "rest.bdf"),
        (ABAQUS, "*MATERIAL", "*INCLUDE, INPUT=rest.inp", "rest.inp"),
        (ABAQUS, "*MATERIAL", " *Include,\n input=rest.inp", "rest.inp"),
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


def test_includes_lie_beside_the_main_deck_too_and_may_have_backslashes(tmp_path):
    (tmp_path / "parts").mkdir()
    at, end = NASTRAN.index("PSOLID"), NASTRAN.index("MAT1")
    (tmp_path / "main.fem").write_text(f"{NASTRAN[:at]}INCLUDE 'parts\\solids.bdf'\n")
    (tmp_path / "parts" / "solids.bdf").write_text(f"{NASTRAN[at:end]}INCLUDE 'parts/steel.bdf'\n")
    (tmp_path / "parts" / "steel.bdf").write_text(NASTRAN[end:])
    assert read_solid_model(tmp_path / "main.fem", units="m-kg-s").blocks[0].material.young == 2.1e11
    (tmp_path / "main.fem").write_text("INCLUDE 'MODELS:solids.bdf'\n")
    with pytest.raises(FileFormatError, match="MODELS stands for a folder"):
        read_solid_model(tmp_path / "main.fem", units="m-kg-s")


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
