"""Mesh law F(θ, δ) of a gear pair over one body period: mesh force against wheel angle and deflection."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from math import ceil, floor, log2

import numpy as np

from nvhchain.conventions import Progress
from nvhchain.errors import SolverError, require, warn_caller
from nvhchain.fidelity import GearFidelity
from nvhchain.gear.compliance.analytic import SliceCompliance, slice_compliance
from nvhchain.gear.compliance.flank_compliance import FlankCompliance, flank_compliance
from nvhchain.gear.contact.engagement import Engagement, close_edges, engaged_reach
from nvhchain.gear.drawing.pair import BACK, DRIVE, GearPair
from nvhchain.gear.drawing.volume_mesh import VolumeMesh
from nvhchain.gear.laws.transmission_error import angle_blocks, body_period_angles, compute_blocks
from nvhchain.handoff import FloatArray, MeshLaw
from nvhchain.kinds import checked

_STIFFEST = 1e-11
"""Deflection per force (m/N) from which the deflections of a law are sought; no gear is stiffer."""


@checked
def mesh_law(
    pair: GearPair,
    *,
    nominal_force: float,
    fidelity: GearFidelity,
    compliances: tuple[FlankCompliance | SliceCompliance, FlankCompliance | SliceCompliance] | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> MeshLaw:
    """Compute the mesh law F(θ, δ) of a pair over its body period.

    Parameters
    ----------
    pair : GearPair
        Gear pair.
    nominal_force : float
        Force along the flank normal (N), `GearPair.normal_force`; sets the range of deflections.
    fidelity : GearFidelity
        `angles_per_mesh` angles per mesh period, deflections, slices and residual.
    compliances : tuple of 2 FlankCompliance or SliceCompliance, optional
        Compliances of pinion and wheel over `engaged_reach(pair, fidelity.corner_gap)` teeth; computed if not supplied.
    executor : Executor, optional
        Runs blocks of angles; by default threads of this process.
    progress : Progress, optional
        Called with (steps done, steps in all).  A step is a tooth of a symmetric sector or a block of angles.

    Returns
    -------
    MeshLaw
        Force (N) on a grid of wheel angles (rad) and deflections (m).

    Raises
    ------
    InputError
        If the force is not positive and finite.
    SolverError
        If a contact does not converge.

    Notes
    -----
    Compliances are computed anew where the load closes edges beyond their reach (`close_edges`).
    """
    angle = body_period_angles(pair, fidelity)
    blocks = angle_blocks(angle)
    teeth = 0 if compliances or fidelity.bodies == "analytic" else pair.pinion.sector + pair.wheel.sector
    steps = teeth + len(blocks)

    def report(done: int) -> None:
        if progress:
            progress(done, steps)

    if compliances is None:
        compliances = pair_compliances(pair, fidelity, progress=lambda done, _: report(done))
    engagement, deflection = engaged(pair, nominal_force, fidelity, compliances)
    force = compute_blocks(
        _force_rows,
        engagement,
        blocks=blocks,
        fixed=(deflection,),
        executor=executor,
        progress=lambda done, _: report(teeth + done),
    )
    if (np.diff(force, axis=1) < 0).any():
        raise SolverError("mesh force falls with deflection, against the contact's physics: tighten contact_residual")
    return tabulated(pair, angle, deflection, force)


def tabulated(
    pair: GearPair, angle: FloatArray, deflection: FloatArray, force: FloatArray, *, meshes: int | None = None
) -> MeshLaw:
    """Return the mesh law of a pair with given forces.

    angle (n_angle,): wheel angles of a period (rad).
    deflection (n_defl,): deflections (m).
    force (n_angle, n_defl): forces (N).
    meshes: mesh periods in a period of the law; by default those of a body period.
    Returns law with the geometry of the pair.
    """
    return MeshLaw(
        angle=angle,
        deflection=deflection,
        force=force,
        period=(meshes or pair.meshes_per_body_period) * pair.mesh_period,
        teeth=(pair.pinion.geometry.teeth, pair.wheel.geometry.teeth),
        base_radius=pair.base_radius,
        base_helix_angle=pair.base_helix_angle,
        working_pressure_angle=pair.working_pressure_angle,
        centre_distance=pair.centre_distance,
        face_width=pair.face_width,
    )


def engaged(
    pair: GearPair,
    nominal_force: float,
    fidelity: GearFidelity,
    compliances: tuple[FlankCompliance | SliceCompliance, FlankCompliance | SliceCompliance] | None = None,
) -> tuple[Engagement, FloatArray]:
    """Return the contact problem with all edges that close in a mesh law, and the deflections of that law.

    Returns deflection (n_defl,): deflections (m).
    """
    angle = body_period_angles(pair, fidelity)
    engagement = Engagement(pair, compliances or pair_compliances(pair, fidelity), fidelity)
    deflection = deflection_grid(engagement, nominal_force, angle)
    closing = close_edges(engagement, deflection[-1], -deflection[0] - pair.backlash)
    if closing is engagement:
        return engagement, deflection
    return closing, deflection_grid(closing, nominal_force, angle)


@checked
def pair_compliances(
    pair: GearPair,
    fidelity: GearFidelity,
    *,
    progress: Progress | None = None,
    flanks: Callable[..., FlankCompliance] | None = None,
) -> tuple[FlankCompliance | SliceCompliance, FlankCompliance | SliceCompliance]:
    """Compute the compliances of pinion and wheel, each over `engaged_reach(pair)` teeth.

    progress: called with (teeth done, teeth of both sectors).
    flanks: function of one gear in place of `flank_compliance`; one that keeps results saves repeated work.

    An `AccuracyWarning` is issued where an analytic body has a web, openings or an imported mesh.
    """
    if fidelity.bodies == "analytic":
        for name, body in (("pinion", pair.pinion), ("wheel", pair.wheel)):
            blank = body.blank
            if blank.web is not None or blank.cutouts is not None or isinstance(blank, VolumeMesh):
                message = f"the {name}'s blank counts as solid but for the twist of a web: analytic bodies have no rim"
                warn_caller(
                    f"{message} that bends, no openings and no imported meshes; take bodies = 'elements'",
                    kind="analytic bodies",
                )
        return slice_compliance(pair.pinion), slice_compliance(pair.wheel)
    reach, first = engaged_reach(pair, fidelity.corner_gap), pair.pinion.sector
    teeth, flanks = first + pair.wheel.sector, flanks or flank_compliance

    def report(done: int) -> None:
        if progress:
            progress(done, teeth)

    return (
        flanks(pair.pinion, fidelity, reach=reach, progress=lambda done, _: report(done)),
        flanks(pair.wheel, fidelity, reach=reach, progress=lambda done, _: report(first + done)),
    )


def _force_rows(engagement: Engagement, angles: FloatArray, deflection: FloatArray) -> FloatArray:
    """Return the mesh force (n_angle, n_defl) in N; the work of an executor."""
    return np.array([engagement.mesh_force(angle, deflection) for angle in angles])


def law_load(force: float) -> float:
    """Return the load (N) whose mesh law serves a force (N) of either sign: the next power of two.

    Laws of one pair differ only in their range of deflections.  Forces between two powers of two share one.  0, inf and
    nan are returned unchanged.
    """
    return float(2.0 ** ceil(log2(abs(force)))) if 0.0 < abs(force) < np.inf else abs(force)


def deflection_grid(engagement: Engagement, nominal_force: float, angle: FloatArray) -> FloatArray:
    """Return deflections (m) from the back flank through the gap to the drive flank.

    Beyond first contact they are even up to a power of two in µm, then in equal ratios.  They end where the softest
    angle carries `drive_reach` or `back_reach` times the nominal force.  Angles between those that are tried may carry
    less.
    """
    require(0 < nominal_force < np.inf, f"nominal_force = {nominal_force:g} N must be positive and finite")
    fidelity = engagement.fidelity
    mesh_angles = angle.reshape(-1, min(fidelity.angles_per_mesh, len(angle)))
    first, touch = (min(engagement.first_contact(one, flank) for one in mesh_angles[0]) for flank in (DRIVE, BACK))
    back = -max(engagement.pair.backlash, 0.0) - touch
    require(
        first - back > -1e-9,
        f"misalignment closes the backlash by {1e6 * (back - first):.1f} µm too much, the flanks jam: increase "
        "centre_distance or thickness_allowance",
    )
    drive_steps = _steps(engagement, mesh_angles, first, fidelity.drive_reach * nominal_force)
    back_steps = _steps(engagement, mesh_angles, back, -fidelity.back_reach * nominal_force)
    gap = [back] if first - back > 1e-9 else []
    return np.concatenate([back - back_steps[::-1], gap, [first], first + drive_steps])


def _steps(engagement: Engagement, mesh_angles: FloatArray, start: float, force: float) -> FloatArray:
    """Return steps (m) beyond the first contact of a flank, until its softest angle carries a force (N).

    mesh_angles: (n_mesh, n_phase) wheel angles (rad).
    start: deflection at first contact (m).
    force: least force at the last step; < 0 on the back flank.

    The softest angle is searched among the phases of a mesh period, on teeth spread over the body period.  The softest
    phase is then searched on all teeth.
    """
    sign = 1.0 if force > 0 else -1.0
    steps_per_doubling, doublings = engagement.fidelity.law_steps[0 if force > 0 else 1]

    def least(angles: FloatArray, last: int) -> tuple[float, int]:
        deflection = np.array([start + sign * _step(last, steps_per_doubling)])
        carried = [sign * float(engagement.mesh_force(angle, deflection)[0]) for angle in angles]
        return min(carried), int(np.argmin(carried))

    phases = np.arange(mesh_angles.shape[1])
    spread = mesh_angles[phases * len(mesh_angles) // len(phases), phases]
    last = steps_per_doubling * floor(log2(_STIFFEST * abs(force) / 1e-6))
    while least(spread[:1], last + steps_per_doubling)[0] < abs(force):
        last += steps_per_doubling
    while least(spread[:1], last)[0] < abs(force):
        last += 1
    phase = least(spread, last)[1]
    softest = np.append(spread[phase], mesh_angles[least(mesh_angles[:, phase], last)[1], phase])
    while least(softest, last)[0] < abs(force):
        last += 1
    lowest = last - doublings * steps_per_doubling
    even = np.arange(1, steps_per_doubling) / steps_per_doubling * _step(lowest, steps_per_doubling)
    return np.append(even, [_step(number, steps_per_doubling) for number in range(lowest, last + 1)])


def _step(number: int, steps_per_doubling: int) -> float:
    """Return a step beyond first contact (m); number 0 is 1 µm."""
    return float(1e-6 * 2.0 ** (number / steps_per_doubling))
