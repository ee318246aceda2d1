"""Master frequencies of radiation resistance: as few as an error in dB allows."""

from __future__ import annotations

from concurrent.futures import Executor
from functools import partial

import numpy as np

from nvhchain.acoustics.bands import BAND
from nvhchain.acoustics.modal_power import waves_at_nodes, waves_nodes
from nvhchain.acoustics.multipoles import wave_reach
from nvhchain.acoustics.radiation_resistance import SurfaceShapes, radiation_resistance
from nvhchain.conventions import Air, Progress
from nvhchain.errors import SolverError, require
from nvhchain.fidelity import STANDARD, AcousticsFidelity
from nvhchain.handoff import FloatArray, RadiationResistance, RigidPlane

_FIRST = (2.0, 0.4)
"""Masters to begin with: the first plus the second times the wavenumber of the band times the reach of the surface from
the origin of the waves; two thirds of what 0.1 dB takes for a gearbox."""


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
) -> RadiationResistance:
    """Radiation resistance at as few masters as interpolation within `fidelity.master_tolerance_db` allows.

    The error of a column is the 2-norm of its waves' error relative to that of its waves, estimated half way between
    masters; where that of any column is larger than the tolerance a master is added.  The provenance keeps the largest
    (`estimated_error_db`).  Combinations of columns that cancel err more: `waves_power` says by how much.

    low, high: Hz, the band.  fidelity.masters: the most masters that may be taken.  The other arguments and errors are
    those of `radiation_resistance`; SolverError when the most masters do not reach the tolerance.
    """
    require(0 <= low < high, f"band {low:g}…{high:g} Hz is empty: give 0 ≤ low < high")
    tolerance, most = fidelity.master_tolerance_db, fidelity.masters
    require(most >= 2 * BAND, f"{most} masters are too few to choose from: allow {2 * BAND} at least")
    waves = 2 * np.pi * (high - low) / air.speed_of_sound * wave_reach(motion.surface, plane)
    new = np.linspace(low, high, min(most, BAND * max(2, int(np.ceil((_FIRST[0] + _FIRST[1] * waves) / BAND)))))
    report = progress or (lambda done, total: None)
    found: RadiationResistance | None = None
    while True:
        known = 0 if found is None else len(found.frequency)
        solved = radiation_resistance(
            motion, new, air=air, fidelity=fidelity, engine=engine, plane=plane, executor=executor,
            progress=partial(_report, report, known, most),
        )  # fmt: skip
        found = solved if found is None else _together(found, solved)
        middle = 0.5 * (found.frequency[1:] + found.frequency[:-1])
        error = _estimated_errors(found, middle, fidelity)
        decibel = 20 * np.log10(1 + error)
        if decibel.max() <= tolerance:
            break
        left = most - len(found.frequency)
        if left == 0:
            worst = int(error.argmax())
            raise SolverError(
                f"{most} masters leave an estimated error of {decibel[worst]:.2g} dB near {middle[worst]:.4g} Hz, "
                f"{tolerance:g} dB asked: allow more masters or a larger master_tolerance_db"
            )
        wanted = np.argsort(-error)[: min(left, max(1, np.count_nonzero(decibel > tolerance)))]
        new = np.sort(middle[wanted])
    report(len(found.frequency), len(found.frequency))
    return found.replace(provenance=found.provenance | {"estimated_error_db": float(decibel.max())})


def _report(report: Progress, known: int, most: int, done: int, _: int) -> None:
    report(known + done, most)


def _estimated_errors(resistance: RadiationResistance, lines: FloatArray, fidelity: AcousticsFidelity) -> FloatArray:
    """(n_f,) largest estimated error of a column's waves relative to them, 2-norms over the waves."""
    nodes = waves_nodes(resistance, fidelity)
    values = [waves_at_nodes(resistance, nodes, node) for node in range(len(nodes.node))]
    sets = np.concatenate([nodes.weights(lines)[None], nodes.error_weights(lines)])
    norms = np.zeros((3, len(lines), resistance.waves.shape[2]))
    for kind, line in np.ndindex(3, len(lines)):
        total = np.zeros(resistance.waves.shape[1:], dtype=complex)
        for node in np.flatnonzero(sets[kind, line]):
            total[: len(values[node])] += sets[kind, line, node] * values[node]
        norms[kind, line] = np.linalg.norm(total, axis=0)
    size = np.where(norms[0] > 0, norms[0], 1.0)
    return np.asarray((np.maximum(norms[1], norms[2]) / size).max(axis=1))


def _together(first: RadiationResistance, second: RadiationResistance) -> RadiationResistance:
    """Both sets of masters as one; a set that ends lower has fewer waves."""
    frequency = np.concatenate([first.frequency, second.frequency])
    order = np.argsort(frequency)
    rows = max(first.waves.shape[1], second.waves.shape[1])
    waves = [np.pad(one.waves, ((0, 0), (0, rows - one.waves.shape[1]), (0, 0))) for one in (first, second)]
    cancellation = [one.cancellation for one in (first, second) if one.cancellation is not None]
    return first.replace(
        frequency=frequency[order],
        waves=np.concatenate(waves)[order],
        cancellation=np.concatenate(cancellation)[order],
    )
