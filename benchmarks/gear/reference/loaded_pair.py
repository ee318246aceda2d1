"""Loaded pair with refined flanks: compliance of all cells that can touch, and the pressure on them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.gear.reference.contact_cells import CoarseGear, TouchingTeeth
from benchmarks.gear.reference.pressure import pressed
from benchmarks.gear.reference.resolution import ReferenceResolution
from nvhchain.conventions import Progress
from nvhchain.errors import SolverError
from nvhchain.gear.compliance.body_flexibility import body_flexibility
from nvhchain.gear.compliance.flank_compliance import load_patterns
from nvhchain.gear.drawing.pair import GearPair
from nvhchain.handoff import FloatArray


@dataclass(frozen=True, eq=False)
class Carried:
    """Response of one blank to the forces of its refined teeth.

    Parameters
    ----------
    sector : int
        Teeth after which the body repeats.
    answer : (sector, reach + 1, r, r) array
        Response of a tooth to patterns of force on another (m/N).
    share : tuple of tuples of (r, n) array
        Share of the patterns in the forces passed on by each cell's unit force, as share[place][pair].
    """

    sector: int
    answer: FloatArray
    share: tuple[tuple[FloatArray, ...], ...]

    def response(self, tooth: int, loaded: int) -> FloatArray:
        """Return the response (r, r) in m/N of `tooth` to patterns on `loaded` (any integers)."""
        if loaded >= tooth:
            return self.answer[tooth % self.sector, loaded - tooth]
        return self.answer[loaded % self.sector, tooth - loaded].T


def carried(
    coarse: CoarseGear,
    gear: int,
    places: Sequence[TouchingTeeth],
    resolution: ReferenceResolution,
    progress: Progress | None = None,
) -> Carried:
    """Load the blank of one gear with the forces that the refined teeth of all places pass on.

    Parameters
    ----------
    coarse : CoarseGear
        Gear.
    gear : int
        0 pinion, 1 wheel.
    places : sequence of TouchingTeeth
        Refined teeth at several wheel angles.
    resolution : ReferenceResolution
        Tolerances of the patterns.
    progress : Progress, optional
        Called with (teeth done, teeth of the sector).

    Returns
    -------
    Carried
        Response of the blank.
    """
    passed = [tooth.passed for place in places for tooth in place.teeth[gear]]
    tooth = replace(coarse.tooth, passed=np.hstack(passed), passed_friction=None)
    patterns, share, strength = load_patterns(tooth, resolution.pattern_tolerance)
    reach = max(place.pairs[-1] - place.pairs[0] for place in places)
    answer = body_flexibility(
        coarse.mesh,
        coarse.tooth,
        coarse.body.material,
        (patterns, strength),
        far_tolerance=resolution.far_tolerance,
        sector=coarse.body.sector,
        reach=reach,
        progress=progress,
    )
    parts = iter(np.split(share, np.cumsum([p.shape[1] for p in passed])[:-1], axis=1))
    return Carried(coarse.body.sector, answer, tuple(tuple(next(parts) for _ in place.pairs) for place in places))


def pair_compliance(touching: TouchingTeeth, place: int, gears: tuple[Carried, Carried], shift: int = 0) -> FloatArray:
    """Return the compliance C of all cells of `touching`.

    Parameters
    ----------
    touching : TouchingTeeth
        Refined teeth.
    place : int
        Number of `touching` among the places of `gears`.
    gears : tuple of 2 Carried
        Responses of pinion and wheel.
    shift : int
        Mesh periods by which both gears have moved on; the wheel angle grows by as many mesh periods.

    Returns
    -------
    (n, n) array
        Compliance (m/N).
    """
    n = len(touching.pair)
    total = np.zeros((n, n))
    at = [np.flatnonzero(touching.pair == i) for i in range(len(touching.pairs))]
    for gear, carrier in enumerate(gears):
        sense = -1 if gear == 0 else 1
        share = carrier.share[place]
        for i, first in enumerate(touching.pairs):
            total[np.ix_(at[i], at[i])] += touching.teeth[gear][i].own
            for j, second in enumerate(touching.pairs):
                answer = carrier.response(sense * (first + shift), sense * (second + shift))
                total[np.ix_(at[i], at[j])] += share[i].T @ answer @ share[j]
    return 0.5 * (total + total.T)


@dataclass(frozen=True, eq=False)
class ReferenceMesh:
    """Equilibrium under one normal force.

    Parameters
    ----------
    deflection : float
        δ (m).
    force : (n,) array
        Force per cell (N).
    pressure : (n,) array
        Pressure (Pa).
    share : dict of int to float
        Share of the force on each tooth pair.
    residual : float
        Residual of the contact conditions (m).
    """

    deflection: float
    force: FloatArray
    pressure: FloatArray
    share: dict[int, float]
    residual: float


def reference_mesh(
    pair: GearPair, touching: TouchingTeeth, compliance: FloatArray, force: float, guess: FloatArray | None = None
) -> ReferenceMesh:
    """Press the pair together with a force along the normal.

    Parameters
    ----------
    pair : GearPair
        Gear pair.
    touching : TouchingTeeth
        Cells and gaps.
    compliance : (n, n) array
        Compliance of the cells (m/N).
    force : float
        Force (N), `GearPair.normal_force` of the pinion's torque.
    guess : (n,) array, optional
        Cell forces of a nearby case (N).

    Returns
    -------
    ReferenceMesh
        Equilibrium.

    Raises
    ------
    SolverError
        If the pressure reaches the last cells of the search range.
    """
    cells = touching.cells
    field = pressed(compliance, cells.gap, force, guess=guess)
    if (field.force[cells.edge] > 0).any():
        raise SolverError("contact pressure reaches the last cells looked at: raise `reach` or `largest_gap`")
    share = {k: float(field.force[touching.pair == i].sum() / force) for i, k in enumerate(touching.pairs)}
    area = cells.width * cells.length / np.cos(pair.base_helix_angle)
    return ReferenceMesh(field.approach, field.force, field.force / area, share, field.residual)
