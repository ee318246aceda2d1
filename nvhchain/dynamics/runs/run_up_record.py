"""Record of a run-up in memory: samples in the order of the time loop, and their hand-off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Unpack

import numpy as np

from nvhchain.conventions import Progress
from nvhchain.dynamics.model.gearbox import Gearbox
from nvhchain.dynamics.runs.contact_loss import excursions, parted_flanks, warn_or_refuse
from nvhchain.dynamics.runs.ramp import Operation
from nvhchain.dynamics.runs.speed_ramp import RunUp, prepare, samples, start
from nvhchain.errors import ResourceError
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.handoff import BearingForces, FloatArray, MeshLaw, ReducedHousing
from nvhchain.handoff.forces import force_and_moment
from nvhchain.kinds import checked
from nvhchain.runtime.memory import free_memory
from nvhchain.runtime.threads import one_blas_thread


@dataclass(frozen=True, eq=False)
class Sampled:
    """Samples that become a hand-off.

    wrench : (n, n_bearing, motions) forces and moments on the housing (N, N m).
    drive, back : (n, n_mesh) deflections of drive flanks and of back flanks (m).
    error : (n, n_mesh) transmission errors (m).
    lag : (n,) lag of the output (rad).
    """

    wrench: FloatArray
    drive: FloatArray
    back: FloatArray
    error: FloatArray
    lag: FloatArray

    @classmethod
    def room(cls, run: RunUp, count: int) -> Sampled:
        """Return space for `count` samples, not filled yet."""
        box = run.model.assembly.gearbox
        drive, back, error = (np.empty((count, len(box.meshes))) for _ in range(3))
        return cls(
            np.empty((count, len(box.bearings), run.model.assembly.bearings.motions)),
            drive,
            back,
            error,
            np.empty(count),
        )

    def fill(self, first: int, piece: FloatArray) -> None:
        """Copy outputs (n, n_out) of a `Decimator` to the samples from `first` on."""
        column = 0
        for part in (self.wrench, self.drive, self.back, self.error, self.lag):
            rows = part[first : first + len(piece)]
            width = rows[0].size
            rows[:] = piece[:, column : column + width].reshape(rows.shape)
            column += width


def record(
    run: RunUp, first: int, sampled: Sampled, mesh_laws: Sequence[MeshLaw], fidelity: DynamicsFidelity
) -> BearingForces:
    """Return the hand-off of samples `first`, first + 1, … of a run, with its accuracy.

    The hand-off takes over the arrays of `sampled`, which become read-only.
    """
    gearbox = run.model.assembly.gearbox
    time = np.arange(first, first + len(sampled.lag), dtype=float) * run.sample_time
    sampled.wrench[:] = run.model.assembly.wrenches(sampled.wrench.reshape(len(time), -1))
    for part in (sampled.wrench, sampled.drive, sampled.error, sampled.lag):
        part.flags.writeable = False
    made = BearingForces(
        time=time,
        **force_and_moment(sampled.wrench),
        names=tuple(bearing.name for bearing in gearbox.bearings),
        positions=np.array(gearbox.bearing_positions),
        input_speed=run.ramp.speed(time),
        mesh_deflection=sampled.drive,
        transmission_error=sampled.error,
        output_lag=sampled.lag,
    )
    parted = parted_flanks(
        run.model,
        made.mesh_deflection,
        sampled.back,
        lambda indices: run.turns(time[indices])[:, None] / run.law_period + run.offset,
        run.sample_time,
        made.input_speed,
    )
    exceeded = excursions(gearbox, mesh_laws, made.mesh_deflection, sampled.back, fidelity)
    return made.replace(accuracy=exceeded | parted, error_names=gearbox.transmission_error_names)


@checked
def run_up(
    gearbox: Gearbox,
    mesh_laws: Sequence[MeshLaw],
    housing: ReducedHousing | None,
    *,
    progress: Progress | None = None,
    **operation: Unpack[Operation],
) -> BearingForces:
    """Return the forces of the bearings on the housing while the input speed changes evenly.

    mesh_laws: one law per mesh, in the gearbox's order.
    housing: housing; None for rigid seats.
    progress: called with the blocks of steps done and in all.
    **operation: speeds, duration, torque, band and fidelity.

    A run from standstill starts on the quasi-static solution. Any other run stays at its start speed until the
    influence of the start has decayed to `settle_level`.

    The record keeps at least `stored_samples_per_period` samples in a period of f_max. A low-pass keeps higher
    frequencies from aliasing into the band up to f_max. Between f_max and half the sampling rate the record fades out.
    It is reproducible bit for bit on one machine.

    If a recorded deflection leaves its mesh law, or flanks separate, there is an AccuracyWarning. The accuracy then
    states `law_exceeded` or `parted`.
    """
    return run_up_with_error(gearbox, mesh_laws, housing, progress=progress, **operation)[0]


@one_blas_thread
@checked
def run_up_with_error(
    gearbox: Gearbox,
    mesh_laws: Sequence[MeshLaw],
    housing: ReducedHousing | None,
    *,
    progress: Progress | None = None,
    **operation: Unpack[Operation],
) -> tuple[BearingForces, FloatArray]:
    """Return the record of `run_up` and the transmission error of the whole gearbox at the same samples.

    Returns error (n_t,): angle (rad) by which the output shaft lags behind the input shaft's angle times the speed
    ratio, > 0 under a driving torque.
    """
    run = prepare(gearbox, mesh_laws, housing, **operation)
    n_out = len(run.decimator.constant)
    needed, available = 2 * 8.0 * run.count * (n_out + 2), free_memory()
    if needed > 0.8 * available:
        raise ResourceError(
            f"a record of {run.count} samples needs {needed / 2**30:.1f} GiB, but {available / 2**30:.1f} are free: "
            "write it to files with record_run_up (`nvhchain record`), or lower f_max or the duration"
        )
    sampled, filled = Sampled.room(run, run.count), 0
    for piece, standing in samples(run, start(run)):
        if len(piece) > 0:
            sampled.fill(filled, piece)
        filled += len(piece)
        if progress:
            progress(standing.block, run.blocks)
    forces = record(run, 0, sampled, mesh_laws, operation["fidelity"])
    warn_or_refuse(forces.accuracy)
    return forces, sampled.lag.copy()
