"""Superelements with unknowns that neither move nor weigh, placeholders and transposed recovery, as Nastran writes."""

import numpy as np
import pytest
import scipy.linalg

from nvhchain.interop.matrices.labelled import LabelledMatrix
from nvhchain.interop.matrices.reduced import SuperelementFiles, read_superelement
from nvhchain.interop.solids.writers import write_nastran
from nvhchain.testing.elements import held_box


@pytest.fixture
def small(tmp_path):
    """Deck of a box, and K, M, R of its seat's shifts and three modal coordinates."""
    model = held_box("hex8")
    deck = write_nastran(model, tmp_path / "box.bdf", units="mm-t-s")
    rng = np.random.default_rng(3)
    K, M = (a @ a.T + 6 * np.eye(6) for a in rng.normal(size=(2, 6, 6)))
    return model, deck, 1e3 * K, 1e-3 * M, rng.normal(size=(3 * len(model.labels), 6))


def frequencies(K, M):
    return np.sqrt(scipy.linalg.eigh(K, M, eigvals_only=True)) / (2 * np.pi)


@pytest.mark.parametrize("recovery", ["all columns", "moving columns", "transposed"])
def test_rotations_of_a_node_of_solids_that_are_empty_are_left_out(small, recovery, tmp_path, monkeypatch):
    model, deck, K, M, R = small
    seat, full = model.rigid_sets[1].label, [0, 1, 2, 6, 7, 8]
    known = [*((seat, c) for c in (1, 2, 3)), *((800001 + i, 0) for i in range(3))]
    wide = np.zeros((9, 9))
    wide[np.ix_(full, full)] = K
    heavy = np.zeros((9, 9))
    heavy[np.ix_(full, full)] = M
    motion = np.zeros((len(R), 9))
    motion[:, full] = R
    rows = tuple((label, c) for label in model.labels.tolist() for c in (1, 2, 3))
    every = tuple([*((seat, c) for c in range(1, 7)), *known[3:]])
    found = {
        "KAAX": LabelledMatrix("KAAX", every, every, wide),
        "MAAX": LabelledMatrix("MAAX", every, every, heavy),
        "BXX": LabelledMatrix("BXX", None, None, np.zeros((1, 1))),
        "MUG1": LabelledMatrix("MUG1", rows, None, motion),
    }
    if recovery == "moving columns":  # empty rows are not written, but counted in the recovery
        found["KAAX"], found["MAAX"] = (
            LabelledMatrix(name, tuple(known), tuple(known), one) for name, one in (("KAAX", K), ("MAAX", M))
        )
    if recovery == "transposed":
        found["MUG1T"] = LabelledMatrix("MUG1T", None, rows, found.pop("MUG1").values.T)
    monkeypatch.setattr("nvhchain.interop.matrices.reduced._read", lambda path: found)
    back = read_superelement(SuperelementFiles((tmp_path / "box.pch",), deck), units="mm-t-s")
    assert back.frequency == pytest.approx(frequencies(K, M), rel=1e-9)
    vectors = scipy.linalg.eigh(K, M)[1]
    shapes = np.abs((R @ vectors).T.reshape(6, -1, 3))
    rows_of = np.searchsorted(back.labels, model.labels)
    scale = shapes.max() / np.abs(back.shapes[:, rows_of]).max()
    assert scale * np.abs(back.shapes[:, rows_of]) == pytest.approx(shapes, rel=1e-6, abs=1e-6 * shapes.max())
