"""The chain: the only file that knows the order of the stages.

A spine of signals (mesh force → bearing force → surface velocity → pressure) runs past load-independent operators
(mesh laws, reduced housing, transfer vectors), which are computed once, kept in a file and found again.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from nvhchain import levels, stages
from nvhchain.case import Case, GearboxCase, RadiatorCase
from nvhchain.errors import require
from nvhchain.fidelity import STANDARD, Fidelity
from nvhchain.handoff import (
    BearingForces,
    FieldPressure,
    FloatArray,
    ForceSpectrum,
    HandOff,
    MeshLaw,
    NoiseTransferFunctions,
    PressureHistory,
    ReducedHousing,
    SurfaceVelocity,
    TransferVectors,
)
from nvhchain.radiator import radiator_velocity
from nvhchain.resume import Shelf, Unwatched, Watcher
from nvhchain.scene import preflight


@dataclass(frozen=True)
class Result:
    """Everything a run made or was given; what the case does not need is None (or empty)."""

    case: Case
    mesh_laws: tuple[MeshLaw, ...]
    bearing_forces: BearingForces | None
    force_spectrum: ForceSpectrum | None
    housing: ReducedHousing | None
    surface_velocity: SurfaceVelocity | None
    transfer_vectors: TransferVectors | None
    pressure: FieldPressure | None
    noise_transfer_functions: NoiseTransferFunctions | None = None
    pressure_history: PressureHistory | None = None

    @property
    def overall(self) -> FloatArray:
        """Level (n_point,) in dB(A) at the field points, over the lines or over the record of a run-up."""
        if self.pressure_history is not None:
            time = self.pressure_history.time
            rate = (len(time) - 1) / float(time[-1] - time[0])
            return levels.equivalent(self.pressure_history.pressure, sample_rate=rate)
        assert self.pressure is not None
        return levels.overall(self.pressure.frequency, self.pressure.pressure)


def run(
    case: Case,
    *,
    fidelity: Fidelity = STANDARD,
    out: str | Path | None = None,
    operators: str | Path | None = None,
    mesh_laws: Sequence[MeshLaw] | None = None,
    bearing_forces: BearingForces | None = None,
    force_spectrum: ForceSpectrum | None = None,
    housing: ReducedHousing | None = None,
    surface_velocity: SurfaceVelocity | None = None,
    transfer_vectors: TransferVectors | None = None,
    executor: Executor | None = None,
    watcher: Watcher | None = None,
) -> Result:
    """Sound pressure of a case at its field points.

    out: folder for the hand-offs; finished stages in it whose inputs have not changed are found, not computed.
    operators: folder for mesh laws, housing and transfer vectors, which several cases may share (default: `out`).
    Any hand-off may be given ready-made; it is then used as it is, and what only it needed is not computed.
    executor: takes mesh-law blocks and frequency bands.  watcher: is told when stages begin, advance and end.

    Raises InputError for what cannot be used, SolverError for a stage that did not reach its residual.
    """
    given = {
        "mesh_laws": mesh_laws,
        "bearing_forces": bearing_forces,
        "force_spectrum": force_spectrum,
        "housing": housing,
        "surface_velocity": surface_velocity,
        "transfer_vectors": transfer_vectors,
    }
    preflight(case, fidelity, [name for name, value in given.items() if value is not None])
    if transfer_vectors is not None:
        _check_transfer_vectors(case, transfer_vectors)
    if mesh_laws is not None and isinstance(case, GearboxCase):
        require(
            len(mesh_laws) == len(case.stages),
            f"{len(mesh_laws)} mesh laws are given for {len(case.stages)} stages: give one per stage, in their order",
        )
    watcher = watcher or Unwatched()
    spine = Shelf(Path(out) if out else None, watcher)
    shared = Shelf(Path(operators) if operators else spine.folder, watcher)
    if isinstance(case, RadiatorCase):
        surface_velocity = surface_velocity or radiator_velocity(case, fidelity.acoustics)
    laws = tuple(mesh_laws or ())
    if isinstance(case, GearboxCase) and case.operation.ramp is not None:
        _check_run_up(given, fidelity)
        housing = housing or stages.reduced_housing(case, fidelity, shared)
        if bearing_forces is None:
            laws = laws or stages.mesh_laws(case, fidelity, shared, executor)
            bearing_forces = stages.run_up_forces(case, laws, housing, fidelity, spine)
        _check_names(case, bearing_forces.names)
        vectors = transfer_vectors or stages.transfer_vectors(case, housing.surface, None, fidelity, shared, executor)
        functions = stages.noise_transfer_functions(case, vectors, housing, bearing_forces, fidelity, shared)
        history = stages.pressure_history(functions, bearing_forces, spine)
        return Result(case, laws, bearing_forces, None, housing, None, vectors, None, functions, history)
    if surface_velocity is None:
        assert isinstance(case, GearboxCase)
        if force_spectrum is None and bearing_forces is not None:
            _check_names(case, bearing_forces.names)
            force_spectrum = stages.force_spectrum(case, bearing_forces, spine)
        housing = housing or stages.reduced_housing(case, fidelity, shared)
        if force_spectrum is None:
            laws = laws or stages.mesh_laws(case, fidelity, shared, executor)
            bearing_forces = stages.steady_forces(case, laws, housing, fidelity, spine)
            force_spectrum = stages.force_spectrum(case, bearing_forces, spine)
        _check_names(case, force_spectrum.names)
        surface_velocity = stages.surface_velocity(housing, force_spectrum, spine)
    if fidelity.acoustics.radiation == "equivalent_radiated_power":
        pressure = stages.equivalent_pressure(case, surface_velocity, force_spectrum, spine)
        return Result(case, laws, bearing_forces, force_spectrum, housing, surface_velocity, None, pressure)
    lines = surface_velocity.frequency
    vectors = transfer_vectors or stages.transfer_vectors(
        case, surface_velocity.surface, lines, fidelity, shared, executor
    )
    pressure = stages.pressure(vectors, surface_velocity, force_spectrum, fidelity, spine)
    return Result(case, laws, bearing_forces, force_spectrum, housing, surface_velocity, vectors, pressure)


def ready_made(hand_offs: Iterable[HandOff]) -> dict[str, Any]:
    """Sort loaded hand-offs into the arguments of `run`."""
    names = {
        BearingForces: "bearing_forces",
        ForceSpectrum: "force_spectrum",
        ReducedHousing: "housing",
        SurfaceVelocity: "surface_velocity",
        TransferVectors: "transfer_vectors",
    }
    given: dict[str, Any] = {}
    for hand_off in hand_offs:
        if isinstance(hand_off, MeshLaw):
            given.setdefault("mesh_laws", []).append(hand_off)
            continue
        kind = type(hand_off)
        require(kind in names, f"{kind.__name__} is not a hand-off that a run can start from")
        require(names[kind] not in given, f"{kind.__name__} is given twice: keep one")
        given[names[kind]] = hand_off
    return given


def _check_transfer_vectors(case: Case, vectors: TransferVectors) -> None:
    points = np.array([point.position for point in case.field_points])
    require(
        vectors.points.shape == points.shape and np.allclose(vectors.points, points, rtol=0, atol=1e-9),
        f"transfer vectors lead to {vectors.points.tolist()} m, the case asks for {points.tolist()} m: recompute them",
    )
    require(
        vectors.air == case.air,
        f"the transfer vectors belong to {vectors.air}, the case has {case.air}: recompute them",
    )
    require(
        vectors.plane == case.reflecting_plane,
        f"the transfer vectors belong to reflecting plane {vectors.plane}, the case has {case.reflecting_plane}: "
        "recompute them",
    )


def _check_run_up(given: dict[str, Any], fidelity: Fidelity) -> None:
    require(
        fidelity.acoustics.radiation != "equivalent_radiated_power",
        "a run-up is heard in time, but the equivalent radiated power has no phase: choose radiation = rayleigh or "
        "boundary_elements",
    )
    useless = [name for name in ("force_spectrum", "surface_velocity") if given[name] is not None]
    require(not useless, f"a run-up is heard in time, from bearing forces: {', '.join(useless)} cannot be used for it")


def _check_names(case: GearboxCase, names: Sequence[str]) -> None:
    known = [bearing.name for bearing in case.bearings]
    odd = sorted(set(names) ^ set(known))
    require(
        not odd, f"bearings of the forces and of the case differ in {', '.join(odd)}: the case has {', '.join(known)}"
    )
