"""Loaded static transmission error and mesh stiffness.

TE = r_bG θ_G − r_bP θ_P = −δ/cos β_b.  The functions return δ/cos β_b, positive on the drive flank, as it is plotted.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from math import ceil, inf, isfinite
from typing import Any

import numpy as np

from nvhchain.conventions import Progress
from nvhchain.errors import InputError, SolverError, require
from nvhchain.fidelity import GearFidelity
from nvhchain.gear.contact.contact_lines import ContactLines, lever_arms
from nvhchain.gear.contact.engagement import ContactProblem, Engagement, close_edges
from nvhchain.gear.contact.local_law import contact_half_width
from nvhchain.gear.drawing.pair import GearPair
from nvhchain.handoff import FloatArray, IntArray, MeshLaw
from nvhchain.kinds import checked
from nvhchain.runtime.threads import threads

_ANGLE_BLOCK = 16
"""Least number of angles per job; they take 20 to 40 ms."""

_PIECES = 16
"""Largest number of jobs; each goes to another process with the compliances of its own teeth and those beside them."""

_MOST_STEPS = 50
"""Largest number of Newton steps."""


@checked
def deflection_at_force(law: MeshLaw, force: float) -> FloatArray:
    """Return the deflection at which a mesh law carries a force, at each of its angles.

    force: force (N); negative on the back flank.
    Returns (n_angle,): deflection δ (m).

    Monotone cubic interpolation of δ over F between the tabulated deflections.
    """
    require(force != 0, "force = 0 N has no unique deflection within the backlash: give a force")
    sense, columns = (1.0 if force > 0 else -1.0), law.force.shape[1]
    least, most = (law.force[:, end] for end in (0, -1))
    outside = np.flatnonzero(~((least <= force) & (force <= most)))
    if len(outside):
        i = int(outside[0])
        raise InputError(
            f"force = {force:g} N lies outside the mesh law, which goes from {least[i]:g} to {most[i]:g} N at angle "
            f"{law.angle[i]:g} rad: compute it with a larger nominal force"
        )
    loaded = sense * law.force > 0
    first, last = np.zeros(len(law.angle), np.int64), np.full(len(law.angle), columns - 1)
    if force > 0:  # the loaded columns and the last unloaded one
        first = np.maximum(loaded.argmax(axis=1) - 1, 0)
    else:
        last = np.minimum(columns - loaded[:, ::-1].argmax(axis=1), columns - 1)
    return monotone_cubic(law.force, law.deflection, first, last, force)


def quasi_static_transmission_error(law: MeshLaw, force: float) -> tuple[FloatArray, FloatArray]:
    """Return the transmission error over one body period at a constant normal force.

    Parameters
    ----------
    law : MeshLaw
        Mesh law.
    force : float
        Normal force (N).

    Returns
    -------
    angle : (n_angle,) array
        Wheel angle (rad).
    te : (n_angle,) array
        δ/cos β_b (m).
    """
    return law.angle, deflection_at_force(law, force) / np.cos(law.base_helix_angle)


@dataclass(frozen=True, eq=False)
class LoadedMesh:
    """Equilibrium at one wheel angle under a given normal force.

    lines: slices.
    deflection: δ (m).
    force (n,): force of each slice (N).
    pressure (n,): Hertzian maximum pressure 2q/(πL) (Pa).
    tangent_stiffness: dF/dδ along the normal (N/m), F the sum of normal forces.
    torque: torque into the pinion and out of the wheel (N m), friction included.
    residual: residual of the complementarity problem (m): gap of loaded slices or overlap of others, whichever is
        larger.
    """

    lines: ContactLines
    deflection: float
    force: FloatArray
    pressure: FloatArray
    tangent_stiffness: float
    torque: tuple[float, float]
    residual: float

    def load_share(self) -> dict[int, float]:
        """Return the share of the force on each tooth pair, by wheel tooth."""
        total = self.force.sum()
        teeth = self.lines.tooth[1]
        return {int(t): float(self.force[teeth == t].sum() / total) for t in np.unique(teeth)}


@checked
def loaded_mesh(
    engagement: Engagement,
    angle: float,
    force: float,
    *,
    guess: float,
    friction: float = 0.0,
    friction_bending: bool = True,
) -> LoadedMesh:
    """Find the deflection δ at which the drive flanks carry the pinion torque of a normal force.

    angle: wheel angle (rad).
    force: T_P/(r_bP cos β_b) (N), `GearPair.normal_force`; without friction the sum of the normal forces.
    guess: any positive deflection of the right order (m).
    friction_bending: if True, friction bends the teeth too, and the compliances must include it. If False, friction
    acts in the balance of torque alone, as with contact modes that are normal to the flank.

    Newton's method on the tangent stiffness by differences, to a relative force error of 1e3 × the contact residual.
    """
    require(
        0 < force < inf,
        f"force = {force:g} N must be positive and finite: unloaded flanks touch at `Engagement.first_contact`",
    )
    require(isfinite(angle), f"angle = {angle:g} rad must be finite")
    return load_problem(engagement.problem(angle), angle, force, guess, friction, friction_bending)


def load_problem(
    problem: ContactProblem,
    angle: float,
    force: float,
    guess: float,
    friction: float = 0.0,
    friction_bending: bool = True,
) -> LoadedMesh:
    """Return `loaded_mesh` of the contact problem at an angle."""
    engagement, lines = problem.engagement, problem.lines
    tolerance, start = 1e3 * engagement.fidelity.contact_residual, float(problem.gap.min())
    pressed = max(guess - start, 0.1 * guess)
    require(0 < pressed < inf, f"guess = {guess:g} m must be a positive deflection, such as 1 nm for every newton")
    unit = engagement.pair.base_radius[0] * np.cos(engagement.pair.base_helix_angle)
    bending = friction if friction_bending else 0.0
    for _ in range(_MOST_STEPS):
        probe = start + pressed * np.array([1.0, 1 + 1e-4])
        forces = problem.forces(probe[:, None] - problem.gap, bending)
        arms = lever_arms(engagement.pair, lines, friction)
        total = forces @ (arms[0] / unit)
        tangent = (total[1] - total[0]) / (probe[1] - probe[0])
        if abs(total[0] - force) <= tolerance * force:
            normal, (pinion_torque, wheel_torque) = forces.sum(axis=1), (arms @ forces[0]).tolist()
            stiffness = (normal[1] - normal[0]) / (probe[1] - probe[0])
            materials = (engagement.pair.pinion.material, engagement.pair.wheel.material)
            q = forces[0] / lines.length
            width = contact_half_width(q, lines.curvature, materials)
            pressure = np.divide(2 * q, np.pi * width, out=np.zeros_like(q), where=width > 0)
            return LoadedMesh(
                lines,
                float(probe[0]),
                forces[0],
                pressure,
                stiffness,
                (pinion_torque, wheel_torque),
                problem.residual(float(probe[0]), forces[0], bending),
            )
        pressed = max(pressed + (force - total[0]) / tangent, pressed / 10)
    raise SolverError(f"no deflection found for {force:g} N at wheel angle {angle:g} rad")


@checked
def loaded_transmission_error(
    engagement: Engagement,
    pinion_torque: float,
    *,
    friction: float = 0.0,
    friction_bending: bool = True,
    executor: Executor | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Return the transmission error over one body period at a constant pinion torque.

    pinion_torque: torque (N m).
    friction_bending: if False, friction acts in the balance of torque alone; see `loaded_mesh`.
    Returns angle (n_angle,): wheel angle (rad). te (n_angle,): δ/cos β_b (m).

    The contact is solved at every angle of the fidelity, not interpolated in a law.  It is solved again where edges
    beyond the `corner_gap` close (`close_edges`).
    """
    pair = engagement.pair
    force, angle = pair.normal_force(pinion_torque), body_period_angles(pair, engagement.fidelity)
    given = (force, friction, friction_bending)
    work = partial(compute_blocks, _deflections, blocks=angle_blocks(angle), fixed=given, executor=executor)
    deflection = work(engagement)
    closing = close_edges(engagement, deflection.max())
    if closing is not engagement:
        deflection = work(closing)
    return angle, deflection / np.cos(pair.base_helix_angle)


def body_period_angles(pair: GearPair, fidelity: GearFidelity) -> FloatArray:
    """Return the wheel angles (rad) over one body period, `angles_per_mesh` to a mesh period."""
    angles_per_mesh = fidelity.angles_per_mesh
    return np.arange(float(pair.meshes_per_body_period * angles_per_mesh)) * (pair.mesh_period / angles_per_mesh)


def angle_blocks(angle: FloatArray) -> list[FloatArray]:
    """Split the angles into jobs of threads or of an executor."""
    size = max(_ANGLE_BLOCK, ceil(len(angle) / _PIECES))
    return [angle[i : i + size] for i in range(0, len(angle), size)]


def compute_blocks(
    work: Callable[..., FloatArray],
    engagement: Engagement,
    *,
    blocks: list[FloatArray],
    fixed: tuple[Any, ...],
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> FloatArray:
    """Return `work(engagement, angles, *fixed)` on all `angle_blocks`, stacked along axis 0.

    executor: runs the blocks; by default threads of this process, as the compiled contact holds no lock.
    progress: called with (blocks done, blocks in all).
    """
    arguments = [[argument] * len(blocks) for argument in fixed]
    # a block is sent to another process without the teeth that its angles do not reach
    tasks = [engagement.select_angles(block) if executor else engagement for block in blocks]
    found: list[FloatArray] = []
    with ExitStack() as ended:
        mapped: Callable[..., Iterable[FloatArray]] = map
        if executor:
            mapped = executor.map
        elif threads() > 1:
            engagement.compliance(engagement.lines(float(blocks[0][0])))  # forms what the threads share
            mapped = ended.enter_context(ThreadPoolExecutor(threads())).map
        for rows in mapped(work, tasks, blocks, *arguments):
            found.append(rows)
            if progress:
                progress(len(found), len(blocks))
    return np.concatenate(found)


def _deflections(
    engagement: Engagement, angles: FloatArray, force: float, friction: float, friction_bending: bool
) -> FloatArray:
    """Return the deflection (n_angle,) in m; the work of an executor."""
    guess, found = 1e-9 * force, []
    for angle in angles:
        mesh = loaded_mesh(engagement, angle, force, guess=guess, friction=friction, friction_bending=friction_bending)
        guess = mesh.deflection
        found.append(guess)
    return np.array(found)


def monotone_cubic(x: FloatArray, y: FloatArray, first: IntArray, last: IntArray, place: float) -> FloatArray:
    """Return the value (rows,) at x = `place` of the cubic through columns `first` to `last` of each row.

    x: (rows, n), never falling.  y: (n,), rising.  first, last: (rows,) with x[first] ≤ at ≤ x[last], first < last. The
    curve jumps where x is equal in several columns.
    """
    row = np.arange(len(x))
    step = np.diff(x, axis=1)
    left = np.clip((x < place).sum(axis=1) - 1, first, last - 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = np.diff(y) / step
        tangent = np.zeros(x.shape)
        near, far = step[:, 1:], step[:, :-1]
        before, after = 2 * near + far, near + 2 * far
        mean = (before / slope[:, :-1] + after / slope[:, 1:]) / (before + after)  # mean of 1/slope
        tangent[:, 1:-1] = 1.0 / mean
        tangent[row, first] = _end(step, slope, row, first, np.minimum(first + 1, last - 1))
        tangent[row, last] = _end(step, slope, row, last - 1, np.maximum(last - 2, first))
        width, rise = step[row, left], slope[row, left]
        start, end = tangent[row, left], tangent[row, left + 1]
        s, bend = place - x[row, left], (start + end - 2 * rise) / width
        curve = y[left] + start * s + ((rise - start) / width - bend) * (s * s) + bend / width * (s * s * s)
    return np.where(s > 0, curve, y[left])


def _end(step: FloatArray, slope: FloatArray, row: IntArray, outer: IntArray, inner: IntArray) -> FloatArray:
    """Return the tangent at an end from the two nearest intervals: that of a parabola, never falling."""
    h, k, m, n = step[row, outer], step[row, inner], slope[row, outer], slope[row, inner]
    tangent = ((2 * h + k) * m - h * n) / (h + k)
    return np.where(inner == outer, m, np.where(tangent > 0, tangent, 0.0))
