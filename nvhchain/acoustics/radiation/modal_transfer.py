"""Pressure per mode and per bearing force of a reduced housing: a new load case costs a dot product."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from nvhchain.acoustics.accuracy.interpolation_error import interpolation_accuracy
from nvhchain.acoustics.interpolation.nodes import check_lines, interpolant
from nvhchain.acoustics.radiation.modal_power import loaded_lines, modal_motion
from nvhchain.acoustics.radiation.projection import products
from nvhchain.acoustics.surfaces.surface import frequency_lines
from nvhchain.conventions import Progress
from nvhchain.errors import InputError, counted, require
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

_SAME_LINE = 1e-9
"""Largest difference of frequencies that count as one line, relative to the highest: rounding of a Fourier axis."""


@checked
def modal_transfer_vectors(
    atv: TransferVectors,
    housing: ReducedHousing,
    frequency: ArrayLike,
    *,
    fidelity: AcousticsFidelity = STANDARD.acoustics,
    progress: Progress | None = None,
) -> ModalTransferVectors:
    """Compute transfer vectors times normal shapes and residual motion of the housing, at the lines of a load case.

    Parameters
    ----------
    atv : TransferVectors
        Transfer vectors of the housing's surface at the masters.
    housing : ReducedHousing
        Modes and residual motions of the housing.
    frequency : (n_f,) array
        Lines (Hz), increasing, within the masters of `atv`.
    fidelity : AcousticsFidelity
        Accuracy settings.
    progress : Progress, optional
        Function that receives the finished and the total number of lines.

    Returns
    -------
    ModalTransferVectors
        Pressure per mode and per residual motion. The accuracy states `expected_error_db` of the vectors and
        `interpolation_error_db`, the largest interpolation error. It also holds the effect of resonances that the mesh
        misses, as for `radiate`.

    Raises
    ------
    InputError
        If the housing radiates from another surface or a line lies outside the masters.
    ResourceError
        If the result does not fit into free memory.

    Warns
    -----
    AccuracyWarning
        If the interpolation error exceeds `fidelity.master_tolerance_db`, and for missed resonances.

    Notes
    -----
    Beyond the error of the vectors, only interpolation between masters errs. Its error is relative to the
    transfer vector of the same line and point. Both are 2-norms over the faces and, with a plane, over the direct and
    the reflected part. This is the mean error of motions that are alike on all faces and random in phase. Motions whose
    parts cancel each other have larger errors; `radiate` estimates them for a surface velocity.
    """
    _check_surface(atv, housing)
    lines = frequency_lines(frequency)
    check_lines(atv.frequency, lines)
    modes, seats = len(housing.natural_frequency), (len(housing.names), housing.motions)
    shapes = np.concatenate([housing.normal_shapes, housing.flat_residual])
    smooth = interpolant(atv, fidelity)
    told = interpolation_accuracy(smooth, atv, lines, fidelity)
    product = products(smooth, shapes.T, lines, len(atv.points), progress)
    return ModalTransferVectors(
        lines,
        atv.points,
        product[:, :, :modes],
        housing.residual_gain() * product[:, :, modes:].reshape(len(lines), len(atv.points), *seats),
        housing.names,
        housing.content_hash,
        atv.air,
        told,
        provenance={"stage": "acoustics.modal_transfer_vectors", "fidelity": repr(fidelity)},
    )


@checked
def noise_transfer_functions(modal: ModalTransferVectors, housing: ReducedHousing) -> NoiseTransferFunctions:
    """Compute pressure per bearing force: jω (Σ_r modes_r φ_r(seat)/(ω_r² − ω² + 2jζ_rω_rω) + residual).

    Parameters
    ----------
    modal : ModalTransferVectors
        Pressure per mode and per residual motion.
    housing : ReducedHousing
        Housing from which `modal` was computed.

    Returns
    -------
    NoiseTransferFunctions
        Functions in Pa/N.

    Raises
    ------
    InputError
        If `modal` was computed from another housing.
    """
    _check_housing(modal, housing)
    rate = 2j * np.pi * modal.frequency[:, None, None]
    weighted = modal.modes * housing.receptance(modal.frequency)[:, None, :]
    flat = weighted.reshape(weighted.shape[0] * weighted.shape[1], weighted.shape[2])
    seats = housing.flat_shapes
    compliant = (flat.real @ seats + 1j * (flat.imag @ seats)).reshape(*weighted.shape[:2], seats.shape[1])
    functions = rate * (compliant + modal.residual.reshape(compliant.shape))
    return NoiseTransferFunctions(
        modal.frequency,
        modal.points,
        functions.reshape(modal.residual.shape),
        modal.names,
        modal.air,
        modal.accuracy,
        provenance=modal.provenance | {"stage": "acoustics.noise_transfer_functions"},
    )


@checked
def modal_pressure(
    modal: ModalTransferVectors, housing: ReducedHousing, force_spectrum: ForceSpectrum
) -> FieldPressure:
    """Compute sound pressure under bearing forces from modal transfer vectors: p = modes · q̇ + residual · jωF.

    Parameters
    ----------
    modal, housing
        As in `noise_transfer_functions`.
    force_spectrum : ForceSpectrum
        Bearing forces (N). Lines that carry force must be lines of `modal`.

    Returns
    -------
    FieldPressure
        Pressure (Pa) at the lines that carry force.

    Raises
    ------
    InputError
        If a line is missing, or the housing or the bearings differ.

    Notes
    -----
    The result equals a forced response followed by `radiate`. Only `radiate` estimates the mesh error of parts of a
    motion that cancel each other, as it has the velocities of the faces.
    """
    _check_housing(modal, housing)
    force, loaded, rows = _loaded(force_spectrum, modal.names, housing.motions, modal.frequency)
    rate, velocity = modal_motion(housing, force_spectrum.frequency[loaded], force)
    residual = modal.residual.reshape(*modal.residual.shape[:2], -1)
    pressure = _products(modal.modes, velocity, rows) + _products(residual, rate, rows)
    return _field(modal, force_spectrum, loaded, pressure, "modal_pressure")


@checked
def transfer_pressure(functions: NoiseTransferFunctions, force_spectrum: ForceSpectrum) -> FieldPressure:
    """Compute sound pressure under bearing forces from noise transfer functions: p = functions · F.

    functions: pressure per bearing force (Pa/N).
    force_spectrum: bearing forces (N). Lines that carry force must be lines of `functions`.
    Returns pressure (Pa) at the lines that carry force.
    """
    motions = functions.functions.shape[3]
    force, loaded, rows = _loaded(force_spectrum, functions.names, motions, functions.frequency)
    values = functions.functions.reshape(*functions.functions.shape[:2], -1)
    return _field(functions, force_spectrum, loaded, _products(values, force, rows), "transfer_pressure")


def _products(operator: ComplexArray, load: ComplexArray, rows: IntArray | slice) -> ComplexArray:
    """Return Σ_c operator (row of the line, point, c) · load (line, c): (n_line, n_point)."""
    return np.asarray(np.matmul(operator[rows], load[:, :, None])[:, :, 0])


def _loaded(
    spectrum: ForceSpectrum, names: tuple[str, ...], motions: int, lines: FloatArray
) -> tuple[ComplexArray, IntArray, IntArray | slice]:
    """Return the force (n, …) at lines that carry any, these lines, and their rows in the operator."""
    force = spectrum.sort_bearings(names, motions)
    loaded = loaded_lines(force)
    wanted = spectrum.frequency[loaded]
    rows = np.clip(np.searchsorted(lines, wanted), 1, max(1, len(lines) - 1))
    rows = np.minimum(rows, len(lines) - 1)
    rows -= np.abs(wanted - lines[rows - 1]) < np.abs(wanted - lines[rows])
    missing = wanted[np.abs(lines[rows] - wanted) > _SAME_LINE * wanted[-1]]
    require(
        len(missing) == 0,
        f"{counted(len(missing), 'line')} with force ({missing.min(initial=np.inf):.6g}…{missing.max(initial=0.0):.6g} "
        f"Hz) missing among the operator's {counted(len(lines), 'line')} ({lines[0]:.6g}…{lines[-1]:.6g} Hz): "
        "make it at the lines of the load",
    )
    whole = np.array_equal(rows, np.arange(len(lines)))
    return force[loaded], loaded, slice(None) if whole else rows


def _field(
    operator: ModalTransferVectors | NoiseTransferFunctions,
    spectrum: ForceSpectrum,
    loaded: IntArray,
    pressure: ComplexArray,
    step: str,
) -> FieldPressure:
    return FieldPressure(
        spectrum.frequency[loaded],
        operator.points,
        pressure,
        spectrum.input_speed,
        operator.accuracy,
        provenance=operator.provenance | {"stage": f"acoustics.{step}"},
    )


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
