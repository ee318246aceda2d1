"""Modes in universal files and HDF5: what is read of them, in which units, and what is refused."""

import re
import tracemalloc

import numpy as np
import pytest

from nvhchain.errors import FileFormatError, InputError
from nvhchain.fem.modal_model import ModalModel
from nvhchain.interop.modes.modal_hdf5 import read_modal_hdf5, write_modal_hdf5
from nvhchain.interop.modes.modal_uff import read_modal_uff
from nvhchain.interop.modes.modal_uff_out import write_modal_uff


def test_units_of_a_universal_file_are_stated_once(tmp_path):
    path = tmp_path / "modes.unv"
    path.write_text(UFF)
    assert read_modal_uff(path, units="mm-t-s").shapes == pytest.approx(read_modal_uff(path).shapes)
    with pytest.raises(InputError, match=r"states units of 0\.001 m and 1000 kg, not those of m-kg-s"):
        read_modal_uff(path, units="m-kg-s")
    with pytest.raises(InputError, match="not those of mm-kg-ms"):
        read_modal_uff(path, units="mm-kg-ms")
    path.write_text(UFF[UFF.index("    -1\n    -1\n") + 7 :])
    plain, stated = read_modal_uff(path), read_modal_uff(path, units="mm-kg-ms")
    assert stated.nodes == pytest.approx(1e-3 * plain.nodes)
    assert stated.frequency == pytest.approx(1e3 * plain.frequency)  # cycles per millisecond
    assert stated.shapes == pytest.approx(plain.shapes)


def test_hdf5_keeps_every_digit(modes, tmp_path):
    back = read_modal_hdf5(write_modal_hdf5(modes, tmp_path / "modes.h5"))
    for name in ("nodes", "labels", "triangles", "frequency", "damping", "shapes"):
        assert np.array_equal(getattr(back, name), getattr(modes, name))


UFF = """\
    -1
   164
         9user: mm, N                 1
  1.0000000000000000D+03  1.0000000000000000D+00  1.0000000000000000D+00
  0.0000000000000000D+00
    -1
    -1
    15
         1         0         0        11  0.00000E+00  0.00000E+00  0.00000E+00
         2         0         0        11  1.00000E+03  0.00000E+00  0.00000E+00
         3         0         0        11  0.00000E+00  1.00000E+03  0.00000E+00
         4         0         0        11  0.00000E+00  0.00000E+00  1.00000E+03
    -1
    -1
  2412
         1       111         1         1         7         4
         1         2         3         4
    -1
    -1
  2414
         1
mode
         1
NONE
NONE
NONE
NONE
NONE
         1         2         2         8         2         3
         0         0         1         0         1         1         0         0
         0         0
  0.00000E+00  1.50000E+02  0.00000E+00  4.00000E+00  1.00000E-02  2.00000E-02
  0.00000E+00  0.00000E+00  0.00000E+00  0.00000E+00  0.00000E+00  0.00000E+00
         1
  1.00000E+00-2.00000E+00  3.00000E+00
         3
 -1.00000E+00-2.00000E+00-3.00000E+00
    -1
"""


def test_dataset_2414_units_modal_mass_and_loss_factor(tmp_path):
    path = tmp_path / "modes.unv"
    path.write_text(UFF)
    model = read_modal_uff(path)
    assert model.nodes[1].tolist() == [1.0, 0.0, 0.0]
    assert model.frequency.tolist() == [150.0]
    assert model.damping[0] == pytest.approx(0.02)  # 1 % viscous and a loss factor of 2 %
    # N s²/mm = 1000 kg
    assert model.shapes[0, 0] == pytest.approx(np.array([1.0, -2.0, 3.0]) / np.sqrt(4000.0))
    assert model.shapes[0, 1].tolist() == [0.0, 0.0, 0.0]
    assert len(model.triangles) == 4
    normal = np.cross(*(model.nodes[model.triangles[:, i]] - model.nodes[model.triangles[:, 0]] for i in (1, 2)))
    outward = model.nodes[model.triangles[:, :3]].mean(axis=1) - model.nodes.mean(axis=0)
    assert (np.einsum("ij,ij->i", normal, outward) > 0).all()


def test_shapes_of_modal_mass_one_are_taken_as_they_stand(tmp_path):
    path = tmp_path / "modes.unv"
    path.write_text(UFF.replace("4.00000E+00  1.00000E-02", "0.00000E+00  1.00000E-02"))
    model = read_modal_uff(path, mass_normalized=True)
    assert model.shapes[0, 0] == pytest.approx(np.array([1.0, -2.0, 3.0]) / np.sqrt(1000.0))


SYSTEM_18 = "    -1\n    18\n         7         0         0         8         1\nTURNED\n{}    -1\n"
SYSTEM_2420 = "    -1\n  2420\n         1\nPART\n         7         0         8\nTURNED\n{}    -1\n"
AXES = " 0.0 0.0 0.0 0.0 2.0 0.0\n 0.0 3.0 1.0\n"  # x along y, z along z, y along −x


@pytest.mark.parametrize(
    ("system", "moved"),
    [
        (SYSTEM_18.format(AXES), [2.0, 1.0, 3.0]),
        (SYSTEM_2420.format(" 0. 0. 1.\n 0. -1. 0.\n 1. 0. 0.\n 0. 0. 0.\n"), [3.0, 2.0, 1.0]),
    ],
)
def test_nodes_that_move_in_systems_of_their_own(tmp_path, system, moved):
    path = tmp_path / "modes.unv"
    first = "         1         0         0        11"
    assert first in UFF
    path.write_text(system + UFF.replace(first, first.replace("0        11", "7        11"), 1))
    assert read_modal_uff(path).shapes[0, 0] == pytest.approx(np.array(moved) / np.sqrt(4000.0))
    path.write_text(path.read_text().replace(" 0. -1. 0.", " 0. 0. 1.").replace("7         0  ", "7         1  "))
    with pytest.raises(InputError, match="system 7, which is turned or curved"):
        read_modal_uff(path)


HEAD = "         1         2         2         8         2         3"
NODE = "         2         0         0        11"
END = " -1.00000E+00-2.00000E+00-3.00000E+00\n    -1\n"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (HEAD, HEAD.replace("2         2         8         2", "3         2         8         5"), "complex modes"),
        ("  2412\n         1       111", "  2412\n         1       121", "no shells and no solids"),
        ("4.00000E+00  1.00000E-02", "0.00000E+00  1.00000E-02", "modal mass 0"),
        ("         3\n -1", "         9\n -1", "node 9 is not defined"),
        (NODE, NODE.replace("0        11", "7        11"), "moves in its own system"),
        (HEAD, HEAD.replace("8", "x"), "not a universal"),
        (HEAD, HEAD.replace("8", "9"), r"no displacements of normal modes .* only of result type \[9\]"),
        (END, "", r"begins in line 19 \(dataset 2414\) does not end"),
        (END, END + UFF[UFF.index("    -1\n  2414") :], "150 Hz is given 2 times"),
    ],
)  # fmt: skip
def test_universal_file_that_cannot_be_used_is_refused(tmp_path, old, new, message):
    path = tmp_path / "bad.unv"
    assert old in UFF
    path.write_text(UFF.replace(old, new, 1))
    with pytest.raises(InputError, match=message):
        read_modal_uff(path)


@pytest.mark.parametrize("other", ["         9", "        12"])
def test_reaction_forces_and_accelerations_of_a_mode_are_no_modes(tmp_path, other):
    path = tmp_path / "modes.unv"
    mode = UFF[UFF.index("    -1\n  2414") :]
    path.write_text(UFF + mode.replace(HEAD, HEAD.replace("         8", other)))
    model = read_modal_uff(path)
    assert model.frequency.tolist() == [150.0]
    assert model.shapes[0, 0] == pytest.approx(np.array([1.0, -2.0, 3.0]) / np.sqrt(4000.0))


def test_exponents_of_three_digits_need_no_letter(tmp_path):
    path = tmp_path / "modes.unv"
    path.write_text(UFF.replace("  1.00000E+00-2.00000E+00  3.00000E+00", "  1.00000-101-2.00000E+00 3.00000D-101"))
    assert read_modal_uff(path).shapes[0, 0] == pytest.approx(np.array([1e-101, -2.0, 3e-101]) / np.sqrt(4000.0))


def test_two_modes_of_one_frequency_and_other_shapes_are_both_kept(tmp_path):
    path = tmp_path / "modes.unv"
    mode = UFF[UFF.index("    -1\n  2414") :]
    path.write_text(UFF + mode.replace("-2.00000E+00  3.00000E+00", " 2.00000E+00  3.00000E+00"))
    assert read_modal_uff(path).frequency.tolist() == [150.0, 150.0]


def test_hdf5_in_other_units_is_refused(modes, tmp_path):
    import h5py

    path = write_modal_hdf5(modes, tmp_path / "modes.h5")
    with h5py.File(path, "a") as file:
        file["nodes"].attrs["units"] = "mm"
    with pytest.raises(InputError, match="nodes is in 'mm', not 'm'"):
        read_modal_hdf5(path)
    path.write_bytes(b"nothing")
    with pytest.raises(FileFormatError, match="damaged"):
        read_modal_hdf5(path)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("nodes", "text", "not HDF5 of this layout"),
        ("frequency", 100.0, r"modes of shapes frequency \(\)"),
        ("damping", [0.01], r"damping \(1,\).* as many are needed"),
        ("triangles", [[0, 1]], "no skin, or one that refers to nodes that do not exist"),
        ("triangles", [[0, 1, 2, 3, -1, -1]], "no skin, or one that refers to nodes that do not exist"),
        ("two_sided", [True], r"two_sided of shape \(1,\)"),
        ("shapes", None, "not HDF5 of this layout"),
    ],
)
def test_hdf5_of_another_layout_is_refused(modes, tmp_path, name, value, message):
    import h5py

    path = write_modal_hdf5(modes, tmp_path / "modes.h5")
    with h5py.File(path, "a") as file:
        del file[name]
        if value is None:
            file.create_group(name)
        else:
            file[name] = value
    with pytest.raises(InputError, match=message):
        read_modal_hdf5(path)


def test_hdf5_takes_units_as_bytes_and_shells_by_an_attribute(modes, tmp_path):
    """As MATLAB writes them, and as one says of all triangles what they are."""
    import h5py

    path = write_modal_hdf5(modes, tmp_path / "modes.h5")
    with h5py.File(path, "a") as file:
        file["nodes"].attrs["units"] = np.bytes_("m")
        del file["two_sided"]
        assert not read_modal_hdf5(path).two_sided.any()
        file["triangles"].attrs["two_sided"] = True
    assert read_modal_hdf5(path).two_sided.all()


def test_numbers_of_a_node_may_stand_on_lines_of_their_own_length(tmp_path):
    path = tmp_path / "modes.unv"
    wide = UFF.replace(HEAD, HEAD[:-1] + "6")
    for values in ("  1.00000E+00-2.00000E+00  3.00000E+00", " -1.00000E+00-2.00000E+00-3.00000E+00"):
        wide = wide.replace(values, values + "\n  7.00000E+00  8.00000E+00  9.00000E+00")
    path.write_text(wide)
    assert wide.count("9.00000E+00") == 2
    path_of_three = tmp_path / "three.unv"
    path_of_three.write_text(UFF)
    assert read_modal_uff(path).shapes == pytest.approx(read_modal_uff(path_of_three).shapes)


def test_rotations_are_not_kept_while_the_other_modes_are_read(tmp_path):
    """Forty modes of six numbers a node: displacements once as read and once in the model, and the nodes."""
    rng = np.random.default_rng(3)
    model = ModalModel(
        nodes=rng.random((400, 3)),
        labels=np.arange(1, 401),
        triangles=np.array([[0, 1, 2]]),
        two_sided=True,
        frequency=np.arange(1.0, 41.0),
        damping=np.full(40, 0.01),
        shapes=rng.random((40, 400, 3)),
    )
    text = write_modal_uff(model, tmp_path / "three.unv").read_text()
    start = text.index("    55\n")
    shapes = re.sub(r"(?m)^(.{39})$", r"\1" + 3 * "  7.00000E+00", text[start:])
    path = tmp_path / "six.unv"
    path.write_text(
        text[:start] + shapes.replace("         8         2         3\n", "         8         2         6\n")
    )
    tracemalloc.start()
    found = read_modal_uff(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert found.shapes == pytest.approx(model.shapes, rel=1e-5)
    assert peak < 3 * found.shapes.nbytes
