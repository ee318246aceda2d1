"""Error of the sound power due to the mapping of the skin's motion onto the radiating faces.

Skin and faces are compared as sets of small sources in the free field: P = (ρ ω²/8πc) Σ Q_i Q_j* sin(kr)/(kr). It is
written as the mean over all directions of |Σ Q_i e^{jk s·x_i}|². The two flanks of a rib then cancel as they do in the
air.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from nvhchain.conventions import Air
from nvhchain.handoff import ComplexArray, FloatArray, HousingAccuracy, IntArray, ReducedHousing, Surface
from nvhchain.housing.modes.response import face_displacement, modal_displacement

_CELL = 0.25
"""Edge of the cells that gather the skin's sources, over that of a radiating face.

Up to 4 kHz the power of a mode of the tests' casting moves by 0.025 dB at most (test_mapping_stated). It is 0.09 dB
with one half and 0.34 dB with one.
"""

_FREQUENCIES = 4
"""Number of frequencies in the upper three octaves of the band at which the error of the mapping is measured."""

_BLOCK = 2_000_000
"""Largest number of entries of the matrix of phases held at once."""


def facet_flux(nodes: FloatArray, facets: IntArray) -> sp.csr_matrix:
    """Return the operator (k, 3 n) from nodal displacements (m) to volumes (m³) of straight six-node facets."""
    corners = nodes[facets[:, :3]]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    # quadratic shape functions: the corners integrate to zero, the mid-edge nodes to a third each
    rows = np.repeat(np.arange(len(facets)), 9)
    columns = (3 * facets[:, 3:, None] + np.arange(3)).ravel()
    values = np.repeat(area[:, None, :] / 3, 3, axis=1).ravel()
    return sp.csr_matrix(sp.coo_matrix((values, (rows, columns)), shape=(len(facets), nodes.size)))


def gathered(centres: FloatArray, size: float) -> tuple[FloatArray, sp.csr_matrix]:
    """Return middles (c, 3) m of cells of edge `size` (m) with facets, and the sum (c, k) over the facets in each."""
    place = np.floor(centres / size).astype(np.int64)
    _, cell, count = np.unique(place, axis=0, return_inverse=True, return_counts=True)
    cell = cell.ravel()
    gather = sp.csr_matrix((np.ones(len(cell)), (cell, np.arange(len(cell)))), shape=(len(count), len(cell)))
    return np.asarray(gather @ centres) / count[:, None], gather


def skin_sources(nodes: FloatArray, facets: IntArray, face_size: float) -> tuple[FloatArray, sp.csr_matrix]:
    """Return places (c, 3) m and displaced volumes (c, 3 n) of the skin's sources, for faces of `face_size` (m)."""
    places, gather = gathered(nodes[facets[:, :3]].mean(axis=1), _CELL * face_size)
    return places, sp.csr_matrix(gather @ facet_flux(nodes, facets))


def source_power(flux: ComplexArray, places: FloatArray, frequency: float) -> FloatArray:
    """Return the mean power (n,) W of volume velocities `flux` (p, n) m³/s (peak) at `places` (p, 3) m, free field."""
    air = Air()
    k = 2 * np.pi * frequency / air.speed_of_sound
    reach = float(np.linalg.norm(places - places.mean(axis=0), axis=1).max())
    # |Σ|² holds spherical harmonics up to twice the degree of the field, which is k·reach and a few more
    directions, weight = _half_sphere(2 * int(np.ceil(k * reach)) + 12)
    # Q = a + jb: with the opposite direction, whose phases are conjugate, the mean is |Σ a e^{jφ}|² + |Σ b e^{jφ}|²
    parts, squares = np.hstack([flux.real, flux.imag]), np.zeros(2 * flux.shape[1])
    step = max(1, _BLOCK // len(places))
    for start in range(0, len(directions), step):
        phase = k * (directions[start : start + step] @ (places - places.mean(axis=0)).T)
        for wave in (np.cos(phase), np.sin(phase)):
            squares += weight[start : start + step] @ (wave @ parts) ** 2
    power = squares.reshape(2, -1).sum(axis=0)
    return np.asarray(air.density * (2 * np.pi * frequency) ** 2 / (8 * np.pi * air.speed_of_sound) * power)


def _half_sphere(degree: int) -> tuple[FloatArray, FloatArray]:
    """Return directions (d, 3) and weights (d,) of sum one, exact for even spherical harmonics up to `degree`."""
    z, weight = np.polynomial.legendre.leggauss(2 * (degree // 4 + 1))
    z, weight = z[z > 0], weight[z > 0]
    angle = 2 * np.pi * np.arange(degree + 1) / (degree + 1)
    ring = np.sqrt(1 - z**2)
    directions = np.stack(
        [np.outer(ring, np.cos(angle)), np.outer(ring, np.sin(angle)), np.outer(z, np.ones(len(angle)))], axis=-1
    )
    return directions.reshape(-1, 3), np.repeat(weight / len(angle), len(angle))


def mapping_error(
    skin_flux: ComplexArray, skin_places: FloatArray, normal_velocity: ComplexArray, surface: Surface, frequency: float
) -> float:
    """Return the power of the faces over that of the skin (dB) at one frequency, summed over all motions (columns).

    skin_flux : (c, n) m³/s at skin_places (c, 3) m.
    normal_velocity : (n_face, n) m/s of the same motions.
    """
    skin = source_power(skin_flux, skin_places, frequency)
    faces = source_power(normal_velocity * surface.areas[:, None], surface.centroids, frequency)
    return float(10 * np.log10(faces.sum() / skin.sum()))


def stated_mapping_errors(
    reduced: ReducedHousing, places: FloatArray, flux_shapes: FloatArray, flux_residual: FloatArray, f_max: float
) -> HousingAccuracy:
    """Return the errors (dB) at some frequencies to f_max (Hz), for unit forces at the seats one after the other.

    places : (c, 3) m of the skin's sources.
    flux_shapes, flux_residual : (c, n_mode) and (c, motions · n_bearing), volume that the skin displaces there in
        every mode and residual motion.
    """
    lines, stated = np.geomspace(f_max / 8, f_max, _FREQUENCIES), []
    load = np.eye(reduced.motions * len(reduced.names), dtype=complex)
    load = load.reshape(len(reduced.names), reduced.motions, -1)[:, :3].reshape(3 * len(reduced.names), -1)
    for frequency in lines:
        alike, rate = np.full(len(load), frequency), 2j * np.pi * frequency
        gain = reduced.residual_gain()
        skin = modal_displacement(reduced, alike, load) @ flux_shapes.T + gain * load @ flux_residual.T
        faces = face_displacement(reduced, alike, load)
        error = mapping_error(rate * skin.T, places, rate * faces.T, reduced.surface, float(frequency))
        stated.append(round(error, 3))
    return HousingAccuracy(mapping_frequency=lines, mapping_error_db=np.array(stated))
