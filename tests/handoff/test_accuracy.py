"""Accuracy is a checked field of a hand-off, part of its identity, and the source of warnings."""

import warnings

import numpy as np
import pytest

from nvhchain.errors import AccuracyWarning, InputError, concerning
from nvhchain.handoff import (
    ACCURACIES,
    FieldPressure,
    ForceAccuracy,
    HousingAccuracy,
    SolverRecord,
    SoundAccuracy,
    warn_of,
)
from nvhchain.testing import hand_offs


def pressure(**stated):
    return FieldPressure([50.0], [[0.0, 0, 1]], [[1.0]], accuracy=SoundAccuracy(**stated))


def test_another_statement_is_another_hand_off_and_no_statement_is_none():
    plain = FieldPressure([50.0], [[0.0, 0, 1]], [[1.0]])
    assert pressure().content_hash == plain.content_hash
    assert len({one.content_hash for one in (plain, pressure(clearance=0.1), pressure(clearance=0.2))}) == 3
    assert pressure(clearance=0.1).replace(provenance={"stage": "x"}).accuracy == SoundAccuracy(clearance=0.1)


@pytest.mark.parametrize(
    ("stated", "message"),
    [
        ({"expected_error_db": np.nan}, "SoundAccuracy.expected_error_db = nan must be finite"),
        ({"resonance_lines": 1.5}, "resonance_lines = 1.5 must be a whole number"),
        ({"interpolation_error": [[0.1]]}, "interpolation_error has shape"),
        ({"interpolation_error": [0.1, 0.2]}, "accuracy states 2 values along point, but there are 1: state as many"),
    ],
)
def test_statements_are_checked_and_fit_their_hand_off(stated, message):
    with pytest.raises(InputError, match=message):
        pressure(**stated)


def test_a_housing_states_an_error_for_each_of_its_modes():
    housing = hand_offs.housing(modes=3)
    with pytest.raises(InputError, match="states 2 values along mode, but there are 3"):
        housing.replace(accuracy=HousingAccuracy([0.1, 0.2]))
    with pytest.raises(InputError, match="must be a HousingAccuracy"):
        housing.replace(accuracy=SoundAccuracy())


def test_later_statements_count_and_earlier_ones_stay():
    both = SoundAccuracy(clearance=0.1, expected_error_db=1.0) | SoundAccuracy(expected_error_db=2.0)
    assert both == SoundAccuracy(clearance=0.1, expected_error_db=2.0)
    assert both.cleared("clearance") == SoundAccuracy(expected_error_db=2.0)
    assert SolverRecord(("direct",)) + SolverRecord(("iterative",), 1e-7, 1e-6) == SolverRecord(
        ("direct", "iterative"), 1e-7, 1e-6
    )


DOUBTS = [
    (SoundAccuracy(asked_error_db=0.1, shape_error_db=0.2, expected_error_low_db=1.0), "coarse for the body"),
    (
        SoundAccuracy(
            elements_per_wavelength=5.0, asked_elements_per_wavelength=6.0, upper_frequency=1000.0, element_size=0.06,
            expected_error_db=0.5,
        ),
        r"5 elements per wavelength at 1000 Hz, 6 asked: expect errors of about 0\.5 dB there; refine to 50 mm",
    ),
    (SoundAccuracy(quadrature_error=0.02, asked_quadrature_error=0.01), r"error of 0\.02 on the surface, 0\.01 asked"),
    (
        SoundAccuracy(interpolation_error_db=0.3, interpolation_frequency=200.0, asked_interpolation_error_db=0.1),
        r"0\.3 dB at 200 Hz, 0\.1 dB asked: take more masters",
    ),
    (
        HousingAccuracy(mapping_frequency=[100.0], mapping_error_db=[-0.8], mapping_tolerance_db=0.5),
        r"miss the sound power of the skin by -0\.8 dB, 0\.5 dB are tolerated",
    ),
    (ForceAccuracy(("A–B",), [-1e-6], [9e-6], [0.0], [8e-6]), r"mesh A–B: deflections of -1…9 µm .* over 0…8 µm"),
]  # fmt: skip


@pytest.mark.parametrize(("stated", "message"), DOUBTS)
def test_warnings_follow_from_what_is_stated_with_value_limit_and_remedy(stated, message):
    with pytest.warns(AccuracyWarning, match=message) as found:
        warn_of(stated)
    assert len(found) == 1


def test_what_keeps_to_what_was_asked_for_is_not_warned_of():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for kind in ACCURACIES.values():
            warn_of(kind())
        warn_of(SoundAccuracy(elements_per_wavelength=6.0, asked_elements_per_wavelength=6.0, element_size=0.06))
        warn_of(SoundAccuracy(expected_error_db=9.0))  # nothing was asked for


def test_a_warning_of_a_hand_off_knows_its_kind_and_what_it_concerns():
    near = pressure(clearance=0.1, expected_error_nearest_db=2.0)
    with pytest.warns(AccuracyWarning) as found, concerning("solid"), concerning("pressure"):
        warn_of(near)
    assert (found[0].message.kind, found[0].message.subjects) == ("field point near the surface", ("solid", "pressure"))
