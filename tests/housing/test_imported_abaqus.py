"""Abaqus input: parts, instances and where they are, the names in them, surfaces, couplings, and what is refused."""

import numpy as np
import pytest

from nvhchain.errors import FileFormatError, InputError
from nvhchain.interop import read_abaqus, read_solid_model
from tests.housing.abaqus_input import ABAQUS


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


def test_mesh_may_stand_in_the_instance_and_its_sets_in_pieces(tmp_path):
    """As Abaqus/CAE writes independent instances: the part is empty."""
    mesh = ABAQUS[ABAQUS.index("*NODE") : ABAQUS.index("*END PART")]
    pieces = mesh.replace("1, 4, 1\n", "1, 2, 1\n*NSET, NSET=bottom\n3, 4\n")
    moved = [(mesh, ""), ("PART=Case\n*END", f"PART=Case\n{pieces}*END")]
    plain, model = read_changed(tmp_path), read_changed(tmp_path, *moved)
    assert np.array_equal(model.nodes, plain.nodes)
    assert np.array_equal(model.held, plain.held)
    assert model.groups["bottom"].tolist() == plain.groups["bottom"].tolist()


def test_names_of_sets_have_no_case(tmp_path):
    model = read_changed(tmp_path, ("1, 4, 1\n", "1, 2, 1\n*NSET, NSET=BOTTOM\n3, 4\n"))
    assert model.labels[model.groups["bottom"]].tolist() == [1, 2, 3, 4]
    assert set(model.groups) == {"bottom", "Ref", "corner"}


SECOND = "*INSTANCE, NAME=B, PART=Case\n1., 0., 0.\n1., 0., 0., 1., 0., 1., 90.\n*END INSTANCE"
"""Beside the first, turned from x to y about the edge between both."""


def test_instance_is_moved_then_turned(tmp_path):
    """Abaqus Keywords Guide, *INSTANCE: the translation comes first.  (x, y) goes to (x + 1, y), then to (1 − y, x)."""
    moved = SECOND[SECOND.index("\n") : SECOND.index("\n*END")]
    plain, model = read_changed(tmp_path), read_changed(tmp_path, ("PART=Case", f"PART=Case{moved}"))
    x, y, z = 1e3 * plain.nodes[plain.labels <= 8].T
    assert 1e3 * model.nodes[model.labels <= 8] == pytest.approx(np.column_stack([1 - y, x, z]), abs=1e-12)
    assert np.array_equal(model.nodes[model.labels > 8], plain.nodes[plain.labels > 8])  # of the assembly
    assert np.array_equal(model.held, plain.held)


def test_instances_of_one_part_are_two_bodies_in_one_coupling(tmp_path):
    """Both with nodes 1 … 8 and element 1; a surface of both and sets of each."""
    model = read_changed(
        tmp_path,
        ("*END INSTANCE", f"*END INSTANCE\n{SECOND}"),
        ("seat, S4", "seat, S4\nB.all, S1"),
        ("bottom, PINNED", "B.bottom, PINNED\nB.7, 1, 1"),
        ("*END PART", "*RIGID BODY, NSET=bottom, REF NODE=5\n*END PART"),
    )
    assert model.elements == 2
    assert {block.group for block in model.blocks} == {"CASE-1.all", "B.all"}
    first, second = (block.nodes[0] for block in model.blocks)
    x, y, z = 1e3 * model.nodes[first].T
    assert 1e3 * model.nodes[second] == pytest.approx(np.column_stack([1 - y, x, z]), abs=1e-12)
    bodies = {rigid.name: set(rigid.nodes) for rigid in model.rigid_sets}
    assert bodies["bottom"] == set(first[:5])
    assert bodies["B.bottom"] == set(second[:5])
    assert bodies["A1"] == {*first[[1, 2, 5, 6]], *second[[0, 1, 2, 3]]}
    assert model.held.sum(axis=1)[second].tolist() == [3, 3, 3, 3, 0, 0, 1, 0]
    assert model.held.sum(axis=1)[first].tolist() == [0, 0, 0, 0, 0, 0, 0, 1]
    assert model.groups["B.bottom"].tolist() == second[:4].tolist()
    assert model.groups["CASE-1.bottom"].tolist() == first[:4].tolist()
    assert model.labels[first].tolist() == list(range(1, 9))


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
        ("*END PART\n", "", "part CASE does not end"),
        (ABAQUS[ABAQUS.index("*ASSEMBLY") : ABAQUS.index("*MATERIAL")], "", r"part CASE has no \*INSTANCE"),
        ("PART=Case", "PART=Lid", "instance Case-1 is of part LID, there is CASE"),
        ("*NSET, NSET=Ref", "*ELEMENT, TYPE=C3D4\n9, 1, 2, 3, 4\n*NSET, NSET=Ref", "C3D4 in the assembly"),
        ("*END INSTANCE", f"*END INSTANCE\n{SECOND}", "set 'bottom' is in instances CASE-1, B: write CASE-1.bottom"),
        ("*END INSTANCE", f"*END INSTANCE\n{SECOND.replace('=B', '=CASE-1')}", "instance CASE-1 is there twice"),
        ("PART=Case\n", "PART=Case\n0., 0., 1.\n0., 0., 0., 0., 0., 0., 90.\n", "axis between one point and itself"),
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


HOLD = "*STEP\n*BOUNDARY\nCase-1.8, 1, 1\n"
SECTION = "*SOLID SECTION, ELSET=ALL, MATERIAL=Steel\n,\n"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("*KINEMATIC", "*DISTRIBUTING, WEIGHTING METHOD=LINEAR", "has weights by LINEAR"),
        ("*KINEMATIC", "*KINEMATIC COUPLING, REF NODE=Ref\ncorner, 1, 2", r"COUPLING of corner couples \['1', '2'\]"),
        ("210000., 0.3", "210000., 0.3, 20.\n70000., 0.3, 400.", r"\*ELASTIC has 2 rows"),
        ("TYPE=C3D8R", "TYPE=C3D5", "type C3D5 are not read"),
        ("*DENSITY\n7.85e-09,\n", "", "needs \\*ELASTIC and \\*DENSITY"),
        ("*SOLID SECTION, ELSET=all", "*SOLID SECTION, ELSET=seat2", "section for set seat2, which is not defined"),
        ("Case-1.8, 3, 3", "Case-1.8, 3, 3, 0.5", "only 0 can be held"),
        ("bottom, PINNED", "bottem, PINNED", "'bottem' is not defined"),
        ("210000., 0.3", "2.1e5, 0.6", "poisson"),
        ("*STEP\n", "*STEP\n*BOUNDARY, OP=NEW\nCase-1.8, 1, 1\n", "OP=NEW releases earlier supports"),
        ("*STEP\n", f"{HOLD}*END STEP\n{HOLD}", r"\*BOUNDARY in steps 1, 2: which of them holds"),
        ("\n,\n*END PART", f"\n,\n{SECTION}*END PART", "element 1 has two sections, of sets all and ALL"),
        ("\n,\n*END PART", f"\n,\n*ELSET, ELSET=Some\n1\n{SECTION}*END PART".replace("=ALL", "=Some"), "all and Some"),
        ("8, 0., 1., 1.\n", "8, 0., 1., 1.\n8, 0., 1., 2.\n", "node 8 is defined twice, at different places"),
        ("5, 6, 7, 8\n", "5, 6, 7, 8\n1, 1, 2, 3, 4, 5, 6, 8, 7\n", "element 1 is defined twice"),
        ("*DENSITY", "*DENSITY\n2.7e-9\n*MATERIAL, NAME=STEEL\n*DENSITY", "material STEEL is defined twice"),
        ("*DENSITY", "*ELASTIC\n70000., 0.3\n*DENSITY", r"material STEEL has \*ELASTIC twice"),
        ("*DENSITY", "*DENSITY\n2.7e-9,\n*DENSITY", r"material STEEL has \*DENSITY twice"),
        ("*DENSITY\n", "*DENSITY\n2.7e-9, 20.\n", r"\*DENSITY has 2 rows"),
        ("*STEP\n", "*STEP\n*MODEL CHANGE, REMOVE\nCase-1.all\n", r"\*MODEL CHANGE takes elements out"),
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


@pytest.mark.parametrize(
    ("keyword", "data"),
    [
        ("*NODE", ABAQUS[ABAQUS.index("1, 0., 0.") : ABAQUS.index("*ELEMENT")]),
        ("*ELEMENT, TYPE=C3D8R, ELSET=All", "1, 1, 2, 3, 4,\n5, 6, 7, 8\n"),
        ("*NSET, NSET=bottom, GENERATE", "1, 4, 1\n"),
        ("*BOUNDARY", "bottom, PINNED\nCase-1.8, 3, 3\n"),
    ],
)
def test_data_in_a_file_of_its_own_stand_under_their_keyword(tmp_path, keyword, data):
    (tmp_path / "data.txt").write_text(data)
    apart = (f"{keyword}\n{data}", f"{keyword}, INPUT=data.txt\n")
    whole, model = read_changed(tmp_path), read_changed(tmp_path, apart)
    assert np.array_equal(model.nodes, whole.nodes)
    assert np.array_equal(model.blocks[0].nodes, whole.blocks[0].nodes)
    assert np.array_equal(model.groups["bottom"], whole.groups["bottom"])
    assert np.array_equal(model.held, whole.held)
    (tmp_path / "data.txt").unlink()
    with pytest.raises(FileFormatError, match=r"data\.txt: cannot be read"):
        read_changed(tmp_path, apart)


def test_orientation_changes_nothing_of_an_isotropic_solid(tmp_path):
    turned = (
        "*SOLID SECTION, ELSET=all",
        "*ORIENTATION, NAME=Turned\n0., 1., 0., -1., 0., 0.\n*SOLID SECTION, ORIENTATION=Turned, ELSET=all",
    )
    model = read_changed(tmp_path, turned)
    assert model.blocks[0].material == read_changed(tmp_path).blocks[0].material


@pytest.mark.parametrize(
    ("keyword", "members"),
    [
        ("*COUPLING, CONSTRAINT NAME=A1, REF NODE=Ref, SURFACE=Seat\n*KINEMATIC", [2, 3, 6, 7]),
        ("*RIGID BODY, NSET=Free, REF NODE=Case-1.7", [2, 3, 6, 7]),
        ("*MPC\nBEAM, Free, Case-1.7", [2, 3, 6, 7]),
        ("*KINEMATIC COUPLING, REF NODE=Case-1.7\nFree, 1, 6", [2, 3, 6, 7]),
        ("*KINEMATIC COUPLING, REF NODE=Case-1.7\nCase-1.2\nCase-1.6, 1, 3", [2, 6, 7]),
    ],
)
def test_reference_node_in_the_solid_moves_with_the_nodes_that_follow_it(tmp_path, keyword, members):
    old = "*COUPLING, CONSTRAINT NAME=A1, REF NODE=Ref, SURFACE=Seat\n*KINEMATIC"
    free = "*NSET, NSET=Free, INSTANCE=Case-1\n2, 3, 6\n"
    named = keyword.replace("REF NODE=Ref", "REF NODE=Case-1.7")
    model = read_changed(tmp_path, (old, f"{free}{named}"))
    (body,) = model.rigid_sets
    assert body.label == 7
    assert model.labels[body.nodes].tolist() == members


def test_exponents_follow_e_or_d(tmp_path):
    model = read_changed(tmp_path, ("7.85e-09", "7.85D-09"), ("210000.", "2.1d5"), ("3, 1., 1., 0.", "3, 1.D0, 1., 0."))
    assert model.blocks[0].material.density == pytest.approx(7850.0)
    assert model.blocks[0].material.young == pytest.approx(210e9)
    assert model.nodes[2].tolist() == [1e-3, 1e-3, 0.0]
