"""The loaded mesh at one position: contact lines, the compliance of both gears between them, slice forces."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations_with_replacement, pairwise
from math import ceil

import numpy as np
from scipy.interpolate import CubicSpline

from nvhchain.errors import SolverError, require
from nvhchain.fidelity import GearFidelity
from nvhchain.gear.compliance import FlankCompliance
from nvhchain.gear.contact import contact_half_width, local_law, slice_forces
from nvhchain.gear.pair import BACK, DRIVE, ContactLines, GearPair, contact_lines
from nvhchain.handoff import FloatArray


def engaged_reach(pair: GearPair) -> int:
    """Largest distance in teeth between two pairs in contact at once."""
    return ceil(pair.total_contact_ratio) - 1


@dataclass(frozen=True, eq=False)
class Engagement:
    """A gear pair with the flank compliances of both gears, ready for contact at any angle.

    fidelity: its `slices` and `contact_residual` are used.
    """

    pair: GearPair
    compliances: tuple[FlankCompliance, FlankCompliance]
    fidelity: GearFidelity

    def __post_init__(self) -> None:
        slices = self.fidelity.slices
        require(slices >= 1, f"slices = {slices}: at least 1 is needed")
        for name, body, c in zip(
            ("pinion", "wheel"), (self.pair.pinion, self.pair.wheel), self.compliances, strict=True
        ):
            require(
                c.tooth_count == body.geometry.teeth and c.sector == body.sector,
                f"compliance of the {name} is for {c.tooth_count} teeth in sectors of {c.sector}, the gear has "
                f"{body.geometry.teeth} in sectors of {body.sector}: compute it for this gear",
            )
            reach = engaged_reach(self.pair)
            require(
                c.reach >= reach,
                f"compliance of the {name} reaches over {c.reach} teeth, {reach} are in contact beside each other: "
                "compute it with a larger reach",
            )
            half = self.pair.face_width / 2 * (1 - 1e-9)
            require(
                c.axial[0] <= -half and c.axial[-1] >= half,
                f"compliance of the {name} covers z = {1e3 * c.axial[0]:.3g}…{1e3 * c.axial[-1]:.3g} mm, the common "
                f"face width needs ±{1e3 * half:.3g} mm",
            )

    @cached_property
    def _splines(self) -> tuple[tuple[CubicSpline, CubicSpline], ...]:
        """Cardinal splines over radius and axial position of either gear."""
        return tuple(
            tuple(CubicSpline(grid, np.eye(len(grid))) for grid in (c.radius, c.axial)) for c in self.compliances
        )

    @cached_property
    def _same_side(self) -> tuple[FloatArray, ...]:
        """Compliances of either gear between flanks of the same side, (2, sector, reach + 1, n_grid, n_grid)."""
        grids = []
        for c in self.compliances:
            n = len(c.radius) * len(c.axial)
            sides = [c.blocks[:, :, side, :, :, side].reshape(c.sector, c.reach + 1, n, n) for side in (0, 1)]
            grids.append(np.stack(sides))
        return tuple(grids)

    def compliance(self, lines: ContactLines) -> FloatArray:
        """C (n, n), m/N: normal approach at every slice under a unit normal force at every other, both gears.

        Interpolated by cubic splines on the compliance grid; the transposed weights spread a slice force over the
        grid, so C stays symmetric and not negative.
        """
        n = len(lines.length)
        total = np.zeros((n, n))
        for teeth, radius, c, splines, blocks in zip(
            lines.tooth, lines.radius, self.compliances, self._splines, self._same_side, strict=True
        ):
            over_profile = splines[0](np.clip(radius, c.radius[0], c.radius[-1]))
            weights = (over_profile[:, :, None] * splines[1](lines.axial)[:, None, :]).reshape(n, -1)
            changes = np.flatnonzero(np.diff(teeth)) + 1
            bounds = [0, *changes.tolist(), n] if n else []
            runs = [slice(a, b) for a, b in pairwise(bounds)]  # the slices of one tooth lie together
            for one, other in combinations_with_replacement(runs, 2):
                first, second = (one, other) if teeth[one.start] <= teeth[other.start] else (other, one)
                tooth = int(teeth[first.start])
                block = blocks[lines.side, tooth % c.sector, int(teeth[second.start]) - tooth]
                part = weights[first] @ (block @ weights[second].T)
                total[first, second] += part
                if first != second:
                    total[second, first] += part.T
        return 0.5 * (total + total.T)

    def forces(
        self, angle: float, approach: FloatArray, *, flank: int = DRIVE, separation: FloatArray | None = None
    ) -> tuple[ContactLines, FloatArray]:
        """Contact lines and slice forces (n_case, n), N, at wheel `angle`, rad.

        approach: (n_case,) m, how far the flanks are pushed together along their normal.
        separation: (n,) m, unloaded gap of every slice beyond that of the pure involutes; none by default.
        Raises SolverError where the contact does not converge or the local law leaves its range.
        """
        lines = contact_lines(self.pair, angle, slices=self.fidelity.slices, flank=flank)
        materials = (self.pair.pinion.material, self.pair.wheel.material)
        law = local_law(lines.curvature, (lines.depth[0], lines.depth[1]), materials)
        offset = np.zeros(len(lines.length)) if separation is None else separation
        forces = slice_forces(
            self.compliance(lines),
            np.asarray(approach, float)[:, None] - offset,
            lines.length,
            law,
            tolerance=self.fidelity.contact_residual,
        )
        width = contact_half_width(forces / lines.length, lines.curvature, materials)
        if (width[:, None] > lines.depth).any():
            raise SolverError(
                f"contact half width reaches {1e3 * width.max():.3g} mm, beyond the tooth's centre line: the load is "
                "too large for the Weber–Banaschek formula"
            )
        return lines, forces

    def mesh_force(self, angle: float, deflection: FloatArray) -> FloatArray:
        """F(θ, δ), (n_defl,) N: > 0 on the drive flank, 0 in the backlash gap, < 0 on the back flank."""
        deflection = np.asarray(deflection, float)
        force = np.zeros(len(deflection))
        closed = deflection > 0
        if closed.any():
            force[closed] = self.forces(angle, deflection[closed])[1].sum(axis=1)
        closed = deflection < -self.pair.backlash
        if closed.any():
            # deepest last: each solution starts the next
            approach = -(deflection[closed] + self.pair.backlash)[::-1]
            force[closed] = -self.forces(angle, approach, flank=BACK)[1].sum(axis=1)[::-1]
        return force
