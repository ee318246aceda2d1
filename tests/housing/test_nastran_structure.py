"""Shells, beams, springs, masses and means in Nastran bulk data, against closed forms and one another."""

import numpy as np
import pytest

from nvhchain.errors import InputError
from nvhchain.fem import factorize, lowest_modes
from nvhchain.fem.structural.sections import section
from nvhchain.housing.imported.repair import sound_mesh
from nvhchain.housing.imported.seats import bearing_seats
from nvhchain.housing.imported.solid_model import append_seats, constrained
from nvhchain.interop import read_nastran, write_nastran

STEEL = "MAT1,1,200000.,,0.3,8.-9"
"""N, mm, t: 200 GPa, 8000 kg/m³."""


def deck(tmp_path, lines, control=""):
    path = tmp_path / "deck.bdf"
    path.write_text("\n".join(["SOL 103", "CEND", control, "BEGIN BULK", STEEL, *lines, "ENDDATA", ""]))
    return read_nastran(path, units="mm-t-s")


def frequencies(model, top):
    K, M, _ = constrained(sound_mesh(model)[0])
    return lowest_modes(K, M, top)[0]


def plate(count, side=1000.0, card="CQUAD4", more=""):
    """Cards of a square plate, held along x = 0 by SPC1; nodes are numbered by rows along y."""
    step = side / count
    grids = [
        f"GRID,{1 + i * (count + 1) + j},,{i * step},{j * step},0." for i in range(count + 1) for j in range(count + 1)
    ]
    cells = []
    for i in range(count):
        for j in range(count):
            a = 1 + i * (count + 1) + j
            corners = [a, a + count + 1, a + count + 2, a + 1]
            if card == "CQUAD4":
                cells.append(f"CQUAD4,{1 + len(cells)},1,{','.join(map(str, corners))}{more}")
            else:
                cells += [
                    f"CTRIA3,{1 + len(cells) + k},1,{corners[0]},{corners[1 + k]},{corners[2 + k]}{more}"
                    for k in (0, 1)
                ]
    return [*grids, *cells, f"SPC1,1,123456,1,THRU,{count + 1}"]


FV16 = np.array([0.421, 1.029, 2.582, 3.306, 3.753, 6.555]) * 10.0
"""NAFEMS FV16 at a tenth of its size, Hz."""


@pytest.mark.parametrize("card", ["CQUAD4", "CTRIA3"])
def test_a_plate_of_shells_vibrates_as_the_benchmark(tmp_path, card):
    model = deck(tmp_path, [*plate(14, card=card), "PSHELL,1,1,5.,1,,1"])
    assert frequencies(model, 70.0)[:6] == pytest.approx(FV16, rel=0.012)


def test_second_order_shells_and_thickness_at_corners(tmp_path):
    """Divided elements; the second half of the cards states its thickness itself."""
    count, step = 8, 125.0
    label = {(i, j): 1 + i * 17 + j for i in range(17) for j in range(17)}
    grids = [f"GRID,{n},,{i * step / 2},{j * step / 2},0." for (i, j), n in label.items() if i % 2 == 0 or j % 2 == 0]
    cells = []
    for i in range(0, 16, 2):
        for j in range(0, 16, 2):
            at = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
            n = [str(label[i + a, j + b]) for a, b in at]
            cells.append(f"CQUAD8,{1 + len(cells)},{1 if j < count else 2},{','.join(n[:6])}\n,{','.join(n[6:])}")
            cells[-1] += "" if j < count else ",5.,5.,5.,5."
    lines = [*grids, *cells, "PSHELL,1,1,5.,1,,1", "PSHELL,2,1,77.,1,,1", "SPC1,1,123456,1,THRU,17"]
    assert frequencies(deck(tmp_path, lines), 70.0)[:6] == pytest.approx(FV16, rel=0.012)


def test_frames_turn_nodes_directions_and_held_motions(tmp_path):
    """The plate lies in a turned system; its nodes move in another, along which they are held in part."""
    lines = [line.replace(",,", ",7,", 1) + (",8" if line[:4] == "GRID" else "") for line in plate(8)]
    lines[-1] = lines[-1].replace("123456", "135").replace("SPC1,1", "SPC1,5")
    lines += ["SPC1,6,246,1,THRU,9", "SPCADD,3,5,6", "PSHELL,1,1,5.,1,,1"]
    lines += ["CORD2R,7,,1.,2.,3.,1.,2.,4.", "+,1.,3.,3."]  # x along −… of the basic system: y, then −x
    lines += ["CORD1R,8,1,2,10"]
    turned = frequencies(deck(tmp_path, lines, "SPC = 3"), 70.0)
    straight = frequencies(deck(tmp_path, [*plate(8), "PSHELL,1,1,5.,1,,1"]), 70.0)
    assert turned[:6] == pytest.approx(straight[:6], rel=1e-9)


_CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
BLOCK = [
    *(f"GRID,{i},,{100.0 * x},{60.0 * y},{40.0 * z}" for i, (x, y, z) in enumerate(_CORNERS, start=1)),
    "CHEXA,1,1,1,2,3,4,5,6",
    "+,7,8",
    "PSOLID,1,1",
]
MASS = 0.1 * 0.06 * 0.04 * 8000.0


@pytest.mark.parametrize("kind", ["CBUSH", "CELAS1", "CELAS2", "CBUSH between", "turned", "CBUSH elsewhere"])
def test_elastic_mounts_to_ground_hold_a_block(tmp_path, kind):
    """Bounce along z on four springs of 2 N/mm, which meet no other motion; stiff ones hold x and y."""
    springs = []
    for i in range(1, 5):
        if kind == "CBUSH":
            springs.append(f"CBUSH,{10 + i},2,{i},,,,,0")
        elif kind == "CBUSH between":
            springs += [f"GRID,{100 + i},,{100.0 * (i in (2, 3))},{60.0 * (i > 2)},0.,,123456"]
            springs += [f"CBUSH,{10 + i},2,{i},{100 + i},,,,0"]
        elif kind == "CBUSH elsewhere":
            springs += [f"CBUSH,{10 + i},2,{i},,,,,0", f"+,,9,{100.0 * (i in (2, 3))},{60.0 * (i > 2)},-9."]
        else:
            last = ["2.", "900.", "900."] if kind != "CELAS1" else ["3", "4", "4"]
            card, order = ("CELAS2", "132") if kind == "turned" else (kind, "321")
            springs += [f"{card},{10 * i + c},{last[c]},{i},{order[c]}" for c in range(3)]
    block = [line + ",8" if kind == "turned" and line[:4] == "GRID" else line for line in BLOCK]
    springs += ["CORD2R,8,,0.,0.,0.,3.,4.,0.", "+,0.,0.,1.", "CORD2R,9,,0.,0.,9.,0.,0.,10.", "+,1.,0.,9."]
    laws = ["PBUSH,2,K,900.,900.,2.", "PELAS,3,2.,,,4,900."]
    found = frequencies(deck(tmp_path, [*block, *springs, *laws]), 2000.0)
    assert found[0] == pytest.approx(np.sqrt(4 * 2000.0 / MASS) / (2 * np.pi), rel=1e-3)


def test_a_rigid_set_of_one_component_slides_in_the_others(tmp_path):
    """Bounce of a block on one spring of 8 N/mm below a plate that it slides on; stiff springs hold it across."""
    across = [f"CELAS2,{10 * i + c},900.,{i},{c}" for i in range(1, 5) for c in (1, 2)]
    lines = [*BLOCK, "GRID,20,,50.,30.,-10.,,12456", "CELAS2,9,8.,20,3", "RBE2,5,20,3,1,2,3,4", *across]
    model = deck(tmp_path, lines)
    assert "RBE2 5 couples components 3 only: it slides, and is no bearing seat" in model.notes
    found = frequencies(model, 2000.0)
    assert found[0] == pytest.approx(np.sqrt(8000.0 / MASS) / (2 * np.pi), rel=1e-3)
    stiff = np.sqrt(4 * 900e3 / MASS) / (2 * np.pi)
    assert found[1:3] == pytest.approx([stiff, stiff], rel=5e-3)


def test_a_mass_along_a_turned_axis_swings_with_what_it_weighs_there(tmp_path):
    """A node on two springs; the mass counts along (3, 4, 0)/5 alone."""
    lines = [
        "GRID,1,,0.,0.,0.,8,3456",
        "CELAS2,1,2.,1,1,2,1",
        "CMASS2,3,1.-3,1,1",
        "CELAS2,2,900.,1,2",
        "CMASS2,4,2.-3,1,2",
    ]
    lines += [
        "CORD2R,8,,0.,0.,0.,0.,0.,1.",
        "+,3.,4.,0.",
        *(f"GRID,{i},,{10 * i}.,{9 * (i % 2)}.,0.,,123456" for i in (2, 3, 4)),
    ]
    lines += ["CTRIA3,9,1,2,3,4", "PSHELL,1,1,1.,1,,1"]
    found = frequencies(deck(tmp_path, lines), 2000.0)
    assert found == pytest.approx(np.sqrt([2e3 / 1.0, 900e3 / 2.0]) / (2 * np.pi), rel=1e-9)


def test_bars_take_what_they_lack_from_baror(tmp_path):
    given = ["CBAR,6,2,20,21,0.,1.,0.", "CBAR,7,2,21,22,0.,1.,0.", "CBEAM,8,3,22,23,0.,1.,0."]
    usual = ["BAROR,,2,,,0.,1.,0.", "BEAMOR,,3,,,0.,1.,0.", "CBAR,6,,20,21", "CBAR,7,2,21,22", "CBEAM,8,,22,23"]
    grids = [f"GRID,{i},,{50.0 * (i - 20)},0.,0." for i in range(20, 24)] + ["SPC1,1,123456,20"]
    laws = ["PBARL,2,1,,BAR", "+,10.,30.", "PBEAML,3,1,,BAR", "+,10.,20.", "CONM2,90,22,,1.-4"]
    laws += ["CTRIA3,91,9,23,24,25", "PSHELL,9,1,.01,1,,1", "GRID,24,,160.,1.,0.", "GRID,25,,160.,0.,0."]
    both = [frequencies(deck(tmp_path, [*grids, *bars, *laws]), 5000.0)[:4] for bars in (given, usual)]
    assert both[1] == pytest.approx(both[0], rel=1e-9)


def test_large_cards_with_the_star_in_their_last_column_are_read(tmp_path):
    """As Nastran writes them in its superelement punch."""
    lines = [*plate(4)[25:], "PSHELL,1,1,5.,1,,1"]
    grids = [line.split(",") for line in plate(4)[:25]]
    large = [
        text
        for _, label, _, x, y, z in grids
        for text in (f"GRID   *{label:>16}{'':16}{float(x):16.6f}{float(y):16.6f}", f"*       {float(z):16.6f}")
    ]
    found, known = (frequencies(deck(tmp_path, [*some, *lines]), 70.0) for some in (large, plate(4)[:25]))
    assert found == pytest.approx(known, rel=1e-12)


def test_masses_beside_their_node_and_beams_of_any_section_move_as_one_body(tmp_path):
    """Total mass, centre and inertia of a block with CONM2 on arms, on a stiff bar."""
    lines = [
        *BLOCK, "GRID,20,,100.,30.,20.", "GRID,21,,150.,30.,20.",
        "RBE2,5,20,123456,2,3,6,7", "CBAR,6,2,20,21,0.,1.,0.", "PBARL,2,1,,TUBE", "+,10.,8.",
        "CONM2,7,21,,1.-3,0.,5.,0.", "+,2.,,3.,,,4.",
    ]  # fmt: skip
    model = sound_mesh(deck(tmp_path, lines))[0]
    K, M, T = constrained(model)
    centre = np.array([0.15, 0.035, 0.02])
    bar = np.pi * (0.01**2 - 0.008**2) * 0.05 * 8000.0
    turn = np.array([0.0, 0.0, 1.0])
    motion = np.cross(turn, model.nodes - centre).ravel()
    reduced = np.linalg.lstsq(T.toarray(), motion, rcond=None)[0]
    # rotations that T does not show follow from no strain
    energy = reduced @ K @ reduced
    frequency, shapes = lowest_modes(K, M, 1e4)
    rigid = shapes[:, frequency < 1.0]
    assert rigid.shape[1] == 6
    shift = (T @ rigid).reshape(len(model.nodes), 3, 6)
    # the rigid modes are mass-normalised: Σ over modes of a uniform shift's share is 1/m and 1/I
    inverse = np.linalg.inv(sum(_share(shift[..., i], model.nodes - centre) for i in range(6)))
    assert np.trace(inverse[:3, :3]) / 3 == pytest.approx(MASS + bar + 1.0, rel=1e-6)
    block = MASS * ((0.1**2 + 0.06**2) / 12 + (0.05 - 0.15) ** 2 + (0.03 - 0.035) ** 2)
    tube = bar * (0.05**2 / 12 + (0.125 - 0.15) ** 2 + 0.005**2) + 8000.0 * np.pi / 4 * (0.01**4 - 0.008**4) * 0.05
    assert inverse[5, 5] == pytest.approx(block + tube + 4e-3, rel=1e-6)
    assert energy >= 0


def _share(shift, arm):
    """Outer product of the rigid motion (6,) of a mode about a point, found by its nodes."""
    columns = np.concatenate(
        [np.broadcast_to(np.eye(3), (len(arm), 3, 3)), [[np.cross(e, a) for e in np.eye(3)] for a in arm]], axis=1
    )
    motion = np.linalg.lstsq(columns.transpose(0, 2, 1).reshape(-1, 6), shift.ravel(), rcond=None)[0]
    return np.outer(motion, motion)


def test_a_mean_carries_a_seat_and_shares_its_force(tmp_path):
    """The seat at the reference of an RBE3 is as flexible as forces shared among the nodes by hand find it."""
    rim = [12, 13, 24, 25]
    lines = [
        *plate(11, 500.0), "PSHELL,1,1,5.,1,,1", "GRID,900,,60.,80.,30.",
        f"RBE3,901,,900,123456,1.,123,{rim[0]},{rim[1]}", f"+,{rim[2]},2.,123,{rim[3]}",
    ]  # fmt: skip
    model = deck(tmp_path, lines)
    seat = bearing_seats(model, {"A": (0.06, 0.08, 0.03)})
    K, _, _ = constrained(sound_mesh(append_seats(model, seat))[0])
    load = np.zeros((K.shape[0], 6))
    load[-6:] = np.eye(6)
    with factorize(K) as factor:
        flexibility = factor.solve(load)[-6:]
    K, _, T = constrained(sound_mesh(deck(tmp_path, lines[:-3]))[0])
    rows = np.searchsorted(model.labels, rim)
    arm, weight = model.nodes[rows] - [0.06, 0.08, 0.03], np.array([1.0, 1.0, 1.0, 2.0])
    motion = np.concatenate(
        [np.broadcast_to(np.eye(3), (4, 3, 3)), [[np.cross(e, a) for e in np.eye(3)] for a in arm]], axis=1
    )
    motion = motion.transpose(0, 2, 1)
    mean = np.linalg.solve(
        np.einsum("kia,k,kib->ab", motion, weight, motion), np.einsum("k,kia->aki", weight, motion).reshape(6, 12)
    )
    where = (3 * rows[:, None] + np.arange(3)).ravel()
    shared = T[where].T @ mean.T
    with factorize(K) as factor:
        by_hand = shared.T @ factor.solve(np.asarray(shared))
    assert flexibility == pytest.approx(by_hand, rel=1e-6, abs=1e-8 * np.abs(by_hand).max())


def test_multi_point_constraints_and_bars_join_two_plates(tmp_path):
    """Two halves of a plate, their twin nodes joined by MPC, RBAR or both, vibrate as one."""
    whole = frequencies(deck(tmp_path, [*plate(8), "PSHELL,1,1,5.,1,,1"]), 70.0)
    lines = []
    for line in plate(8):
        cells = line.split(",")
        if cells[0] == "CQUAD4" and int(cells[1]) > 32:
            cells[3:] = [str(int(n) + 1000) if 37 <= int(n) <= 45 else n for n in cells[3:]]
        lines.append(",".join(cells))
    for j in range(9):
        lines.append(f"GRID,{1037 + j},,500.,{125.0 * j},0.")
        if j % 2:
            lines.append(f"RBAR,{500 + j},{37 + j},{1037 + j},123456,,,123456")
        else:
            lines += [f"MPC,4,{1037 + j},{c},1.,{37 + j},{c},-1." for c in range(1, 7)]
    found = frequencies(deck(tmp_path, [*lines, "PSHELL,1,1,5.,1,,1"], "MPC = 4"), 70.0)
    assert found[:6] == pytest.approx(whole[:6], rel=1e-6)


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (["CQUAD4,9,2,1,2,3,4"], "1 shells of 2 on solids excluded"),
        (["CBAR,9,2,1,2,0.,0.,1."], "1 beams of 2 on solids excluded"),
        (["DESVAR,1,A,1.", "BCTSET,1,2,3,0."], "1 BCTSET, 1 DESVAR excluded"),
        (["DEQATN  7       F(A,B) = A", "        + B", "PDAMP,1,2."], "1 DEQATN, 1 PDAMP excluded"),
        (["MPC,4,1,1,1.,2,1,-1."], "MPC 4 excluded"),
        (["NSM1,5,PSOLID,1.,1"], "1 NSM1 excluded: case control selects none"),
    ],
)
def test_leftovers_are_noted(tmp_path, lines, message):
    assert any(message in note for note in sound_mesh(deck(tmp_path, [*BLOCK, *lines]))[1])


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (["CQUAD4,9,2,1,2,3,90", "GRID,90,,0.,60.,5."], "1 shells of property '2', first 9, have no section"),
        (["CQUAD4,9,2,1,2,3,4", "PSHELL,2,1,1.,1,,1", "+,,,5"], "couples membrane and bending"),
        (["CBAR,9,2,1,2,1.,0.,0.", "PBAR,2,1,1.,1.,1.,1."], "beam 9: its direction lies along its axis"),
        (["RBE3,9,,90,123456,1.,123,1,2", "GRID,90,,0.,0.,0."], "mean 9: its 2 nodes lie on a line"),
        (["CBUSH,9,3,1,2,,,,0"], "PBUSH 3 is not defined"),
        (["CSHEAR,9,3,1,2,3,4"], "the first is CSHEAR, 9, 3, 1, 2, 3, 4"),
        (["GRID,90,,1.,1.,1.", "CONM2,9,90,,1."], "in 2 parts"),
        (["PARAM,UNITSYS,MN-MM"], "UNITSYS MN-MM states mm-kg-s, read in mm-t-s"),
    ],
)
def test_what_cannot_be_read_is_named(tmp_path, lines, message):
    with pytest.raises(InputError, match=message):
        constrained(sound_mesh(deck(tmp_path, [*BLOCK, *lines]))[0])


def test_mass_that_case_control_selects_is_not_lost(tmp_path):
    with pytest.raises(InputError, match=r"carries 1 NSML, .*the first is NSML, 5"):
        deck(tmp_path, [*BLOCK, "NSML,5,PSOLID,1,1."], "NSM = 5")


def test_a_model_of_shells_is_not_written_without_them(tmp_path):
    model = deck(tmp_path, [*plate(2), "PSHELL,1,1,5.,1,,1"])
    with pytest.raises(InputError, match="are read, but not written"):
        write_nastran(model, tmp_path / "out.bdf", units="mm-t-s")
    assert not (tmp_path / "out.bdf").exists()


@pytest.mark.parametrize(
    ("kind", "dimensions", "area", "second"),
    [
        ("I", "40.,20.,20.,2.,4.,4.", 2 * 80 + 64, (20 * 40**3 - 18 * 32**3) / 12),
        ("I1", "18.,2.,32.,40.", 2 * 80 + 64, (20 * 40**3 - 18 * 32**3) / 12),
        ("CHAN", "20.,40.,2.,4.", 2 * 80 + 64, (20 * 40**3 - 18 * 32**3) / 12),
        ("CHAN1", "18.,2.,32.,40.", 2 * 80 + 64, (20 * 40**3 - 18 * 32**3) / 12),
        ("TUBE2", "10.,2.", np.pi * 36, np.pi / 4 * (10**4 - 8**4)),
        ("T2", "20.,30.,4.,2.", 80 + 52, None),
    ],
)
def test_sections_by_dimensions_have_the_area_and_moment_of_their_drawing(kind, dimensions, area, second):
    found = section(kind, [1e-3 * float(x) for x in dimensions.split(",")])
    if second is None:  # flange 20 × 4 and web 2 × 26 about their common centre
        centre = (80 * 0.0 + 52 * 15.0) / 132
        second = 20 * 4**3 / 12 + 80 * centre**2 + 2 * 26**3 / 12 + 52 * (15 - centre) ** 2
    assert found.area == pytest.approx(1e-6 * area)
    assert found.bending_y == pytest.approx(1e-12 * second)


def test_a_rod_with_a_mass_at_its_end_as_in_simcenter_nastran(tmp_path):
    """Frequencies (Hz) that release 2019.2 prints for ten CBAR of pyNastran's model beam_modes, with lumped mass."""
    lines = [f"GRID,{i + 1},,{float(i)},0.,0." for i in range(11)] + ["GRID,12,,10.5,0.,0.", "GRID,13,,10.,.5,0."]
    lines += [f"CBAR,{i},1,{i},{i + 1},0.,1.,0." for i in range(1, 10)] + ["CBEAM,10,3,10,11,0.,1.,0."]
    lines += ["PBARL,1,2,,ROD", "+,1.", "PBEAML,3,2,,ROD", "+,1.", "CONM2,21,11,,2.59-3", "+,2.59-3,,2.59-3,,,2.59-3"]
    lines += ["CTRIA3,90,9,11,12,13", "PSHELL,9,2,.01,2,,2", "MAT1,2,3.+7,1.1628+7,.29,7.4851-4", "SPC1,1,123456,1"]
    path = tmp_path / "rod.bdf"
    path.write_text("\n".join(["BEGIN BULK", *lines, "ENDDATA", ""]))
    found = frequencies(read_nastran(path, units="in-lbf-s"), 8000.0)
    for printed, error in ((456.6603, 2e-3), (2674.588, 0.015), (4507.487, 3e-3)):
        assert np.abs(found / printed - 1).min() < error


def half_of_solids(solids, overlap):
    """Cards of a cantilever, 200 × 80 × 8 mm, of bricks for x below a number of rows and of shells beyond."""
    label, cells = {}, []

    def node(i, j, k):
        return label.setdefault((i, j, k), len(label) + 1)

    for i in range(20):
        for j in range(8):
            around = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
            for k in (-1, 0) if i < solids else ():
                eight = [node(*at, k + up) for up in (0, 1) for at in around]
                cells += [f"CHEXA,{len(cells) + 1},1,{','.join(map(str, eight[:6]))}", f"+,{eight[6]},{eight[7]}"]
            if i >= solids - overlap:
                four = [node(*at, 0) for at in around]
                cells.append(f"CQUAD4,{len(cells) + 1},{2 if i >= solids else 3},{','.join(map(str, four))}")
    grids = [f"GRID,{n},,{10.0 * i},{10.0 * j},{4.0 * k}" for (i, j, k), n in label.items()]
    held = [f"SPC1,1,123456,{n}" for (i, _, _), n in label.items() if i == 0]
    laws = ["PSOLID,1,1", "PSHELL,2,1,8.,1,,1", "PSHELL,3,2,8.,2,,2", "MAT1,2,200000.,,.3,8.-11"]
    return [*grids, *cells, *held, *laws]


def test_shells_that_reach_one_row_into_solids_carry_moments_and_those_that_do_not_hang_as_by_a_hinge(tmp_path):
    whole, joined, hinged = (
        frequencies(deck(tmp_path, half_of_solids(*rows)), 3000.0) for rows in ((0, 0), (10, 1), (10, 0))
    )
    assert joined[:6] == pytest.approx(whole[:6], rel=0.015)
    assert hinged[0] < 1e-3
