"""Mesh law F(θ, δ) of a gear pair over one body period: mesh force against wheel angle and deflection."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor

import numpy as np

from nvhchain.conventions import Progress
from nvhchain.errors import SolverError, require, warn_caller
from nvhchain.fidelity import GearFidelity
from nvhchain.gear.compliance.analytic import SliceCompliance, slice_compliance
from nvhchain.gear.compliance.flank_compliance import FlankCompliance, flank_compliance
from nvhchain.gear.contact.engagement import Engagement, close_edges, engaged_reach
from nvhchain.gear.drawing.pair import BACK, DRIVE, GearPair
from nvhchain.gear.drawing.volume_mesh import VolumeMesh
from nvhchain.gear.laws.transmission_error import angle_blocks, body_period_angles, compute_blocks, loaded_mesh
from nvhchain.handoff import FloatArray, MeshLaw
from nvhchain.kinds import checked

_CARRIED = 1.25
"""Smallest force on the back flank over the nominal one; angles between those that are tried may carry less."""
_EXTENSIONS = 12
"""Largest number of extensions of the back flank's deflections, by a quarter each."""


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
    require(0 < nominal_force < np.inf, f"nominal_force = {nominal_force:g} N must be positive and finite")
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


def deflection_grid(engagement: Engagement, nominal_force: float, angle: FloatArray) -> FloatArray:
    """Return deflections (m) from the back flank through the gap to the drive flank, densest at first contact.

    The softest angle sets the range, so that the drive flank carries `drive_reach` times the nominal force.  It is
    searched among the phases of a mesh period, on teeth spread over the body period.  The softest phase is then
    searched on all teeth.  Where the two effects do not add up, an angle between may carry some thousandths less.  The
    back flank reaches `back_reach` times the nominal force.
    """
    fidelity = engagement.fidelity
    phases = min(fidelity.angles_per_mesh, len(angle))
    mesh_angles = angle.reshape(-1, phases)
    probes = mesh_angles[np.arange(phases) * len(mesh_angles) // phases, np.arange(phases)]
    guess, carried = 1e-9 * nominal_force, []
    for probe in probes:
        guess = loaded_mesh(engagement, probe, fidelity.drive_reach * nominal_force, guess=guess).deflection
        carried.append(guess)
    same_phase = mesh_angles[:, int(np.argmax(carried))]
    for probe in same_phase:
        guess = loaded_mesh(engagement, probe, fidelity.drive_reach * nominal_force, guess=guess).deflection
        carried.append(guess)
    probes, softest = np.concatenate([probes, same_phase]), max(carried)
    first, back_contact = (min(engagement.first_contact(probe, flank) for probe in probes) for flank in (DRIVE, BACK))
    back_contact = -max(engagement.pair.backlash, 0.0) - back_contact
    require(
        first - back_contact > -1e-9,
        f"misalignment closes the backlash by {1e6 * (back_contact - first):.1f} µm too much, the flanks jam: increase "
        "centre_distance or thickness_allowance",
    )
    total = fidelity.deflections
    back = max(2, round((total - 2) * fidelity.back_reach / (fidelity.back_reach + fidelity.drive_reach)))
    drive = total - 2 - back
    reach = softest - first

    def grading(n: int, reach: float) -> FloatArray:
        return reach * (np.arange(1, n + 1) / n) ** 1.5

    backwards = back_contact - grading(back, _reach_behind(engagement, nominal_force, probes, back_contact, reach))
    gap = [back_contact] if first - back_contact > 1e-9 else []
    return np.concatenate([backwards[::-1], gap, [first], first + grading(drive, reach)])


def _reach_behind(
    engagement: Engagement, nominal_force: float, probes: FloatArray, back_contact: float, reach: float
) -> float:
    """Return the reach of deflections on the back flank (m), in proportion to that of the drive flank (m).

    It is longer where the back flank is the softer one, by its relief or crowning, and would not carry the force.
    """
    fidelity = engagement.fidelity
    length = reach * fidelity.back_reach / fidelity.drive_reach
    wanted = _CARRIED * nominal_force
    for _ in range(_EXTENSIONS):
        carried = min(-float(engagement.mesh_force(probe, np.array([back_contact - length]))[0]) for probe in probes)
        if carried >= wanted:
            break
        wanted, length = fidelity.back_reach * nominal_force, 1.25 * length
    return length
