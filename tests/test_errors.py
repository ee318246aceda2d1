"""Warnings of the package."""

import numpy as np
import pytest

from nvhchain.acoustics import sphere, transfer_vectors
from nvhchain.conventions import Air
from nvhchain.errors import AccuracyWarning
from nvhchain.fidelity import DRAFT


def test_a_warning_points_at_the_call_outside_the_package_however_deep_it_arises():
    points = np.array([[1.0, 0.0, 0.0]])
    with pytest.warns(AccuracyWarning) as found:
        transfer_vectors(sphere(0.1, 1), points, [3000.0], air=Air(), fidelity=DRAFT.acoustics)
    assert {warning.filename for warning in found} == {__file__}
