"""Conversion of a hand-off to an xarray data set with named axes."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from nvhchain.handoff.declared import LABELS
from nvhchain.runtime.extras import check_installed

if TYPE_CHECKING:
    import xarray

    from nvhchain.handoff.base import Declared


def dataset(hand_off: Declared) -> xarray.Dataset:
    """Return an object, and those inside, as a data set.

    Fields are variables; values and labels of axes are coordinates.
    """
    check_installed("xarray")
    import xarray

    inside, attributes = [], {"kind": type(hand_off).__name__, "content_hash": hand_off.content_hash}
    variables: dict[str, Any] = {}
    coordinates: dict[str, Any] = {}
    for quantity in hand_off.declared.values():
        given = getattr(hand_off, quantity.name)  # also a computed one
        description = {"units": quantity.unit, "long_name": quantity.meaning}
        if hasattr(given, "to_xarray"):
            inside.append(given.to_xarray())
        elif dataclasses.is_dataclass(given):
            attributes |= {f"{quantity.name}_{key}": item for key, item in vars(given).items()}
        elif not quantity.absent(given):
            variables[quantity.name] = (quantity.dims, np.asarray(given), description)
            if quantity.names_axis:
                coordinates[quantity.dims[0]] = _distinct(given)
    for dims, _, _ in variables.values():
        coordinates |= {axis: list(LABELS[axis]) for axis in dims if axis in LABELS}
    return xarray.merge([xarray.Dataset(variables, coordinates), *inside]).assign_attrs(attributes)


def _distinct(labels: Sequence[str]) -> list[str]:
    """Return labels of which repeated ones have their number, so that each selects one entry."""
    seen: dict[str, int] = {}
    found = []
    for label in map(str, labels):
        seen[label] = seen.get(label, 0) + 1
        found.append(label if seen[label] == 1 else f"{label} ({seen[label]})")
    return found
