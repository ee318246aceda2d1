"""Static equilibrium of a gearbox on bearings whose stiffness depends on their load."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from nvhchain.bearings import StiffnessMatrix
from nvhchain.bearings.catalogue import RollingBearing
from nvhchain.bearings.loaded import load_surplus, usual_stiffness
from nvhchain.bearings.newton import settle
from nvhchain.dynamics.model.assembly import Assembly, assemble
from nvhchain.dynamics.model.gearbox import Gearbox
from nvhchain.dynamics.model.parts import Bearing
from nvhchain.dynamics.model.train import shaft_torques
from nvhchain.dynamics.time_loop.quasi_static import static_mesh_forces
from nvhchain.errors import InputError, SolverError, counted, warn_caller
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.handoff import FloatArray, MeshLaw, ReducedHousing
from nvhchain.kinds import checked

RESIDUAL = 1e-11
"""Largest unbalanced force of an unknown, relative to the load in the norm of the usual stiffness."""

SEAT_ROUNDS = 60
"""Largest number of Newton iterations for bearings in series with flexible seats."""

LEAST_LOAD = 1e-3
"""Load (N) to which residuals of an unloaded gearbox relate."""

STIFFNESS_ROUNDING = 1e-11
"""Rounding of a stiffness, relative to the diagonal. Differences from rounding then give the same cached results."""
FORCE_DIGITS, PLACE_DIGITS = 6, 15
"""Decimal digits of the forces (N, N m) and displacements (m, rad) of bearings."""

FAR = 5e-3
"""Displacement (m) beyond every play, at which a bearing that carries a direction pushes back."""


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """Gearbox in balance under its torque at standstill.

    gearbox: gearbox whose bearings have their stiffness and force at this load (`StiffnessMatrix`); bearings without
        model are unchanged.
    mesh_force (n_mesh,): forces along the flank normals (N), < 0 on back flanks.
    bearing_load (n_bearing, 5): forces on the housing along x, y, z (N) and moments about x and y (N m).
    shaft_bearing_load (n_shaft_bearing, 5): forces and moments of the inner shafts on the outer ones, in the order of
        `gearbox.shaft_bearings`.
    displacement (n_support, 5): displacement of the shafts against the seats, then of inner against outer shafts (m,
        rad).
    stiffness (n_support, 5, 5): tangent stiffness (N/m, N, N m), in the order of `gearbox.supports`.
    misalignment (n_mesh, 2): tilts of each wheel against its pinion (rad), as of `static_misalignment`.
    steps: Newton steps from the unloaded position.
    residual: largest unbalanced force, relative to the load.
    """

    gearbox: Gearbox
    mesh_force: FloatArray
    bearing_load: FloatArray
    shaft_bearing_load: FloatArray
    displacement: FloatArray
    stiffness: FloatArray
    misalignment: FloatArray
    steps: int
    residual: float


@checked
def equilibrium(
    gearbox: Gearbox,
    mesh_laws: Sequence[MeshLaw],
    housing: ReducedHousing | None,
    *,
    input_torque: float,
    fidelity: DynamicsFidelity | None = None,
    face_moment: FloatArray | None = None,
) -> Equilibrium:
    """Return the static equilibrium of shafts, bearings and housing under a torque.

    mesh_laws: one law per mesh, in the gearbox's order; only their directions count.
    housing: housing; None for rigid seats.
    input_torque: torque along the input's rotation (N m).
    fidelity: elements and modes of flexible shafts, as in `assemble`.
    face_moment: (n_mesh,) moment (N m) of the load about mid-width, by which the teeth oppose the tilt; 0 by default.
    Returns loads, displacements and stiffness of the bearings, misalignment of the meshes.

    The torques fix the mesh forces, which act at mid-width, spread evenly over the points of meshes that tilt. Unknowns
    are shafts (rigid, or flexible with the gearbox's option) and housing modes. The seats' residual flexibility is in
    series with the bearings. Seats of a reduced housing with five motions tilt. The energy is convex, and Newton's
    method minimises it from the unloaded position (`nvhchain.bearings.newton`).
    """
    supports, n_seat = gearbox.supports, len(gearbox.bearings)
    made = [usual_stiffness(bearing) for bearing in supports]
    usual, reach = np.array([stiffness for stiffness, _ in made]), max(each for _, each in made)
    stand_in = tuple(
        replace(bearing, model=_matrix(k), radial_stiffness=1.63e8, axial_stiffness=5.05e7)
        for bearing, k in zip(supports, _held(usual), strict=True)
    )
    assembly = assemble(_supported(gearbox, stand_in), mesh_laws, housing, fidelity=fidelity)
    if face_moment is not None:
        assembly = assembly.opposed(face_moment)
    n, links = assembly.lateral, assembly.links
    seats = np.vstack([assembly.bearing_map, assembly.link_map])[:, :n]
    load = assembly.load(shaft_torques(gearbox, assembly.train, input_torque))
    mesh_force = static_mesh_forces(assembly, load)
    carried = np.array([share * mesh_force[mesh] for mesh, share in zip(assembly.mesh, assembly.share, strict=True)])
    flank = assembly.contact[2 * np.arange(len(carried)) + (carried < 0.0), :n]
    outside = load[:n] - flank.T @ np.abs(carried)
    spring = seats.T @ block_diag(assembly.bearings.stiffness, links.stiffness) @ seats
    diagonal = np.diag(assembly.stiffness)[:n]
    scale = max(float(np.linalg.norm(outside / np.sqrt(diagonal))), LEAST_LOAD / float(np.sqrt(diagonal[0])))
    bearings = _Seated(supports, block_diag(assembly.bearings.residual, links.residual))

    def forces(x: FloatArray) -> tuple[FloatArray, FloatArray]:
        force, stiffness = bearings.evaluate(seats @ x)
        own = assembly.own_stiffness
        return own * x + seats.T @ force, np.diag(own) + seats.T @ stiffness @ seats

    moved = (seats @ np.linalg.solve(assembly.stiffness[:n, :n], outside)).reshape(-1, 5)[:, :3]
    nonlinear = not all(bearing.linear for bearing in supports)
    surplus = load_surplus(moved, reach) if nonlinear else 1.0
    try:
        settled = settle(forces, outside, spring, np.sqrt(diagonal) * scale, RESIDUAL, surplus)
    except SolverError as error:
        raise InputError(_refusal(gearbox, assembly, outside, input_torque, str(error))) from None
    x = settled.position
    loads = bearings.evaluate(seats @ x)[0].reshape(-1, 5)
    place = bearings.displacement.reshape(-1, 5)
    stiffness = np.array([b.evaluate(u)[1] for b, u in zip(supports, place, strict=True)])
    loose = [number for number, k in enumerate(stiffness) if not k.any()]
    if loose:
        names = ", ".join(supports[number].name for number in loose)
        warn_caller(
            f"no load on {counted(len(loose), 'bearing')} ({names}), whose rolling elements then have no stiffness: "
            "that under a usual load takes its place; give a preload, or a stiffness",
            kind="bearings without load",
        )
        stiffness[loose] = _held(usual)[loose]
    for bearing, u in zip(supports, place, strict=True):
        if isinstance(bearing.model, RollingBearing):
            bearing.model.check_load(u, bearing.name)
    operating = tuple(
        bearing if bearing.linear else replace(bearing, model=_matrix(k, force, u))
        for bearing, k, force, u in zip(supports, stiffness, loads, place, strict=True)
    )
    tilted = np.concatenate([x, np.zeros(assembly.free.shape[1])])
    return Equilibrium(
        _supported(gearbox, operating),
        mesh_force,
        loads[:n_seat],
        loads[n_seat:],
        place,
        stiffness,
        np.asarray((assembly.misalignment @ tilted).reshape(-1, 2)),
        settled.steps,
        settled.residual,
    )


def _supported(gearbox: Gearbox, supports: Sequence[Any]) -> Gearbox:
    """Return the gearbox with other bearings, in the order of `Gearbox.supports`."""
    n_seat = len(gearbox.bearings)
    return replace(gearbox, bearings=tuple(supports[:n_seat]), shaft_bearings=tuple(supports[n_seat:]))


def _matrix(stiffness: FloatArray, force: FloatArray | None = None, place: FloatArray | None = None) -> StiffnessMatrix:
    """Return a bearing of constant stiffness (5, 5), with its force (5,) at a place (5,), all rounded."""
    size = np.sqrt(np.abs(np.diag(stiffness)))
    unit = STIFFNESS_ROUNDING * np.outer(size, size)
    rounded = np.round(0.5 * (stiffness + stiffness.T) / np.where(unit > 0.0, unit, 1.0)) * unit
    values = tuple(map(tuple, (0.5 * (rounded + rounded.T)).tolist()))
    if force is None or place is None:
        return StiffnessMatrix(values)
    return StiffnessMatrix(values, tuple(np.round(force, FORCE_DIGITS)), tuple(np.round(place, PLACE_DIGITS)))


def _held(usual: FloatArray) -> FloatArray:
    """Return stiffness matrices (n, 5, 5) without coupling between motions, and none without any stiffness along z."""
    held = usual * np.eye(5)
    softest = 1e-3 * held[:, 0, 0]
    held[:, 2, 2] = np.maximum(held[:, 2, 2], softest)
    return held


class _Seated:
    """Bearings in series with flexible seats: forces (m,) and stiffness by the displacement of shafts and modes (m,).

    displacement : (m,) of the bearings themselves, the last one evaluated; the start of the next search.
    """

    def __init__(self, bearings: Sequence[Bearing], residual: FloatArray) -> None:
        self.bearings, self.residual = bearings, residual
        self.rigid = not residual.any()
        self.displacement = np.zeros(5 * len(bearings))

    def _alone(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        force, stiffness = np.zeros(len(u)), np.zeros((len(u), len(u)))
        for i, bearing in enumerate(self.bearings):
            block = slice(5 * i, 5 * i + 5)
            force[block], stiffness[block, block] = bearing.evaluate(u[block])
        return force, stiffness

    def evaluate(self, moved: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return force (m,) and stiffness (m, m) of the series: u + R F(u) = moved."""
        if self.rigid:
            self.displacement = moved
            return self._alone(moved)
        u = self.displacement
        force, stiffness = self._alone(u)
        gap = u + self.residual @ force - moved
        size = float(np.abs(moved).max()) + 1e-12
        for _ in range(SEAT_ROUNDS):
            if float(np.abs(gap).max()) <= 1e-13 * size:
                break
            step, reach = np.linalg.solve(np.eye(len(u)) + self.residual @ stiffness, -gap), 1.0
            before = float(np.linalg.norm(gap))
            while True:
                force, stiffness = self._alone(u + reach * step)
                gap = u + reach * step + self.residual @ force - moved
                if float(np.linalg.norm(gap)) < before or reach < 1e-3:
                    break
                reach *= 0.5
            u = u + reach * step
            if float(np.abs(reach * step).max()) <= 1e-15 * size:
                break
        self.displacement = u
        series = np.linalg.solve((np.eye(len(u)) + self.residual @ stiffness).T, stiffness.T)
        return force, np.asarray(0.5 * (series + series.T))


def _refusal(gearbox: Gearbox, assembly: Assembly, outside: FloatArray, torque: float, why: str) -> str:
    """Return the message for a gearbox that finds no equilibrium: the shaft whose thrust nothing carries, if one."""
    for i, shaft in enumerate(gearbox.shafts):
        thrust = float(outside[5 * i + 2])
        # an outer shaft moves against its inner one
        own_bearings = [(1.0, bearing) for bearing in gearbox.supports if bearing.shaft == shaft.name]
        own_bearings += [(-1.0, bearing) for bearing in gearbox.shaft_bearings if bearing.outer_shaft == shaft.name]
        names = ", ".join(bearing.name for _, bearing in own_bearings)
        for way in (1.0, -1.0) if thrust >= 0.0 else (-1.0, 1.0):
            push = np.array([0.0, 0.0, way * FAR, 0.0, 0.0])
            if any(side * way * bearing.evaluate(side * push)[0][2] > 0.0 for side, bearing in own_bearings):
                continue
            force = (
                f"its thrust of {thrust:.4g} N"
                if thrust * way > 0.0
                else f"an axial force along {'+' if way > 0.0 else '−'}z"
            )
            return (
                f"shaft {shaft.name} finds no equilibrium at {torque:g} N m: none of its bearings {names} carries "
                f"{force}: turn the thrust of one, or take a bearing that carries both ways"
            )
    return f"the gearbox finds no equilibrium at {torque:g} N m ({why}): take less clearance, or less torque"
