"""Sound pressure of spherical waves outside the sphere that encloses a body."""

from __future__ import annotations

import numpy as np

from nvhchain.acoustics.waves.high_plane import body_waves, polar_functions
from nvhchain.acoustics.waves.multipoles import frame, waves_from_middle
from nvhchain.handoff import ComplexArray, FloatArray, IntArray, RigidPlane, Surface


class OutgoingWaves:
    """Values of the waves of a surface at field points.

    surface : radiating surface; waves as of `multipole_amplitudes`.
    points : (n_point, 3) field points (m) outside the enclosing sphere.
    order : highest order of the waves.
    """

    def __init__(self, surface: Surface, plane: RigidPlane | None, points: FloatArray, order: int) -> None:
        self.plane, self.order = plane, order
        self._origin, axes = frame(surface, plane)
        self._mirrors = plane is not None and waves_from_middle(surface, plane)
        self._even = plane is not None and not self._mirrors
        both = points
        if self._mirrors:
            assert plane is not None
            both = np.concatenate([points, plane.mirror(points)])
        offset = (both - self._origin) @ axes.T
        self._radius = np.linalg.norm(offset, axis=1)
        self._harmonics = _harmonics(offset / self._radius[:, None], order)
        self._degree = np.floor(np.sqrt(np.arange((order + 1) ** 2))).astype(int)
        if self._even:
            number = np.arange((order + 1) ** 2)
            m = number - self._degree * (self._degree + 1)
            kept = (self._degree + m) % 2 == 0
            self._harmonics, self._degree = np.sqrt(2.0) * self._harmonics[:, kept], self._degree[kept]
        self._count = len(points)

    def pressure(self, wavenumber: FloatArray, waves: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Return the sound pressure (n_set, n_k, n_point) of sets of waves (n_set, n_k, n_row) Pa m.

        The second array is the part of the highest degree, which is that of each wavenumber.

        p = −jk Σ j^−l h_l(kr) a_lm Y_lm, h_l of the second kind, follows from the far field r e^{jkr} p = Σ a_lm Y_lm.
        h_l+1 = (2l + 1)/x h_l − h_l−1 is stable upwards, as |h_l| grows with l.
        """
        sets, count = waves.shape[:2]
        amplitude = np.zeros((sets, count, len(self._degree)), dtype=complex)
        rows = min(waves.shape[2], amplitude.shape[2])
        amplitude[:, :, :rows] = waves[:, :, :rows]
        if self._mirrors:
            assert self.plane is not None
            height = float(self.plane.height(self._origin[None])[0])
            amplitude = np.array(
                [
                    [body_waves(a, k * height, self.order) for k, a in zip(wavenumber, set_amplitude, strict=True)]
                    for set_amplitude in amplitude
                ]
            )
        top = np.where((amplitude != 0).any(axis=0), self._degree, 0).max(axis=1, initial=0)
        radial, place = self._radial(wavenumber, top)
        found = np.zeros((2, sets, count, len(self._radius)), dtype=complex)
        for l in range(int(top.max(initial=0)) + 1):
            lines, same_degree = np.flatnonzero(top >= l), self._degree == l
            part = radial[lines, :, l][:, place] * (
                amplitude[:, lines][:, :, same_degree] @ self._harmonics[:, same_degree].T
            )
            found[0][:, lines] += part
            found[1][:, lines] = part
        if self._mirrors:
            found = found[..., : self._count] + found[..., self._count :]
        return found[0], found[1]

    @property
    def few(self) -> bool:
        """True where sums over degrees at the points are fewer numbers than the waves, and no mirror image is added."""
        return not self._mirrors and self._count <= self.order + 1

    def degree_sums(self, waves: ComplexArray) -> ComplexArray:
        """Return the sums Σ_m a_lm Y_lm (n_column, n_point, n_degree) of waves (n_row, n_column) at the points."""
        found = np.zeros((waves.shape[1], self._count, self.order + 1), dtype=complex)
        degree = self._degree[: len(waves)]
        for l in np.unique(degree):
            rows = np.flatnonzero(degree == l)
            found[:, :, l] = (self._harmonics[:, rows] @ waves[rows]).T
        return found

    def radial(self, wavenumber: FloatArray, top: IntArray) -> ComplexArray:
        """Return −jk j^−l h_l(kr) (n_k, n_point, n_degree) 1/m; zero above the degree `top` of each wavenumber."""
        found, place = self._radial(wavenumber, top)
        return found[:, place]

    def _radial(self, wavenumber: FloatArray, top: IntArray) -> tuple[ComplexArray, IntArray]:
        """Return the radial functions (n_k, n_radius, n_degree) at different radii, and the radius of every point."""
        radius, place = np.unique(self._radius, return_inverse=True)
        found = np.zeros((len(wavenumber), len(radius), self.order + 1), dtype=complex)
        lines = np.arange(len(wavenumber))
        kr = wavenumber[:, None] * radius
        before, now = np.exp(-1j * kr) / kr, 1j * np.exp(-1j * kr) / kr  # h of degrees −1 and 0
        for l in range(int(top.max(initial=0)) + 1):
            inside = top[lines] >= l
            lines, kr, before, now = lines[inside], kr[inside], before[inside], now[inside]
            found[lines, :, l] = (-1j) ** (l + 1) * wavenumber[lines, None] * now
            before, now = now, (2 * l + 1) / kr * now - before
        return found, place


def _harmonics(direction: FloatArray, order: int) -> FloatArray:
    """Return real spherical harmonics (n, (order + 1)²) of unit norm at directions (n, 3), in rows l² + l ± m."""
    found = np.zeros((len(direction), (order + 1) ** 2))
    azimuth = np.arctan2(direction[:, 1], direction[:, 0])
    for m, polar in enumerate(polar_functions(np.clip(direction[:, 2], -1.0, 1.0), order)):
        degree = np.arange(m, order + 1)
        middle = degree * degree + degree
        scaled = polar / np.sqrt(np.pi if m else 2.0 * np.pi)
        found[:, middle + m] = scaled * np.cos(m * azimuth)[:, None]
        if m:
            found[:, middle - m] = scaled * np.sin(m * azimuth)[:, None]
    return found
