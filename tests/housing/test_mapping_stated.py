"""What the mapping onto the radiating faces does to the sound power is stated of every casting."""

import warnings
from dataclasses import replace

import pytest

from nvhchain.errors import AccuracyWarning
from nvhchain.housing import reduce_housing, reduction

F_MAX = 1700.0


@pytest.fixture
def reduce_it(casting, fidelity, mesh, surface, monkeypatch):
    monkeypatch.setattr(reduction, "mesh_casting", lambda *_: mesh)
    monkeypatch.setattr(reduction, "radiating_surface", lambda *_: surface)
    return lambda tolerance: reduce_housing(
        casting, f_max=F_MAX, surface_size=0.022, fidelity=replace(fidelity, mapping_tolerance_db=tolerance)
    )


def test_casting_states_the_error_of_its_mapping_and_warns_beyond_the_tolerance(reduce_it):
    with warnings.catch_warnings():
        warnings.simplefilter("error", AccuracyWarning)
        found = reduce_it(1.0).provenance["mapping_error_db"]
    assert list(found) == ["212.5 Hz", "425 Hz", "850 Hz", "1700 Hz"]
    assert all(0 < abs(error) < 0.2 for error in found.values())
    with pytest.warns(AccuracyWarning, match="casting: the radiating faces miss the sound power of the skin by"):
        assert reduce_it(0.0).provenance["mapping_error_db"] == found
