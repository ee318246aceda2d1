"""Hand-offs that earlier versions saved are read.  *_1.h5: before files began with a checksum of their bytes."""

from pathlib import Path
from shutil import copy

import h5py
import numpy as np
import pytest

from nvhchain.conventions import Air
from nvhchain.errors import FileFormatError
from nvhchain.files import hdf5
from nvhchain.handoff import BearingForces, ReducedHousing, RigidPlane, Surface, TransferVectors

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


def test_an_old_file_that_was_altered_is_refused(tmp_path):
    path = copy(HERE / "transfer_vectors_1.h5", tmp_path)
    with h5py.File(path, "r+") as file:
        file["vectors"][0, 0, 0] = 7.0
    with pytest.raises(FileFormatError, match="checksum"):
        hdf5.load(path)
