"""Load distribution of a loaded mesh: along the line of action, along the face, for friction, and tilt stiffness."""

from __future__ import annotations

from concurrent.futures import Executor
from functools import partial
from math import cos, inf, sin

import numpy as np

from nvhchain.conventions import Progress
from nvhchain.errors import require
from nvhchain.fidelity import GearFidelity
from nvhchain.gear.compliance.analytic import SliceCompliance
from nvhchain.gear.compliance.flank_compliance import FlankCompliance
from nvhchain.gear.contact.engagement import Engagement, close_edges
from nvhchain.gear.deviations.pairs import PairDeviations
from nvhchain.gear.drawing.pair import GearPair
from nvhchain.gear.laws.mesh_law import pair_compliances
from nvhchain.gear.laws.transmission_error import angle_blocks, body_period_angles, compute_blocks, load_problem
from nvhchain.handoff import FloatArray, LoadDistribution, MeshPeriod
from nvhchain.kinds import checked

Compliances = tuple[FlankCompliance | SliceCompliance, FlankCompliance | SliceCompliance]
"""Compliances of pinion and wheel."""

PROBE = 0.02
"""Displacement of the ends of the face for the difference quotient of the tilt stiffness, relative to the
deflection."""


@checked
def load_distribution(
    pair: GearPair,
    *,
    nominal_force: float,
    fidelity: GearFidelity,
    compliances: Compliances | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
    deviations: PairDeviations | None = None,
) -> LoadDistribution:
    """Compute sliding, arm and centre of the load over a body period, and the stiffness against tilt.

    nominal_force: force along the flank normal (N).
    fidelity: `angles_per_mesh` angles per mesh period, slices and residual.
    compliances: as in `mesh_law`; computed if not supplied.
    progress: called with (blocks done, blocks in all).
    deviations: those that all teeth share (`PairDeviations.shared`).

    Friction would change the load in second order of its coefficient.
    """
    require(0 < nominal_force < inf, f"nominal_force = {nominal_force:g} N must be positive and finite")
    angle = body_period_angles(pair, fidelity)
    engagement = Engagement(pair, compliances or pair_compliances(pair, fidelity), fidelity, deviations)
    work = partial(
        compute_blocks,
        _carried,
        blocks=angle_blocks(angle),
        fixed=(nominal_force,),
        executor=executor,
        progress=progress,
    )
    rows = work(engagement)
    closing = engagement if deviations is not None else close_edges(engagement, rows[:, -1].max())
    sliding, arm, offset, tilt, slices, _ = (rows if closing is engagement else work(closing)).T
    return LoadDistribution(
        angle=angle,
        period=pair.body_period,
        sliding=sliding,
        arm=arm,
        offset=offset,
        force=nominal_force,
        tilt_ratio=float(tilt.mean() / slices.mean()),
    )


def mesh_period(
    pair: GearPair, *, nominal_force: float, fidelity: GearFidelity, compliances: Compliances | None = None
) -> MeshPeriod:
    """Compute deflection, stiffness and load distribution of a pair over its first mesh period.

    nominal_force: force along the flank normal (N).
    fidelity: `angles_per_mesh` angles, slices and residual; `bodies = "analytic"` takes tenths of a second.
    compliances: as in `mesh_law`; computed if not supplied.
    Returns mesh without the variation between the teeth of a body with openings.
    """
    angle = np.asarray(np.arange(fidelity.angles_per_mesh) * (pair.mesh_period / fidelity.angles_per_mesh))
    engagement = Engagement(pair, compliances or pair_compliances(pair, fidelity), fidelity)
    rows = _carried(engagement, angle, nominal_force)
    closing = close_edges(engagement, rows[:, -1].max())
    if closing is not engagement:
        rows = _carried(closing, angle, nominal_force)
    sliding, arm, offset, tilt, slices, deflection = rows.T
    made = LoadDistribution(
        angle=angle,
        period=pair.mesh_period,
        sliding=sliding,
        arm=arm,
        offset=offset,
        force=nominal_force,
        tilt_ratio=float(tilt.mean() / slices.mean()),
    )
    width = pair.face_width * cos(pair.base_helix_angle)
    return MeshPeriod(made, deflection, 12.0 * float(slices.mean()) / width**2)


def _carried(engagement: Engagement, angles: FloatArray, force: float) -> FloatArray:
    """Return one row per angle (n_angle, 6); the work of an executor.

    The columns are sliding (1), arm (m) and offset (m) of the load, tilt stiffness (N m/rad), and deflection (m).  Tilt
    stiffness takes two columns: by the contact problem, and by independent slices.
    """
    pair = engagement.pair
    guess, found = 1e-9 * force, []
    for angle in angles:
        problem = engagement.problem(float(angle))
        loaded = load_problem(problem, float(angle), force, guess)
        guess, lines = loaded.deflection, loaded.lines
        share = loaded.force / loaded.force.sum()
        sense, distance = mean_sliding(pair, lines.position, lines.length)
        lever = cos(pair.base_helix_angle) * lines.axial + pair.sense * sin(pair.base_helix_angle) * (
            lines.position - pair.pitch_point
        )
        width = pair.face_width * cos(pair.base_helix_angle)
        tilt = 2.0 * PROBE * guess / width
        less, more = problem.forces(guess - problem.gap + np.array([[-tilt], [tilt]]) * lever)
        found.append(
            [
                share @ sense,
                share @ distance,
                share @ lines.axial,
                (more - less) @ lever / (2.0 * tilt),
                loaded.tangent_stiffness * width**2 / 12.0,
                loaded.deflection,
            ]
        )
    return np.array(found)


def mean_sliding(pair: GearPair, position: FloatArray, length: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the means of the sense of sliding σ and of σ s (m) over every slice, in the shape of the arguments.

    position: distance s of the slices' middles from the pinion's base tangent point (m).
    length: length of the slices (m).

    A slice crossed by the pitch point counts on both sides.
    """
    offset = position - pair.pitch_point
    half = np.maximum(0.5 * length * abs(sin(pair.base_helix_angle)), 1e-12)
    crossing = np.abs(offset) < half
    sense = np.where(crossing, offset / half, np.sign(offset))
    mean_distance = np.where(crossing, (offset**2 + half**2) / (2.0 * half), np.abs(offset))  # mean of |s − s_C|
    return sense, pair.pitch_point * sense + mean_distance
