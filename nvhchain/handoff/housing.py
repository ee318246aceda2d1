"""Hand-offs of the housing and the motion of its surface."""

from __future__ import annotations

from typing import Any, Self

import numpy as np

from nvhchain.errors import InputError, counted, require
from nvhchain.handoff.accuracy import HousingAccuracy
from nvhchain.handoff.base import ComplexArray, FloatArray, HandOff
from nvhchain.handoff.declared import array, value
from nvhchain.handoff.surface import Surface

LINES_PER_PRODUCT = 512
"""Frequency lines per matrix product."""

_RESONANCE_DISTANCE = 1e-9
"""Relative distance of ω² and ω_r² below which an undamped response is pure rounding error."""


class ReducedHousing(HandOff):
    """A housing as grounded normal modes, Ritz vectors and residual flexibility at its bearing seats.

    Notes
    -----
    Ritz vectors are the uppermost modes. They and the residual flexibility stand for all modes that are excluded.

    Shapes are mass-normalised; those of faces are outward. Structural damping is a loss factor of twice the fraction of
    critical at the lines of a spectrum. In time all damping is viscous.

    Motions of a seat are translations along x, y, z, or these and tilts about x and y (rad), on which moments act
    (N m).
    """

    natural_frequency: FloatArray = array("Hz", "mode", "natural frequency, rising", lower_limit=0.0)
    modal_damping: FloatArray = array("1", "mode", "fraction of critical damping")
    seat_shapes: FloatArray = array("kg-1/2", "mode, bearing, motion", "mode shapes at the seats")
    normal_shapes: FloatArray = array("kg-1/2", "mode, face", "outward mode shapes of the faces")
    seat_residual: FloatArray = array(
        "m/N", "bearing, motion, loaded_bearing=bearing, loaded_motion=motion", "residual flexibility of the seats"
    )
    face_residual: FloatArray = array("m/N", "bearing, motion, face", "residual flexibility of the faces, outward")
    names: tuple[str, ...] = array("", "bearing", "bearing names")
    positions: FloatArray = array("m", "bearing, axis", "bearing seat centres")
    surface: Surface = value("", "radiating surface")
    structural_damping: bool | None = value("1", "damping is structural; absent: viscous", default=None)
    ritz_vectors: int | None = value("1", "number of the uppermost modes that are Ritz vectors", default=None)
    accuracy: HousingAccuracy = value("", "stated accuracy", default=HousingAccuracy())

    def _check(self) -> None:
        object.__setattr__(self, "structural_damping", True if self.structural_damping else None)
        frequency, damping = self.natural_frequency, self.modal_damping
        require(
            bool((np.diff(frequency) >= 0).all()),
            "ReducedHousing.natural_frequency is not sorted: give it in rising order with its shapes",
        )
        require(
            bool(((damping >= 0) & (damping < 1)).all()),
            "ReducedHousing.modal_damping must lie in 0 … 1 (fraction of critical damping)",
        )
        object.__setattr__(self, "ritz_vectors", self.ritz_vectors or None)
        require(
            0 <= (self.ritz_vectors or 0) <= len(frequency),
            f"ReducedHousing.ritz_vectors = {self.ritz_vectors}: there are {counted(len(frequency), 'mode')}",
        )
        require(self.motions in (3, 5), f"ReducedHousing.seat_shapes has {self.motions} motions per seat: give 3 or 5")
        matrix = self.seat_residual.reshape(self.motions * len(self.names), -1)
        require(
            bool(np.abs(matrix - matrix.T).max(initial=0.0) <= 1e-6 * np.abs(matrix).max(initial=0.0)),
            "ReducedHousing.seat_residual must be symmetric",
        )

    @property
    def motions(self) -> int:
        """Motions of every seat: 3 translations, or 5 with the tilts about x and y."""
        return int(self.seat_shapes.shape[2])

    @property
    def mode_count(self) -> int:
        """Number of natural modes, which come before the Ritz vectors."""
        return len(self.natural_frequency) - (self.ritz_vectors or 0)

    @property
    def flat_shapes(self) -> FloatArray:
        """Mode shapes (n_mode, motions · n_bearing) at the seats."""
        return self.seat_shapes.reshape(len(self.natural_frequency), self.motions * len(self.names))

    @property
    def flat_residual(self) -> FloatArray:
        """Residual flexibility (motions · n_bearing, n_face) of the faces."""
        return self.face_residual.reshape(self.motions * len(self.names), -1)

    def drop_tilts(self) -> ReducedHousing:
        """Return the housing with the translations of its seats alone."""
        if self.motions == 3:
            return self
        return self.replace(
            seat_shapes=self.seat_shapes[:, :, :3],
            seat_residual=self.seat_residual[:, :3, :, :3],
            face_residual=self.face_residual[:, :3],
        )

    def drop_ritz_vectors(self) -> ReducedHousing:
        """Return the housing with its natural modes and residual flexibility alone, without their truncation error."""
        kept, told = self.mode_count, self.accuracy
        told = told.cleared("truncation_error_db", "truncation_frequency", "truncation_error_at_db")
        if told.frequency_error is not None:
            told = told.replace(frequency_error=told.frequency_error[:kept])
        return self.replace(
            natural_frequency=self.natural_frequency[:kept],
            modal_damping=self.modal_damping[:kept],
            seat_shapes=self.seat_shapes[:kept],
            normal_shapes=self.normal_shapes[:kept],
            ritz_vectors=None,
            accuracy=told,
        )

    def receptance(
        self, frequency: FloatArray, *, structural: bool | None = None, damping: FloatArray | None = None
    ) -> ComplexArray:
        """Return the modal coordinate per modal force (n_f, n_mode) s².

        Parameters
        ----------
        frequency : (n_f,) array
            Frequency (Hz).
        structural : bool, optional
            Structural instead of viscous damping; by default `structural_damping`.
        damping : (n_f,) array, optional
            Damping ratio of all modes at every line, in place of `modal_damping`.

        Raises
        ------
        InputError
            If a mode without damping is driven at its resonance (a rigid one at 0 Hz, too).

        Notes
        -----
        The receptance is 1/(ω_r² − ω² + 2jζω_rω). With structural damping of loss factor 2ζ it is 1/(ω_r²(1 + 2jζ) −
        ω²).
        """
        structural = bool(self.structural_damping) if structural is None else structural
        omega = 2 * np.pi * np.asarray(frequency)[:, None]
        natural = 2 * np.pi * self.natural_frequency
        zeta = self.modal_damping if damping is None else damping[:, None]
        stiff = natural**2 - omega**2
        loss = 2 * zeta * natural * (natural if structural else omega)
        endless = (np.abs(stiff) <= _RESONANCE_DISTANCE * natural**2) & (loss <= _RESONANCE_DISTANCE * natural**2)
        if endless.any():
            line, mode = np.argwhere(endless)[0]
            raise InputError(
                f"mode {mode + 1} at {self.natural_frequency[mode]:.6g} Hz has no damping and is driven at its "
                f"resonance ({np.asarray(frequency)[line]:.6g} Hz): its response is unbounded; give it damping or "
                "leave the line out"
            )
        return np.asarray(1.0 / (stiff + 1j * loss))

    def residual_gain(self, *, structural: bool | None = None) -> complex:
        """Return the factor of both residual flexibilities at a line.

        It is 1/(1 + jη) of the highest mode for structural damping, and 1 for viscous damping.
        """
        structural = bool(self.structural_damping) if structural is None else structural
        if not structural or len(self.modal_damping) == 0:
            return 1.0
        return 1.0 / (1.0 + 2j * float(self.modal_damping[-1]))


def times_real(left: ComplexArray, right: FloatArray) -> ComplexArray:
    """Return complex (m, n) times real (n, k) matrix as two real products: half the work of a complex one."""
    product = np.empty((left.shape[0], right.shape[1]), dtype=complex)
    product.real = np.ascontiguousarray(left.real) @ right
    product.imag = np.ascontiguousarray(left.imag) @ right
    return product


def _superposed(velocity: SurfaceVelocity) -> ComplexArray:
    """Return the normal velocity (n_f, n_face) m/s from coordinates and shapes."""
    assert velocity.coordinates is not None
    assert velocity.shapes is not None
    normal = np.empty((len(velocity.frequency), velocity.shapes.shape[1]), dtype=complex)
    for start in range(0, len(normal), LINES_PER_PRODUCT):
        part = slice(start, start + LINES_PER_PRODUCT)
        normal[part] = times_real(velocity.coordinates[part], velocity.shapes)
        normal[part] *= 2j * np.pi * velocity.frequency[part, None]
    return normal


class SurfaceVelocity(HandOff):
    """Outward normal velocity of every face: given, or the superposition jω · coordinates · shapes.

    Notes
    -----
    A superposition stores its two factors; `normal_velocity` is computed at the first access.
    """

    frequency: FloatArray = array("Hz", "frequency", "frequency", lower_limit=0.0)
    normal_velocity: ComplexArray = array(
        "m/s", "frequency, face", "outward normal velocity, peak", made_by=_superposed
    )
    surface: Surface = value("", "radiating surface")
    coordinates: ComplexArray | None = array(
        "m kg1/2, N", "frequency, shape", "displacement of modes, residual force", default=None
    )
    shapes: FloatArray | None = array("kg-1/2, m/N", "shape, face", "mode shapes, residual flexibility", default=None)

    @classmethod
    def superposition(
        cls, frequency: FloatArray, coordinates: ComplexArray, shapes: FloatArray, surface: Surface
    ) -> SurfaceVelocity:
        """Return the velocity jω · coordinates · shapes.

        Parameters
        ----------
        frequency : (n_f,) array
            Frequency (Hz).
        coordinates : (n_f, n_shape) complex array
            Displacement per unit of a shape, peak.
        shapes : (n_shape, n_face) array
            Outward shapes of the faces.
        surface : Surface
            Radiating surface.
        """
        return cls(frequency, None, surface, coordinates, shapes)  # type: ignore[arg-type]

    def select(self, lines: Any) -> SurfaceVelocity:
        """Return the velocity at some of its lines, one at least: rising indices, a slice or a mask."""
        if self.coordinates is None:
            return self.replace(frequency=self.frequency[lines], normal_velocity=self.normal_velocity[lines])
        return self.replace(frequency=self.frequency[lines], coordinates=self.coordinates[lines])

    def _check(self) -> None:
        given = "normal_velocity" in vars(self)
        factors = (self.coordinates is not None) + (self.shapes is not None)
        require(
            factors == (0 if given else 2),
            "SurfaceVelocity needs normal_velocity, or coordinates and shapes in its place: give one of both",
        )

    def replace(self, **changes: Any) -> Self:
        """Return a new, checked object with some fields changed; a new velocity replaces both factors."""
        if changes.get("normal_velocity") is not None:
            changes = {"coordinates": None, "shapes": None, **changes}
        return super().replace(**changes)
