"""Ways of sound about a body and by a plane: how transfer vectors turn in frequency, known without solving."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nvhchain.acoustics.waves.multipoles import plane_foot
from nvhchain.conventions import Air
from nvhchain.handoff import FloatArray, RigidPlane, Surface

_SEEN = 0.8
"""Largest turn of the echo from one master to the next that these show, in units of π: with 1 a box 0.25 m above a
plane kept 0.24 dB where 0.1 were asked (14 masters from 300 Hz to 2600 Hz, the lowest two 0.96 π apart)."""

_MOST = 2.0
"""Largest error of a straight line between two values, relative to values that turn between them."""


@dataclass(frozen=True)
class Paths:
    """Phases, in rad/Hz, and what comes with them.

    phase_slope: largest phase slope of the interpolated function.  echo: phase slope of the way from the body to a
    rigid plane and back, 0 without one.  echoed: sound that takes this way and meets the body again, relative to what
    the body radiates: its radius over that way, the pressure of a monopole there; mostly 0.2 to 1.9 times that was
    found, 8 beside a spurious pole (spheres 1.5 and 5 m above a plane).
    """

    phase_slope: float
    echo: float = 0.0
    echoed: float = 0.0

    def line_error(self, frequency: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
        """Bound (n_f,) on the relative error at lines (Hz) between neighbouring masters at `low` and `high` (n_f,) Hz
        that a straight line joins, of a body that does not resonate: |g''|/2 (f − f₁)(f₂ − f), |g''| = slope² |g|.
        """
        return _curved(self.phase_slope, frequency, low, high)

    def hidden_error(self, frequency: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
        """Relative error (n_f,) at lines between masters so far apart that the echo turns by π or nearly so from one to
        the next: no master shows it then, for it may be taken for one that turns less."""
        hidden = self.echo * (high - low) > _SEEN * np.pi
        return np.where(hidden, self.echoed * np.minimum(1.0, _curved(self.echo, frequency, low, high)), 0.0)


def paths_about(surface: Surface, plane: RigidPlane | None, air: Air) -> Paths:
    """Return the paths about a body.

    The phase of the direct way is removed: what is left turns with detours about the body, no longer than its radius.
    """
    per_metre = 2 * np.pi / air.speed_of_sound
    middle = plane_foot(surface, None)
    radius = float(np.linalg.norm(surface.vertices - middle, axis=1).max())
    phase_slope = per_metre * radius
    if plane is None:
        return Paths(phase_slope)
    way = 2.0 * float(plane.height(middle[None])[0])
    return Paths(phase_slope, per_metre * way, radius / way)


def _curved(phase_slope: float, frequency: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    inside = np.maximum((frequency - low) * (high - frequency), 0.0)
    return np.minimum(_MOST, 0.5 * phase_slope**2 * inside)
