"""Deviations of a gear drawn at random within a tolerance class."""

from __future__ import annotations

import numpy as np

from nvhchain.errors import require
from nvhchain.gear.deviations.flanks import GearDeviations, ToothFlanks
from nvhchain.gear.deviations.tolerances import FlankTolerances
from nvhchain.gear.drawing.geometry import GearGeometry
from nvhchain.handoff import FloatArray
from nvhchain.kinds import checked

SCATTER = 0.3
"""Standard deviation of the slope of one tooth about that of the gear, relative to the latter's.

Tool and machine set the slope of a gear; its blank's wobble and the process scatter its teeth."""
_ROUNDS = 20
"""Rounds in which white noise and eccentricity are scaled to both limits of the pitch."""


@checked
def drawn_deviations(
    geometry: GearGeometry,
    limits: FlankTolerances,
    *,
    seed: int,
    drives: bool = True,
    angle: float | None = None,
) -> GearDeviations:
    """Draw the deviations of one gear that uses its tolerances up.

    limits: tolerances, such as those of a class (`flank_tolerances`); 0 for none.
    seed: number of the draw; the same number gives the same gear.
    drives: True for a pinion, whose eccentricity moves its drive flanks as the other flanks of a wheel.
    angle: angle of the eccentricity (rad), as in `GearDeviations`; drawn by default.

    The pitch is an eccentricity, a sine over one turn, plus white noise from tooth to tooth. Both are scaled until the
    largest single pitch deviation is f_pT and the cumulative one F_pT, as far as F_rT allows. Slopes are those of the
    gear plus a scatter of each tooth; the largest is at its tolerance. Waves of form have the range of their tolerance,
    the same on all teeth. Both flanks share the eccentricity alone.
    """
    require(seed >= 0, f"seed = {seed} must be 0 or more")
    random = np.random.default_rng([seed, geometry.teeth])
    anywhere = float(random.uniform(0.0, 2.0 * np.pi))
    angle = anywhere if angle is None else angle
    noises = random.standard_normal((2, geometry.teeth))
    # the other flank has its own noise on the same eccentricity
    (noise, eccentricity), (other, _) = (
        _scaled_pitch(limits, noise, eccentric_pitch(geometry, 1.0, angle, drives=sense))
        for noise, sense in zip(noises, (drives, not drives), strict=True)
    )

    def flanks(pitch: FloatArray) -> ToothFlanks:
        def slope(limit: float) -> FloatArray:
            values = random.standard_normal() + SCATTER * random.standard_normal(geometry.teeth)
            return np.asarray(values * (limit / np.abs(values).max()))

        even = np.ones(geometry.teeth)
        profile, helix = slope(limits.profile_slope), slope(limits.helix_slope)
        waves = [(float(random.uniform(1.0, 3.0)), float(random.uniform(0.0, 2.0 * np.pi))) for _ in range(2)]
        return ToothFlanks(
            pitch, profile, limits.profile_form * even, helix, limits.helix_form * even, waves[0], waves[1]
        )

    return GearDeviations(flanks(noise), flanks(other), eccentricity, angle)


def _scaled_pitch(limits: FlankTolerances, noise: FloatArray, wave: FloatArray) -> tuple[FloatArray, float]:
    """Return the noise (n_tooth,) of a flank's place (m) and the eccentricity (m) at the limits of the pitch.

    wave: (n_tooth,), place of the flanks per unit of eccentricity.
    """
    share, eccentricity = limits.single_pitch / np.abs(_steps(noise)).max(), 0.0
    for _ in range(_ROUNDS):
        single = np.abs(_steps(share * noise + eccentricity * wave)).max()
        share *= limits.single_pitch / max(single, 1e-12)
        total = np.ptp(share * noise + eccentricity * wave)
        eccentricity += (limits.cumulative_pitch - total) / np.ptp(wave)
        eccentricity = min(max(eccentricity, 0.0), 0.5 * limits.run_out)
    pitch = share * noise + eccentricity * wave
    worst = max(
        np.abs(_steps(pitch)).max() / max(limits.single_pitch, 1e-12) if limits.single_pitch else 0.0,
        np.ptp(pitch) / max(limits.cumulative_pitch, 1e-12),
    )
    return np.asarray(share * noise / max(worst, 1.0)), float(eccentricity / max(worst, 1.0))


def _steps(place: FloatArray) -> FloatArray:
    """Return the single pitch deviations (n_tooth,), the steps from each flank to the next around the gear."""
    return np.asarray(np.roll(place, -1) - place)


def eccentric_pitch(geometry: GearGeometry, eccentricity: float, angle: float, *, drives: bool = True) -> FloatArray:
    """Return the place of each drive flank (n_tooth,) (m) on the reference circle by eccentricity alone.

    eccentricity, angle, drives : as in `GearDeviations` and `drawn_deviations`.
    """
    alpha = geometry.transverse_pressure_angle * (1.0 if drives else -1.0)
    turn = np.arange(geometry.teeth) * (2.0 * np.pi / geometry.teeth)
    wave = np.sin(turn + angle + alpha) / np.cos(alpha)
    return np.asarray(eccentricity * (wave if drives else -wave))
