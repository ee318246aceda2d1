"""Bearing forces written for other programs: names, units, and what cannot be written."""

from dataclasses import replace

import h5py
import numpy as np
import pytest
from scipy.io import loadmat

from nvhchain.errors import InputError
from nvhchain.interop import read_bearing_forces, read_record, write_bearing_forces
from nvhchain.interop.forces import csv_mat_hdf5 as records
from nvhchain.testing.hand_offs import SUFFIXES


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_names_with_blanks_commas_and_marks_come_back_as_written(forces, tmp_path, suffix):
    odd = forces.replace(names=("A  b", "Läger, '轴'=[z]", *(f"{i}#" for i in range(len(forces.names) - 2))))
    channels = write_bearing_forces(odd, tmp_path / f"odd{suffix}")
    assert read_bearing_forces(tmp_path / f"odd{suffix}", channels).content_hash == odd.content_hash


def test_names_that_differ_by_blanks_only_are_refused_where_a_table_cannot_tell_them_apart(forces, tmp_path):
    alike = forces.replace(names=("A b", "A  b", *(f"{i}" for i in range(len(forces.names) - 2))))
    with pytest.raises(InputError, match="differ by blanks only"):
        write_bearing_forces(alike, tmp_path / "alike.csv")


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_folder_in_the_place_of_the_file_is_refused(forces, tmp_path, suffix):
    (tmp_path / f"taken{suffix}").mkdir()
    with pytest.raises(InputError, match="a folder stands where a file is to be written"):
        write_bearing_forces(forces, tmp_path / f"taken{suffix}")


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_what_the_system_does_not_let_be_written_is_refused_with_its_reason(forces, tmp_path, suffix):
    name = "n" * 300 + suffix
    with pytest.raises(InputError, match=rf"{name}: cannot be written \(File name too long\): choose another"):
        write_bearing_forces(forces, tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_forces_beyond_the_size_of_a_mat_file_are_sent_to_hdf5(forces, tmp_path, monkeypatch):
    monkeypatch.setattr(records, "LARGEST_MAT", forces.force.nbytes)
    with pytest.raises(InputError, match=r"exceed an array of a MAT file, .*: write \.h5"):
        write_bearing_forces(forces, tmp_path / "a.mat")
    write_bearing_forces(forces, tmp_path / "a.h5")


def test_matlab_reads_names_and_units(forces, tmp_path):
    write_bearing_forces(forces, tmp_path / "a.mat")
    content = loadmat(tmp_path / "a.mat", simplify_cells=True)
    assert list(content["names"]) == ["A", "B"]
    assert content["units"] == {"time": "s", "input_speed": "rad/s", "force": "N", "positions": "m"}
    write_bearing_forces(forces, tmp_path / "a.h5")
    with h5py.File(tmp_path / "a.h5") as file:
        assert file["force"].attrs["units"] == "N"
        assert list(file["names"].asstr()) == ["A", "B"]


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_moments_of_seats_come_back_as_written(forces, tmp_path, suffix):
    moved = forces.replace(moment=np.random.default_rng(3).standard_normal((len(forces.time), 2, 2)))
    channels = write_bearing_forces(moved, tmp_path / f"a{suffix}")
    assert read_bearing_forces(tmp_path / f"a{suffix}", channels).content_hash == moved.content_hash
    units = read_record(tmp_path / f"a{suffix}").units
    assert {units[name] for name in channels.moments} == {"N m"}
    turned = replace(channels, acts_on="shaft", moment_unit="N mm") if suffix == ".csv" else None
    if turned is not None:
        with pytest.raises(InputError, match=r"N m.*N mm"):
            read_bearing_forces(tmp_path / f"a{suffix}", turned)
        on_shaft = read_bearing_forces(tmp_path / f"a{suffix}", replace(turned, moment_unit="N m"))
        assert (on_shaft.wrench == -moved.wrench).all()


def test_moments_of_some_bearings_or_about_one_axis_are_refused(forces, tmp_path):
    channels = write_bearing_forces(forces.replace(moment=np.ones((len(forces.time), 2, 2))), tmp_path / "a.csv")
    one, other = channels.bearings
    with pytest.raises(InputError, match="for some bearings only"):
        replace(channels, bearings=(one, replace(other, mx=None, my=None)))
    with pytest.raises(InputError, match="about both axes, or none"):
        replace(other, my=None)
    with pytest.raises(InputError, match="'A:mx', 'A:mx' name a channel twice: give each its own"):
        replace(one, my="A:mx")
    assert replace(channels, rotation=((1, -1e-12, 0), (1e-12, 1, 0), (0, 0, 1))).moments
    with pytest.raises(InputError, match="mx and my are given without moment_unit: state it, one of N m, kN m"):
        replace(channels, moment_unit=None)
    with pytest.raises(InputError, match="moment_unit = 'N' is unknown: choose from N m, kN m"):
        replace(channels, moment_unit="N")
    with pytest.raises(InputError, match="give forces and moments along the gearbox's axes"):
        replace(channels, rotation=((0, 1, 0), (-1, 0, 0), (0, 0, 1)))
