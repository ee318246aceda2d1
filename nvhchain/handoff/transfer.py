"""Hand-offs that convert surface motion to sound pressure or power."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nvhchain.conventions import Air
from nvhchain.dimensions import Length
from nvhchain.errors import require
from nvhchain.handoff.accuracy import SolverRecord, SoundAccuracy
from nvhchain.handoff.base import ComplexArray, FloatArray, HandOff, IntArray
from nvhchain.handoff.declared import array, value
from nvhchain.handoff.surface import Surface


@dataclass(frozen=True)
class RigidPlane:
    """Rigid plane that reflects all sound; bodies and field points lie on the side of its normal.

    Parameters
    ----------
    point : tuple of float
        Any point of the plane (m).
    normal : tuple of float
        Direction into the air, of any length; stored with unit length.
    """

    point: tuple[Length, Length, Length]
    normal: tuple[float, float, float]

    def __post_init__(self) -> None:
        for name in ("point", "normal"):
            value = np.asarray(getattr(self, name), dtype=float)
            require(
                value.shape == (3,) and bool(np.isfinite(value).all()),
                f"rigid plane {name} = {getattr(self, name)}: three finite coordinates are needed",
            )
            if name == "normal":
                length = float(np.linalg.norm(value))
                require(length > 0, "rigid plane normal has no length: give the direction into the air")
                value = value if abs(length - 1.0) < 1e-14 else value / length  # stored planes keep their bits
            object.__setattr__(self, name, tuple(value.tolist()))

    def height(self, points: FloatArray) -> FloatArray:
        """Return the distance (n,) m of points (n, 3) m from the plane, positive on the side of the air."""
        return np.asarray((points - np.asarray(self.point)) @ np.asarray(self.normal))

    def mirror(self, points: FloatArray) -> FloatArray:
        """Return the mirror images (n, 3) m of points (n, 3) m."""
        return np.asarray(points - 2.0 * self.height(points)[:, None] * np.asarray(self.normal))

    def mirror_direction(self, vectors: NDArray[Any]) -> NDArray[Any]:
        """Return the mirror images (n, 3) of directions (n, 3): the component along the normal changes its sign."""
        normal = np.asarray(self.normal)
        return np.asarray(vectors - 2.0 * (vectors @ normal)[:, None] * normal)


class TransferVectors(HandOff):
    """Acoustic transfer vectors at master frequencies: p = vectors · v_n.

    Notes
    -----
    Image vectors are the part of the vectors with reflection at the plane: sound to the mirror images of the points.
    Their phase is that of the longer path.
    """

    frequency: FloatArray = array("Hz", "frequency", "master frequency", lower_limit=0.0)
    points: FloatArray = array("m", "point, axis", "field points", fewest=1)
    vectors: ComplexArray = array("Pa s/m", "frequency, point, face", "acoustic transfer vectors")
    surface: Surface = value("", "radiating surface")
    air: Air = value("speed_of_sound m/s, density kg/m3", "air around the body")
    plane: RigidPlane | None = value(
        "point m, unit normal into the air", "rigid plane; absent: free field", default=None
    )
    image_vectors: ComplexArray | None = array(
        "Pa s/m", "frequency, point, face", "part by way of the plane", default=None
    )
    accuracy: SoundAccuracy = value("", "stated accuracy", default=SoundAccuracy())

    def _check(self) -> None:
        require(
            (self.plane is None) == (self.image_vectors is None),
            "TransferVectors.image_vectors belong to a plane: give both or neither",
        )

    def unfolded(self) -> TransferVectors:
        """Return the vectors without a plane, to the points and then to their mirror images (2 n_point in all).

        The pressure at a point is the sum of both. Each part has the phase of its own path only, which interpolation
        between masters removes. Without a plane the vectors themselves are returned.
        """
        if self.plane is None or self.image_vectors is None:
            return self
        points = len(self.points)
        both = np.empty((len(self.frequency), 2 * points, self.vectors.shape[2]), dtype=complex)
        np.subtract(self.vectors, self.image_vectors, out=both[:, :points])
        both[:, points:] = self.image_vectors
        both.flags.writeable = False  # read-only arrays are not copied
        return TransferVectors(
            self.frequency,
            np.concatenate([self.points, self.plane.mirror(self.points)]),
            both,
            self.surface,
            self.air,
            accuracy=self.accuracy,
            provenance=self.provenance,
        )


class ModalTransferVectors(HandOff):
    """Transfer vectors times the shapes of a reduced housing, at the lines of a load: p = modes · q̇ + residual · Ḟ."""

    frequency: FloatArray = array("Hz", "frequency", "frequency", lower_limit=0.0)
    points: FloatArray = array("m", "point, axis", "field points")
    modes: ComplexArray = array(
        "Pa s m-1 kg-1/2", "frequency, point, mode", "pressure per velocity of a modal coordinate"
    )
    residual: ComplexArray = array("Pa s/N", "frequency, point, bearing, motion", "pressure per rate of bearing force")
    names: tuple[str, ...] = array("", "bearing", "bearing names")
    housing: str = value("", "content hash of the reduced housing")
    air: Air = value("speed_of_sound m/s, density kg/m3", "air around the body")
    accuracy: SoundAccuracy = value("", "stated accuracy", default=SoundAccuracy())


class NoiseTransferFunctions(HandOff):
    """Sound pressure per bearing force: p = functions · F."""

    frequency: FloatArray = array("Hz", "frequency", "frequency", lower_limit=0.0)
    points: FloatArray = array("m", "point, axis", "field points")
    functions: ComplexArray = array("Pa/N", "frequency, point, bearing, motion", "pressure per bearing force")
    names: tuple[str, ...] = array("", "bearing", "bearing names")
    air: Air = value("speed_of_sound m/s, density kg/m3", "air around the body")
    accuracy: SoundAccuracy = value("", "stated accuracy", default=SoundAccuracy())


class RadiationResistance(HandOff):
    """Spherical waves that leave a surface per unit velocity of its coordinates, at master frequencies.

    Notes
    -----
    P = ½ |waves q̇|², so that the radiation resistance matrix R = Re(wavesᴴ waves) is positive semidefinite. Rows
    without significance at a frequency are zero. The plane wave resistance is ρc ∫ φ_i φ_j dS, the limit of R at high
    frequency.

    ½ q̇ᴴ cancellation q̇, hermitian, is a power that bounds the mesh's error where parts of a motion cancel each other.
    Wall waves are ρc ∫ (h ∇φ_i/2π)·(h ∇φ_j/2π) dS with the mean edge h. Their ratio to the plane waves is the square of
    mean edges per wave on the walls.
    """

    frequency: FloatArray = array("Hz", "frequency", "master frequency", lower_limit=0.0)
    waves: ComplexArray = array(
        "", "frequency, wave, column", "spherical waves, W^1/2 per unit velocity of a coordinate"
    )
    plane_wave_resistance: FloatArray = array(
        "N s/m", "column, other_column=column", "radiation resistance at high frequency"
    )
    air: Air = value("speed_of_sound m/s, density kg/m3", "air around the body")
    reach: float = value("m", "farthest vertex from the middle of surface and image")
    plane: RigidPlane | None = value(
        "point m, unit normal into the air", "rigid plane; absent: free field", default=None
    )
    housing: str = value("", "content hash of the reduced housing, or empty", default="")
    cancellation: ComplexArray | None = array(
        "N s/m",
        "frequency, column, other_column=column",
        "resistance of the error of motions that cancel",
        default=None,
    )
    wall_waves: FloatArray | None = array(
        "N s/m",
        "column, other_column=column",
        "plane wave resistance, times (edges per wave on the walls)²",
        default=None,
    )
    accuracy: SoundAccuracy = value("", "stated accuracy", default=SoundAccuracy())

    def waves_at(self, master: int) -> ComplexArray:
        """Return the waves (n_row, n_column) of a master without the zero rows at its end."""
        used = np.flatnonzero(self.waves[master].any(axis=1))
        return self.waves[master, : used[-1] + 1 if len(used) else 0]

    @cached_property
    def inner_products(self) -> tuple[ComplexArray, ComplexArray]:
        """Inner products (n_master, n_master) of waves over frequency above 0 Hz, the first factor conjugate or not.

        Every column counts alike: its norm over all masters is 1.
        """
        above = np.flatnonzero(self.frequency > 0)
        values = self.waves[above] / self.frequency[above, None, None]
        square = sum(np.einsum("fwc,fwc->c", part, part) for part in (values.real, values.imag))
        values *= 1.0 / np.sqrt(np.where(square > 0, square, 1.0))
        values = values.reshape(len(above), -1)
        return values.conj() @ values.T, values @ values.T


class SolvedBand(HandOff):
    """Values of a step at a few consecutive frequencies: a checkpoint that is kept until the step is done."""

    frequency: FloatArray = array("Hz", "frequency", "frequency", lower_limit=0.0)
    values: ComplexArray = array("", "frequency, value", "values of a step, one row a frequency")
    shape: IntArray = array("1", "dimension", "shape of the values of one frequency")
    record: SolverRecord = value("", "how the systems were solved", default=SolverRecord())

    def _check(self) -> None:
        wanted = (len(self.frequency), int(np.prod(self.shape)))
        require(self.values.shape == wanted, f"SolvedBand.values has shape {self.values.shape}, but {wanted} is needed")
