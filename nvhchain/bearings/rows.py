"""Rows of balls and rollers: force and tangent stiffness of the inner ring against the outer one.

The displacement u = (x, y, z, θx, θy) is that of the inner ring at the centre of its bearing, z along the shaft. The
force is the gradient of the elastic energy of all elements, and the stiffness is its second derivative, exactly.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nvhchain.bearings.hertz import LINE_EXPONENT, LINE_STIFFNESS
from nvhchain.handoff import FloatArray

LAMINAE = 41
"""Laminae of a roller; ISO/TS 16281 asks for 30 at least."""


def azimuths(count: int) -> FloatArray:
    """Return the azimuths (count,) of evenly spaced elements (rad), the first on the x axis."""
    return 2.0 * np.pi * np.arange(count) / count


def motion_at(z: float) -> FloatArray:
    """Return the matrix (5, 5) from the displacement of the bearing's centre to that of a plane at `z` (m) from it."""
    matrix = np.eye(5)
    matrix[0, 4], matrix[1, 3] = z, -z
    return matrix


@dataclass(frozen=True, eq=False)
class BallRow:
    """Row of balls.

    count: number of balls.
    stiffness: K (N/m^(3/2)) of a ball between its raceways.
    pitch_radius: radius of the circle of ball centres (m).
    distance: distance A = r_i + r_o − D_w of the groove centres of an unloaded ball that touches both raceways (m).
    axial, radial: offset of the groove centres of the inner ring from those of the outer one at u = 0 (m).
    z: plane of the ball centres from the centre of the bearing (m).

    The groove centres at azimuth ψ lie a = axial + z + R (θx sin ψ − θy cos ψ) apart along the shaft and b = radial +
    x cos ψ + y sin ψ across it. The ball is compressed by √(a² + b²) − A along the line between them. The lever R is
    the pitch radius: with it, both the first order of the tilt and the shortening of a tilted ring are right
    (docs/reference/bearings.md).
    """

    count: int
    stiffness: float
    pitch_radius: float
    distance: float
    axial: float
    radial: float
    z: float = 0.0

    @cached_property
    def _maps(self) -> tuple[FloatArray, FloatArray]:
        """Motion (count, 5) along and across the shaft of the inner groove centres by the displacement."""
        psi = azimuths(self.count)
        axial_motion, radial_motion = np.zeros((self.count, 5)), np.zeros((self.count, 5))
        axial_motion[:, 2], radial_motion[:, 0], radial_motion[:, 1] = 1.0, np.cos(psi), np.sin(psi)
        axial_motion[:, 3], axial_motion[:, 4] = self.pitch_radius * np.sin(psi), -self.pitch_radius * np.cos(psi)
        shift = motion_at(self.z)
        return axial_motion @ shift, radial_motion @ shift

    def elements(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return load (count,) (N) and contact angle (count,) (rad) of the balls at the displacement `u` (5,)."""
        axial_motion, radial_motion = self._maps
        a, b = self.axial + axial_motion @ u, self.radial + radial_motion @ u
        stretch = np.maximum(np.hypot(a, b) - self.distance, 0.0)
        return self.stiffness * stretch**1.5, np.arctan2(a, b)

    def evaluate(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return force (5,) and stiffness (5, 5) at the displacement `u` (5,)."""
        axial_motion, radial_motion = self._maps
        a, b = self.axial + axial_motion @ u, self.radial + radial_motion @ u
        length = np.hypot(a, b)
        stretch = np.maximum(length - self.distance, 0.0)
        slope = 1.5 * self.stiffness * np.sqrt(stretch)
        load = slope * stretch / 1.5
        normal = (a[:, None] * axial_motion + b[:, None] * radial_motion) / length[:, None]
        side = (b[:, None] * axial_motion - a[:, None] * radial_motion) / length[:, None]
        return load @ normal, (normal.T * slope) @ normal + (side.T * (load / length)) @ side


@dataclass(frozen=True, eq=False)
class RollerRow:
    """Row of rollers, divided into laminae.

    count: number of rollers.
    length: effective length L_we (m).
    pitch_radius: radius of the circle of roller centres (m).
    angle: contact angle (rad), positive for a row that carries loads of the inner ring along +z.
    gap: gap of the unloaded roller along its normal at u = 0 (m); negative for preload.
    profile (n_lamina,): relief of roller and raceways together at every lamina (m), ≥ 0.
    z: plane of the roller centres from the centre of the bearing (m).
    aligning: True where the rollers follow the tilt of the inner ring without load (spherical roller bearing).

    A lamina is compressed by the motion of the inner raceway along the normal (cos α, sin α), minus gap and relief. It
    carries q = c L_we^(8/9)/n δ^(10/9) (ISO/TS 16281, 4.3). The roller tilts by half the tilt of the rings.
    """

    count: int
    length: float
    pitch_radius: float
    angle: float
    gap: float
    profile: FloatArray
    z: float = 0.0
    aligning: bool = False

    @cached_property
    def _normals(self) -> FloatArray:
        """Approach (count · n_lamina, 5) of every lamina by the displacement."""
        psi, n = azimuths(self.count)[:, None], len(self.profile)
        place = self.length * ((np.arange(n) + 0.5) / n - 0.5)[None, :]
        cosine, sine = np.cos(self.angle), np.sin(self.angle)
        # arm of the normal about the tilt axis; places along the roller's axis (−sin α, cos α)
        arm = (self.pitch_radius - place * sine) * sine - (self.z + place * cosine) * cosine
        rows = np.zeros((self.count, n, 5))
        rows[..., 0], rows[..., 1], rows[..., 2] = cosine * np.cos(psi), cosine * np.sin(psi), sine
        if not self.aligning:
            rows[..., 3], rows[..., 4] = arm * np.sin(psi), -arm * np.cos(psi)
        return rows.reshape(-1, 5)

    @property
    def lamina_stiffness(self) -> float:
        """Constant c_s (N/m^(10/9)) of a lamina."""
        return float(LINE_STIFFNESS * self.length ** (8.0 / 9.0) / len(self.profile))

    def _compression(self, u: FloatArray) -> FloatArray:
        relief = np.tile(self.profile, self.count)
        return np.asarray(np.maximum(self._normals @ u - self.gap - relief, 0.0))

    def elements(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return load (count,) (N) and contact angle (count,) (rad) of the rollers at the displacement `u` (5,)."""
        load = self.lamina_stiffness * self._compression(u) ** LINE_EXPONENT
        return load.reshape(self.count, -1).sum(axis=1), np.full(self.count, self.angle)

    def evaluate(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return force (5,) and stiffness (5, 5) at the displacement `u` (5,)."""
        pressed = self._compression(u)
        carried = np.flatnonzero(pressed)
        normal, root = self._normals[carried], pressed[carried] ** (LINE_EXPONENT - 1.0)
        load = self.lamina_stiffness * root * pressed[carried]
        return load @ normal, (normal.T * (LINE_EXPONENT * self.lamina_stiffness * root)) @ normal


def logarithmic_profile(diameter: float, length: float) -> FloatArray:
    """Return the relief (m) of a roller against both raceways, 2 P(x) of ISO/TS 16281.

    diameter, length: diameter D_we and effective length L_we of the roller (m).
    Returns (n_lamina,): relief (m).

    P = 0.00035 D_we ln(1/(1 − (2x/L_we)²)). For rollers longer than 2.5 D_we, it is 0.0005 D_we
    ln(1/(1 − ((2|x| − (L_we − 2.5 D_we))/(2.5 D_we))²)) beyond a straight middle.
    """
    x = np.abs(2.0 * ((np.arange(LAMINAE) + 0.5) / LAMINAE - 0.5)) * length  # 2|x|
    end, factor = (length, 0.00035) if length <= 2.5 * diameter else (2.5 * diameter, 0.0005)
    end_position = np.maximum(x - (length - end), 0.0) / end
    return np.asarray(2.0 * factor * diameter * -np.log1p(-(end_position**2)))


def crowned_profile(radius_difference: float, length: float) -> FloatArray:
    """Return the relief (m) of a roller of circular profile against both raceways.

    radius_difference: difference of the curvatures 1/R_roller − 1/R_raceway (1/m), alike at both raceways.
    length: effective length (m).
    Returns (n_lamina,): relief (m), x² (1/R_roller − 1/R_raceway).
    """
    x = length * ((np.arange(LAMINAE) + 0.5) / LAMINAE - 0.5)
    return np.asarray(x**2 * radius_difference)
