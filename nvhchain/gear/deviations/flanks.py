"""Deviations of every flank of a gear from its drawing: material added, along the flank's normal.

Teeth count in the order in which they come into mesh.  Amounts are > 0 where material is added, so that the flank meets
its mate earlier.  `docs/decisions/0018` has the equations.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from nvhchain.errors import require, require_within
from nvhchain.gear.drawing.geometry import GearGeometry
from nvhchain.handoff import FloatArray, IntArray

LARGEST = 0.5e-3
"""Largest deviation (m); a larger one has a wrong unit."""


@dataclass(frozen=True, eq=False)
class ToothFlanks:
    """Deviations of one flank of every tooth.

    pitch (n_tooth,): place of the flank (m), an arc in the transverse plane on the reference circle.
    profile_slope (n_tooth,): f_Hα (m), in the transverse plane tangent to the base circle: half is added at the tip and
        half taken at the other end.
    profile_form (n_tooth,): f_fα (m), the range of a wave along the profile.
    helix_slope (n_tooth,): f_Hβ (m): half is added towards +z and half taken at the other end.
    helix_form (n_tooth,): f_fβ (m), the range of a wave along the face.
    profile_wave, helix_wave: number of waves over the usable profile, or the face width, and their phase at its start
        (rad).
    topography (n_tooth or 1, n_profile, n_face): measured deviations along the normal (m). Steps are even in rolled
        length from form to tip circle, and in z over the face width. One tooth stands for all.
    """

    pitch: FloatArray
    profile_slope: FloatArray
    profile_form: FloatArray
    helix_slope: FloatArray
    helix_form: FloatArray
    profile_wave: tuple[float, float] = (2.0, 0.0)
    helix_wave: tuple[float, float] = (1.0, 0.0)
    topography: FloatArray | None = None

    def __post_init__(self) -> None:
        count = len(self.pitch)
        for name in ("pitch", "profile_slope", "profile_form", "helix_slope", "helix_form"):
            value = np.asarray(getattr(self, name), float)
            object.__setattr__(self, name, value)
            require(
                value.shape == (count,) and bool((np.abs(value) <= LARGEST).all()),
                f"{name} must hold one number for each of {count} teeth, within ±{LARGEST:g} m: give it in m",
            )
        if self.topography is not None:
            shape = self.topography.shape
            require(
                len(shape) == 3 and shape[0] in (1, count) and min(shape[1:]) >= 2,
                f"topography of shape {shape} must be (teeth, profile, face): 1 or {count} teeth and at least 2 × 2 "
                "points",
            )
            require(
                bool((np.abs(self.topography) <= LARGEST).all()),
                f"topography holds numbers beyond ±{LARGEST:g} m: give it in m",
            )

    def shared(self) -> ToothFlanks:
        """Return flanks that all have the mean of the deviations."""

        def mean(values: FloatArray) -> FloatArray:
            return np.full(len(values), values.mean())

        return replace(
            self,
            pitch=mean(self.pitch),
            profile_slope=mean(self.profile_slope),
            profile_form=mean(self.profile_form),
            helix_slope=mean(self.helix_slope),
            helix_form=mean(self.helix_form),
            topography=None if self.topography is None else self.topography.mean(axis=0, keepdims=True),
        )

    @property
    def bent(self) -> bool:
        """True where the gap varies over a flank: deviations beyond those of the pitch."""
        slopes = (self.profile_slope, self.profile_form, self.helix_slope, self.helix_form, self.topography)
        return any(values is not None and bool(np.any(values)) for values in slopes)

    def added(self, geometry: GearGeometry, tooth: IntArray, radius: FloatArray, axial: FloatArray) -> FloatArray:
        """Return the material added (m) along the normal at contact points.

        tooth (…, n) int array: tooth, in the order of mesh.
        radius, axial (n,): radius and z of the points (m).
        Returns (…, n): material (m).
        """
        low, high = geometry.usable_flank
        rolled = np.sqrt(np.maximum(radius**2 - geometry.base_radius**2, 0.0))
        profile = np.clip((rolled - low) / (high - low), 0.0, 1.0)
        face = np.clip(axial / geometry.face_width + 0.5, 0.0, 1.0)

        def wave(form: FloatArray, shape: tuple[float, float], share: FloatArray) -> FloatArray:
            return np.asarray(0.5 * form[tooth] * np.cos(2.0 * np.pi * shape[0] * share + shape[1]))

        transverse = (
            self.pitch[tooth] * np.cos(geometry.transverse_pressure_angle)
            + self.profile_slope[tooth] * (profile - 0.5)
            + self.helix_slope[tooth] * (face - 0.5)
            + wave(self.profile_form, self.profile_wave, profile)
            + wave(self.helix_form, self.helix_wave, face)
        )
        total = transverse * np.cos(geometry.base_helix_angle)
        if self.topography is not None:
            total = total + _bilinear(self.topography, tooth, profile, face)
        return np.asarray(total)


def _bilinear(grid: FloatArray, tooth: IntArray, profile: FloatArray, face: FloatArray) -> FloatArray:
    """Return the values of a grid (n_tooth or 1, n_profile, n_face) between its points, at shares 0…1."""
    tooth = np.zeros_like(tooth) if len(grid) == 1 else tooth
    x, y = profile * (grid.shape[1] - 1), face * (grid.shape[2] - 1)
    i, j = np.minimum(x.astype(int), grid.shape[1] - 2), np.minimum(y.astype(int), grid.shape[2] - 2)
    u, v = x - i, y - j
    return np.asarray(
        (1 - u) * (1 - v) * grid[tooth, i, j]
        + u * (1 - v) * grid[tooth, i + 1, j]
        + (1 - u) * v * grid[tooth, i, j + 1]
        + u * v * grid[tooth, i + 1, j + 1]
    )


@dataclass(frozen=True)
class Ghost:
    """Undulation of all flanks by the generating machine, along the direction of its motion.

    order: waves per turn of the gear, such as the teeth of the machine's index worm wheel.
    amplitude: amplitude along the normal (m).
    phase: phase (rad): amplitude × cos(order × angle of the gear + phase) on the drive flanks, the opposite on the
        others.
    """

    order: float
    amplitude: float
    phase: float = 0.0


@dataclass(frozen=True, eq=False)
class GearDeviations:
    """Deviations of a gear from its drawing.

    drive, coast: flanks that transmit while the pinion drives, and the others.
    eccentricity: distance of the teeth's axis from that of rotation (m), half the run-out F_r.
    eccentricity_angle: angle of the eccentricity from the direction of the mating axis while tooth 0 is in mesh, in
        running direction (rad).
    ghosts: undulations.
    first_tooth: tooth at the pitch point at time 0: the phase of assembly.
    """

    drive: ToothFlanks
    coast: ToothFlanks
    eccentricity: float = 0.0
    eccentricity_angle: float = 0.0
    ghosts: tuple[Ghost, ...] = field(default_factory=tuple)
    first_tooth: int = 0

    def __post_init__(self) -> None:
        require_within("eccentricity", self.eccentricity, 0, LARGEST, "m")
        require(
            len(self.drive.pitch) == len(self.coast.pitch),
            f"{len(self.drive.pitch)} drive and {len(self.coast.pitch)} coast flanks: give one of each per tooth",
        )

    def shared(self) -> GearDeviations:
        """Return what all teeth share: no run-out, no ghosts."""
        return replace(self, drive=self.drive.shared(), coast=self.coast.shared(), eccentricity=0.0, ghosts=())

    @property
    def teeth(self) -> int:
        """Number of teeth."""
        return len(self.drive.pitch)

    def turned(
        self, angle: FloatArray, *, drives: bool, drive: bool, pressure_angle: float, helix: float
    ) -> FloatArray:
        """Return the material (m) along the normal that run-out and ghosts add, the same at all points in contact.

        angle: angle of the gear since tooth 0 was in mesh (rad).
        drives: True for the pinion, which drives.
        drive: True for the drive flanks.
        pressure_angle: transverse working pressure angle α_wt (rad).
        helix: base helix angle β_b (rad).
        """
        ahead = 1.0 if drives == drive else -1.0
        way = angle + self.eccentricity_angle
        total = ahead * self.eccentricity * np.sin(way + ahead * pressure_angle) * np.cos(helix)
        for ghost in self.ghosts:
            sign = 1.0 if drive else -1.0
            total = total + sign * ghost.amplitude * np.cos(ghost.order * angle + ghost.phase)
        return np.asarray(total)
