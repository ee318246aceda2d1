"""From the motion of the surface to sound."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from typing import Any

import numpy as np

from nvhchain import acoustics
from nvhchain.case import Case, GearboxCase
from nvhchain.fidelity import Fidelity
from nvhchain.files.shelf import Shelf
from nvhchain.handoff import (
    BearingForces,
    FieldPressure,
    FloatArray,
    ForceSpectrum,
    NoiseTransferFunctions,
    PressureHistory,
    ReducedHousing,
    Surface,
    SurfaceVelocity,
    TransferVectors,
)

_FEW_LINES = 16
"""So many lines are solved as they are: masters between which they could be interpolated would hardly be fewer."""


ROUNDING = 1e-9
"""Relative; lines of a Fourier transform that pass the band's edge by less share the transfer vectors of the band."""


def transfer_vectors(
    case: Case,
    surface: Surface,
    lines: FloatArray | None,
    fidelity: Fidelity,
    shelf: Shelf,
    executor: Executor | None,
) -> TransferVectors:
    """Transfer vectors to the field points at master frequencies.  lines: (n_f,) Hz wanted; None: the whole band."""
    points = _points(case)
    where: dict[str, Any] = {"air": case.air, "engine": case.engine, "plane": case.reflecting_plane}
    if lines is not None and len(lines) <= _FEW_LINES:
        frequencies: tuple[Any, ...] = (lines,)
        compute: Callable[..., TransferVectors] = acoustics.transfer_vectors
    else:
        frequencies = span(case, lines)
        compute = acoustics.adaptive_transfer_vectors
    return shelf.stage_in_parts(
        "transfer_vectors-{key}",
        TransferVectors,
        "acoustics",
        (surface, points, frequencies, where),
        lambda progress, parts: compute(
            surface,
            points,
            *frequencies,
            **where,
            fidelity=fidelity.acoustics,
            executor=executor,
            progress=progress,
            shards=parts,
        ),
        fidelity=fidelity.acoustics,
    )


def span(case: Case, lines: FloatArray | None) -> tuple[float, float]:
    """Hz that the masters span: the band of the case, or the lines where those pass it by more than rounding."""
    if isinstance(case, GearboxCase):
        low, high = case.band.low, case.band.high
        if lines is None or (lines[0] > low * (1 - ROUNDING) and lines[-1] < high * (1 + ROUNDING)):
            return low, high
        return min(low, float(lines[0])), max(high, float(lines[-1]))
    assert lines is not None
    return float(lines[0]), float(lines[-1])


def _points(case: Case) -> FloatArray:
    return np.array([point.position for point in case.field_points])


def equivalent_pressure(
    case: Case, velocity: SurfaceVelocity, forces: ForceSpectrum | None, shelf: Shelf
) -> FieldPressure:
    """Level without phase of the equivalent radiated power, spread evenly."""
    speed = forces.input_speed if forces is not None else 0.0
    return shelf.stage(
        "pressure",
        FieldPressure,
        "acoustics",
        (velocity, _points(case), case.air, case.reflecting_plane, speed),
        lambda progress: acoustics.equivalent_pressure(
            velocity, _points(case), case.air, plane=case.reflecting_plane
        ).replace(input_speed=speed),
        fidelity=None,
    )


def pressure(
    vectors: TransferVectors,
    velocity: SurfaceVelocity,
    forces: ForceSpectrum | None,
    fidelity: Fidelity,
    shelf: Shelf,
) -> FieldPressure:
    """Sound pressure at the lines of the surface velocity."""
    speed = forces.input_speed if forces is not None else 0.0
    return shelf.stage(
        "pressure",
        FieldPressure,
        "acoustics",
        (vectors, velocity, speed),
        lambda progress: acoustics.radiate(vectors, velocity, fidelity=fidelity.acoustics, progress=progress).replace(
            input_speed=speed
        ),
        fidelity=fidelity.acoustics,
    )


def noise_transfer_functions(
    case: GearboxCase,
    vectors: TransferVectors,
    reduced: ReducedHousing,
    forces: BearingForces,
    fidelity: Fidelity,
    shelf: Shelf,
) -> NoiseTransferFunctions:
    """Pressure per bearing force over the band, at lines as close as the housing's decay asks for."""
    lines = acoustics.convolution_lines(
        forces.sample_rate, case.band.high, acoustics.decay_time(reduced, case.band.high)
    )
    lines = lines[lines >= case.band.low]

    def compute(progress: Any) -> NoiseTransferFunctions:
        modal = acoustics.modal_transfer_vectors(
            vectors, reduced, lines, fidelity=fidelity.acoustics, progress=progress
        )
        return acoustics.noise_transfer_functions(modal, reduced)

    return shelf.stage(
        "noise_transfer_functions-{key}",
        NoiseTransferFunctions,
        "acoustics",
        (vectors, reduced, lines),
        compute,
        fidelity=fidelity.acoustics,
    )


def pressure_history(functions: NoiseTransferFunctions, forces: BearingForces, shelf: Shelf) -> PressureHistory:
    """Sound pressure in time."""
    return shelf.stage(
        "pressure_history",
        PressureHistory,
        "acoustics",
        (functions, forces),
        lambda progress: acoustics.run_up_pressure(functions, forces, progress=progress),
        fidelity=None,
    )
