"""Options of the dynamics beyond the plain model; all are off by default."""

from __future__ import annotations

from dataclasses import dataclass

from nvhchain.dynamics.model.friction import LARGEST_COEFFICIENT
from nvhchain.errors import require
from nvhchain.kinds import check_fields

TILT_POINTS = 2
"""Points across the face of a mesh that tilts.

Two give slices side by side their exact resistance. With three the forces differ by 0.01 dB
(docs/measured/dynamics/options.md).
"""


@dataclass(frozen=True)
class Options:
    """Additions to the plain dynamic model; docs/measured/dynamics/options.md has their effects on the example gearbox.

    Parameters
    ----------
    friction : float
        Coefficient of friction of the flanks under their nominal force, usually 0.05; 0: none.
    shuttling : bool
        The centre of every mesh's load moves along the face.
    tilt : bool
        Meshes act at several points across the face. They resist the tilt of their gears and follow it.
    loaded_misalignment : bool
        Mesh laws are those of gears tilted by the static load, in addition to the stage's own misalignment. Not
        together with tilt, which includes that tilt.
    flexible_shafts : bool
        Shafts bend and twist.
    gyroscopic : bool
        Shafts have gyroscopic moments.
    rigid_housing : bool
        The seats of the bearings are fixed in the gearbox. The housing then moves under the forces on it, but without
        feedback on the shafts. Bearing forces alone then need no housing.
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
        """True where friction or shuttling needs the place of the load on the flanks."""
        return self.friction > 0.0 or self.shuttling
