"""Orders have the names of the gear meshes that they come from."""

import pytest

from nvhchain.plots.marks import order_name

MESH, SLOTS = {"stage1": 20.0, "stage2": 12.0}, {"stage1": 2.0}


@pytest.mark.parametrize(
    ("order", "name"),
    [
        (20.0, "stage1 × 1"),
        (60.01, "stage1 × 3 = stage2 × 5"),
        (116.0, "stage1 × 6 − 2 × slots"),
        (42.0, "stage1 × 2 + 1 × slots"),
        (113.7, ""),
        (2.0, ""),
    ],
)
def test_harmonics_come_before_sidebands_and_the_rest_has_no_name(order, name):
    assert order_name(order, MESH, SLOTS) == name
