"""Sound pressure of a moving surface."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from nvhchain import acoustics
from nvhchain.case import Case
from nvhchain.chain.running import Run
from nvhchain.handoff import (
    FieldPressure,
    FloatArray,
    NoiseTransferFunctions,
    PressureHistory,
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
"""So many lines are solved as they are: masters between which they could be interpolated would hardly be fewer."""

ROUNDING = 1e-9
"""Relative; lines of a Fourier transform that pass the band's edge by less share the transfer vectors of the band."""


def surroundings(run: Run) -> dict[str, Any]:
    """Air, engine and reflecting plane, as arguments of the acoustics."""
    return {"air": run.case.air, "engine": run.case.engine, "plane": run.case.reflecting_plane}


def speed_of(run: Run) -> float:
    """Input speed (rad/s) of the forces that move the surface; 0 where none are known."""
    forces = run.get(FORCE_SPECTRUM)
    return forces.input_speed if forces is not None else 0.0


def band_of(case: Case, lines: FloatArray | None) -> tuple[float, float]:
    """Band (Hz) of the masters: that of the case, or of lines that pass it by more than rounding."""
    low, high = case.limits
    if lines is None or (lines[0] > low * (1 - ROUNDING) and lines[-1] < high * (1 + ROUNDING)):
        return low, high
    return min(low, float(lines[0])), max(high, float(lines[-1]))


def transfer_vectors(run: Run) -> TransferVectors:
    """Transfer vectors to the field points: at few lines themselves, else at master frequencies of the band."""
    points, where, lines = _points(run.case), surroundings(run), None
    if run.case.running_up:
        surface = run[HOUSING].surface
    else:
        surface, lines = run[SURFACE_VELOCITY].surface, run[SURFACE_VELOCITY].frequency
    if lines is not None and len(lines) <= _FEW_LINES:
        frequencies: tuple[Any, ...] = (lines,)
        compute: Callable[..., TransferVectors] = acoustics.transfer_vectors
    else:
        frequencies = band_of(run.case, lines)
        compute = acoustics.adaptive_transfer_vectors
    made: TransferVectors = run.cached_in_parts(
        TRANSFER_VECTORS,
        (surface, points, frequencies, where),
        lambda progress, parts: compute(
            surface,
            points,
            *frequencies,
            **where,
            fidelity=run.fidelity.acoustics,
            executor=run.executor,
            progress=progress,
            shards=parts,
        ),
    )
    return made


def _points(case: Case) -> FloatArray:
    return np.array([point.position for point in case.field_points])


def pressure(run: Run) -> FieldPressure:
    """Sound pressure at the lines of the surface velocity.

    At the level of the equivalent radiated power it has no phase and is spread evenly.
    """
    velocity, speed = run[SURFACE_VELOCITY], speed_of(run)
    made: FieldPressure
    if run.scene.spread_evenly:
        points, air, plane = _points(run.case), run.case.air, run.case.reflecting_plane
        made = run.cached(
            PRESSURE,
            (velocity, points, air, plane, speed),
            lambda progress: acoustics.equivalent_pressure(velocity, points, air, plane=plane).replace(
                input_speed=speed
            ),
        )
        return made
    vectors, knobs = run[TRANSFER_VECTORS], run.fidelity.acoustics
    made = run.cached(
        PRESSURE,
        (vectors, velocity, speed),
        lambda progress: acoustics.radiate(vectors, velocity, fidelity=knobs, progress=progress).replace(
            input_speed=speed
        ),
    )
    return made


def noise_transfer_functions(run: Run) -> NoiseTransferFunctions:
    """Pressure per bearing force over the band, at lines as close as the housing's decay asks for."""
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
    functions, forces = run[NOISE_TRANSFER_FUNCTIONS], run[BEARING_FORCES]
    made: PressureHistory = run.cached(
        PRESSURE_HISTORY,
        (functions, forces),
        lambda progress: acoustics.run_up_pressure(functions, forces, progress=progress),
    )
    return made
