"""Archives of Ansys: the same body as from other files, and what is refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from nvhchain.errors import InputError
from nvhchain.fem import lowest_modes
from nvhchain.housing.imported.repair import sound_mesh
from nvhchain.housing.imported.seats import bearing_seats
from nvhchain.housing.imported.solid_model import append_seats, constrained
from nvhchain.interop import read_nastran, read_solid_model
from nvhchain.testing.elements import SPLITS, held_box
from tests.interop.ansys_files import FREEDOMS, archive, elements_block, nodes_block


def frequencies(model, top=4000.0):
    K, M, _ = constrained(sound_mesh(model)[0])
    return lowest_modes(K, M, top)[0]


@pytest.mark.parametrize("units", ["m-kg-s", "mm-t-s", "in-lbf-s"])
@pytest.mark.parametrize("joint", ["CE", "MPC184", "rigid"])
def test_units_components_and_rigid_bodies_of_every_kind(joint, units, tmp_path):
    model = held_box("hex8")
    back = read_solid_model(archive(model, tmp_path / "box.cdb", units=units, joint=joint), units=units)
    assert frequencies(back) == pytest.approx(frequencies(model), rel=1e-9)
    assert [r.label for r in back.rigid_sets] == [r.label for r in model.rigid_sets]
    assert np.array_equal(back.labels[back.groups["TOP"]], model.labels[model.groups["TOP"]])
    assert back.structure.relations == ()


@pytest.mark.parametrize("quadratic", [False, True])
@pytest.mark.parametrize("kind", list(SPLITS))
@pytest.mark.parametrize("tetrahedron", [186, 187])
def test_every_kind_of_element_keeps_its_nodes_in_order(kind, quadratic, tetrahedron, tmp_path):
    model = sound_mesh(held_box(kind))[0] if quadratic else held_box(kind)
    nodes = model.nodes.copy()
    nodes[:, 1] += 0.02 * nodes[:, 0] ** 2 / 0.2**2  # bent, so that no mid-edge node is at a middle
    model = replace(model, nodes=nodes)
    types = {"hex": 186, "wedge": 186, "tet": tetrahedron}
    back = read_solid_model(archive(model, tmp_path / "box.cdb", units="mm-t-s", types=types), units="mm-t-s")
    assert back.blocks[0].kind == model.blocks[0].kind
    assert frequencies(back, 3000.0) == pytest.approx(frequencies(model, 3000.0), rel=1e-9)


def test_a_remote_point_of_kind_deformable_carries_a_seat(tmp_path):
    model = held_box("hex8")
    back = read_solid_model(archive(model, tmp_path / "box.cdb", units="m-kg-s", joint="deformable"), units="m-kg-s")
    mean = back.structure.averages[1]
    assert mean.weights[:, 0].sum() == pytest.approx(0.06 * 0.05)
    at = {"S": model.rigid_sets[1].reference}
    assert bearing_seats(back, at)[0].nodes.tolist() == [mean.node]
    stiff = append_seats(sound_mesh(back)[0], bearing_seats(back, at))
    assert stiff is not None


def test_the_nodes_of_an_archive_written_by_ansys_are_those_of_another_reader():
    mapdl = pytest.importorskip("mapdl_archive")
    for name in ("HexBeam", "TetBeam"):
        path = Path(mapdl.examples.hexarchivefile).with_name(f"{name}.cdb")
        if name == "TetBeam":
            with pytest.raises(InputError, match="must state EX"):
                read_solid_model(path, units="m-kg-s")
            continue
        other, model = mapdl.Archive(str(path)), read_solid_model(path, units="m-kg-s")
        assert np.array_equal(model.labels, other.nnum)
        assert np.array_equal(model.nodes, other.nodes)
        assert np.array_equal(model.labels[model.blocks[0].nodes], np.array([one[10:] for one in other.elem]))
        assert set(model.groups) == set(other.node_components)


STEEL = ["MPDATA,R5.0, 1,EX  , 1, 1, 200000.", "MP,PRXY,1,0.3", "MPDATA,R5.0, 1,DENS, 1, 1, 8.E-9"]


def plate(count=6, side=1000.0, quadratic=False, split=False):
    """Nodes and shells of a square plate, and the labels along x = 0."""
    fine = 2 * count if quadratic else count
    labels = {(i, j): 1 + i * (fine + 1) + j for i in range(fine + 1) for j in range(fine + 1)}
    points = [(i * side / fine, j * side / fine, 0.0) for i, j in labels]
    cells = []
    step = 2 if quadratic else 1
    for i in range(0, fine, step):
        for j in range(0, fine, step):
            a, b, c, d = ((i, j), (i + step, j), (i + step, j + step), (i, j + step))
            shells = [(a, b, c, c), (a, c, d, d)] if split else [(a, b, c, d)]
            for own in shells:
                middles = [tuple((p + q) // 2 for p, q in zip(own[k], own[(k + 1) % 4], strict=True)) for k in range(4)]
                cells.append([labels[one] for one in (*own, *(middles if quadratic else ()))])
    used = sorted({n for cell in cells for n in cell})
    return used, [points[n - 1] for n in used], cells, [n for n in used if points[n - 1][0] == 0.0]


@pytest.mark.parametrize(
    ("kind", "quadratic", "split", "card"),
    [
        (181, False, False, "CQUAD4"),
        (181, False, True, "CTRIA3"),
        (281, True, False, "CQUAD8"),
        (281, True, True, "CTRIA6"),
    ],
)
def test_shells_with_offset_beams_masses_and_springs_are_those_of_nastran(kind, quadratic, split, card, tmp_path):
    labels, points, cells, held = plate(quadratic=quadratic, split=split)
    top, corner = max(labels) + 1, labels[-1]
    points.append((points[-1][0], points[-1][1], 200.0))
    rows = [(1 + i, 1, 1, 1, 1, cell) for i, cell in enumerate(cells)]
    count = len(rows)
    rows += [
        (count + 1, 2, 1, 1, 2, [corner, top, labels[0]]),
        (count + 2, 3, 1, 2, 1, [top]),
        (count + 3, 4, 1, 3, 1, [top, labels[0]]),
    ]
    lines = [f"ET,1,{kind}", "ET,2,188", "ET,3,21", "KEYOP,3,3,0", "ET,4,14", "/UNITS,MPA"]
    lines += [*nodes_block([*labels, top], points), *elements_block(rows), *STEEL]
    lines += [
        "SECTYPE,1,SHELL,,plate",
        "SECOFFSET,BOT",
        "SECBLOCK, 1",
        " 5.0 ,  1,  0.0, 5",
        "SECTYPE,2,BEAM,RECT,post",
    ]
    lines += ["SECOFFSET,CENT", "SECDATA, 10.0, 30.0, 2, 2", "RLBLOCK,2,3,6,7", "(2i8,6g16.9)", "(7g16.9)"]
    lines += [f"{2:8d}{6:8d}" + "".join(f"{x:16.9g}" for x in (1e-3, 1e-3, 1e-3, 0.5, 0.5, 0.5))]
    lines += [
        f"{3:8d}{1:8d}{7.0:16.9g}",
        *[f"D,{n:8d},{one},0.,0." for n in held for one in FREEDOMS],
    ]
    (tmp_path / "plate.cdb").write_text("\n".join([*lines, ""]))
    ours = read_solid_model(tmp_path / "plate.cdb", units="mm-t-s")
    order = {"CTRIA3": (0, 1, 2), "CTRIA6": (0, 1, 2, 4, 5, 7)}.get(card, range(8))
    bulk = ["SOL 103", "BEGIN BULK", "MAT1,1,200000.,,0.3,8.-9"]
    bulk += [f"GRID,{n},,{x},{y},{z}" for n, (x, y, z) in zip([*labels, top], points, strict=True)]
    for i, cell in enumerate(cells):
        own = [cell[k] for k in order if k < len(cell)]
        bulk.append(
            f"{card},{1 + i},1,{','.join(map(str, own[:6]))}" + (f",{','.join(map(str, own[6:]))}" if own[6:] else "")
        )
        if card == "CQUAD8":
            bulk[-1] = f"CQUAD8,{1 + i},1,{','.join(map(str, own[:6]))},+\n+,{own[6]},{own[7]},,,,,,2.5"
        elif card == "CTRIA6":
            bulk[-1] += ",+\n+,,2.5"
        else:
            bulk[-1] += ",,2.5"
    bulk += [f"CBAR,{count + 1},2,{corner},{top},{labels[0]}", "PBARL,2,1,,BAR\n,10.0,30.0", "PSHELL,1,1,5.,1,,1"]
    bulk += [f"CONM2,{count + 2},{top},,1.E-3\n,0.5,,0.5,,,0.5", f"SPC1,1,123456,{','.join(map(str, held[:6]))}"]
    bulk += [f"SPC1,1,123456,{n}" for n in held[6:]]
    bulk += [f"CBUSH,{count + 3},3,{top},{labels[0]},0.,0.,1.", "PBUSH,3,K,7.0", "ENDDATA", ""]
    (tmp_path / "plate.bdf").write_text("\n".join(bulk))
    theirs = read_nastran(tmp_path / "plate.bdf", units="mm-t-s")
    # both matrices are equal to 2e-14 of their largest entry. The largest eigenvalue is 6e12 times the lowest, which
    # therefore differs by 1.4e-6 on one machine and less on others
    assert frequencies(ours, 60.0) == pytest.approx(frequencies(theirs, 60.0), rel=1e-5)
    assert len(frequencies(ours, 60.0)) > 3


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("ET,        1,186", "ET,        1,223", "6 of type 223.*first is element 1"),
        ("KEYOP, 7, 1, 1", "KEYOP, 7, 1, 6", r"joint \(KEYOPT\(1\) = 6\)"),
        ("/PREP7", "/PREP7\n/UNITS,BFT", "/UNITS, BFT is not read"),
        ("/PREP7", "/PREP7\n/UNITS,SI", "is m-kg-s, read in mm-t-s"),
        ("/PREP7", "/PREP7\nTB,ELAS,1,1,2", "1 TB of elasticity"),
        ("MPDATA,R5.0, 1,DENS", "MPDATA,R5.0, 1,DAMP", "must state EX"),
        ("/GO", "D,1,UX,0.5,0.", "only 0 is held"),
        ("/GO", "CE,R5.0,DEFI,2,1,0.\nCE,R5.0,NODE,1,UX,1.0", "lacks 1 terms"),
        ("/GO", "CP,1,UX,1,99999", "node 99999 is not defined"),
        ("EBLOCK,19,SOLID", "EBLOCK,10", "CDWRITE"),
        ("/GO", "DBLOCK,1\n(i9,a6,2(pg16.9))", "constraints as DBLOCK: write them as D"),
        ("/GO", "SECCONTROLS,0,0,0,0.4,1,1,1", "SECCONTROLS states added mass"),
        ("ET,        1,186", "ET,        1,179", "6 of type 179"),
        ("EBLOCK,19,SOLID,        40,        40", "EBLOCK,19,SOLID,        40,        900", "declares 40|holds"),
    ],
)
def test_archives_that_would_change_the_answer_are_refused(old, new, message, tmp_path):
    path = archive(held_box("hex8"), tmp_path / "box.cdb", units="mm-t-s", joint="MPC184")
    text = path.read_text()
    if old.startswith("EBLOCK,19,SOLID, "):
        old = next(line for line in text.splitlines() if line.startswith("EBLOCK"))
        new = ",".join([*old.split(",")[:3], " 999", " 999"])
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=message) as caught:
        read_solid_model(path, units="mm-t-s")
    assert "\n" not in str(caught.value)


def plate_archive(path, types, constants, turned=0.0):
    """Archive of a plate of shells with a mass at its last corner, whose axes are turned (degrees) about z."""
    labels, points, cells, held = plate()
    rows = [(1 + i, 1, 1, 1, 1, cell) for i, cell in enumerate(cells)] + [(900, 2, 1, 2, 1, [labels[-1]])]
    lines = [*types, "/UNITS,MPA", *nodes_block(labels, points), *elements_block(rows), *STEEL, *constants]
    at = next(i for i, line in enumerate(lines) if line.startswith(f"{labels[-1]:9d}") and "E" in line)
    lines[at] += "".join(f"{angle:20.13E}".replace("E+", "E+0") for angle in (turned, 0.0, 0.0))
    lines += [f"D,{n:8d},{one},0.,0." for n in held for one in FREEDOMS]
    path.write_text("\n".join([*lines, ""]))
    return read_solid_model(path, units="mm-t-s")


def test_types_in_blocks_and_corner_thickness_are_read(tmp_path):
    """Key options of ETBLOCK; shells whose four corners have a mean of 5 mm; blocks that end as of late."""
    mass = "R,2,1.E-3,1.E-3,1.E-3,9.,9.,9."
    plain = plate_archive(tmp_path / "a.cdb", ["ET,1,181", "ET,2,21", "KEYOP,2,3,2"], ["R,1,5.0", mass])
    block = ["ETBLOCK,2,2", "(2i9,19a9)", f"{1:9d}{181:9d}" + 19 * f"{0:9d}"]
    block += [f"{2:9d}{21:9d}{0:9d}{0:9d}{2:9d}" + 16 * f"{0:9d}", f"{-1:9d}"]
    found = plate_archive(tmp_path / "b.cdb", block, ["R,1,7.0,6.0,4.0,3.0", mass, "N,UNBL,LOC,-1"])
    assert not found.structure.masses.matrix[0][3:, 3:].any()  # KEYOPT(3) = 2 of the block: no inertia
    assert frequencies(found, 60.0) == pytest.approx(frequencies(plain, 60.0), rel=1e-9)
    with pytest.raises(InputError, match=r"SHELL181\) has ADMSUA among its real constants"):
        plate_archive(tmp_path / "c.cdb", ["ET,1,181", "ET,2,21"], ["R,1,5.0,0,0,0,0,1.E-9", mass])
    with pytest.raises(InputError, match=r"SURF154\) has foundation stiffness \(EFS\), not read"):
        plate_archive(tmp_path / "d.cdb", ["ET,1,181", "ET,2,154"], ["R,1,5.0", "R,2,0,0,0,3.5"])


@pytest.mark.parametrize(("key", "inertia"), [(0, (4.0, 1.0, 2.0)), (1, (1.0, 4.0, 2.0))])
def test_inertias_of_a_mass_lie_along_the_axes_of_its_node_where_its_key_option_says_so(key, inertia, tmp_path):
    values = ["R,1,5.0", "R,2,1.E-3,1.E-3,1.E-3,4.,1.,2."]
    model = plate_archive(tmp_path / "a.cdb", ["ET,1,181", "ET,2,21", f"KEYOP,2,2,{key}"], values, turned=90.0)
    found = np.diag(model.structure.masses.matrix[0])[3:]
    assert found == pytest.approx(1e-3 * np.array(inertia), abs=1e-12)  # t mm² = 1e-3 kg m²


def test_bonded_contact_ties_and_other_contact_is_noted(tmp_path):
    """Two boxes one on the other: bonded they are one body, in symmetric contact too."""
    box = held_box("hex8", counts=(6, 2, 1), held=False)
    top = replace(box, nodes=box.nodes + np.array([0.0, 0.0, 0.05]))
    count, points = len(box.nodes), 1e3 * np.vstack([box.nodes, top.nodes])
    cells = np.vstack([box.blocks[0].nodes, top.blocks[0].nodes + count]) + 1
    rows = [(1 + i, 1, 1, 1, 1, cell.tolist()) for i, cell in enumerate(cells)]
    upper = [[cell[k] for k in (4, 5, 6, 7)] for *_, cell in rows[: len(rows) // 2]]
    lower = [[cell[k] for k in (0, 1, 2, 3)] for *_, cell in rows[len(rows) // 2 :]]
    for pair, (contact, target) in {11: (lower, upper), 12: (upper, lower)}.items():
        for kind, faces in ((3, contact), (2, target)):
            rows += [(1 + len(rows) + i, kind, 1, pair, 1, face) for i, face in enumerate(faces)]
    held = [f"D,{1 + i},ALL,0.,0." for i in np.flatnonzero(points[:, 0] == 0.0)]
    lines = ["ET,1,185", "ET,2,170", "ET,3,174", "KEYOP,3,12,5", *nodes_block(range(1, 2 * count + 1), points)]
    (tmp_path / "two.cdb").write_text("\n".join([*lines, *elements_block(rows), *STEEL, *held, ""]))
    model = read_solid_model(tmp_path / "two.cdb", units="mm-t-s")
    whole = held_box("hex8", counts=(6, 2, 2), lengths=(0.2, 0.06, 0.1), material=model.blocks[0].material)
    whole = replace(whole, rigid_sets=(), held=np.repeat(whole.nodes[:, :1] == 0.0, 3, axis=1))
    assert frequencies(model, 6000.0) == pytest.approx(frequencies(whole, 6000.0), rel=0.01)
    assert any("symmetric bond" in note for note in model.notes)
    loose = (tmp_path / "two.cdb").read_text().replace("KEYOP,3,12,5", "KEYOP,3,12,0")
    (tmp_path / "two.cdb").write_text(loose)
    assert any("not bonded" in note for note in read_solid_model(tmp_path / "two.cdb", units="mm-t-s").notes)
