"""Cost and level of spectral lines below the remains of the integrator's start.

    python -m benchmarks silent_lines OUT

Writes docs/measured/acoustics/silent_lines.md. OUT is that of benchmarks/chain/error_band.py. For every case that was
run there at `standard`, velocity and pressure are computed again: at all lines, and at those with a bearing force above
`settle_level` times the strongest.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

from benchmarks.chain.error_band import computed, there
from benchmarks.chain.error_band_cases import fitted, held_out
from benchmarks.publish import publish
from nvhchain import levels
from nvhchain.acoustics import radiate
from nvhchain.case import GearboxCase
from nvhchain.handoff import FieldPressure, ForceSpectrum, ReducedHousing, TransferVectors
from nvhchain.housing import respond

PRESET = "standard"
REPEATS = 5


def row(case: GearboxCase, out: Path) -> str:
    """Return the row of one case."""
    run = computed(case, PRESET, out)
    spectrum, housing, vectors = run.force_spectrum, run.housing, run.transfer_vectors
    assert spectrum is not None
    assert housing is not None
    assert vectors is not None
    size = np.abs(spectrum.force).max(axis=(1, 2))
    loud = size > run.fidelity.dynamics.settle_level * size.max()
    kept = ForceSpectrum(spectrum.frequency, spectrum.force * loud[:, None, None], spectrum.names, spectrum.input_speed)
    (whole, all_seconds), (less, loud_seconds) = (sound(housing, of, vectors) for of in (spectrum, kept))
    change = levels.overall(whole.frequency, whole.pressure) - levels.overall(less.frequency, less.pressure)
    silent = 20 * np.log10(size[~loud].max() / size.max()) if not loud.all() else None
    return (
        f"| {case.name} | {len(loud)} | {loud.sum()} | {'' if silent is None else f'{silent:.0f}'} | "
        f"{20 * np.log10(size[loud].min() / size.max()):.0f} | {1e3 * all_seconds:.0f} | {1e3 * loud_seconds:.0f} | "
        f"{len(vectors.frequency)} | {np.abs(change).max():.1g} |"
    )


def sound(housing: ReducedHousing, spectrum: ForceSpectrum, vectors: TransferVectors) -> tuple[FieldPressure, float]:
    """Return the pressure, and the least processor seconds of several runs from the forces to it."""
    taken = []
    for _ in range(REPEATS):
        begun = time.process_time()
        pressure = radiate(vectors, respond(housing, spectrum))
        taken.append(time.process_time() - begun)
    return pressure, min(taken)


def main() -> None:
    """Measure all existing cases and publish the page."""
    out = Path(sys.argv[1])
    head = (
        "| case | lines | with force | loudest without / dB | weakest with / dB | all lines / ms | with force / ms | "
        "masters | dB(A) |\n|---|---:|---:|---:|---:|---:|---:|---:|---:|\n"
    )
    rows = [row(case, out) for case in (*fitted(), *held_out()) if there(case, out)]
    publish("acoustics/silent_lines", head + "\n".join(rows) + "\n")


if __name__ == "__main__":
    main()
