"""Discretisation error of motions whose parts cancel each other: the sound of a residual dipole."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.sparse import block_diag, coo_array, csr_array, diags_array
from scipy.sparse.linalg import SuperLU, splu

from nvhchain.acoustics.accuracy.mesh_error import FAINT, MESH_ERROR, QUADRATURE_GROWTH
from nvhchain.acoustics.interpolation.adaptive import error_decibel
from nvhchain.acoustics.interpolation.nodes import line_batches
from nvhchain.acoustics.surfaces.bodies import split_bodies
from nvhchain.acoustics.surfaces.clustering import diameter
from nvhchain.acoustics.surfaces.surface import SHARP_ANGLE, edge_table, mean_edge, width_to_length
from nvhchain.conventions import Air
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import ComplexArray, FloatArray, IntArray, RigidPlane, SoundAccuracy, Surface, SurfaceVelocity
from nvhchain.levels import a_weighting
from nvhchain.runtime.threads import blas_threads

CANCELLATION = 0.22
"""Bound on the residual thrust F due to the error of the mesh: F = CANCELLATION S p h²/(a² w). S is the area and p the
root mean square pressure on it. h is the mean edge, a half the diagonal and w the width over length of the body that
carries the pressure. Rotating boxes and ellipsoids of irregular mesh have 0.004 to 0.16
(docs/measured/acoustics/sound_power.md); they radiate hardly anything else at low frequency. Ellipsoids with random
shifts of their vertices have up to 0.21. Strips that bend all along err by 0.5 dB at four edges a wave, both as long as
wide and 16 times as long. Bodies of revolution that rotate about their own axis exceed the bound: only the facets move
their air."""

ESTIMATE = 2.9
"""Largest ratio of estimated pressures of motions to those of boundary elements (`pressure_of_motion`)."""

QUIET_RATIO = 0.1
"""Pressure at the loudest of many points, relative to that of uniform radiation from the whole surface, below which a
motion hardly radiates. A single point uses the square: behind the gearbox it has less than a tenth by chance at one
line in forty, and at least 0.017."""

_MOST_LINES = 256
"""Number of lines with estimated surface pressures: those of the largest errors by motion and `wall_wavenumber`."""


def cancellation_resistance(
    surface: Surface, wavenumber: float, pressure: ComplexArray, plane: RigidPlane | None, quadrature_error: float
) -> ComplexArray:
    """Return the radiation resistance E (m, m), times ρc, of the error for velocities with pressures (n_v, m) Pa.

    quadrature_error : error of `expected_accuracy`.

    E is Hermitian and semidefinite. ½ q̇ᴴ E q̇/(ρc) is the power k²F²/(24πρc) of a dipole with the residual thrust F.
    Over a rigid plane it is twice that: the plane doubles the thrust along it and leaves half of the space. Source:
    Morse & Ingard, Theoretical Acoustics, 1968, sect. 7.1.
    """
    dipole = wavenumber**2 / (12 * np.pi) * (1.0 if plane is None else 2.0)
    face_pressure = pressure[surface.triangles].mean(axis=1)
    return np.asarray(dipole * sum(thrust.squared for thrust in _thrusts(surface, face_pressure, quadrature_error)))


def cancellation_pressure(
    surface: Surface,
    wavenumber: FloatArray,
    face_pressure: ComplexArray,
    points: FloatArray,
    plane: RigidPlane | None,
    quadrature_error: float,
) -> FloatArray:
    """Return the largest pressure (m,) Pa of residual thrusts F at field points (n_point, 3) m.

    wavenumber : (m,) rad/m.
    face_pressure : (n_face, m) Pa, pressures on the faces.

    The pressure is |jk + 1/r| F/(4πr), on the axis of a dipole at the centre of the pressures on every body. The
    distance r is at least half their extent. A plane doubles the result.
    """
    squares = np.zeros(len(wavenumber))
    for thrust in _thrusts(surface, face_pressure, quadrature_error):
        nearest = [float(np.linalg.norm(points - middle, axis=1).min()) for middle in thrust.middles]
        r = np.maximum(nearest, thrust.extents)
        squares += (1.0 + (wavenumber * r) ** 2) * thrust.squared.diagonal().real / (4 * np.pi * r**2) ** 2
    return np.asarray(np.sqrt(squares) * (1.0 if plane is None else 2.0))


def cancellation_of_motion(
    surface_velocity: SurfaceVelocity,
    loudest: FloatArray,
    points: FloatArray,
    air: Air,
    plane: RigidPlane | None,
    quadrature_error: float,
) -> FloatArray:
    """Return `cancellation_pressure` over the loudest pressure, (n_f,), at the lines of a surface velocity.

    loudest : (n_f,) Pa, pressure at the loudest point.

    Pressures on the surface are estimated (`pressure_of_motion`). The result counts bodies with subsonic motion: waves
    on their walls are shorter than those in the air, or than the body (`wall_wavenumber`). Faster motion radiates from
    the whole surface, and a point receives little of it where waves happen to cancel. Flanks of ribs or teeth,
    separated by sharp edges, may also cancel each other; motions that are `QUIET_RATIO` therefore count as well. Other
    lines are zero, and so are those beyond the `_MOST_LINES` worst.
    """
    surface = surface_velocity.surface
    bodies, wavenumber = split_bodies(surface), 2 * np.pi * surface_velocity.frequency / air.speed_of_sound
    lines = np.flatnonzero((wavenumber > 0) & (loudest > 0))
    away = max(np.linalg.norm(points - surface.centroids.mean(axis=0), axis=1).min(), 0.5 * diameter(surface.vertices))
    quiet = QUIET_RATIO ** (1.0 + 1.0 / len(points)) * air.impedance / (np.sqrt(4 * np.pi) * away)

    def relative_velocity(lines: IntArray, faces: IntArray) -> ComplexArray:  # scaled, as squares may overflow
        return surface_velocity.normal_velocity[np.ix_(lines, faces)].T / loudest[lines]

    cancels = np.zeros((len(bodies), len(wavenumber)), dtype=bool)
    suspect = np.zeros(len(wavenumber))
    for piece in (lines[batch] for batch in line_batches(len(lines))):
        k, moving = wavenumber[piece], [relative_velocity(piece, faces) for faces, _ in bodies]
        energy = np.array([body.areas @ np.abs(v) ** 2 for (_, body), v in zip(bodies, moving, strict=True)])
        wall_wavenumbers = np.array([wall_wavenumber(body, v) for (_, body), v in zip(bodies, moving, strict=True)])
        cancels[:, piece] = (k < wall_wavenumbers) | (quiet * np.sqrt(energy.sum(axis=0)) > 1.0)
        ahead = (cancels[:, piece] * energy * np.minimum(k / wall_wavenumbers, 1.0) ** 2).sum(axis=0)
        suspect[piece] = ahead * (1.0 + (k * away) ** 2)
    left = np.zeros(len(wavenumber))
    worst = np.sort(lines[np.argsort(suspect[lines])[-_MOST_LINES:]])
    for piece in (worst[batch] for batch in line_batches(len(worst))):
        k, face_pressure = wavenumber[piece], np.zeros((len(surface.triangles), len(piece)), dtype=complex)
        for number, (faces, body) in enumerate(bodies):
            mine = np.flatnonzero(cancels[number, piece])
            if len(mine) > 0:
                v = relative_velocity(piece[mine], faces)
                face_pressure[np.ix_(faces, mine)] = pressure_of_motion(body, k[mine], v, air)
        left[piece] = cancellation_pressure(surface, k, face_pressure, points, plane, quadrature_error)
    return left


def wall_wavenumber(body: Surface, velocity: ComplexArray) -> FloatArray:
    """Return wavenumbers (m,) rad/m of normal velocities (n_face, m) along the walls.

    They are √(1/a² + ∫|∇v|² dS/∫|v|² dS), with a half the diagonal of the body.
    """
    size = body.areas @ np.abs(velocity) ** 2
    return np.asarray(
        np.sqrt(1.0 / (0.5 * diameter(body.vertices)) ** 2 + _slopes(body, velocity) / np.where(size > 0, size, 1.0))
    )


def short_waves(surface_velocity: SurfaceVelocity) -> FloatArray:
    """Return the square (n_f,) of mean edges per wave on the walls; zero at lines without velocity.

    It is ∫(h|∇v|/2π)² dS over ∫|v|² dS.
    """
    form, areas = wall_waves(surface_velocity.surface), surface_velocity.surface.areas
    found = np.zeros(len(surface_velocity.frequency))
    fastest = np.abs(surface_velocity.normal_velocity).max(axis=1)
    moving = np.flatnonzero(fastest)
    for piece in (moving[batch] for batch in line_batches(len(moving))):
        v = (surface_velocity.normal_velocity[piece] / fastest[piece, None]).T  # scaled, as squares may overflow
        found[piece] = (v.conj() * (form @ v)).sum(axis=0).real.clip(0.0) / (areas @ np.abs(v) ** 2)
    return found


@lru_cache(maxsize=8)
def wall_waves(surface: Surface) -> csr_array:
    """Return ∫(h ∇u/2π)·(h ∇v/2π) dS as a form (n_face, n_face) of normal velocities, h the mean edge of each body."""
    bodies = split_bodies(surface)
    form = block_diag([(mean_edge(body) / (2 * np.pi)) ** 2 * _walls(body)[0] for _, body in bodies], format="csr")
    place = np.argsort(np.concatenate([faces for faces, _ in bodies]))
    return csr_array(form[place][:, place])


def _slopes(body: Surface, velocity: ComplexArray) -> FloatArray:
    """Return ∫|∇v|² dS (m,) of normal velocities (n_face, m), not across edges."""
    stiffness, _ = _walls(body)
    return np.asarray((velocity.conj() * (stiffness @ velocity)).sum(axis=0).real.clip(0.0))


def pressure_of_motion(body: Surface, wavenumber: FloatArray, velocity: ComplexArray, air: Air) -> ComplexArray:
    """Estimate pressures (n_face, m) Pa on a body from normal velocities (n_face, m) m/s at wavenumbers (m,).

    The shape is the smoothed velocity, q = (1/a² − Δ)⁻¹ v. The size is √∫|p|² = ρck √∫v* q, at most ρcv. A wave of
    wavenumber κ on a wall has the pressure ρck v/κ if κ > k. A body of half diagonal a that moves as a whole has at
    most ρcka v. The operator Δ acts on the surface, but not across edges, where the velocity jumps and the pressure
    does not (finite volumes). The estimate is 0.6 to 2.9 times the result of boundary elements, in the mean over the
    faces (`tests/acoustics/test_cancelling_motions.py`).
    """
    _, factors = _walls(body)
    areas, columns = body.areas[:, None], velocity.shape[1]
    with blas_threads(1):  # SuperLU multiplies small blocks; further threads spin and take ten times the processor time
        parts = factors.solve(np.concatenate([areas * velocity.real, areas * velocity.imag], axis=1))
    smooth = parts[:, :columns] + 1j * parts[:, columns:]
    ahead = (areas * velocity.conj() * smooth).sum(axis=0).real * wavenumber**2
    energy = np.minimum(ahead, (areas * np.abs(velocity) ** 2).sum(axis=0))
    size = (areas * np.abs(smooth) ** 2).sum(axis=0)
    return np.asarray(air.impedance * np.sqrt(energy / np.where(size > 0, size, 1.0)) * smooth)


@lru_cache(maxsize=8)
def _walls(body: Surface) -> tuple[csr_array, SuperLU]:
    """Return −∫Δ over the faces, (n_face, n_face), and the factors of ∫(1/a² − Δ)."""
    ends, sides, angle = edge_table(body)
    first, last = body.vertices[ends.T]
    way = np.linalg.norm(body.centroids[sides] - 0.5 * (first + last)[:, None], axis=2).sum(axis=1)
    conductance = np.where(angle < SHARP_ANGLE, np.linalg.norm(last - first, axis=1) / way, 0.0)
    faces = len(body.triangles)
    conductances = coo_array((conductance, tuple(sides.T)), (faces, faces)).tocsr()
    conductances = conductances + conductances.T
    stiffness = (diags_array(conductances.sum(axis=1)) - conductances).tocsr()
    return stiffness, splu((stiffness + diags_array(body.areas / (0.5 * diameter(body.vertices)) ** 2)).tocsc())


@dataclass(frozen=True, eq=False)
class _Thrust:
    """Residual thrusts of the pressures on one body.

    squared : FᴴF (N²).
    middles : (m, 3) centres of the carrying areas (m).
    extents : half extents of the carrying areas (m).
    """

    squared: ComplexArray
    middles: FloatArray
    extents: FloatArray


def _thrusts(surface: Surface, face_pressure: ComplexArray, quadrature_error: float) -> list[_Thrust]:
    """Return the residual thrusts on every body for pressures on the faces (n_face, m) Pa.

    F = (CANCELLATION h²/(a²w) + ε) √(S ∫|p|² dS), with h the mean edge and ε the error of sound fields by quadrature,
    which is that of sharp edges. For the body, a is half the diagonal and S the area. For the part that carries |p|², a
    is √3 radii of gyration and S is 2 (∫|p|² dS)²/∫|p|⁴ dS. The smaller values count. Distant parts at rest cancel
    nothing. The factor w is the width over length of the body or, if that is larger, of the carrying part
    (`width_to_length`). The values belong to every column by itself.
    """
    made = []
    for faces, body in split_bodies(surface):
        here, h = face_pressure[faces], mean_edge(body)
        carried = body.areas[:, None] * np.abs(here) ** 2
        total = carried.sum(axis=0)
        weight = np.where(total > 0, carried, body.areas[:, None])
        weight = weight / weight.sum(axis=0)
        middles = weight.T @ body.centroids
        square = (body.centroids**2).sum(axis=1) @ weight - (middles**2).sum(axis=1)
        extents = np.clip(np.sqrt(3.0 * square.clip(0.0)), h, 0.5 * diameter(body.vertices))
        area = np.minimum(body.areas.sum(), 2.0 / (weight**2 / body.areas[:, None]).sum(axis=0))
        spread = np.column_stack([body.areas / body.areas.sum(), weight])
        slender = width_to_length(body.centroids, spread)
        compact = np.maximum(extents**2 * np.maximum(slender[0], slender[1:]), h**2)
        share = (CANCELLATION * h**2 / compact + QUADRATURE_GROWTH * quadrature_error) * np.sqrt(area)
        squared = np.outer(share, share) * ((here.conj().T * body.areas) @ here)
        made.append(_Thrust(squared, middles, extents))
    return made


def heard(frequency: FloatArray, amplitude: FloatArray) -> FloatArray:
    """Return 1 for lines (n_f,) within `FAINT` of the A-weighted strongest, 0 for those that nobody hears beside it."""
    if not (amplitude > 0.0).any():
        return np.zeros(len(amplitude))
    with np.errstate(divide="ignore"):
        level = 20.0 * np.log10(amplitude / amplitude.max()) + a_weighting(np.maximum(frequency, 1.0))
    return np.asarray(level > level.max() + 10.0 * np.log10(FAINT), dtype=float)


def cancellation_accuracy(
    frequency: FloatArray,
    power: FloatArray,
    error_power: FloatArray,
    wall_wave_error: FloatArray,
    fidelity: AcousticsFidelity,
    one_element_frequency: float,
    overestimate: float = 1.0,
) -> SoundAccuracy:
    """Return the accuracy for the largest error of motions whose parts cancel each other (dB), and its frequency (Hz).

    power, error_power : (n_f,) of one unit, the computed power and that of the residual dipole. Their amplitudes add in
        the worst case.
    wall_wave_error : (n_f,) result of `short_waves`. Waves on walls err like waves in the air (`MESH_ERROR`) if they
    are shorter.
    one_element_frequency : frequency (Hz) at which the mesh has one element per wavelength.
    overestimate : factor by which the errors may be too large.

    A line counts if its error, in spite of this factor, exceeds two errors: that of a mesh with
    `fidelity.elements_per_wavelength` and that of this mesh.
    """
    loud = np.flatnonzero(power > 0)
    if len(loud) == 0:
        return SoundAccuracy()
    air_wave_error = (frequency[loud] / one_element_frequency) ** 2
    error = np.sqrt(error_power[loud] / power[loud]) + MESH_ERROR * (wall_wave_error[loud] - air_wave_error).clip(0.0)
    worst = int(error.argmax())
    if error[worst] == 0:
        return SoundAccuracy()
    asked = overestimate * MESH_ERROR * np.maximum(1 / fidelity.elements_per_wavelength**2, air_wave_error)
    return SoundAccuracy(
        cancellation_error_db=error_decibel(error[worst]),
        cancellation_frequency=float(frequency[loud[worst]]),
        cancellation_lines=int(np.count_nonzero(error > asked)),
    )
