"""Hand-offs that earlier versions saved are read.  *_1.h5: before files began with a checksum of their bytes."""

from pathlib import Path
from shutil import copy

import h5py
import numpy as np
import pytest

from nvhchain.conventions import Air
from nvhchain.errors import FileFormatError
from nvhchain.files import hdf5
from nvhchain.handoff import (
    BearingForces,
    ForceAccuracy,
    HousingAccuracy,
    ReducedHousing,
    RigidPlane,
    SoundAccuracy,
    Surface,
    TransferVectors,
)
from nvhchain.testing import hand_offs

HERE = Path(__file__).parent
SURFACE = Surface([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
SAVED = {
    "bearing_forces_1": BearingForces(
        [0.0, 1.0, 2.0],
        np.arange(9.0).reshape(3, 1, 3),
        ("A1",),
        [[0.0, 1, 2]],
        261.8,
        transmission_error=np.ones((3, 2)),
        output_lag=np.ones(3),
    ),
    "reduced_housing_1": ReducedHousing(
        [100.0],
        [0.02],
        [[[1.0, 2, 3]]],
        [[1.0, 2, 3, 4]],
        np.eye(3).reshape(1, 3, 1, 3),
        np.ones((1, 3, 4)),
        ("A1",),
        [[0.0, 0, 0]],
        SURFACE,
    ),
    "transfer_vectors_1": TransferVectors(
        [50.0],
        [[0.0, 0, 5]],
        np.full((1, 1, 4), 2 + 1j),
        SURFACE,
        Air(340.0, 1.2),
        RigidPlane((0.1, 0, -2), (1.0, 2, 7)),
        np.full((1, 1, 4), 1j),
    ),
}


@pytest.mark.parametrize("name", SAVED)
def test_an_old_file_holds_what_was_saved(name):
    assert hdf5.load(HERE / f"{name}.h5").content_hash == SAVED[name].content_hash
    kind, provenance = hdf5.record(HERE / f"{name}.h5")
    assert kind == type(SAVED[name]).__name__
    assert provenance == {"stage": "before checksums of bytes"}


UNTYPED = {
    "housing": (
        hand_offs.housing(modes=2),
        {
            "frequency_error": [0.01, 0.02],
            "residual_mass": np.arange(81.0).reshape(9, 9).tolist(),
            "truncation_error_db": 0.5,
            "truncation_error_at_db": {"212.5 Hz": 0.1, "425 Hz": 0.2},
            "mapping_error_db": {"500 Hz": -0.3},
        },
        HousingAccuracy(
            [0.01, 0.02], np.arange(81.0).reshape(3, 3, 3, 3), 0.5, [212.5, 425.0], [0.1, 0.2], [500.0], [-0.3]
        ),
    ),
    "forces": (
        SAVED["bearing_forces_1"],
        {
            "beyond_mesh_law": {"A–B": {"lowest": 1.0, "highest": 2.0, "table_lowest": 3.0, "table_highest": 4.0}},
            "parted_flanks": {"A–B": {"seconds": 0.1, "time_step": 1e-5, "bent_ways": True}},
        },
        ForceAccuracy(("A–B",), [1.0], [2.0], [3.0], [4.0], parted=("A–B",), parted_time=[0.1], time_step=1e-5),
    ),
    "vectors": (
        SAVED["transfer_vectors_1"],
        {"expected_error_dB": 0.3, "elements_per_wavelength": 6.0, "estimated_error_db": 0.05},
        SoundAccuracy(expected_error_db=0.3, elements_per_wavelength=6.0, estimated_error_db=0.05),
    ),
}
"""Hand-off, what its provenance stated before schema 3, and the accuracy that it is read as."""


def save_untyped(hand_off, provenance, path, monkeypatch):
    with monkeypatch.context() as before:
        before.setattr(hdf5, "SCHEMA_VERSION", 2)
        return hdf5.save(hand_off.replace(provenance={"stage": "x", **provenance}), path)


@pytest.mark.parametrize("name", UNTYPED)
def test_accuracy_of_an_older_file_is_taken_from_its_provenance_once(name, tmp_path, monkeypatch):
    hand_off, provenance, accuracy = UNTYPED[name]
    read = hdf5.load(save_untyped(hand_off, provenance, tmp_path / "old.h5", monkeypatch))
    assert read.accuracy == accuracy
    assert read.provenance == {"stage": "x"}
    again = hdf5.load(hdf5.save(read, tmp_path / "new.h5"))
    assert again.content_hash == read.content_hash != hand_off.content_hash


def test_a_newer_file_takes_no_accuracy_from_its_history(tmp_path):
    hand_off, provenance, _ = UNTYPED["vectors"]
    read = hdf5.load(hdf5.save(hand_off.replace(provenance=provenance), tmp_path / "new.h5"))
    assert not read.accuracy.is_stated
    assert read.provenance == provenance


def test_an_older_statement_of_another_form_is_one_line(tmp_path, monkeypatch):
    hand_off, provenance, _ = UNTYPED["housing"]
    for nonsense in ({"frequency_error": [0.01]}, {"mapping_error_db": 7.0}, {"residual_mass": "much"}):
        path = save_untyped(hand_off, provenance | nonsense, tmp_path / "old.h5", monkeypatch)
        with pytest.raises(FileFormatError, match=r"old\.h5: not readable by this version .*: make it anew") as said:
            hdf5.load(path)
        assert len(str(said.value).splitlines()) == 1


def test_an_old_file_that_was_altered_is_refused(tmp_path):
    path = copy(HERE / "transfer_vectors_1.h5", tmp_path)
    with h5py.File(path, "r+") as file:
        file["vectors"][0, 0, 0] = 7.0
    with pytest.raises(FileFormatError, match="checksum"):
        hdf5.load(path)
