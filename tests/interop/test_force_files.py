"""Tables, MAT and HDF5 files of foreign forces as programs write them, and files that are none."""

from dataclasses import replace

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from nvhchain.errors import InputError
from nvhchain.files.hdf5 import save
from nvhchain.interop import BearingChannels, ForceChannels, read_bearing_forces, read_record
from nvhchain.testing.hand_offs import POSITIONS, one_bearing


def test_stored_hand_off_and_matlab_73_file_are_read_as_hdf5(forces, tmp_path, declared):
    stored = save(forces, tmp_path / "forces.h5")
    names = [f"force[{i},{k}]" for i in range(2) for k in range(3)]
    channels = replace(
        declared,
        bearings=(BearingChannels("A", *names[:3]), BearingChannels("B", *names[3:])),
        time_channel="time",
        speed=None,
        speed_channel="input_speed",
    )
    np.testing.assert_array_equal(read_bearing_forces(stored, channels, positions=POSITIONS).force, forces.force)
    matlab = tmp_path / "v73.mat"
    matlab.write_bytes(stored.read_bytes())
    np.testing.assert_array_equal(read_bearing_forces(matlab, channels, positions=POSITIONS).force, forces.force)


def test_fields_of_a_matlab_structure_are_channels(tmp_path):
    time = np.arange(50) / 1000.0
    force = np.sin(time)
    savemat(tmp_path / "run.mat", {"run": {"t": time, "left": {"x": force, "y": 2 * force, "z": -force}}})
    meaning = ForceChannels(
        (BearingChannels("A1", "run.left.x", "run.left.y", "run.left.z", (0.0, 0.0, 0.0)),),
        force_unit="N",
        acts_on="housing",
        speed=10.0,
        time_channel="run.t",
    )
    found = read_bearing_forces(tmp_path / "run.mat", meaning)
    assert np.array_equal(found.force[:, 0], np.stack([force, 2 * force, -force], axis=1))
    assert found.sample_rate == pytest.approx(1000.0)


def test_two_arrays_with_channels_of_one_name_are_refused(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["F"], file["F[0]"] = np.ones((9, 2)), np.ones(9)
    with pytest.raises(InputError, match=r"two arrays have channels called F\[0\]"):
        read_record(tmp_path / "a.h5")


def test_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read_record(tmp_path / "no.csv")


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.csv", b"", "line of names"),
        ("a.csv", b"t,Ax\n0,1,2\n", "2 names, but 3 columns"),
        ("a.csv", b"t,Ax\n0,1\n1,oops\n", "line of names"),
        ("a.csv", b"t,t\n0,1\n1,1\n", "names repeat"),
        ("a.csv", b"\xff\xfe\x00", "line of names"),
        ("a.mat", b"MATLAB 5.0 MAT-file" + b"\0" * 40, "not a MAT file"),
        ("a.h5", b"\x89HDF\r\n\x1a\n" + b"\0" * 30, "damaged, truncated or not HDF5"),
        ("a.uff", b"    -1\n    58\nrubbish\n    -1\n", "universal file|no time response"),
        ("a.uff", b"hello", "universal file|no time response"),
        ("a.doc", b"", "suffix '.doc' names no known format"),
    ],
)
def test_damaged_and_foreign_files_are_refused_in_one_line(tmp_path, declared, name, content, message):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(InputError, match=message) as caught:
        read_bearing_forces(path, declared, positions=POSITIONS)
    assert "\n" not in str(caught.value)


TABLES = {
    "quoted": '"t","x","y","z"\n"s","N","N","N"\n"0.0","1","2","3"\n"0.001","4","5","6"\n',
    "commas at the ends": "t,x,y,z,\ns,N,N,N,\n0.0,1,2,3,\n0.001,4,5,6,\n",
    "comma below the names only": "t,x,y,z\ns,N,N,N\n0.0,1,2,3,\n0.001,4,5,6,\n",
    "header of numpy": "# a run, with, two, samples\n# t,x,y,z\n# s,N,N,N\n0.0,1,2,3\n0.001,4,5,6\n",
    "indented comment": "  # made by hand, once\nt,x,y,z\n  # units\ns,N,N,N\n0.0,1,2,3\n0.001,4,5,6 # last\n",
    "free text above": "Gearbox 7\nsolver, 2024, 'rev 2'\nduration,0.002,\nt,x,y,z\ns,N,N,N\n0.0,1,2,3\n0.001,4,5,6\n",
    "comment at the first numbers": "t,x,y,z\ns,N,N,N\n0.0,1,2,3 # first\n0.001,4,5,6\n",
    "names alone": "# by hand\n#t, x, y, z\n0.0,1,2,3\n0.001,4,5,6\n",
}


@pytest.mark.parametrize("layout", TABLES)
def test_tables_are_read_as_spreadsheets_and_numpy_write_them(tmp_path, layout):
    (tmp_path / "a.csv").write_text(TABLES[layout])
    channels = one_bearing(*"xyz", sample_rate=None, time_channel="t")
    found = read_bearing_forces(tmp_path / "a.csv", channels)
    np.testing.assert_array_equal(found.force[:, 0], [[1, 2, 3], [4, 5, 6]])
    np.testing.assert_array_equal(found.time, [0.0, 1e-3])
    if layout != "names alone":
        with pytest.raises(InputError, match="'x' is in 'N' by the file, but 'kN' is declared"):
            read_bearing_forces(tmp_path / "a.csv", replace(channels, force_unit="kN"))


@pytest.mark.parametrize(
    ("text", "message"),
    [("run,7\nt,x,y\n0,1\n1,2\n", "2 names, but 3 units"),
     ("0,1,1,1\n1,2,2,2\n", "names repeat: 0, 1, 1, 1: put a line"), ("t,x\ns,N\n", "ends before the first number"),
     ("t,x\n0,1\n1,2,3\n", "number of columns changed"), ("t,x\n0,\n1,\n", "2 names, but 1 columns")],
)  # fmt: skip
def test_tables_without_names_numbers_or_equal_rows_are_refused(tmp_path, text, message):
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(InputError, match=message):
        read_record(tmp_path / "a.csv")
