"""The rigid plane of the engine that a foreign housing is bolted to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nvhchain.dimensions import Length
from nvhchain.errors import require
from nvhchain.handoff import FloatArray


@dataclass(frozen=True)
class EnginePlane:
    """The rigid plane that closes a housing.  point: m on it.  normal: unit vector that points at the engine."""

    point: tuple[Length, Length, Length]
    normal: tuple[float, float, float]

    def __post_init__(self) -> None:
        length = float(np.linalg.norm(self.normal))
        require(abs(length - 1) < 1e-6, f"EnginePlane normal = {self.normal} has length {length:g}: make it 1")

    @property
    def arrays(self) -> tuple[FloatArray, FloatArray]:
        """Point and normal."""
        return np.array(self.point, dtype=float), np.array(self.normal, dtype=float)
