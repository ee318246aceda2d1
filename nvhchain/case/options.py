"""What the dynamics of a gearbox can take in beside the plain model: nothing is on, or computed, unless asked for."""

from __future__ import annotations

from dataclasses import dataclass

from nvhchain.dynamics.model.friction import LARGEST_COEFFICIENT
from nvhchain.errors import require
from nvhchain.kinds import check_fields

TILT_POINTS = 2
"""Across the face, of a mesh that tilts: as many as give slices side by side their exact resistance; with three the
forces differ by 0.01 dB (docs/measured/dynamics/options.md)."""


@dataclass(frozen=True)
class Options:
    """What each does to the example gearbox is measured in docs/measured/dynamics/options.md.

    friction: coefficient of the flanks under their nominal force; usual is 0.05; 0: none.
    shuttling: the centre of every mesh's load moves along the face.
    tilt: meshes carry at several points across the face and so resist, and follow, the tilt of their gears.
    loaded_misalignment: mesh laws are those of gears tilted by the load at standstill, on top of the stage's own
    misalignment; not together with tilt, which holds that tilt already.
    flexible_shafts: shafts bend and twist.
    gyroscopic: the shafts' spin turns their tilting.
    rigid_housing: the seats of the bearings stand still in the gearbox; the housing then moves under the forces that
    act on it, but not with the shafts. Bearing forces alone then need no housing.
    """

    friction: float = 0.0
    shuttling: bool = False
    tilt: bool = False
    loaded_misalignment: bool = False
    flexible_shafts: bool = False
    gyroscopic: bool = False
    rigid_housing: bool = False

    def __post_init__(self) -> None:
        check_fields(self)
        require(
            0.0 <= self.friction <= LARGEST_COEFFICIENT,
            f"friction = {self.friction:g} is outside 0…{LARGEST_COEFFICIENT:g}: give the coefficient, usual is 0.05",
        )
        require(
            not (self.tilt and self.loaded_misalignment),
            "tilt and loaded_misalignment are both asked for, which would count the tilt under load twice: keep one",
        )

    @property
    def face_points(self) -> int:
        """Points across the face at which a mesh carries."""
        return TILT_POINTS if self.tilt else 1

    @property
    def load_distribution(self) -> bool:
        """Whether forces beside those of the mesh laws act, for which it takes where the flanks carry."""
        return self.friction > 0.0 or self.shuttling
