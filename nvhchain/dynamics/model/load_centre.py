"""Shuttling: the centre of a mesh's load moves along the face with the position of the mesh.

A force F at ζ from mid-width equals the same force at mid-width and the moment ζ ẑ × F on the wheel. The pinion takes
the opposite moment. F is taken at its nominal value, as in `nvhchain.dynamics.model.friction`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nvhchain.dynamics.model.angle_laws import check_table, law_of_angle
from nvhchain.errors import require
from nvhchain.handoff import FloatArray, MeshLaw
from nvhchain.kinds import check_fields

FARTHEST = 1.0
"""Largest offset from mid-width (m); a larger one indicates a wrong unit."""


@dataclass(frozen=True, eq=False)
class LoadCentre:
    """Centre of the load of the drive flanks along the face, under nominal load.

    Parameters
    ----------
    period : float
        Period of the angles (rad of the wheel).
    angle : (n_angle,) array
        Wheel angles (rad), increasing from 0 within one period.
    offset : (n_angle,) array
        Offset from mid-width along z (m).
    """

    period: float
    angle: FloatArray
    offset: FloatArray

    def __post_init__(self) -> None:
        check_fields(self)
        check_table(self, "load centre", "offset")
        require(
            bool((np.abs(self.offset) <= FARTHEST).all()),
            f"mesh load centre: offset of {np.abs(self.offset).max():g} m is off any face: give it in m",
        )


def centre_law(law: MeshLaw, centre: LoadCentre, force: float) -> MeshLaw:
    """Return F ζ / b (N) as a law that does not depend on the deflection.

    force : nominal mesh force along the flank normal (N).
    """
    return law_of_angle(law, centre.period, centre.angle, force * centre.offset / law.face_width, force, "load centre")
