"""Sound pressure of a moving surface."""

from __future__ import annotations

from typing import Any

import numpy as np

from nvhchain import acoustics
from nvhchain.acoustics import ENGINES, Adaptive, ExteriorProblem, Work
from nvhchain.case import Case
from nvhchain.chain.running import Run
from nvhchain.handoff import (
    FieldPressure,
    FloatArray,
    NoiseTransferFunctions,
    PressureHistory,
    Surface,
    TransferVectors,
)
from nvhchain.scene.steps import (
    BEARING_FORCES,
    FORCE_SPECTRUM,
    HOUSING,
    NOISE_TRANSFER_FUNCTIONS,
    PRESSURE,
    PRESSURE_HISTORY,
    SURFACE_VELOCITY,
    TRANSFER_VECTORS,
)

_FEW_LINES = 16
"""Largest number of lines that are solved directly; interpolation would need about as many masters."""

ROUNDING = 1e-9
"""Relative tolerance of the band: lines of a Fourier transform this far outside use its transfer vectors."""


def surroundings(run: Run) -> dict[str, Any]:
    """Air, engine and reflecting plane, for the keys of cached results."""
    return {"air": run.case.air, "engine": run.case.engine, "plane": run.case.reflecting_plane}


def exterior_problem(run: Run, surface: Surface) -> ExteriorProblem:
    """Radiating surface in its surroundings."""
    case, engine = run.case, ENGINES[run.case.engine]
    return ExteriorProblem(
        surface, air=case.air, plane=case.reflecting_plane, engine=engine, fidelity=run.fidelity.acoustics
    )


def speed_of(run: Run) -> float:
    """Input speed (rad/s) of the forces that move the surface; 0 without forces."""
    forces = run.get(FORCE_SPECTRUM)
    return forces.input_speed if forces is not None else 0.0


def band_of(case: Case, lines: FloatArray | None) -> tuple[float, float]:
    """Band (Hz) of the masters: that of the case, or that of lines more than rounding outside."""
    low, high = case.limits
    if lines is None or (lines[0] > low * (1 - ROUNDING) and lines[-1] < high * (1 + ROUNDING)):
        return low, high
    return min(low, float(lines[0])), max(high, float(lines[-1]))


def transfer_vectors(run: Run) -> TransferVectors:
    """Transfer vectors to the field points: at the lines if they are few, else at master frequencies of the band."""
    if run.case.running_up:
        return _vectors(run, run[HOUSING].surface, None)
    return _vectors(run, run[SURFACE_VELOCITY].surface, run[SURFACE_VELOCITY].frequency)


def transfer_vectors_ahead(run: Run) -> None:
    """Compute the transfer vectors of a gearbox before its forces are known, for a band with many lines.

    run: run with its housing. Lines outside the band, which few gearboxes have, take vectors of their own later.
    """
    band, (low, high) = run.gearbox.band, run.case.limits
    if TRANSFER_VECTORS in run.scene.steps and high - low > 2 * _FEW_LINES * band.resolution:
        _vectors(run, run[HOUSING].surface, None)


def _vectors(run: Run, surface: Surface, lines: FloatArray | None) -> TransferVectors:
    """Return transfer vectors at few lines, or at masters of the band for many or unknown ones."""
    points, where = _points(run.case), surroundings(run)
    band = (lines,) if lines is not None and len(lines) <= _FEW_LINES else band_of(run.case, lines)
    frequencies = band[0] if len(band) == 1 else Adaptive(*band)
    made: TransferVectors = run.cached_in_parts(
        TRANSFER_VECTORS,
        (surface, points, band, where),
        lambda progress, parts: exterior_problem(run, surface).transfer_vectors(
            points, frequencies, Work(run.executor, progress, parts)
        ),
    )
    return made


def _points(case: Case) -> FloatArray:
    return np.array([point.position for point in case.field_points])


def _names(case: Case) -> tuple[str, ...]:
    return tuple(point.name for point in case.field_points)


def pressure(run: Run) -> FieldPressure:
    """Sound pressure at the lines of the surface velocity.

    The equivalent radiated power gives a pressure without phase, the same in all directions.
    """
    velocity, speed, names = run[SURFACE_VELOCITY], speed_of(run), _names(run.case)
    made: FieldPressure
    if run.scene.spread_evenly:
        points, air, plane = _points(run.case), run.case.air, run.case.reflecting_plane
        made = run.cached(
            PRESSURE,
            (velocity, points, air, plane, speed, names),
            lambda progress: acoustics.equivalent_pressure(velocity, points, air, plane=plane).replace(
                input_speed=speed, point_names=names
            ),
        )
        return made
    vectors, knobs = run[TRANSFER_VECTORS], run.fidelity.acoustics
    made = run.cached(
        PRESSURE,
        (vectors, velocity, speed, names),
        lambda progress: acoustics.radiate(vectors, velocity, fidelity=knobs, progress=progress).replace(
            input_speed=speed, point_names=names
        ),
    )
    return made


def noise_transfer_functions(run: Run) -> NoiseTransferFunctions:
    """Pressure per bearing force over the band, at a line spacing that the housing's decay requires."""
    vectors, reduced, band = run[TRANSFER_VECTORS], run[HOUSING], run.gearbox.band
    decay = acoustics.decay_time(reduced, band.high)
    lines = acoustics.convolution_lines(run[BEARING_FORCES].sample_rate, band.high, decay)
    lines = lines[lines >= band.low]

    def compute(progress: Any) -> NoiseTransferFunctions:
        modal = acoustics.modal_transfer_vectors(
            vectors, reduced, lines, fidelity=run.fidelity.acoustics, progress=progress
        )
        return acoustics.noise_transfer_functions(modal, reduced)

    made: NoiseTransferFunctions = run.cached(NOISE_TRANSFER_FUNCTIONS, (vectors, reduced, lines), compute)
    return made


def pressure_history(run: Run) -> PressureHistory:
    """Sound pressure in time."""
    functions, forces, names = run[NOISE_TRANSFER_FUNCTIONS], run[BEARING_FORCES], _names(run.case)
    made: PressureHistory = run.cached(
        PRESSURE_HISTORY,
        (functions, forces, names),
        lambda progress: acoustics.run_up_pressure(functions, forces, progress=progress).replace(point_names=names),
    )
    return made
