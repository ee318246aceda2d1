"""Units of foreign forces: what a file, a name or an attribute states must agree with what is declared."""

from dataclasses import replace

import h5py
import numpy as np
import pytest
from scipy.io import savemat
from scipy.io.matlab import MatlabOpaque

from nvhchain.errors import InputError
from nvhchain.interop import read_bearing_forces, read_record, write_bearing_forces
from nvhchain.interop.forces import csv_mat_hdf5 as records
from nvhchain.interop.forces.channel_units import unit_called
from nvhchain.testing.hand_offs import POSITIONS, csv, one_bearing, six_tones


def test_units_in_the_file_must_agree_with_the_declared_ones(tmp_path, declared):
    time = np.arange(100) / 10e3
    path = csv(tmp_path / "a.csv", time, six_tones(time), units="s,N,N,N,N,kN,N")
    with pytest.raises(InputError, match=r"'By' is in 'kN' by the file, but 'N' is declared"):
        read_bearing_forces(path, declared, positions=POSITIONS)
    path = csv(tmp_path / "b.csv", time, six_tones(time), units="ms,N,N,N,N,N,N")
    with pytest.raises(InputError, match=r"'t' is in 'ms' by the file, but 's' is declared"):
        read_bearing_forces(path, declared, positions=POSITIONS)


@pytest.mark.parametrize("level", ["5", "7.3"])
def test_units_in_a_matlab_file_must_agree(forces, tmp_path, level):
    path = tmp_path / "a.mat"
    channels = write_bearing_forces(forces, path)
    assert read_record(path).units["force[1,2]"] == "N"
    if level == "7.3":
        path.unlink()
        with h5py.File(path, "w") as file:
            for name, unit in (("time", "s"), ("input_speed", "rad/s"), ("force", "N")):
                file[name] = getattr(forces, name).T  # as MATLAB stores its axes
                file[name].attrs["MATLAB_class"] = np.bytes_("double")
                file[f"units/{name}"] = np.array([[ord(c)] for c in unit], dtype=np.uint16)
                file[f"units/{name}"].attrs["MATLAB_class"] = np.bytes_("char")
        assert list(read_record(path).units) == list(read_record(path).channels)
    assert read_bearing_forces(path, channels).force.tobytes() == forces.force.tobytes()
    for change, message in (
        ({"force_unit": "kN"}, r"'force\[0,0\]' is in 'N' by the file, but 'kN' is declared"),
        ({"speed_unit": "rpm"}, "'input_speed' is in 'rad/s' by the file"),
        ({"time_unit": "ms"}, "'time' is in 's' by the file"),
    ):
        with pytest.raises(InputError, match=message):
            read_bearing_forces(path, replace(channels, **change))


def matlab_text(file, name, text):
    """As MATLAB stores a char in a file of level 7.3."""
    file[name] = np.array([[ord(c)] for c in text], dtype=np.uint16)
    file[name].attrs["MATLAB_class"] = np.bytes_("char")
    return file[name].ref


@pytest.mark.parametrize("texts", [["kN"] * 3, ["N", "N", "kN"]])
def test_units_in_a_cell_array_of_matlab_73_must_agree(tmp_path, texts):
    with h5py.File(tmp_path / "a.mat", "w") as file:
        file["F"] = np.arange(27.0).reshape(3, 9)
        file["F"].attrs["MATLAB_class"] = np.bytes_("double")
        cells = [[matlab_text(file, f"#refs#/{i}", text)] for i, text in enumerate(texts)]
        file.create_dataset("units/F", data=np.array(cells, dtype=h5py.ref_dtype), dtype=h5py.ref_dtype)
        file["units/F"].attrs["MATLAB_class"] = np.bytes_("cell")
    names = [f"F[{i}]" for i in range(3)]
    stated = ", ".join(dict.fromkeys(texts))
    with pytest.raises(InputError, match=rf"'F\[0\]' is in '{stated}' by the file, but 'N' is declared"):
        read_bearing_forces(tmp_path / "a.mat", one_bearing(*names))
    if len(set(texts)) == 1:
        found = read_bearing_forces(tmp_path / "a.mat", one_bearing(*names, force_unit="kN"))
        assert found.force[1, 0].tolist() == [1e3, 10e3, 19e3]


@pytest.mark.parametrize("level", ["5", "7.3"])
def test_a_unit_that_matlab_stored_as_an_object_is_refused(tmp_path, monkeypatch, level):
    """Strings in double quotes; only MATLAB tells what they hold."""
    force = np.arange(9.0)
    if level == "7.3":
        with h5py.File(tmp_path / "a.mat", "w") as file:
            for name in "xyz":
                file[name] = force
            file["units/x"] = np.array([[0xDD000000, 2, 1, 1, 1, 1]], dtype=np.uint32)
            file["units/x"].attrs["MATLAB_class"] = np.bytes_("string")
    else:
        savemat(tmp_path / "a.mat", {})
        kind = [("s0", "O"), ("s1", "O"), ("s2", "O"), ("arr", "O")]
        unit = MatlabOpaque(np.array([(b"", b"MCOS", b"string", np.ones((6, 1), np.uint32))], dtype=kind))
        content = dict.fromkeys("xyz", force) | {"units": np.array([[(unit,)]], dtype=[("x", "O")])}
        monkeypatch.setattr(records, "loadmat", lambda path: content)
    with pytest.raises(InputError, match="'x' is in 'a string, which only MATLAB reads: store a char' by the file"):
        read_bearing_forces(tmp_path / "a.mat", one_bearing(*"xyz"))


def test_units_of_a_nested_matlab_structure_belong_to_the_fields_beside_them(tmp_path):
    wave = np.sin(np.arange(50.0))
    savemat(tmp_path / "run.mat", {"run": {"left": wave, "right": wave, "units": {"left": "kN", "right": ""}}})
    assert read_record(tmp_path / "run.mat").units == {"run.left": "kN"}


@pytest.mark.parametrize("called", ["Unit", "UNITS", "units"])
def test_attributes_and_structures_with_units_may_be_written_in_any_case(tmp_path, called):
    wave = np.sin(np.arange(50.0))
    savemat(tmp_path / "a.mat", {**dict.fromkeys("xyz", wave), called: dict.fromkeys("xyz", "kN")})
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name in "xyz":
            file[name] = wave
            file[name].attrs[called] = "kN"
    with h5py.File(tmp_path / "b.h5", "w") as file:
        for name in "xyz":
            file[name] = wave
            file[name].attrs.update({called: "kN", "unit": "N"})
    for path, found in (("a.mat", "kN"), ("a.h5", "kN"), ("b.h5", "kN, N|N, kN")):
        with pytest.raises(InputError, match=rf"'x' is in '({found})' by the file, but 'N' is declared"):
            read_bearing_forces(tmp_path / path, one_bearing(*"xyz"))


@pytest.mark.parametrize("columns", [1, 3])
def test_a_unit_counts_whatever_the_name_of_its_dataset(tmp_path, columns):
    force = np.sin(np.arange(100.0))
    names = ["F [x]", "F [y]", "F [z]"] if columns == 1 else [f"F [left][{i}]" for i in range(3)]
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name in names if columns == 1 else ["F [left]"]:
            file[name] = force if columns == 1 else np.stack([force] * 3, axis=1)
            file[name].attrs["units"] = "kN"
    with pytest.raises(InputError, match=r"'F \[.*\]' is in 'kN' by the file, but 'N' is declared"):
        read_bearing_forces(tmp_path / "a.h5", one_bearing(*names))
    found = read_bearing_forces(tmp_path / "a.h5", one_bearing(*names, force_unit="kN"))
    np.testing.assert_array_equal(found.force[:, 0, 2], 1e3 * force)


def test_a_unit_in_the_name_of_a_channel_must_agree(tmp_path):
    force = np.sin(np.arange(100.0))
    path = csv(tmp_path / "a.csv", force, np.stack([force] * 2, axis=1), header="Fx [kN],Fy [kN],Fz [kN]")
    names = ["Fx [kN]", "Fy [kN]", "Fz [kN]"]
    with pytest.raises(InputError, match=r"'Fx \[kN\]' is in 'kN' by its name, but 'N' is declared"):
        read_bearing_forces(path, one_bearing(*names))
    assert read_bearing_forces(path, one_bearing(*names, force_unit="kN")).force.max() == 1e3 * force.max()
    path = csv(tmp_path / "c.csv", force, np.stack([force] * 2, axis=1), header="Fx [N],Mx [Nm],Fz [N]")
    with pytest.raises(InputError, match=r"'Mx \[Nm\]' is in 'N m' by its name, but 'N' is declared"):
        read_bearing_forces(path, one_bearing("Fx [N]", "Mx [Nm]", "Fz [N]"))
    # no unit of force: a side, a number, a bearing's own name before the axis
    path = csv(tmp_path / "b.csv", force, np.stack([force] * 2, axis=1), header="Fx [S],Fy [2],B [kN]:z")
    assert read_bearing_forces(path, one_bearing("Fx [S]", "Fy [2]", "B [kN]:z")).force.max() == force.max()


@pytest.mark.parametrize(
    ("text", "unit"),
    [("NEWTONS", "N"), ("Newton", "N"), ("[N]", "N"), ("(kN)", "kN"), ("KN", "kN"), ("MN", "MN"), ("mN", "mN"),
     ("mn", None), ("Nm", "N m"), ("kn-m", "kN m"), ("mN·m", "mN m"),
     ("MNm", "MN m"), ("mnm", None), ("", None), ("SEC", "s"), ("S", "s"), ("Seconds", "s"), ("µs", "us"), ("μm", "um"),
     ("1/min", "rpm"), ("°", "deg")],
)  # fmt: skip
def test_units_are_known_by_the_names_that_files_use(text, unit):
    assert unit_called(text) == unit


@pytest.mark.parametrize("stated", [np.array([b"N"]), np.array(["newton"], dtype=object), b"N", "N", ""])
def test_a_unit_may_be_an_attribute_of_any_kind_of_text(tmp_path, stated):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name in "xyz":
            file[name] = np.arange(9.0)
            file[name].attrs["units"] = stated
    assert len(read_bearing_forces(tmp_path / "a.h5", one_bearing(*"xyz")).time) == 9
    if len(stated):
        with pytest.raises(InputError, match="by the file, but 'kN' is declared"):
            read_bearing_forces(tmp_path / "a.h5", one_bearing(*"xyz", force_unit="kN"))


def test_units_of_several_columns_count_in_a_cell_array_and_an_attribute(tmp_path):
    table = np.arange(27.0).reshape(9, 3)
    names = [f"F[{i}]" for i in range(3)]
    for texts, message in ((["kN"] * 3, r"'F\[0\]' is in 'kN' by"), (["N", "N", "kN"], r"'F\[0\]' is in 'N, kN' by")):
        savemat(tmp_path / "a.mat", {"F": table, "units": {"F": np.array(texts, dtype=object)}})
        with h5py.File(tmp_path / "a.h5", "w") as file:
            file["F"] = table
            file["F"].attrs["unit"] = texts
        for path in (tmp_path / "a.mat", tmp_path / "a.h5"):
            with pytest.raises(InputError, match=message):
                read_bearing_forces(path, one_bearing(*names))
    savemat(tmp_path / "a.mat", {"F": table, "units": {"F": np.array(["N"] * 3, dtype=object)}})
    assert read_bearing_forces(tmp_path / "a.mat", one_bearing(*names)).force[1, 0].tolist() == [3.0, 4.0, 5.0]


def test_units_of_a_table_may_stand_in_brackets_and_be_spelled_out(tmp_path):
    time = np.arange(100) / 10e3
    path = csv(tmp_path / "a.csv", time, six_tones(time)[:, :3], header="t,x,y,z", units="[sec],[N],Newton,NEWTONS")
    found = read_bearing_forces(path, one_bearing(*"xyz", sample_rate=None, time_channel="t"))
    assert found.sample_rate == pytest.approx(10e3)
