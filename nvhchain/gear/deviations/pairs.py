"""Deviations of both gears of a pair, as a gap between their flanks."""

from __future__ import annotations

from dataclasses import dataclass
from math import lcm

import numpy as np

from nvhchain.errors import require
from nvhchain.gear.deviations.flanks import GearDeviations
from nvhchain.gear.drawing.pair import DRIVE, GearPair, Misalignment
from nvhchain.handoff import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class PairDeviations:
    """Deviations of pinion and wheel.

    pinion, wheel: deviations; None for a gear as drawn.
    misalignment: angles between the axes beyond those of the pair as drawn.
    """

    pinion: GearDeviations | None
    wheel: GearDeviations | None
    misalignment: Misalignment = Misalignment()  # noqa: RUF009 (frozen)

    def check(self, pair: GearPair) -> None:
        """Raise InputError if the deviations belong to gears with other numbers of teeth."""
        for name, gear, geometry in zip(("pinion", "wheel"), (self.pinion, self.wheel), pair.geometries, strict=True):
            require(
                gear is None or gear.teeth == geometry.teeth,
                f"deviations of the {name} are those of {gear.teeth if gear else 0} teeth, the gear has "
                f"{geometry.teeth}: give one value per tooth",
            )

    def shared(self) -> PairDeviations | None:
        """Return the part that all teeth share; None where it leaves the load where it is."""
        pinion, wheel = (None if gear is None else gear.shared() for gear in (self.pinion, self.wheel))
        bent = any(gear is not None and gear.drive.bent for gear in (pinion, wheel))
        if self.misalignment == Misalignment() and not bent:
            return None
        return PairDeviations(pinion, wheel, self.misalignment)

    def meshes(self, pair: GearPair) -> int:
        """Return the number of mesh periods after which the same flanks meet in the same state.

        Returns least common multiple of the body period and the teeth of gears with deviations.
        """
        deviating = [g.teeth for g, d in zip(pair.geometries, (self.pinion, self.wheel), strict=True) if d is not None]
        return lcm(pair.meshes_per_body_period, *deviating)

    def removed(
        self,
        pair: GearPair,
        flank: int,
        order: IntArray,
        radius: FloatArray,
        axial: FloatArray,
        travel: FloatArray,
        later: IntArray | int = 0,
    ) -> FloatArray:
        """Return the gap (m) along the normal that deviations open between the flanks; < 0 where they close it.

        order (2, n) int array: teeth of pinion and wheel in the order in which they mesh.
        radius (2, n): radius of the contact points (m).
        axial (n,): z of the contact points (m).
        travel (n,) or float: wheel angle (rad).
        later (n_later,) int array or int: mesh periods that have passed since.
        Returns (n_later, n) or (n,) array: gap (m).
        """
        shift = np.asarray(later)[..., None]
        total = np.zeros(np.broadcast_shapes((*shift.shape[:-1], 1), (len(axial),)))
        drive = flank == DRIVE
        if self.misalignment != Misalignment():
            rolled = np.sqrt(np.maximum(radius**2 - pair.base_radius[:, None] ** 2, 0.0))
            total = total + self.misalignment.separation(
                rolled[0] - pair.pitch_point,
                axial,
                drive=drive,
                sense=pair.sense,
                pressure_angle=pair.working_pressure_angle,
                tilt=pair.base_helix_angle,
            )
        for number, gear in enumerate((self.pinion, self.wheel)):
            if gear is None:
                continue
            geometry = pair.geometries[number]
            tooth = (order[number] + gear.first_tooth + shift) % geometry.teeth
            flanks = gear.drive if drive else gear.coast
            turn = (travel + shift * pair.mesh_period) * (pair.wheel.geometry.teeth / geometry.teeth)
            total = total - flanks.added(geometry, tooth, radius[number], pair.face_positions(axial)[number])
            total = total - gear.turned(
                turn + gear.first_tooth * 2.0 * np.pi / geometry.teeth,
                drives=number == 0,
                drive=drive,
                pressure_angle=pair.working_pressure_angle,
                helix=pair.base_helix_angle,
            )
        return np.asarray(total)
