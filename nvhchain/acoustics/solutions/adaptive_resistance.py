"""Master frequencies of radiation resistance: as few as an error in dB allows."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from nvhchain.acoustics.interpolation.adaptive import KNOBS, check_band, choose_masters, first_masters, squared_norms
from nvhchain.acoustics.interpolation.nodes import Nodes
from nvhchain.acoustics.radiation.modal_power import waves_at_nodes, waves_nodes
from nvhchain.acoustics.solutions.radiation_resistance import SurfaceShapes, radiation_resistance
from nvhchain.acoustics.solutions.transfer_vectors import made_by
from nvhchain.acoustics.waves.multipoles import path_reach
from nvhchain.conventions import Air, Progress
from nvhchain.fidelity import STANDARD, AcousticsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, RadiationResistance, RigidPlane
from nvhchain.kinds import checked

_PER_WAVE = 0.2
"""Masters to begin with, beside two, over the wavenumber of the band times twice the reach of the surface from the
origin of the waves; two thirds of what 0.1 dB takes for a gearbox."""


@checked
def adaptive_radiation_resistance(
    motion: SurfaceShapes,
    low: float,
    high: float,
    *,
    air: Air = Air(),  # noqa: B008 (frozen)
    fidelity: AcousticsFidelity = STANDARD.acoustics,
    engine: str = "fused",
    plane: RigidPlane | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
    shards: str | Path | None = None,
) -> RadiationResistance:
    """Radiation resistance at as few masters, from five up, as an error of `fidelity.master_tolerance_db` allows.

    The error of a column is the 2-norm of its waves' error relative to that of its waves, the worst of the columns.
    `choose_masters` says how masters are added and tested, and `adaptive_transfer_vectors` what no master shows and
    what the provenance keeps (`estimated_error_db`, `tested_error_db`, `missed_width`).  Combinations of columns that
    cancel err more: `waves_power` says by how much.

    low, high: Hz, the band.  fidelity.masters: the most masters that may be taken.  The other arguments and errors are
    those of `radiation_resistance`; SolverError when the most masters do not reach the tolerance.
    """
    check_band(low, high, fidelity)
    solve = partial(
        radiation_resistance, motion, air=air, fidelity=fidelity, engine=engine, plane=plane, executor=executor,
        shards=shards,
    )  # fmt: skip
    waves = 2 * np.pi * (high - low) / air.speed_of_sound * 2 * path_reach(motion.surface, plane)
    first = first_masters(low, high, waves, _PER_WAVE, fidelity)
    chosen = choose_masters(_Waves(solve, fidelity), first, fidelity, progress)
    knobs = ("multipole_digits", *KNOBS)
    made = made_by("adaptive_radiation_resistance", fidelity, engine, knobs, chosen.records)
    return chosen.found.replace(provenance=chosen.found.provenance | made | chosen.told)


@dataclass(frozen=True, eq=False)
class _WavesBetween(Nodes):
    """Waves between masters."""

    resistance: RadiationResistance

    def at_nodes(self) -> ComplexArray:
        """(n_column, n_node, n_row)."""
        values = np.zeros((len(self.node), *self.resistance.waves.shape[1:]), dtype=complex)
        for node in range(len(values)):
            waves = waves_at_nodes(self.resistance, self, node)
            values[node, : len(waves)] = waves
        return values.transpose(2, 0, 1)


@dataclass(frozen=True, eq=False)
class _Waves:
    """Radiation resistance as what masters are chosen for.  solved_at: `radiation_resistance` of frequencies."""

    solved_at: Callable[..., RadiationResistance]
    fidelity: AcousticsFidelity

    def solve(self, frequency: FloatArray, progress: Progress) -> RadiationResistance:
        return self.solved_at(frequency, progress=progress)

    def together(self, first: RadiationResistance, second: RadiationResistance) -> RadiationResistance:
        return _together(first, second)

    def interpolant(self, found: RadiationResistance) -> _WavesBetween:
        return _WavesBetween(**vars(waves_nodes(found, self.fidelity)), resistance=found)

    def estimated_errors(self, smooth: _WavesBetween, lines: FloatArray) -> FloatArray:
        return _largest(smooth, smooth.weights(lines), smooth.error_weights(lines))

    def changes(self, smooth: _WavesBetween, lines: FloatArray, masters: FloatArray) -> FloatArray:
        return _largest(smooth, smooth.weights(lines), smooth.change_weights(lines, masters)[None])

    def misprediction(self, smooth: _WavesBetween, solved: RadiationResistance) -> float:
        weights = smooth.weights(solved.frequency)
        values = np.tensordot(weights, smooth.at_nodes(), axes=(1, 1)).transpose(0, 2, 1)
        truth, found = _alike(solved.waves, values)
        wrong, size = np.linalg.norm(found - truth, axis=1), np.linalg.norm(truth, axis=1)
        return float((wrong / np.where(size > 0, size, 1.0)).max())


def _largest(smooth: _WavesBetween, whole: ComplexArray, parts: ComplexArray) -> FloatArray:
    """Largest of the parts (n_part, n_f, n_node) relative to the whole (n_f, n_node), both as weights of the values at
    the nodes: (n_f,), the worst of the columns."""
    worst = np.zeros(len(whole))
    for values in smooth.at_nodes():
        gram = values.conj() @ values.T
        size = squared_norms(whole, gram)
        part = squared_norms(parts, gram).max(axis=0)
        worst = np.maximum(worst, np.sqrt(part / np.where(size > 0, size, 1.0)))
    return worst


def _alike(*waves: ComplexArray) -> list[ComplexArray]:
    """Waves (n_f, n_row, n_column) with as many rows; a set that ends lower has fewer."""
    rows = max(one.shape[1] for one in waves)
    return [np.pad(one, ((0, 0), (0, rows - one.shape[1]), (0, 0))) for one in waves]


def _together(first: RadiationResistance, second: RadiationResistance) -> RadiationResistance:
    """Both sets of masters as one."""
    frequency = np.concatenate([first.frequency, second.frequency])
    order = np.argsort(frequency)
    cancellation = [one.cancellation for one in (first, second) if one.cancellation is not None]
    return first.replace(
        frequency=frequency[order],
        waves=np.concatenate(_alike(first.waves, second.waves))[order],
        cancellation=np.concatenate(cancellation)[order],
    )
