"""Castings in STEP files: what is found in them, what is refused, and their elements against known bodies."""

from dataclasses import replace
from pathlib import Path
from random import Random

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.case import Cad
from nvhchain.conventions import ALUMINIUM, STEEL
from nvhchain.errors import InputError
from nvhchain.fem import lowest_modes, stiffness_and_mass
from nvhchain.fem.solid_model import ElementBlock, SolidModel
from nvhchain.fidelity import DRAFT, HousingFidelity
from nvhchain.housing import CadBolt, CadPart, CadSeat, cad_model, survey
from nvhchain.housing.cad import _gmsh
from nvhchain.housing.cad.cylinders import find_bolts, find_seats, holes
from nvhchain.housing.casting.mesh import mesh_casting
from nvhchain.housing.casting.solids import bolt_circle, casting_recipe
from nvhchain.housing.imported.repair import sound_mesh
from nvhchain.housing.imported.solid_model import append_seats, constrained
from nvhchain.housing.modes.mounting_plane import MountingPlane
from nvhchain.housing.reduction import held_matrices
from tests.housing.step_files import write_casting, write_step

CASE = Path(__file__).parents[2] / "cases/small/cad.toml"
COARSE = HousingFidelity(element_size=0.017, elements_per_turn=8.0)


@pytest.fixture(scope="module")
def case():
    return nvh.load_case(CASE)


@pytest.fixture(scope="module")
def found(case):
    return case.housing.survey(case, COARSE)


@pytest.mark.slow
def test_seats_bolts_and_walls_of_the_example_are_found(case, found):
    radii = {name: round(1e3 * seat.radius, 6) for name, seat in found.seats.items()}
    assert radii == {"A1": 22.0, "A2": 22.0, "B1": 24.0, "B2": 24.0}
    assert len(found.bolts) == 6
    assert found.wall == pytest.approx(5e-3, rel=1e-6)
    assert found.notes == ("2 faces smaller than 1.5 mm removed",)
    shape = case.housing.shape(case, COARSE)
    around = shape.nodes[shape.seats["B2"]] - [68.54129e-3, 0.0, 0.0]
    assert np.allclose(np.hypot(*around[:, :2].T), 0.024, rtol=1e-6)


@pytest.mark.slow
def test_mass_of_the_elements_is_that_of_the_solid(case, found):
    with pytest.warns(nvh.errors.AccuracyWarning, match="2 faces"):
        model, seats = case.housing.model(case, COARSE)
    model, _ = sound_mesh(append_seats(model, seats))
    block = model.blocks[0]
    _, M = stiffness_and_mass(model.nodes, block.nodes, block.kind, block.material)
    each = M @ np.ones((M.shape[0], 1))
    mass = float(each[::3].sum())
    assert mass == pytest.approx(block.material.density * found.volume, rel=2e-3)
    assert model.nodes[:, 2].min() == pytest.approx(0.0, abs=1e-9)
    assert [seat.name for seat in seats] == list(case.seats)
    assert [bolt.held.all() for bolt in model.rigid_sets] == [True] * 6 + [False] * 4
    assert found.unknowns(0.017, 0.017) == pytest.approx(3 * len(model.nodes), rel=0.15)


def test_cantilever_in_a_step_file_has_the_frequency_of_a_beam(tmp_path):
    write_step(tmp_path / "beam.step", "occ.addBox(0, 0, 0, 300, 12, 8)")
    job = {
        "file": str(tmp_path / "beam.step"),
        "size": 8,
        "smallest": 4,
        "per_turn": 16,
        "ignore": 0,
        "lengths": [0, 1e4],
        "dimension": 3,
    }
    made = _gmsh.mesh(job)
    nodes = 1e-3 * made["nodes"]
    K, M = stiffness_and_mass(nodes, made["elements"], "tet10", STEEL)
    free = np.repeat(nodes[:, 0] > 1e-9, 3)
    frequency, _ = lowest_modes(K[free][:, free], M[free][:, free], 500.0)
    beam = 1.87510407**2 / (2 * np.pi * 0.3**2) * np.sqrt(STEEL.young / STEEL.density / 12) * np.array([8e-3, 12e-3])
    assert frequency[:2] == pytest.approx(beam, rel=5e-3)
    assert float(made["volume"]) == pytest.approx(300 * 12 * 8)


@pytest.mark.slow
def test_elements_as_long_as_a_fillet_are_straightened_and_not_refused(tmp_path):
    """Flat elements on a fillet have two arcs that cross: their mid-edge nodes come close, and are right."""
    write_step(
        tmp_path / "box.step",
        """
outer, inner = occ.addBox(0, 0, 0, 90, 65, 50), occ.addBox(5, 5, 5, 80, 55, 40)
occ.synchronize()
edges = gmsh.model.getBoundary(gmsh.model.getBoundary([(3, inner)], oriented=False), combined=False, oriented=False)
inner = occ.fillet([inner], sorted({tag for _, tag in edges}), [4])[0][1]
occ.cut([(3, outer)], [(3, inner)])
""",
    )
    job = {"file": str(tmp_path / "box.step"), "size": 13, "smallest": 6.5, "per_turn": 16, "ignore": 0}
    made = _gmsh.mesh(job | {"lengths": [0, 1e4], "dimension": 3})
    count, elements = len(made["nodes"]), made["elements"]
    block = ElementBlock("tet10", elements, ALUMINIUM, np.arange(1, len(elements) + 1))
    box = SolidModel(1e-3 * made["nodes"], np.arange(1, count + 1), (block,), (), np.zeros((count, 3), dtype=bool))
    sound, notes = sound_mesh(box)
    assert any("overlapped themselves straightened" in note for note in notes)
    _, M = stiffness_and_mass(sound.nodes, sound.blocks[0].nodes, "tet10", ALUMINIUM)
    mass = float((M @ np.ones((M.shape[0], 1)))[::3].sum())
    assert mass == pytest.approx(1e-9 * float(made["volume"]) * ALUMINIUM.density, rel=0.01)


def test_holes_far_smaller_than_the_elements_are_meshed(tmp_path):
    """Long elements cross each other in tapped holes of 4 mm; elements there are made smaller, not the part refused."""
    write_step(
        tmp_path / "frame.step",
        """
body, _ = occ.cut([(3, occ.addBox(0, 0, 0, 90, 65, 50))], [(3, occ.addBox(8.2, 8.2, -1, 73.6, 48.6, 43))])
occ.cut(body, [(3, occ.addCylinder(x, y, -1, 0, 0, 20, 2)) for x in (4.1, 85.9) for y in (4.1, 60.9)])
""",
    )
    job = {"file": str(tmp_path / "frame.step"), "size": 13, "smallest": 6.5, "per_turn": 16, "ignore": 0}
    made = _gmsh.mesh(job | {"lengths": [0, 1e4], "dimension": 3})
    corners = made["nodes"][made["elements"][:, :4]]
    volume = np.linalg.det(corners[:, 1:] - corners[:, :1]).sum() / 6
    assert volume == pytest.approx(float(made["volume"]), rel=0.01)


@pytest.mark.slow
def test_parametric_casting_as_step_has_the_same_modes(casting, tmp_path):
    fidelity = HousingFidelity(element_size=0.019, elements_per_turn=8.0, elements_per_bending_wavelength=3.0)
    mesh = mesh_casting(casting, fidelity)
    K, M, _ = held_matrices(mesh, casting)
    own, _ = lowest_modes(K, M, 4000.0)
    write_casting(tmp_path / "casting.step", casting_recipe(casting, 0.019, 8.0))
    bolts = tuple(CadBolt((*map(float, axis), 0.005)) for axis in bolt_circle(casting))
    part = CadPart("casting.step", material=casting.material, bolts=bolts)
    model, seats = cad_model(
        part, tmp_path, {bore.name: bore.centre for bore in casting.bores}, f_max=1000.0, fidelity=fidelity
    )
    K, M, _ = constrained(sound_mesh(append_seats(model, seats))[0])
    read, _ = lowest_modes(K, M, 4000.0)
    assert read[:5] == pytest.approx(own[:5], rel=5e-3)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:gear_case.step")
def test_a_step_casting_has_the_frequencies_of_elements_half_as_large(case):
    """The first ten, both corrected for their elements, within 1.3 %, and within the 95 % limits that they state.

    A bound of 0.5 % was that of a smaller correction, which moved the coarser mesh less (docs/decisions/0045).
    """
    contents = case.housing.read(case, 0.03)
    coarse, fine = (
        case.housing.reduce(case, contents, 0.03, replace(DRAFT.housing, element_size=size), None)
        for size in (DRAFT.housing.element_size, 0.5 * DRAFT.housing.element_size)
    )
    apart = coarse.natural_frequency[:10] / fine.natural_frequency[:10] - 1.0
    stated = np.hypot(coarse.accuracy.frequency_error[:10], fine.accuracy.frequency_error[:10])
    assert (np.abs(apart) < 2.0 * stated).all()
    assert np.abs(apart).max() < 0.013
    assert np.sqrt(np.mean(apart**2)) < 8e-3


@pytest.mark.slow
def test_wrong_unit_is_refused_with_the_scale_that_mends_it(case, tmp_path):
    text = (CASE.parent / "gear_case.step").read_text()
    assert "SI_UNIT(.MILLI.,.METRE.)" in text
    (tmp_path / "metres.step").write_text(text.replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT($,.METRE.)"))
    part = replace(case.housing, file="metres.step")
    with pytest.raises(
        InputError, match=r"2.005e\+05 mm long.*its bearings lie 94 mm apart.*millimetres.*scale = 0\.001"
    ):
        survey(part, tmp_path, case.seats, COARSE)
    assert len(survey(replace(part, scale=1e-3), tmp_path, case.seats, COARSE).bolts) == 6


def test_part_in_another_frame_is_placed(case, found):
    """The file's x is taken for z, its z for x, and its origin for another point."""
    part = replace(case.housing, origin=(0.01, 0.02, 0.03), x_axis=(0.0, 0.0, 2.0), z_axis=(1.0, 0.0, 0.0))
    assert np.allclose(part.placed(np.array([[17.0, 21.0, 38.0]])), [[0.008, -0.001, 0.007]])
    assert np.linalg.det(part.rotation) == pytest.approx(1.0)
    with pytest.raises(InputError, match="not perpendicular"):
        replace(part, z_axis=(1.0, 0.0, 1.0))


@pytest.mark.slow
def test_all_missing_seats_are_named_with_the_cylinders_there(case):
    moved = dict(case.seats) | {"A1": (0.0, 0.0, 0.06), "B2": (0.070, 0.0, 0.127)}
    with pytest.raises(InputError) as refused:
        survey(case.housing, CASE.parent, moved, COARSE)
    text = str(refused.value)
    assert (
        "bearing A1 at x = 0, y = 0, z = 60 mm lies in none of the cylinders on its axis: radius 22 at x = 0, " in text
    )
    assert "z = 22…44 mm" in text
    assert "bearing B2 at x = 70, y = 0, z = 127 mm has no cylinder on its axis within 0.1 mm" in text
    named = replace(case.housing, seats=(CadSeat("B2", (0.0685, 0.0, 0.12)),))
    fixed = survey(named, CASE.parent, dict(case.seats) | {"B2": (0.070, 0.0, 0.127)}, COARSE)
    assert fixed.seats["B2"].radius == pytest.approx(0.024)


def test_unknown_bolt_diameter_lists_the_holes(case):
    with pytest.raises(InputError, match=r"bolt_diameter = 12 mm at the mounting plane; there are 6 of 10 mm"):
        survey(replace(case.housing, bolt_diameter=0.012), CASE.parent, case.seats, COARSE)


def row(face, centre, radius, low, high, angle=2 * np.pi, axis=(0.0, 0.0, 1.0), hole=1.0):
    return [face, *centre, *axis, radius, low, high, angle, hole]


def test_halves_and_grooves_of_a_seat_are_one_cylinder():
    halves = [row(1, (0, 0, 0), 0.02, 0, 0.01, np.pi), row(2, (0, 0, 0.01), 0.02, 0, 0.01, np.pi, (0.0, 0.0, -1.0))]
    halves[1][8:10] = 0.0, 0.01
    groove = [row(3, (0, 0, 0), 0.02, 0.012, 0.02), row(4, (0, 0, 0), 0.02, 0.05, 0.06)]
    both = holes(np.array([*halves, *groove, row(5, (0, 0, 0), 0.03, 0, 0.02, hole=-1.0)]))
    assert sorted(tuple(sorted(c.faces)) for c in both) == [(1, 2, 3), (4,)]
    part = CadPart("a.step")
    assert sorted(find_seats(part, both, {"A": (0, 0, 0.005)})["A"].faces) == [1, 2, 3]


@pytest.mark.parametrize(("angle", "count"), [(1.5 * np.pi, 2), (0.5 * np.pi, 1)], ids=["hole", "fillet"])
def test_a_bolt_hole_that_breaks_through_an_edge_is_one(angle, count):
    """It was excluded without a word, and a part on six bolts stood on two; a fillet of its radius is none."""
    found = holes(np.array([row(1, (0, 0, 0), 0.005, 0, 0.01), row(2, (0.05, 0, 0), 0.005, 0, 0.01, angle)]))
    part = CadPart("a.step", bolt_diameter=0.010, mounting_plane=MountingPlane((0, 0, 0), (0, 0, -1)))
    assert len(find_bolts(part, found, [])) == count


def test_seat_in_two_cylinders_is_refused_until_one_is_named():
    found = holes(np.array([row(1, (0, 0, 0), 0.02, 0, 0.02), row(2, (0, 0, 0), 0.05, -0.1, 0.1)]))
    with pytest.raises(
        InputError, match=r"lies in 2 cylinders: radius 20 at .*; radius 50 at .*: name one by its radius"
    ):
        find_seats(CadPart("a.step"), found, {"A": (0, 0, 0.01)})
    named = CadPart("a.step", seats=(CadSeat("A", (0, 0, 0.01), 0.02),))
    assert find_seats(named, found, {"A": (0, 0, 0.01)})["A"].faces == (1,)
    partly = holes(np.array([row(1, (0, 0, 0), 0.02, 0, 0.02), row(2, (0, 0, 0), 0.05, -0.1, 0.1, np.pi)]))
    assert find_seats(CadPart("a.step"), partly, {"A": (0, 0, 0.01)})["A"].faces == (1,)


@pytest.mark.parametrize(
    ("drawing", "why"),
    [
        (
            "b = occ.addBox(0, 0, 0, 90, 50, 40); occ.synchronize()\nocc.remove([(3, b)])\nocc.remove([(2, 1)], True)",
            r"holds 5 faces and no solid.*open edge at \[0, ",
        ),
        (
            "occ.addBox(0, 0, 0, 90, 50, 40); occ.addBox(0, 0, 41, 90, 50, 10)",
            r"its 2 solids do not hang together: the one at \[45, 25, 46\] mm touches none",
        ),
        ("occ.addRectangle(0, 0, 0, 30, 40)", "holds 1 faces and no solid"),
    ],
    ids=["open shell", "apart", "sheet"],
)
def test_part_that_is_no_closed_body_is_refused(drawing, why, tmp_path):
    write_step(tmp_path / "part.step", drawing)
    with pytest.raises(InputError, match=why):
        survey(CadPart("part.step"), tmp_path, {"A": (0, 0, 0)}, COARSE)


def test_file_that_is_no_step_is_refused(tmp_path):
    (tmp_path / "part.step").write_text("ISO-10303-21;\nnothing\n")
    with pytest.raises(InputError, match=r"part\.step: it .*AP214 or AP242"):
        survey(CadPart("part.step"), tmp_path, {"A": (0, 0, 0)}, COARSE)
    with pytest.raises(InputError, match="no such STEP file"):
        survey(CadPart("none.step"), tmp_path, {"A": (0, 0, 0)}, COARSE)
    with pytest.raises(InputError, match=r"'part\.iges' is no STEP file"):
        CadPart("part.iges")


@pytest.mark.slow
def test_touching_solids_share_their_faces(tmp_path):
    """Two halves of one beam with a seat in each vibrate as one body."""
    drawing = """
for x in (0, 60):
    low = occ.addBox(x, -15, 0, 60, 30, 20)
    occ.cut([(3, low)], [(3, occ.addCylinder(x + 30, 0, 0, 0, 0, 20, 8))])
"""
    write_step(tmp_path / "part.step", drawing)
    seats = {"A": (0.03, 0.0, 0.01), "B": (0.09, 0.0, 0.01)}
    job = survey(CadPart("part.step"), tmp_path, seats, COARSE)
    assert job.notes == ("2 solids bonded where they touch",)
    assert job.area == pytest.approx(
        1e-6 * (2 * 120 * 30 + 2 * 20 * 150 + 2 * (2 * np.pi * 8 * 20 - 2 * np.pi * 64)), rel=1e-6
    )
    with pytest.warns(nvh.errors.AccuracyWarning, match="2 solids bonded"):
        model, found = cad_model(CadPart("part.step"), tmp_path, seats, f_max=1000.0, fidelity=COARSE)
    sound_mesh(append_seats(model, found))


@pytest.mark.parametrize(
    ("place", "said"), [(60, []), (58, ["solids overlap by 1.9 % of their volume, which counts once"])]
)
def test_overlapping_solids_are_named(tmp_path, place, said):
    write_step(
        tmp_path / "part.step",
        f"""
for x in (0, {place}):
    low = occ.addBox(x, -15, 0, 60, 30, 20)
    occ.cut([(3, low)], [(3, occ.addCylinder(x + 30, 0, 0, 0, 0, 20, 8))])
""",
    )
    seats = {"A": (0.03, 0.0, 0.01), "B": (1e-3 * place + 0.03, 0.0, 0.01)}
    job = survey(CadPart("part.step"), tmp_path, seats, COARSE)
    assert [note.partition(":")[0] for note in job.notes if "overlap" in note] == said


BLOCK = """
block = occ.addBox(0, 0, 0, 80, 40, 20)
body, _ = occ.cut([(3, block)], [(3, occ.addCylinder(x, 20, 0, 0, 0, 20, 8)) for x in (20, 60)])
"""
SEATS = {"A": (0.02, 0.02, 0.01), "B": (0.06, 0.02, 0.01)}
VOLUME = 1e-9 * (80 * 40 * 20 - 2 * np.pi * 64 * 20)


def test_faces_that_close_are_sewn_and_those_that_do_not_name_an_open_edge(tmp_path):
    alone = "occ.remove(body); occ.synchronize()\n"
    write_step(tmp_path / "part.step", BLOCK + alone)
    job = survey(CadPart("part.step"), tmp_path, SEATS, COARSE)
    assert job.volume == pytest.approx(VOLUME, rel=1e-9)
    assert job.notes == ("its 8 faces were sewn into 1 solid",)
    of_the_bore = "occ.remove([f for f in occ.getEntities(2) if abs(occ.getMass(*f) - 1005.3) < 0.1][:1])\n"
    write_step(tmp_path / "open.step", BLOCK + alone + of_the_bore)
    with pytest.raises(InputError, match=r"holds 7 faces and no solid.*open edge at \[[26]0, 20, [02]0?\] mm"):
        survey(CadPart("open.step"), tmp_path, SEATS, COARSE)


@pytest.mark.parametrize(
    ("more", "faces"),
    [
        ("body, _ = occ.cut(body, [(3, occ.addCylinder(40, 20, 12, 0, 0, 8, 1.25))])", 2),
        ("drill = [(3, occ.addCylinder(40, 20, 12, 0, 0, 8, 1.25)), (3, occ.addCone(40, 20, 11, 0, 0, 1, 0, 1.25))]\n"
         "body, _ = occ.cut(body, drill)", 2),
        ("body, _ = occ.fuse(body, [(3, occ.addCylinder(40, 20, 20, 0, 0, 8, 1.2))])", 2),
    ],
    ids=["blind hole", "drilled hole", "pin"],
)  # fmt: skip
def test_small_blind_holes_and_pins_are_removed_with_their_ends(tmp_path, more, faces):
    write_step(tmp_path / "part.step", BLOCK + more)
    job = survey(CadPart("part.step", smallest_feature=1.5e-3), tmp_path, SEATS, COARSE)
    assert job.notes == (f"{faces} faces smaller than 1.5 mm removed",)
    assert job.volume == pytest.approx(VOLUME, rel=1e-9)


def test_small_faces_that_cannot_be_removed_stay_and_are_said(tmp_path):
    """A small step into an edge has no neighbours that could close it; so have several solids."""
    step = "body, _ = occ.cut(body, [(3, occ.addCylinder(40, 0, 20, 0, 6, 0, 1.2))])"
    write_step(tmp_path / "part.step", BLOCK + step)
    job = survey(CadPart("part.step", smallest_feature=1.5e-3), tmp_path, SEATS, COARSE)
    assert all("removed" in note or "stay" in note for note in job.notes)
    assert job.volume == pytest.approx(VOLUME, rel=2e-3)
    write_step(tmp_path / "two.step", BLOCK + "occ.addBox(0, 40, 0, 80, 1, 1)")
    job = survey(CadPart("two.step", smallest_feature=2e-3), tmp_path, SEATS, COARSE)
    assert any("stay: they are removed from a single solid only" in note for note in job.notes)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:gear_case.step")
def test_step_file_goes_to_sound(case, tmp_path):
    result = nvh.run(case, fidelity=DRAFT, out=tmp_path)
    assert isinstance(case.housing, Cad)
    assert result.pressure is not None
    level = 20 * np.log10(np.sqrt(0.5 * (np.abs(result.pressure.pressure[:, 0]) ** 2).sum()) / 20e-6)
    assert 50.0 < level < 75.0


def test_a_file_whose_reader_crashes_is_refused_as_damaged(tmp_path, request):
    """A few changed bytes leave references to lines that are gone."""
    step = bytearray((request.config.rootpath / "cases" / "small" / "gear_case.step").read_bytes())
    random = Random(6)
    random.choice("abcd")
    for _ in range(random.randint(1, 20)):
        step[random.randrange(len(step))] = random.randrange(256)
    (tmp_path / "part.step").write_bytes(step)
    with pytest.raises(InputError, match=r"part\.step: it cannot be read as STEP \(Unresolved Reference"):
        survey(CadPart("part.step"), tmp_path, {"A": (0, 0, 0)}, COARSE)
