"""One record of a run-up in memory: its samples, put in place as the time loop leaves them, and its hand-off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Unpack

import numpy as np

from nvhchain.conventions import Progress
from nvhchain.dynamics.model.gearbox import Gearbox
from nvhchain.dynamics.runs.contact_loss import parted_flanks
from nvhchain.dynamics.runs.law_range import marked, remind
from nvhchain.dynamics.runs.ramp import Operation
from nvhchain.dynamics.runs.speed_ramp import RunUp, prepare, samples, start
from nvhchain.dynamics.time_loop.one_thread import on_one_thread
from nvhchain.errors import ResourceError
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.handoff import BearingForces, FloatArray, MeshLaw, ReducedHousing
from nvhchain.kinds import checked
from nvhchain.runtime.memory import free_memory


@dataclass(frozen=True, eq=False)
class Sampled:
    """What becomes a hand-off: forces (n, n_bearing, 3) N, deflections of drive flanks and of back flanks and
    transmission errors (n, n_mesh) m, lag of the output (n,) rad."""

    force: FloatArray
    drive: FloatArray
    back: FloatArray
    error: FloatArray
    lag: FloatArray

    @classmethod
    def room(cls, run: RunUp, count: int) -> Sampled:
        """For `count` samples, not filled yet."""
        box = run.model.assembly.gearbox
        drive, back, error = (np.empty((count, len(box.meshes))) for _ in range(3))
        return cls(np.empty((count, len(box.bearings), 3)), drive, back, error, np.empty(count))

    def fill(self, first: int, piece: FloatArray) -> None:
        """Put (n, n_out) outputs of a `Decimator` in place from sample `first`."""
        column = 0
        for part in (self.force, self.drive, self.back, self.error, self.lag):
            rows = part[first : first + len(piece)]
            width = rows[0].size
            rows[:] = piece[:, column : column + width].reshape(rows.shape)
            column += width


def record(
    run: RunUp, first: int, sampled: Sampled, mesh_laws: Sequence[MeshLaw], fidelity: DynamicsFidelity
) -> BearingForces:
    """The hand-off of samples `first`, first + 1, … of a run, `marked`. It takes the arrays of `sampled`, which nobody
    may write any more."""
    gearbox = run.model.assembly.gearbox
    time = np.arange(first, first + len(sampled.lag), dtype=float) * run.sample_time
    for part in (sampled.force, sampled.drive, sampled.error, sampled.lag):
        part.flags.writeable = False
    made = BearingForces(
        time=time,
        force=sampled.force,
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
        lambda at: run.ramp.turns(time[at])[:, None] / run.law_period + run.offset,
        run.sample_time,
    )
    return marked(made, sampled.back, gearbox, mesh_laws, fidelity, parted)


@checked
def run_up(
    gearbox: Gearbox,
    mesh_laws: Sequence[MeshLaw],
    housing: ReducedHousing | None,
    *,
    progress: Progress | None = None,
    **operation: Unpack[Operation],
) -> BearingForces:
    """Forces of the bearings on the housing while the input speed changes evenly from start_speed to end_speed.

    mesh_laws: one per mesh, in the gearbox's order.  housing: None for rigid seats.  operation: `Operation`.

    From a standstill the run starts on the quasi-static solution; from any other speed it runs at that speed until
    `settle_level` of the start is left. Every so many steps that a period of f_max keeps
    `stored_samples_per_period` samples, one is stored, after a low-pass that keeps the rest from folding into the band
    up to f_max; between f_max and half the sampling rate the record fades out. Bit for bit reproducible on one machine.
    Raises InputError when the step is too long for f_max or the meshes, ResourceError when the record does not fit
    into memory (`record_run_up` writes it to files), SolverError when the start cannot be forgotten.
    AccuracyWarning, and `beyond_mesh_law` or `parted_flanks` in the provenance, where a recorded deflection leaves its
    mesh law or flanks part.
    """
    return run_up_with_error(gearbox, mesh_laws, housing, progress=progress, **operation)[0]


@on_one_thread
@checked
def run_up_with_error(
    gearbox: Gearbox,
    mesh_laws: Sequence[MeshLaw],
    housing: ReducedHousing | None,
    *,
    progress: Progress | None = None,
    **operation: Unpack[Operation],
) -> tuple[BearingForces, FloatArray]:
    """`run_up` and the transmission error of the whole gearbox at the same samples.

    (n_t,) rad by which the output shaft lags behind the input shaft's angle times the speed ratio, > 0 under a driving
    torque.
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
    remind(forces)
    return forces, sampled.lag.copy()
