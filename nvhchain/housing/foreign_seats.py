"""Which rigid set of a foreign model carries which bearing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from nvhchain.errors import InputError, require
from nvhchain.fem.solid_model import RigidSet, SolidModel
from nvhchain.handoff import FloatArray

SEAT_TOLERANCE = 1e-4
"""m, within which a rigid set's reference point is that of a bearing."""


def bearing_seats(
    model: SolidModel, positions: Mapping[str, Sequence[float]], names: Mapping[str, str] | None = None
) -> tuple[RigidSet, ...]:
    """The rigid set of every bearing, renamed to it.

    positions: bearing → centre of its seat, m.  names: bearing → name of a rigid set (RBE2 or coupling), number of its
    reference node, or name of a node group, which is made rigid about the position; a bearing without a name gets the
    set whose reference point is at its position.

    Raises InputError for a bearing without a seat.
    """
    names = names or {}
    unknown = sorted(set(names) - set(positions))
    require(
        not unknown, f"seats are named for {', '.join(unknown)}, which are no bearings: known {', '.join(positions)}"
    )
    return tuple(
        _seat(model, bearing, np.array(at, dtype=float), names.get(bearing)) for bearing, at in positions.items()
    )


def _seat(model: SolidModel, bearing: str, position: FloatArray, name: str | None) -> RigidSet:
    known = ", ".join(f"{r.name} at {np.round(1e3 * r.reference, 3).tolist()} mm" for r in model.rigid_sets) or "none"
    if name is None:
        distance = [float(np.linalg.norm(rigid.reference - position)) for rigid in model.rigid_sets]
        nearest = min(distance, default=np.inf)
        require(
            nearest <= SEAT_TOLERANCE,
            f"bearing {bearing} at {np.round(1e3 * position, 3).tolist()} mm has no rigid set of {model.source} within "
            f"{1e3 * SEAT_TOLERANCE:g} mm; there are: {known}",
        )
        return replace(model.rigid_sets[distance.index(nearest)], name=bearing)
    for rigid in model.rigid_sets:
        if name in (rigid.name, str(rigid.label)):
            return replace(rigid, name=bearing)
    if name in model.groups:
        return RigidSet(bearing, position, np.unique(model.groups[name]))
    raise InputError(
        f"bearing {bearing}: {model.source} has no rigid set or node group {name!r}; rigid sets: {known}; "
        f"groups: {', '.join(model.groups) or 'none'}"
    )
