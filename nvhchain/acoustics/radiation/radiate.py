"""Sound pressure of a vibrating surface from its acoustic transfer vectors."""

from __future__ import annotations

import numpy as np

from nvhchain.acoustics.accuracy.cancellation import (
    ESTIMATE,
    cancellation_accuracy,
    cancellation_of_motion,
    heard,
    short_waves,
)
from nvhchain.acoustics.accuracy.mesh_error import missed_resonances
from nvhchain.acoustics.interpolation.nodes import Interpolant, check_lines, interpolant, line_batches, support
from nvhchain.acoustics.radiation.projection import check_memory
from nvhchain.conventions import Progress
from nvhchain.errors import InputError
from nvhchain.fidelity import STANDARD, AcousticsFidelity
from nvhchain.handoff import (
    ComplexArray,
    FieldPressure,
    FloatArray,
    SoundAccuracy,
    SurfaceVelocity,
    TransferVectors,
    warn_of,
)
from nvhchain.kinds import checked

_BLOCK_BYTES = 2**28
"""Bytes of remainders at the nodes that are held at once; the points of a block share the reading of velocities."""


@checked
def radiate(
    atv: TransferVectors,
    surface_velocity: SurfaceVelocity,
    *,
    fidelity: AcousticsFidelity = STANDARD.acoustics,
    progress: Progress | None = None,
) -> FieldPressure:
    """Compute sound pressure at the field points, p(ω) = vector(ω) · v_n(ω), at every line of the surface velocity.

    Parameters
    ----------
    atv : TransferVectors
        Transfer vectors at the masters.
    surface_velocity : SurfaceVelocity
        Normal velocity of the faces (m/s), peak values, at lines within the masters.
    fidelity : AcousticsFidelity
        Accuracy settings.
    progress : Progress, optional
        Function that receives the finished and the total number of steps.

    Returns
    -------
    FieldPressure
        Pressure (Pa); zero at lines without velocity and at 0 Hz. Notes describe its accuracy.

    Raises
    ------
    InputError
        If the surfaces differ or a line lies outside the masters.
    ResourceError
        If the result does not fit into free memory.

    Warns
    -----
    AccuracyWarning
        For the errors of interpolation, resonances and cancellation, see Notes.

    Notes
    -----
    Transfer vectors are interpolated between their master frequencies, velocities never.

    Interpolation: `interpolation_error` of the accuracy is the largest estimated error of each point, relative to its
    peak pressure. It is at least the error that `interpolate_vectors` states for its vectors. A warning is given above
    `fidelity.master_tolerance_db`.

    Resonances: the mesh may miss resonances of the air in openings (`resonance_shift` of the vectors' accuracy). From
    four masters on, the interpolation looks for poles. Then `resonance_error_db` is the largest effect on the loudest
    point of a line, at `resonance_frequency` Hz. A warning is given where it exceeds the error of a mesh with
    `fidelity.elements_per_wavelength`. With fewer masters, the accuracy states `resonance_shift` alone, and a warning
    names openings narrower than half an edge.

    Mesh: `expected_error_db` of the vectors holds for motions with audible sound.

    Cancellation: the mesh error is larger if parts of a motion cancel each other, or if the mesh is coarse for
    bending waves. It is 1 dB for a thin plate that bends in four elements a wave. It is 12 dB for a coarse block
    in torsion at 1 Hz, 1 km away. The bound `cancellation_error_db`, at `cancellation_frequency` Hz, covers vectors
    from a mesh. It counts motions along the walls slower than sound and motions with hardly any sound at the points. It
    is like that of `solve_direct`, but from an estimated surface pressure (`cancellation_of_motion`). The warning is
    like that of `sound_power`, but begins only where the estimate is certain.
    """
    smooth = _prepare(atv, surface_velocity, fidelity)
    vector_accuracy = atv.accuracy
    shift = vector_accuracy.resonance_shift or 0.0
    pressure, error, shifted = _evaluate(smooth, surface_velocity, len(atv.points), progress, shift)
    frequency, amplitude = surface_velocity.frequency, np.abs(pressure)
    peak, loudest = amplitude.max(axis=0), amplitude.max(axis=1)
    relative = error.max(axis=0) / np.where(peak > 0, peak, 1.0)
    stated = 10.0 ** ((vector_accuracy.interpolation_error_db or 0.0) / 20.0) - 1.0  # vectors that are no masters
    told = SoundAccuracy(
        interpolation_error=np.maximum(relative, stated),
        interpolation_frequency=float(frequency[error.argmax(axis=0)][relative.argmax()]),
        asked_interpolation_error_db=fidelity.master_tolerance_db,
    )
    audible = heard(frequency, loudest)
    told |= missed_resonances(shift, smooth.poles, frequency, audible * loudest, shifted.max(axis=1), fidelity)
    if vector_accuracy.elements_per_wavelength is not None and audible.any():
        one_element = float(atv.frequency[-1]) * vector_accuracy.elements_per_wavelength
        quadrature, lines = vector_accuracy.quadrature_error or 0.0, np.flatnonzero(audible)
        motion, power = surface_velocity.select(lines), np.ones(len(lines))
        left = cancellation_of_motion(motion, loudest[lines], atv.points, atv.air, atv.plane, quadrature)
        short = short_waves(motion)
        told |= cancellation_accuracy(frequency[lines], power, left**2, short, fidelity, one_element, ESTIMATE)
    warn_of(told)
    return FieldPressure(
        frequency,
        atv.points,
        pressure,
        accuracy=SoundAccuracy(expected_error_db=vector_accuracy.expected_error_db) | told,
        provenance={"stage": "acoustics.radiate", "fidelity": repr(fidelity)},
    )


@checked
def interpolation_error(
    atv: TransferVectors, surface_velocity: SurfaceVelocity, *, fidelity: AcousticsFidelity = STANDARD.acoustics
) -> FloatArray:
    """Estimate the error of `radiate` due to interpolation between masters.

    Returns (n_f, n_point): estimated error (Pa); zero at the masters.

    Every master is omitted in turn and predicted from its neighbours. The misfit of the nearest one is scaled by the
    known ratio of the interpolation polynomials. For a sphere of 0.1 m, one in a hundred placements of five masters up
    to 2.5 kHz erred by 0.5 to 0.9 dB with 0.1 dB stated.

    Fewer than three masters use the error expected from the body's size (`Nodes.error_weights`). It is 0.9 to 100 times
    the true error for spheres that move in shapes of degree 0 to 3, and larger the more smoothly they radiate. It is
    too low for a body that resonates.

    High above a rigid plane, the echo from the plane hits the body. Its phase turns too fast for the masters to
    resolve. The pressure of this echo is added (`Paths.unresolved_echo_error`), at silent points as well.
    """
    smooth = _prepare(atv, surface_velocity, fidelity)
    return _evaluate(smooth, surface_velocity, len(atv.points), None, 0.0)[1]


def _prepare(atv: TransferVectors, surface_velocity: SurfaceVelocity, fidelity: AcousticsFidelity) -> Interpolant:
    """Check the arguments and return the interpolant."""
    if atv.surface.content_hash != surface_velocity.surface.content_hash:
        raise InputError(
            f"transfer vectors belong to another surface ({len(atv.surface.triangles)} triangles) than the surface "
            f"velocity ({len(surface_velocity.surface.triangles)} triangles): compute both on the same one"
        )
    check_lines(atv.frequency, surface_velocity.frequency[_radiating(surface_velocity)])
    return interpolant(atv, fidelity)


def _radiating(surface_velocity: SurfaceVelocity) -> np.ndarray:
    """Return the indices of lines whose motion and frequency are not zero."""
    given = surface_velocity.coordinates
    moving = (surface_velocity.normal_velocity if given is None else given).any(axis=1)
    return np.flatnonzero(moving & (surface_velocity.frequency > 0))


def _evaluate(
    smooth: Interpolant, surface_velocity: SurfaceVelocity, points: int, progress: Progress | None, shift: float
) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """Return pressure (n_f, n_point), its estimated error, and its change if resonances shift by `shift`.

    Lines that do not radiate are zero. Velocities are projected on the remainders at the masters, and the projections
    are interpolated; no vector between masters is formed. Sound that reaches a point by way of a plane comes in further
    rows of `smooth` and is added.
    """
    from nvhchain.acoustics.radiation._delay import delayed  # compiled

    lines = _radiating(surface_velocity)
    shape = (len(surface_velocity.frequency), points)
    check_memory(32 * shape[0] * points, "pressures and their error estimates")
    pressure = np.zeros(shape, dtype=complex)
    error, shifted = np.zeros(shape), np.zeros(shape)
    pieces = [lines[batch] for batch in line_batches(len(lines))]
    ends = range(len(smooth.atv.points))
    together = max(1, _BLOCK_BYTES // (16 * len(smooth.node) * len(smooth.atv.surface.triangles)))
    blocks = [ends[start : start + together] for start in range(0, len(ends), together)]
    report = progress or (lambda done, total: None)
    for done, block in enumerate(blocks):
        values = [smooth.node_values(end) for end in block]
        distances = [smooth.distance(end) for end in block]
        for number, piece in enumerate(pieces):
            report(done * len(pieces) + number, len(blocks) * len(pieces))
            frequency = surface_velocity.frequency[piece]
            velocity = np.ascontiguousarray(surface_velocity.normal_velocity[piece])
            weights, misfit = smooth.weights(frequency), smooth.error_weights(frequency)
            moved = smooth.shift_weights(frequency, shift) if shift > 0 else misfit[:0]
            needed = support(np.concatenate([weights, *misfit, *moved]))
            for end, value, distance in zip(block, values, distances, strict=True):
                projected = delayed(smooth.wavenumber(frequency), distance, velocity) @ value[needed].T
                pressure[piece, end % points] += (projected * weights[:, needed]).sum(axis=1)
                error[piece, end % points] += np.abs((projected * misfit[:, :, needed]).sum(axis=2)).max(axis=0)
                shifted[piece, end % points] += np.abs((projected * moved[:, :, needed]).sum(axis=2)).sum(axis=0)
    report(len(blocks) * len(pieces), len(blocks) * len(pieces))
    vertices = smooth.atv.surface.vertices
    middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
    # a point within the body, such as the middle of a ring, counts as one at its radius
    near = np.linalg.norm(vertices - middle, axis=1).max()
    distance = np.linalg.norm(smooth.atv.points[:points] - middle, axis=1).clip(near)
    loudest = (np.abs(pressure[lines]) * distance).max(axis=1, initial=0.0)  # at 1 m
    error[lines] += (smooth.unresolved_echo_error(surface_velocity.frequency[lines]) * loudest)[:, None] / distance
    return pressure, error, shifted
