"""Modes in results of Nastran: the same housing as through our own HDF5, and what is refused."""

import numpy as np
import pytest

from nvhchain.errors import FileFormatError, InputError
from nvhchain.fem import lowest_modes
from nvhchain.housing.imported.repair import sound_mesh
from nvhchain.housing.imported.solid_model import constrained
from nvhchain.interop import read_modal_model, write_nastran
from nvhchain.testing.elements import held_box
from tests.interop.nastran_results import CARDS, write_h5, write_op2, write_punch

HEX20 = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 16, 17, 18, 19, 12, 13, 14, 15]
"""Order of CHEXA: middles of the upright edges before those of the top."""

AXIS = (0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0)
"""Cylindrical system about z."""


@pytest.fixture(scope="module")
def body():
    """Box of quadratic bricks with its modes to 9 kHz in millimetres, tonnes and seconds."""
    model = sound_mesh(held_box("hex8", held=True))[0]
    K, M, T = constrained(model)
    frequency, vectors = lowest_modes(K, M, 9000.0)
    shapes = np.asarray(T @ vectors).T.reshape(len(frequency), -1, 3)
    scale = np.sqrt(1e3) * 2.0  # √t for kg, and a modal mass of 4
    return model, [(float(f), 4.0, scale * shape) for f, shape in zip(frequency, shapes, strict=True)], shapes


def cards(model):
    block = model.blocks[0]
    return {CARDS[block.shape]: model.labels[block.nodes][:, HEX20].tolist()}


@pytest.mark.parametrize("kind", ["h5", "h5 and deck", "turned h5", "op2", "big-endian op2", "pch"])
def test_results_of_nastran_make_the_same_housing(body, kind, tmp_path):
    model, modes, shapes = body
    labels, places = model.labels.tolist(), 1e3 * model.nodes
    deck = write_nastran(model, tmp_path / "box.bdf", units="mm-t-s")
    normal = {"units": "mm-t-s"}
    if kind == "h5":
        lone = [(f, m, np.vstack([at, np.zeros(3)])) for f, m, at in modes]  # a scalar point, which has no place
        path = write_h5(tmp_path / "box.h5", [*labels, 900001], lone, (places, cards(model), ()))
    elif kind == "turned h5":
        radius = np.hypot(*places[:, :2].T)
        out = np.where(radius[:, None] > 0, places[:, :2] / np.maximum(radius, 1e-9)[:, None], [1.0, 0.0])
        turned = [
            (f, m, np.column_stack([(at[:, :2] * out).sum(1), at[:, 1] * out[:, 0] - at[:, 0] * out[:, 1], at[:, 2]]))
            for f, m, at in modes
        ]
        path = write_h5(tmp_path / "box.h5", labels, turned, (places, cards(model), AXIS))
    elif kind == "h5 and deck":
        path, normal = write_h5(tmp_path / "box.h5", labels, modes), normal | {"deck": deck}
    elif kind == "pch":
        path = write_punch(tmp_path / "box.pch", labels, [(f, 1.0, at / 2.0) for f, _, at in modes])
        normal |= {"deck": deck, "mass_normalized": True}
    else:
        path = write_op2(tmp_path / "box.op2", labels, modes, endian=">" if "big" in kind else "<")
        normal |= {"deck": deck}
    back = read_modal_model(path, **normal)
    assert back.frequency == pytest.approx([f for f, _, _ in modes], rel=1e-6)
    rows = np.searchsorted(back.labels, labels)
    assert np.abs(back.shapes[:, rows] - shapes).max() < 1e-6 * np.abs(shapes).max()
    assert len(back.triangles) == 2 * 2 * (3 * 2 + 2 * 1 + 3 * 1)


def test_what_is_missing_is_named(body, tmp_path):
    model, modes, _ = body
    labels = model.labels.tolist()
    deck = write_nastran(model, tmp_path / "box.bdf", units="mm-t-s")
    h5 = write_h5(tmp_path / "box.h5", labels, modes)
    for path, options, message in (
        (h5, {}, "give units"),
        (h5, {"units": "mm-t-s"}, "state the deck"),
        (write_op2(tmp_path / "box.op2", labels, modes), {"units": "mm-t-s"}, "state the deck"),
        (write_punch(tmp_path / "box.pch", labels, modes), {"units": "mm-t-s", "deck": deck}, "mass_normalized = true"),
        (
            write_h5(tmp_path / "none.h5", labels, [(f, 0.0, at) for f, _, at in modes]),
            {"units": "mm-t-s", "deck": deck},
            "modal mass 0",
        ),
    ):
        with pytest.raises(InputError, match=message):
            read_modal_model(path, **options)
    text = (tmp_path / "box.pch").read_text()
    (tmp_path / "two.pch").write_text(text + text.replace("$SUBCASE ID =           1", "$SUBCASE ID =           2"))
    with pytest.raises(InputError, match="subcases 1, 2"):
        read_modal_model(tmp_path / "two.pch", units="mm-t-s", deck=deck, mass_normalized=True)


def test_a_punch_file_that_ends_within_a_mode_is_refused(body, tmp_path):
    model, modes, _ = body
    path = write_punch(tmp_path / "box.pch", model.labels.tolist(), [(f, 1.0, at) for f, _, at in modes])
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[:-6]))
    deck = write_nastran(model, tmp_path / "box.bdf", units="mm-t-s")
    with pytest.raises(FileFormatError, match=r"has \d+ nodes, the first \d+: the file is cut off"):
        read_modal_model(path, units="mm-t-s", deck=deck, mass_normalized=True)
