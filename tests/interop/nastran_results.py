"""Modes as Nastran writes them: HDF5, OP2 and punch."""

import struct

import h5py
import numpy as np

DOMAIN = [("ID", "<i8"), ("SUBCASE", "<i8"), ("ANALYSIS", "<i8"), ("TIME_FREQ_EIGR", "<f8"), ("MODE", "<i8")]
VECTOR = [("ID", "<i8"), *[(name, "<f8") for name in ("X", "Y", "Z", "RX", "RY", "RZ")], ("DOMAIN_ID", "<i8")]
SUMMARY = [("MODE", "<i8"), ("EIGEN", "<f8"), ("FREQ", "<f8"), ("MASS", "<f8"), ("DOMAIN_ID", "<i8")]
GRID = [("ID", "<i8"), ("CP", "<i8"), ("X", "<f8", (3,)), ("CD", "<i8")]
CARDS = {"tet": "CTETRA", "wedge": "CPENTA", "hex": "CHEXA"}


def eigenvalue(frequency):
    return (2 * np.pi * frequency) ** 2


def write_h5(path, labels, modes, geometry=None, subcase=1):
    """Write modes (frequency, modal mass, motion (n, 3)) of nodes; geometry: places, card names → rows, frames."""
    with h5py.File(path, "w") as file:
        result = file.create_group("NASTRAN/RESULT")
        domains = [(k, subcase, 2, eigenvalue(f), k) for k, (f, _, _) in enumerate(modes, start=1)]
        result["DOMAINS"] = np.array([(99, subcase, 1, 0.0, 0), *domains], dtype=DOMAIN)
        rows = [
            (label, *at, 0.0, 0.0, 0.0, k)
            for k, (_, _, motion) in enumerate(modes, start=1)
            for label, at in zip(labels, motion, strict=True)
        ]
        result["NODAL/EIGENVECTOR"] = np.array(rows, dtype=VECTOR)
        table = [(k, eigenvalue(f), f, mass, 1) for k, (f, mass, _) in enumerate(modes, start=1)]
        result["SUMMARY/EIGENVALUE"] = np.array(table, dtype=SUMMARY)
        if geometry is None:
            return path
        places, cards, frames = geometry
        grid = np.array([(n, 0, p, 7 if frames else 0) for n, p in zip(labels, places, strict=False)], dtype=GRID)
        file["NASTRAN/INPUT/NODE/GRID"] = grid
        for name, members in cards.items():
            kind = [("EID", "<i8"), ("PID", "<i8"), ("G", "<i8", (len(members[0]),)), ("DOMAIN_ID", "<i8")]
            table = [(1 + i, 1, tuple(row), 1) for i, row in enumerate(members)]
            file[f"NASTRAN/INPUT/ELEMENT/{name}"] = np.array(table, dtype=kind)
        if frames:
            names = [("CID", "<i8"), ("RID", "<i8"), *[(f"{a}{i}", "<f8") for a in "ABC" for i in (1, 2, 3)]]
            file["NASTRAN/INPUT/COORDINATE_SYSTEM/CORD2C"] = np.array([(7, 0, *frames)], dtype=names)
    return path


def write_punch(path, labels, modes, subcase=1):
    lines = []
    for number, (frequency, _, motion) in enumerate(modes, start=1):
        lines += ["$TITLE   = BOX", "$SUBTITLE=", "$LABEL   =", "$EIGENVECTOR", "$REAL OUTPUT"]
        lines += [f"$SUBCASE ID = {subcase:11d}", f"$EIGENVALUE = {eigenvalue(frequency):14.7E}  MODE = {number:5d}"]
        for label, at in zip(labels, motion, strict=True):
            lines += [
                f"{label:10d}       G" + "".join(f"{x:18.6E}" for x in at),
                "-CONT-" + " " * 12 + 3 * f"{0.0:18.6E}",
            ]
    path.write_text("".join(f"{line:72}{i:8d}\n" for i, line in enumerate(lines, start=1)))
    return path


def write_op2(path, labels, modes, subcase=1, endian="<"):
    """Write LAMA and OUGV1 of 32 bits."""
    out = bytearray()

    def record(data):
        out.extend(struct.pack(f"{endian}i", len(data)) + data + struct.pack(f"{endian}i", len(data)))

    def key(*numbers):
        for number in numbers:
            record(struct.pack(f"{endian}i", number))

    def words(*values):
        return b"".join(struct.pack(f"{endian}{'f' if isinstance(v, float) else 'i'}", v) for v in values)

    def table(name, records):
        key(2)
        record(name.ljust(8).encode())
        key(-1, 7)
        record(words(101, 0, 0, 0, 0, 0, 0))
        key(-2, 1, 0, 2)
        record(name.ljust(8).encode())
        key(-3, 1, 0)
        for number, data in enumerate(records, start=4):
            key(len(data) // 4)
            record(data)
            key(-number, 1, 0)
        key(0)

    key(3)
    record(words(11, 26, 26))
    key(7)
    record(b"NASTRAN FORT TAPE ID CODE - ")
    key(2)
    record(b"XXXXXXXX")
    key(-1, 0)
    summary = [
        (k, k, eigenvalue(f), 2 * np.pi * f, f, float(mass), float(mass) * eigenvalue(f))
        for k, (f, mass, _) in enumerate(modes, start=1)
    ]
    table("LAMA", [words(*[0] * 146), b"".join(words(*map(_plain, row)) for row in summary)])
    vectors = []
    for number, (frequency, _, motion) in enumerate(modes, start=1):
        head = [21, 7, 0, subcase, number, float(eigenvalue(frequency)), 0, 0, 1, 8] + [0] * 136
        vectors.append(words(*head))
        rows = [words(10 * n + 1, 1, *map(float, at), 0.0, 0.0, 0.0) for n, at in zip(labels, motion, strict=True)]
        vectors.append(b"".join(rows))
    table("OUGV1", vectors)
    key(0)
    path.write_bytes(bytes(out))
    return path


def _plain(value):
    return value if isinstance(value, int) else float(value)
