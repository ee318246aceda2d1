"""Residual flexibility switched off: what is left is the modal sum, and what the excluded modes add is gone."""

from dataclasses import replace

import numpy as np
import pytest

from nvhchain.errors import AccuracyWarning, InputError
from nvhchain.handoff import HousingAccuracy
from nvhchain.housing import reduce_housing, reduction, truncation_errors
from nvhchain.housing.modes.response import face_displacement
from nvhchain.housing.reduction import apply_residual_knob
from tests.housing.seat_motion import seat_flexibility

F_MAX = 1700.0


@pytest.fixture
def pair(mesh, surface, casting, fidelity, reduced, monkeypatch):
    """The same casting with and without; meshed and reduced before."""
    monkeypatch.setattr(reduction, "mesh_casting", lambda *_: mesh)
    monkeypatch.setattr(reduction, "radiating_surface", lambda *_: surface)
    monkeypatch.setattr(reduction, "reduce_mesh", lambda *_, **__: reduced)
    knobs = [replace(fidelity, residual_flexibility=switch) for switch in (True, False)]
    with pytest.warns(AccuracyWarning, match="housing elements of 30 mm"):
        return [reduce_housing(casting, f_max=F_MAX, surface_size=0.022, fidelity=knob) for knob in knobs]


def test_modes_are_the_same_and_the_response_is_their_sum(pair):
    with_it, without = pair
    natural = with_it.mode_count
    assert np.array_equal(with_it.natural_frequency[:natural], without.natural_frequency)
    assert np.array_equal(with_it.normal_shapes[:natural], without.normal_shapes)
    line, force = np.array([0.8 * F_MAX]), np.eye(3 * len(without.names), dtype=complex)[:1]
    shapes = without.seat_shapes.reshape(len(without.natural_frequency), -1)
    modal = (force @ shapes.T * without.receptance(line)) @ without.normal_shapes
    assert np.allclose(face_displacement(without, line, force), modal, rtol=1e-12, atol=0)
    assert not np.allclose(face_displacement(with_it, line, force), modal, rtol=1e-3, atol=0)


def test_seats_are_stiffer_by_what_the_modes_left_out_would_give(pair):
    with_it, without = pair
    lost = np.diag(seat_flexibility(with_it) - seat_flexibility(without))
    assert (lost > 0).all()
    assert (lost > 0.1 * np.diag(seat_flexibility(with_it))).any()


def test_nothing_is_said_of_a_truncation_that_is_no_longer_so(pair):
    assert pair[0].accuracy.truncation_error_db is not None
    assert pair[1].accuracy.truncation_error_db is None
    with pytest.raises(InputError, match="states no truncation error"):
        truncation_errors(pair[1], np.array([F_MAX]))


def test_a_housing_without_modes_nor_residual_is_refused(reduced, fidelity):
    """It stood still: -5887 dB(A) between limits of -5887 and -5887."""
    still = reduced.drop_ritz_vectors().replace(
        natural_frequency=np.zeros(0),
        modal_damping=np.zeros(0),
        seat_shapes=reduced.seat_shapes[:0],
        normal_shapes=reduced.normal_shapes[:0],
        accuracy=HousingAccuracy(),
    )
    assert apply_residual_knob(still, fidelity) is still
    with pytest.raises(InputError, match="residual_flexibility = False leaves nothing that moves"):
        apply_residual_knob(still, replace(fidelity, residual_flexibility=False))
