"""Transfer vectors between their masters, whole or multiplied by shapes of the surface."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike

from nvhchain.acoustics.accuracy.interpolation_error import interpolation_accuracy
from nvhchain.acoustics.interpolation.nodes import Interpolant, check_lines, interpolant, line_batches, support
from nvhchain.acoustics.surfaces.surface import frequency_lines
from nvhchain.conventions import Progress
from nvhchain.errors import ResourceError
from nvhchain.fidelity import STANDARD, AcousticsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, TransferVectors
from nvhchain.kinds import checked
from nvhchain.runtime.memory import free_memory
from nvhchain.runtime.threads import blas_threads


@checked
def interpolate_vectors(
    atv: TransferVectors, frequency: ArrayLike, *, fidelity: AcousticsFidelity = STANDARD.acoustics
) -> TransferVectors:
    """Interpolate transfer vectors at lines between the masters, as `radiate` does.

    Returns vectors at the lines. The accuracy is that of `atv` with the interpolation error, as for
    `modal_transfer_vectors`. Results made from these vectors carry at least this error.
    """
    lines = frequency_lines(frequency)
    paths = 1 if atv.plane is None else 2
    check_memory(paths * 16 * len(lines) * atv.vectors[0].size, "transfer vectors at the lines")
    points, faces = atv.vectors.shape[1:]
    check_lines(atv.frequency, lines)
    smooth = interpolant(atv, fidelity)
    told = interpolation_accuracy(smooth, atv, lines, fidelity)
    vectors = np.empty((len(lines), paths * points, faces), dtype=complex)
    for piece, end, values in _pieces(smooth, lines):
        vectors[piece, end] = values
    image = None
    if atv.plane is not None:
        image = vectors[:, points:]
        vectors = vectors[:, :points] + image
    accuracy = atv.accuracy | told
    if accuracy.elements_per_wavelength is not None and lines[-1] > 0:
        finer = accuracy.elements_per_wavelength * float(atv.frequency[-1] / lines[-1])
        accuracy = accuracy.replace(elements_per_wavelength=finer, upper_frequency=float(lines[-1]))
    provenance = atv.provenance | {
        "stage": "acoustics.vectors_at",
        "fidelity": repr(fidelity),
        "masters": len(atv.frequency),
    }
    return TransferVectors(
        lines, atv.points, vectors, atv.surface, atv.air, atv.plane, image, accuracy, provenance=provenance
    )


def products(
    smooth: Interpolant, columns: FloatArray | ComplexArray, lines: FloatArray, points: int, progress: Progress | None
) -> ComplexArray:
    """Multiply transfer vectors by shapes at lines between the masters.

    smooth: interpolant of the transfer vectors.
    columns (n_face, n_column): real or complex normal velocity per unit of a column.
    lines (n_f,): lines (Hz) within the masters.
    points: number of field points, without mirror images.
    progress: function that receives the finished and the total number of lines.
    Returns (n_f, n_point, n_column): pressure (Pa) per unit of a column.

    Every line interpolates the vectors first and then multiplies. The removed phase differs from face to face, so that
    the product at the masters is no smooth function of frequency. The result equals `interpolate_vectors` times shapes.
    """
    check_memory(16 * len(lines) * points * columns.shape[1], "projected transfer vectors")
    real = not np.iscomplexobj(columns)
    product = np.zeros((len(lines), points, columns.shape[1]), dtype=complex)
    report = progress or (lambda done, total: None)
    report(0, len(lines))
    with blas_threads(1):  # pieces are small: a second thread takes more processor time than it saves
        for piece, end, values in _pieces(smooth, lines):
            point = end % points
            if real:  # half the work of a complex product
                product[piece, point].real += np.ascontiguousarray(values.real) @ columns
                product[piece, point].imag += np.ascontiguousarray(values.imag) @ columns
            else:
                product[piece, point] += values @ columns
            if point == points - 1:
                report(piece.stop, len(lines))
    return product


def check_memory(size: float, subject: str, remedy: str = "ask for fewer lines or field points") -> None:
    """Raise ResourceError unless `size` bytes of `subject` fit into free memory."""
    free = free_memory()
    if size > free:
        raise ResourceError(f"{subject} need {size / 2**30:.3g} GiB, {free / 2**30:.3g} GiB are free: {remedy}")


def _pieces(smooth: Interpolant, lines: FloatArray) -> Iterator[tuple[slice, int, ComplexArray]]:
    """Yield lines, a field point and its vectors (lines, n_face), piece by piece.

    With a plane, the mirror images of the field points follow the field points.
    """
    for end in range(len(smooth.atv.points)):
        values, distance = smooth.node_values(end), smooth.distance(end)
        for piece in line_batches(len(lines)):
            weights = smooth.weights(lines[piece])
            nodes = support(weights)
            phase = np.exp(-1j * smooth.wavenumber(lines[piece])[:, None] * distance)
            yield piece, end, weights[:, nodes] @ values[nodes] * phase
