"""Rigid plane that an imported housing is bolted to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nvhchain.dimensions import Length
from nvhchain.errors import require
from nvhchain.handoff import FloatArray


@dataclass(frozen=True)
class MountingPlane:
    """Rigid plane that closes a housing.

    Parameters
    ----------
    point : (float, float, float)
        Point on the plane (m).
    normal : (float, float, float)
        Unit vector out of the housing.
    """

    point: tuple[Length, Length, Length]
    normal: tuple[float, float, float]

    def __post_init__(self) -> None:
        length = float(np.linalg.norm(self.normal))
        require(abs(length - 1) < 1e-6, f"MountingPlane normal = {self.normal} has length {length:g}: make it 1")

    @property
    def arrays(self) -> tuple[FloatArray, FloatArray]:
        """Point (3,) and normal (3,)."""
        return np.array(self.point, dtype=float), np.array(self.normal, dtype=float)
