"""Gearbox at standstill at given positions of its mesh laws: torques fix the gear forces, laws the deflections."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import cos, sin

import numpy as np

from nvhchain.dynamics.model.angle_laws import centre_law, friction_laws
from nvhchain.dynamics.model.assembly import Assembly, assemble
from nvhchain.dynamics.model.gearbox import Gearbox
from nvhchain.dynamics.model.parts import StaticTilt
from nvhchain.dynamics.model.train import shaft_torques
from nvhchain.dynamics.time_loop.law_table import (
    LawTable,
    deflection_under,
    force_at,
    mean_slope,
    row_at,
    slope_at,
    tabulate,
)
from nvhchain.errors import SolverError, require
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.handoff import FloatArray, IntArray, MeshLaw, ReducedHousing
from nvhchain.kinds import checked

STIFF = 1e8
"""Stiffness of a mesh (N/m) that scales residuals."""
SMALL = 1e-5
"""Deflection of a mesh (m) that scales residuals."""
RESIDUAL = 1e-11
"""Residual of points across the faces in balance, relative to the loads; it is rounding."""
ROUNDS = 60
"""Largest number of Newton iterations; a few are usual, more indicate failure."""


@dataclass(frozen=True, eq=False)
class StaticState:
    """Equilibrium without motion.

    position : (n,) unknowns x.
    mesh_force : (n_mesh,) forces along the flank normal (N), < 0 on the back flank; the difference where both flanks
        touch.
    bearing_force : (n_bearing, 3) forces on the housing (N).
    """

    position: FloatArray
    mesh_force: FloatArray
    bearing_force: FloatArray


def static_mesh_forces(assembly: Assembly, load: FloatArray) -> FloatArray:
    """Return the mesh forces (n_mesh,) along the flank normals (N) under a generalised force (n,), < 0 on back flanks.

    An open train is statically determinate.
    """
    # all points of a mesh share its row in torsion; drive-flank rows serve both signs, because the back flank's is
    # their negative there
    _, first = np.unique(assembly.mesh[assembly.share > 0.0], return_index=True)
    force = np.linalg.solve(assembly.contact[2 * first, assembly.lateral :].T, load[assembly.lateral :])
    # rounding on a mesh without torque is no contact
    force[np.abs(force) <= 1e-12 * np.abs(force).max(initial=0.0)] = 0.0
    return np.asarray(force)


def nominal_mesh_forces(assembly: Assembly, mesh_laws: Sequence[MeshLaw], torque: FloatArray) -> FloatArray:
    """Return `static_mesh_forces` (n_mesh,) (N) under shaft torques (n_shaft,) (N m).

    Raises InputError if a law ends below its force at some angle. Beyond its last deflections a law only continues in a
    straight line.
    """
    nominal = static_mesh_forces(assembly, assembly.load(torque))
    for law, force in zip(mesh_laws, nominal, strict=True):
        side, end = (1.0, -1) if force >= 0.0 else (-1.0, 0)
        limit = float((side * law.force[:, end]).min())
        require(
            side * force <= limit * (1.0 + 1e-9),
            f"the torque asks for {force:.6g} N of the mesh law with teeth {law.teeth}, which ends at "
            f"{side * limit:.6g} N: tabulate it to larger deflections or lower the torque",
        )
    return nominal


def static_state(assembly: Assembly, table: LawTable, torque: FloatArray, phases: FloatArray) -> StaticState:
    """Return the equilibrium under external shaft torques (n_shaft,) (N m) at mesh-law `phases` (n_mesh,), in periods.

    The torques fix one force per mesh. Bearings and housing deflect under these forces, and the inverted laws give the
    torsional positions. A mesh without force rests at the drive side's end of its gap. If a mesh has several points, or
    touches on both flanks, Newton's method starts from this solution with the load spread evenly.

    Raises SolverError if a law cannot carry its force or the points do not settle.
    """
    rows = [row_at(table, e, phases[k]) for e, k in enumerate(assembly.mesh)]
    grids = [table.deflection[e, : table.cells[e]] for e in range(len(rows))]
    points = np.flatnonzero(assembly.share > 0.0)
    load = assembly.load(torque)
    for e in np.flatnonzero(assembly.share == 0.0):
        load = load - assembly.contact[2 * e] * force_at(grids[e], rows[e], np.zeros(1))[0]
    force = static_mesh_forces(assembly, load)
    point_mesh = assembly.mesh[points]
    carried = assembly.share[points] * force[point_mesh]
    back = carried < 0.0
    flank = assembly.contact[2 * points + back]
    n = assembly.lateral
    lateral = np.linalg.solve(assembly.stiffness[:n, :n], load[:n] - flank[:, :n].T @ np.abs(carried))
    wanted = np.array([deflection_under(grids[e], rows[e], f) for e, f in zip(points, carried, strict=True)])
    gap = np.where(back, -wanted, wanted) - flank[:, :n] @ lateral
    mean = assembly.share[points] * (point_mesh == np.arange(len(force))[:, None])
    torsion = np.linalg.solve(mean @ flank[:, n:], mean @ gap)
    position = np.concatenate([lateral, torsion])
    # if the load brings gears closer than their backlash allows, their other flanks touch too
    sense = np.where(back, 1.0, -1.0)
    others = sense * (assembly.contact[2 * points + ~back] @ position)
    wedged = any(
        turn * force_at(grids[e], rows[e], np.array([deflection]))[0] > 0.0
        for e, deflection, turn in zip(points, others, sense, strict=True)
    )
    if wedged or len(points) > len(force):
        position = _settled(assembly, [(grids[e], rows[e]) for e in points], points, load, position)
    carried = assembly.wrenches((assembly.bearing_stiffness @ position)[None])[0]
    return StaticState(position, force, carried[:, :3])


def _settled(
    assembly: Assembly,
    laws: Sequence[tuple[FloatArray, FloatArray]],
    points: IntArray,
    load: FloatArray,
    position: FloatArray,
) -> FloatArray:
    """Return the position (n,) at which the forces of all points balance `load`, by Newton's method from `position`."""
    contact = assembly.contact[np.stack([2 * points, 2 * points + 1], axis=1).ravel()]
    size = np.sqrt(np.diag(assembly.stiffness) + (contact**2).sum(axis=0) * STIFF)

    def balance(x: FloatArray) -> tuple[FloatArray, FloatArray]:
        pressed = contact @ x
        force, slope = np.zeros(len(pressed)), np.zeros(len(pressed))
        for k, (grid, row) in enumerate(laws):
            for i, side in ((2 * k, 1.0), (2 * k + 1, -1.0)):
                deflection = np.array([side * pressed[i]])
                f = side * float(force_at(grid, row, deflection)[0])
                if f > 0.0:
                    force[i], slope[i] = f, float(slope_at(grid, row, deflection)[0])
        return assembly.stiffness @ x + contact.T @ force - load, slope

    residual, slope = balance(position)
    tolerance = RESIDUAL * max(float(np.linalg.norm(load / size)), np.sqrt(STIFF) * SMALL)
    for _ in range(ROUNDS):
        if float(np.linalg.norm(residual / size)) <= tolerance:
            return position
        # if every point of a mesh is open, nothing holds its torsion: a weak spring does for one iteration
        matrix = assembly.stiffness + (contact.T * np.maximum(slope, 1e-6 * STIFF)) @ contact
        step, reach = np.linalg.solve(matrix, -residual), 1.0
        before = float(np.linalg.norm(residual / size))
        while True:
            trial = position + reach * step
            residual, slope = balance(trial)
            if float(np.linalg.norm(residual / size)) < before or reach < 1e-4:
                break
            reach *= 0.5
        position = trial
    raise SolverError(
        f"the load of the meshes did not settle on their flanks within {ROUNDS} rounds: use one face point, or give "
        "more backlash where both flanks touch"
    )


@checked
def static_bearing_forces(
    gearbox: Gearbox,
    mesh_laws: Sequence[MeshLaw],
    housing: ReducedHousing | None,
    *,
    input_torque: float,
) -> FloatArray:
    """Return the bearing forces on the housing at standstill.

    mesh_laws: one law per mesh, in the gearbox's order.
    housing: housing; None for rigid seats.
    input_torque: torque along the input's rotation (N m).
    Returns (n_bearing, 3): forces (N).
    """
    assembly = assemble(gearbox, mesh_laws, housing)
    torque = shaft_torques(gearbox, assembly.train, input_torque)
    table = tabulate(laws_of_rows(assembly, mesh_laws, nominal_mesh_forces(assembly, mesh_laws, torque)), 1)
    return static_state(assembly, table, torque, law_phases(assembly, mesh_laws)).bearing_force


@checked
def static_misalignment(
    gearbox: Gearbox,
    mesh_laws: Sequence[MeshLaw],
    housing: ReducedHousing | None,
    *,
    input_torque: float,
    fidelity: DynamicsFidelity | None = None,
) -> FloatArray:
    """Return the tilt of each wheel's axis against its pinion's under load at standstill.

    fidelity: elements and modes of flexible shafts, as in `assemble`.
    Returns (n_mesh, 2): tilts (rad), the misalignment of a gear pair. The first lies in the plane of action of the
    drive flanks, > 0 where it closes them towards +z. The second lies across it, > 0 where the wheel leaves the pinion
    towards +z.
    """
    tilts = opposed_misalignment(gearbox, mesh_laws, housing, input_torque=input_torque, fidelity=fidelity)
    return tilts(np.zeros(len(mesh_laws)))


def opposed_misalignment(
    gearbox: Gearbox,
    mesh_laws: Sequence[MeshLaw],
    housing: ReducedHousing | None,
    *,
    input_torque: float,
    fidelity: DynamicsFidelity | None = None,
) -> Callable[[FloatArray], FloatArray]:
    """Return the function from moments of the teeth to the tilts of `static_misalignment`, which they oppose.

    Its argument (n_mesh,) is the moment (N m) of every mesh's load about mid-width, > 0 where more of the load lies
    towards +z.
    """
    assembly = assemble(gearbox, mesh_laws, housing, fidelity=fidelity)
    torque = shaft_torques(gearbox, assembly.train, input_torque)
    table = tabulate(laws_of_rows(assembly, mesh_laws, nominal_mesh_forces(assembly, mesh_laws, torque)), 1)
    phases = law_phases(assembly, mesh_laws)

    def tilts(moment: FloatArray) -> FloatArray:
        position = static_state(assembly.opposed(moment), table, torque, phases).position
        return np.asarray((assembly.misalignment @ position).reshape(-1, 2))

    return tilts


def face_loads(
    gearbox: Gearbox, mesh_laws: Sequence[MeshLaw], *, input_torque: float, fidelity: DynamicsFidelity
) -> list[FloatArray]:
    """Return the forces (n_point,) (N) that every mesh would have with its whole face loaded as at each of its points.

    The gearbox stands still. Forces of back flanks are negative.

    mesh_laws: one law per mesh, in the gearbox's order; of its forces the mean slope counts.
    fidelity: elements and modes of flexible shafts, as in `assemble`.
    """
    assembly = assemble(gearbox, mesh_laws, None, fidelity=fidelity)
    torque = shaft_torques(gearbox, assembly.train, input_torque)
    nominal = nominal_mesh_forces(assembly, mesh_laws, torque)
    table = tabulate(laws_of_rows(assembly, mesh_laws, nominal), 1)
    position = static_state(assembly, table, torque, law_phases(assembly, mesh_laws)).position
    found: list[list[float]] = [[] for _ in mesh_laws]
    for row, (mesh, share) in enumerate(zip(assembly.mesh, assembly.share, strict=True)):
        if share > 0.0:
            back = bool(nominal[mesh] < 0.0)
            deflection = (-1.0 if back else 1.0) * float(assembly.contact[2 * row + back] @ position)
            found[mesh].append(mean_slope(table, row, share * nominal[mesh]) / share * deflection)
    return [np.array(each) for each in found]


def laws_of_rows(assembly: Assembly, mesh_laws: Sequence[MeshLaw], nominal: FloatArray) -> list[MeshLaw]:
    """Return the law of every pair of contact rows: shares of the mesh laws, then friction and shuttling.

    nominal : (n_mesh,) nominal mesh forces (N), for friction and shuttling.
    """
    laws, relieved_laws = [], assembly.laws_beside_waves(mesh_laws)
    for mesh, share, offset in zip(assembly.mesh, assembly.share, assembly.offset, strict=True):
        if share > 0.0:
            law = _tilted_law(relieved_laws[mesh], assembly.gearbox.meshes[mesh].static_tilt, float(offset))
            laws.append(law.replace(force=share * law.force))
    for mesh, law, force in zip(assembly.gearbox.meshes, mesh_laws, nominal, strict=True):
        if mesh.friction is not None:
            laws += friction_laws(law, mesh.friction, float(force))
        if mesh.load_centre is not None:
            laws.append(centre_law(law, mesh.load_centre, float(force)))
    return laws


def _tilted_law(law: MeshLaw, tilt: StaticTilt | None, offset: float) -> MeshLaw:
    """Return the law of a point at an offset (m) from mid-width, loaded there at the static tilt as at mid-width."""
    if tilt is None:
        return law
    arm, double = offset * cos(law.base_helix_angle), 2.0 * law.working_pressure_angle
    drive, back = arm * tilt.in_plane, arm * (tilt.in_plane * cos(double) + tilt.normal * sin(double))
    pushing, pulling = (law.deflection[(side * law.force > 0.0).any(axis=0)] for side in (1.0, -1.0))
    middle = 0.5 * (pulling.max() + pushing.min()) if len(pulling) and len(pushing) else -np.inf
    moved = law.deflection + np.where(law.deflection > middle, drive, back)
    falling = bool((np.diff(moved) <= 0.0).any())  # flanks without play between them
    return law.replace(deflection=law.deflection + drive if falling else moved)


def law_phases(assembly: Assembly, mesh_laws: Sequence[MeshLaw]) -> FloatArray:
    """Return the phases of the laws (n_mesh,) at time 0, in periods."""
    return np.array([mesh.phase / law.period for mesh, law in zip(assembly.gearbox.meshes, mesh_laws, strict=True)])
