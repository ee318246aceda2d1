"""Pressure per mode and per bearing force of a reduced housing: a new load case costs a dot product."""

from __future__ import annotations

from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from nvhchain.acoustics.accuracy.interpolation_error import STATED, told_vectors
from nvhchain.acoustics.interpolation.nodes import check_lines, interpolant
from nvhchain.acoustics.radiation.projection import products
from nvhchain.acoustics.surfaces.surface import frequency_lines
from nvhchain.conventions import Progress
from nvhchain.errors import InputError, require
from nvhchain.fidelity import STANDARD, AcousticsFidelity
from nvhchain.handoff import (
    ComplexArray,
    FieldPressure,
    FloatArray,
    ForceSpectrum,
    IntArray,
    ModalTransferVectors,
    NoiseTransferFunctions,
    ReducedHousing,
    TransferVectors,
)
from nvhchain.kinds import checked

_TOLD = ("fidelity", *chain.from_iterable(STATED))
"""Of an operator's provenance, what holds for what is made from it."""

_SAME_LINE = 1e-9
"""Frequencies that differ by less, relative to the highest, are one line: rounding of a Fourier transform's axis."""


@checked
def modal_transfer_vectors(
    atv: TransferVectors,
    housing: ReducedHousing,
    frequency: ArrayLike,
    *,
    fidelity: AcousticsFidelity = STANDARD.acoustics,
    progress: Progress | None = None,
) -> ModalTransferVectors:
    """Transfer vectors times normal shapes and residual motion of the housing, at the lines of a load case.

    frequency: (n_f,) Hz, increasing, within the masters of `atv`.  Beyond the vectors (`expected_error_dB`, kept from
    them) only interpolation between masters errs (`project`).  The provenance keeps by how much at most
    (`interpolation_error_dB`), relative to the transfer vector of the same line and point, both as 2-norms over the
    faces and, with a plane, over the direct and the reflected part: what motions suffer in the mean that are alike on
    all faces and random in phase; those whose parts cancel suffer more (`radiate` tells it of a surface velocity).
    AccuracyWarning where it exceeds `fidelity.master_tolerance_db`.  In the same norm it keeps what resonances that the
    mesh misses make of the vectors, and warns of it, as `radiate` does.
    Raises InputError when the housing radiates from another surface or a line lies outside the masters, ResourceError.
    """
    _check_surface(atv, housing)
    lines = frequency_lines(frequency)
    check_lines(atv, lines)
    modes, bearings = len(housing.natural_frequency), len(housing.names)
    shapes = np.concatenate([housing.normal_shapes, housing.face_residual.reshape(3 * bearings, -1)])
    smooth = interpolant(atv, fidelity)
    made = {"stage": "acoustics.modal_transfer_vectors", "fidelity": repr(fidelity)}
    provenance = made | told_vectors(smooth, atv, lines, fidelity)
    product = products(smooth, shapes.T, lines, len(atv.points), progress)
    return ModalTransferVectors(
        lines,
        atv.points,
        product[:, :, :modes],
        housing.residual_gain() * product[:, :, modes:].reshape(len(lines), len(atv.points), bearings, 3),
        housing.names,
        housing.content_hash,
        atv.air,
        provenance=provenance,
    )


@checked
def noise_transfer_functions(modal: ModalTransferVectors, housing: ReducedHousing) -> NoiseTransferFunctions:
    """Pressure per bearing force, jω (Σ_r modes_r φ_r(seat)/(ω_r² − ω² + 2jζ_rω_rω) + residual), Pa/N.

    housing: the one whose shapes `modal` holds.  Raises InputError for another one.
    """
    _check_housing(modal, housing)
    rate = 2j * np.pi * modal.frequency[:, None, None]
    weighted = modal.modes * housing.receptance(modal.frequency)[:, None, :]
    flat = weighted.reshape(weighted.shape[0] * weighted.shape[1], weighted.shape[2])
    seats = housing.seat_shapes.reshape(flat.shape[1], 3 * len(housing.names))
    compliant = (flat.real @ seats + 1j * (flat.imag @ seats)).reshape(*weighted.shape[:2], seats.shape[1])
    functions = rate * (compliant + modal.residual.reshape(compliant.shape))
    return NoiseTransferFunctions(
        modal.frequency,
        modal.points,
        functions.reshape(modal.residual.shape),
        modal.names,
        modal.air,
        provenance={"stage": "acoustics.noise_transfer_functions"} | told_of(modal),
    )


@checked
def modal_pressure(
    modal: ModalTransferVectors, housing: ReducedHousing, force_spectrum: ForceSpectrum
) -> FieldPressure:
    """Sound pressure under bearing forces from modal transfer vectors, p = modes · q̇ + residual · jωF.

    The same as forced response and `radiate` one after the other, at the lines that carry force; they must be among
    those of `modal`.  What a mesh errs by where parts of the motion cancel each other is told by `radiate` alone, which
    sees it on the faces.  Raises InputError otherwise, and for another housing or other bearings.
    """
    _check_housing(modal, housing)
    force, loaded, rows = _loaded(force_spectrum, modal.names, modal.frequency)
    rate = 2j * np.pi * force_spectrum.frequency[loaded, None] * force
    seats = housing.seat_shapes.reshape(len(housing.natural_frequency), 3 * len(housing.names))
    velocity = (rate @ seats.T) * housing.receptance(force_spectrum.frequency[loaded])
    residual = modal.residual.reshape(*modal.residual.shape[:2], -1)
    pressure = _products(modal.modes, velocity, rows) + _products(residual, rate, rows)
    return _field(modal, force_spectrum, loaded, pressure, "modal_pressure")


@checked
def transfer_pressure(functions: NoiseTransferFunctions, force_spectrum: ForceSpectrum) -> FieldPressure:
    """Sound pressure under bearing forces from noise transfer functions, p = functions · F.

    The lines that carry force must be among those of `functions`.  Raises InputError otherwise and for other bearings.
    """
    force, loaded, rows = _loaded(force_spectrum, functions.names, functions.frequency)
    values = functions.functions.reshape(*functions.functions.shape[:2], -1)
    return _field(functions, force_spectrum, loaded, _products(values, force, rows), "transfer_pressure")


def _products(operator: ComplexArray, load: ComplexArray, rows: IntArray | slice) -> ComplexArray:
    """Σ_c operator (row of the line, point, c) · load (line, c): (n_line, n_point)."""
    return np.asarray(np.matmul(operator[rows], load[:, :, None])[:, :, 0])


def _loaded(
    spectrum: ForceSpectrum, names: tuple[str, ...], lines: FloatArray
) -> tuple[ComplexArray, IntArray, IntArray | slice]:
    """Force (n, 3 n_bearing) N at the lines that carry any, these lines, and where the operator has them."""
    force = spectrum.in_order(names)
    loaded = np.flatnonzero(force.any(axis=1))
    if loaded.size == 0:
        loaded = np.array([0])  # no force anywhere: one line of zeros
    wanted = spectrum.frequency[loaded]
    rows = np.clip(np.searchsorted(lines, wanted), 1, max(1, len(lines) - 1))
    rows = np.minimum(rows, len(lines) - 1)
    rows -= np.abs(wanted - lines[rows - 1]) < np.abs(wanted - lines[rows])
    missing = wanted[np.abs(lines[rows] - wanted) > _SAME_LINE * wanted[-1]]
    require(
        len(missing) == 0,
        f"{len(missing)} lines with force ({missing.min(initial=np.inf):.6g}…{missing.max(initial=0.0):.6g} Hz) "
        f"are not among the operator's {len(lines)} lines ({lines[0]:.6g}…{lines[-1]:.6g} Hz): "
        "make it at the lines of the load",
    )
    whole = np.array_equal(rows, np.arange(len(lines)))
    return force[loaded], loaded, slice(None) if whole else rows


def _field(
    operator: ModalTransferVectors | NoiseTransferFunctions,
    spectrum: ForceSpectrum,
    loaded: IntArray,
    pressure: ComplexArray,
    stage: str,
) -> FieldPressure:
    return FieldPressure(
        spectrum.frequency[loaded],
        operator.points,
        pressure,
        spectrum.input_speed,
        provenance={"stage": f"acoustics.{stage}"} | told_of(operator),
    )


def told_of(operator: ModalTransferVectors | NoiseTransferFunctions) -> dict[str, Any]:
    """What the provenance of an operator says of what is made from it."""
    return {name: operator.provenance[name] for name in _TOLD if name in operator.provenance}


def _check_surface(atv: TransferVectors, housing: ReducedHousing) -> None:
    if atv.surface.content_hash != housing.surface.content_hash:
        raise InputError(
            f"transfer vectors belong to another surface ({len(atv.surface.triangles)} triangles) than the reduced "
            f"housing ({len(housing.surface.triangles)} triangles): compute both on the same one"
        )


def _check_housing(modal: ModalTransferVectors, housing: ReducedHousing) -> None:
    if modal.housing != housing.content_hash:
        raise InputError(
            f"modal transfer vectors belong to another housing ({modal.housing[:12]}) than the one given "
            f"({housing.content_hash[:12]}): make them from this one"
        )
