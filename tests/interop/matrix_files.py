"""Reduced matrices as other programs write them; the first six unknowns are motions of one node."""

import numpy as np


def _dmig(name, form, rows, columns, matrix, kind=2):
    yield f"{'DMIG':8}{name:8}{0:8d}{form:8d}{kind:8d}{0:8d}{'':16}{len(columns) if form == 9 else '':>8}"
    for k, (node, component) in enumerate(columns):
        entries = [i for i in range(len(rows)) if matrix[i, k] and (form != 6 or i >= k)]
        if entries:
            yield f"{'DMIG*':8}{name:16}{node:16d}{component:16d}"
        for i in entries:
            values = (matrix[i, k],) if kind < 3 else (matrix[i, k].real, matrix[i, k].imag)
            cells = "".join(f"{value:16.9E}".replace("E", "D") for value in values)
            yield f"{'*':8}{rows[i][0]:16d}{rows[i][1]:16d}{cells}"


def unknowns(seat, count):
    return [*((seat, c) for c in range(1, 7)), *((800001 + i, 0) for i in range(count - 6))]


def write_dmig(path, seat, matrices, recovery=None, form=6):
    """Write matrices by name, and a recovery (labels, (3 n, q))."""
    count = len(next(iter(matrices.values())))
    rows = unknowns(seat, count)
    lines = []
    for name, matrix in matrices.items():
        lines += _dmig(name, form, rows, rows, matrix, 4 if np.iscomplexobj(matrix) else 2)
    if recovery is not None:
        labels, motion = recovery
        own = [(label, c) for label in labels for c in (1, 2, 3)]
        lines += _dmig("MUG1", 9, own, [(k, 0) for k in range(1, count + 1)], motion)
    path.write_text("\n".join([*lines, ""]))
    return path


def write_mtx(path, seat, matrices):
    """Write a linear user element, with modal coordinates at nodes below 1."""
    count = len(next(iter(matrices.values())))
    nodes = [seat, *(-i for i in range(1, count - 5))]
    lines = ["** SUBSTRUCTURE MATRIX", f"*USER ELEMENT, NODES={len(nodes):8d}, LINEAR", "** ELEMENT NODES"]
    lines += ["** " + ",".join(map(str, nodes[i : i + 8])) for i in range(0, len(nodes), 8)]
    lines += ["1, 2, 3, 4, 5, 6", "2, 1"]
    for kind, matrix in matrices.items():
        values = [f"{matrix[i, k]:.17g}" for k in range(count) for i in range(k + 1)]
        lines += [f"*MATRIX,TYPE={kind}", *(", ".join(values[i : i + 4]) + "," for i in range(0, len(values), 4))]
    path.write_text("\n".join([*lines, ""]))
    return path


def write_coordinates(path, seat, matrix):
    rows = [(seat, c) for c in range(1, 7)] + [(-i, 1) for i in range(1, len(matrix) - 5)]
    lines = [
        f"{a},{b}, {c},{d}, {matrix[i, k]:.17e}"
        for i, (a, b) in enumerate(rows)
        for k, (c, d) in enumerate(rows)
        if k <= i and matrix[i, k]
    ]
    path.write_text("\n".join([*lines, ""]))
    return path
