"""Small valid decks with shells, a beam, a mass, springs and couplings; units mm, t, s."""

from __future__ import annotations


def nastran_frame() -> str:
    """Plate of 16 quadrilaterals with a tube, a mass, a mean of nodes, a bushing, a spring and a local frame."""
    grids = [f"GRID,{1 + 5 * i + j},,{25.0 * i},{25.0 * j},0." for i in range(5) for j in range(5)]
    cells = [
        f"CQUAD4,{1 + 4 * i + j},1,{a},{a + 5},{a + 6},{a + 1}"
        for i in range(4)
        for j in range(4)
        for a in [1 + 5 * i + j]
    ]
    others = """PSHELL,1,1,5.,1,,1
GRID,200,,100.,30.,20.
GRID,201,,150.,30.,20.
RBE2,500,200,123456,13,14,18,19
CBAR,600,2,200,201,0.,1.,0.
PBARL,2,1,,TUBE
+,10.,8.
CONM2,700,201,,1.-3,0.,5.,0.
+,2.,,3.,,,4.
RBE3,800,,201,123456,1.,123,10,11
+,12
CBUSH,900,3,15,,,,,0
PBUSH,3,K,900.,900.,2.
CORD2R,5,,0.,0.,0.,0.,0.,1.
+,1.,0.,0.
CELAS2,901,5.,16,3
SPC1,1,123456,1,THRU,5"""
    begin = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "MAT1,1,200000.,,0.3,8.-9"]
    return "\n".join([*begin, *grids, *cells, others, "ENDDATA", ""])


def abaqus_frame() -> str:
    """Brick under a plate of shells, tied, with a beam, a mass, a spring and a distributing coupling."""
    place = [(i, j, k) for i in range(3) for j in range(3) for k in range(2)]
    label = {at: n for n, at in enumerate(place, start=1)}
    around = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    nodes = [f"{n}, {40.0 * i}, {40.0 * j}, {20.0 * k}" for (i, j, k), n in label.items()]
    nodes += [f"{101 + 4 * i + j}, {26.0 * i}, {26.0 * j}, 20." for i in range(4) for j in range(4)]
    bricks = [
        ", ".join(map(str, [1 + 2 * i + j, *(label[i + a, j + b, k] for a, b, k in around)]))
        for i in range(2)
        for j in range(2)
    ]
    shells = [
        f"{11 + 3 * i + j}, {a}, {a + 4}, {a + 5}, {a + 1}"
        for i in range(3)
        for j in range(3)
        for a in [101 + 4 * i + j]
    ]
    return "\n".join([
        "*NODE", *nodes, "900, 40., 40., 60.", "901, 40., 40., 90.",
        "*ELEMENT, TYPE=C3D8, ELSET=BLOCK", *bricks,
        "*ELEMENT, TYPE=S4, ELSET=PLATE", *shells,
        "*ELEMENT, TYPE=B31, ELSET=BAR", "31, 900, 901",
        "*ELEMENT, TYPE=MASS, ELSET=WEIGHT", "41, 901",
        "*ELEMENT, TYPE=SPRING1, ELSET=SPRING", "51, 116",
        "*MATERIAL, NAME=STEEL", "*ELASTIC", "200000., 0.3", "*DENSITY", "8.e-9",
        "*SOLID SECTION, ELSET=BLOCK, MATERIAL=STEEL",
        "*SHELL SECTION, ELSET=PLATE, MATERIAL=STEEL, OFFSET=0.5", "2.",
        "*BEAM SECTION, SECTION=BOX, ELSET=BAR, MATERIAL=STEEL", "10., 20., 1., 1., 1., 1.", "0., 1., 0.",
        "*MASS, ELSET=WEIGHT", "1.e-4", "*SPRING, ELSET=SPRING", "3", "40.",
        "*SURFACE, NAME=TOP", "1, S2", "2, S2", "3, S2", "4, S2",
        "*NSET, NSET=CORNERS", "101, 104, 113, 116", "*SURFACE, NAME=UNDER, TYPE=NODE", "CORNERS",
        "*TIE, NAME=JOINT", "UNDER, TOP",
        "*COUPLING, CONSTRAINT NAME=SEAT, REF NODE=900, SURFACE=TOP", "*DISTRIBUTING",
        "*NSET, NSET=FEET", "1, 5, 13, 17", "*BOUNDARY", "FEET, 1, 3", "",
    ])  # fmt: skip
