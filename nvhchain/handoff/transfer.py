"""What turns surface motion into sound pressure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nvhchain.conventions import Air
from nvhchain.dimensions import Length
from nvhchain.errors import require
from nvhchain.handoff.base import (
    ComplexArray,
    FloatArray,
    HandOff,
    IntArray,
    array,
    distinct_names,
    frequencies,
    increasing,
)
from nvhchain.handoff.surface import Surface


@dataclass(frozen=True)
class RigidPlane:
    """A rigid plane that reflects all sound; bodies and field points lie on the side its normal points to.

    point: m, any point of the plane.  normal: any length, into the air; kept with unit length.
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
                value = value if abs(length - 1.0) < 1e-14 else value / length  # stored planes come back bit for bit
            object.__setattr__(self, name, tuple(value.tolist()))

    def height(self, points: FloatArray) -> FloatArray:
        """Distance (n,) m of points (n, 3) m from the plane, positive on the side of the air."""
        return np.asarray((points - np.asarray(self.point)) @ np.asarray(self.normal))

    def mirror(self, points: FloatArray) -> FloatArray:
        """Mirror images (n, 3) m of points (n, 3) m."""
        return np.asarray(points - 2.0 * self.height(points)[:, None] * np.asarray(self.normal))

    def mirror_direction(self, vectors: NDArray[Any]) -> NDArray[Any]:
        """Mirror images (n, 3) of directions (n, 3): the component along the normal changes its sign."""
        normal = np.asarray(self.normal)
        return np.asarray(vectors - 2.0 * (vectors @ normal)[:, None] * normal)


@dataclass(frozen=True, eq=False)
class TransferVectors(HandOff):
    """Acoustic transfer vectors at master frequencies: p = vectors · v_n.

    frequency: (n_f,) Hz.  points: (n_point, 3) m.  vectors: (n_f, n_point, n_face) complex Pa/(m/s).
    plane: a rigid plane near the body, or None for a free field.
    image_vectors: (n_f, n_point, n_face) complex Pa/(m/s), with a plane: the part of `vectors` that reaches the points
        by way of the plane, as if it went to their mirror images; its phase is that of the longer path.
    breaks: (n_break,) Hz, masters that end a piece of the band, or None: from the next master on the vectors are those
        of another surface (`fidelity.coarse_edge_ratios`), and nothing is known of the lines between both.
    """

    frequency: FloatArray
    points: FloatArray
    vectors: ComplexArray
    surface: Surface
    air: Air
    plane: RigidPlane | None = None
    image_vectors: ComplexArray | None = None
    breaks: FloatArray | None = None

    def __post_init__(self) -> None:
        frequency = frequencies(self)
        points = array(self, "points", float, (None, 3))
        require(len(points) > 0, "TransferVectors.points is empty: at least one field point is needed")
        shape = (len(frequency), len(points), len(self.surface.triangles))
        array(self, "vectors", complex, shape)
        require(
            (self.plane is None) == (self.image_vectors is None),
            "TransferVectors.image_vectors belong to a plane: give both or neither",
        )
        if self.image_vectors is not None:
            array(self, "image_vectors", complex, shape)
        if self.breaks is not None:
            array(self, "breaks", float, (None,))
            increasing(self, "breaks")
            require(
                bool(np.isin(self.breaks, frequency[:-1]).all()),
                f"TransferVectors.breaks {self.breaks} Hz end pieces of the band: each must be a master, not the last",
            )

    def unfolded(self) -> TransferVectors:
        """The same vectors without a plane, to the points and then to their mirror images (2 n_point in all).

        The pressure at a point is the sum of both. Each part has the one phase of its own path, which interpolation
        between masters removes. Without a plane: the vectors themselves.
        """
        if self.plane is None or self.image_vectors is None:
            return self
        points = len(self.points)
        both = np.empty((len(self.frequency), 2 * points, self.vectors.shape[2]), dtype=complex)
        np.subtract(self.vectors, self.image_vectors, out=both[:, :points])
        both[:, points:] = self.image_vectors
        both.flags.writeable = False  # and so it is taken without another copy
        return TransferVectors(
            self.frequency,
            np.concatenate([self.points, self.plane.mirror(self.points)]),
            both,
            self.surface,
            self.air,
            breaks=self.breaks,
            provenance=self.provenance,
        )


@dataclass(frozen=True, eq=False)
class ModalTransferVectors(HandOff):
    """Transfer vectors times the shapes of a reduced housing: p = modes · q̇ + residual · Ḟ.

    frequency: (n_f,) Hz, the lines of a load case.  points: (n_point, 3) m.
    modes: (n_f, n_point, n_mode) complex Pa per unit velocity of a modal coordinate, Pa s/(m kg^½).
    residual: (n_f, n_point, n_bearing, 3) complex Pa per unit rate of a bearing force, Pa s/N.
    names: n_bearing.  housing: content hash of the reduced housing whose shapes they are.
    """

    frequency: FloatArray
    points: FloatArray
    modes: ComplexArray
    residual: ComplexArray
    names: tuple[str, ...]
    housing: str
    air: Air

    def __post_init__(self) -> None:
        frequency = frequencies(self)
        points = array(self, "points", float, (None, 3))
        array(self, "modes", complex, (len(frequency), len(points), None))
        residual = array(self, "residual", complex, (len(frequency), len(points), None, 3))
        distinct_names(self, "names", residual.shape[2])


@dataclass(frozen=True, eq=False)
class NoiseTransferFunctions(HandOff):
    """Sound pressure per bearing force: p = functions · F.

    frequency: (n_f,) Hz.  points: (n_point, 3) m.  functions: (n_f, n_point, n_bearing, 3) complex Pa/N.
    names: n_bearing.
    """

    frequency: FloatArray
    points: FloatArray
    functions: ComplexArray
    names: tuple[str, ...]
    air: Air

    def __post_init__(self) -> None:
        frequency = frequencies(self)
        points = array(self, "points", float, (None, 3))
        functions = array(self, "functions", complex, (len(frequency), len(points), None, 3))
        distinct_names(self, "names", functions.shape[2])


@dataclass(frozen=True, eq=False)
class RadiationResistance(HandOff):
    """Spherical waves that leave a surface per unit velocity of its coordinates, at master frequencies.

    frequency: (n_f,) Hz.  waves: (n_f, n_wave, n_column) complex √W per unit of q̇, so that P = ½ |waves q̇|²
    and the radiation resistance matrix is R = Re(wavesᴴ waves), positive semidefinite by its making; rows beyond those
    that count at a frequency are zero.
    plane_wave_resistance: (n_column, n_column) ρc ∫ φ_i φ_j dS, what R tends to at high frequency; ½ q̇ᴴ … q̇ is the
    equivalent radiated power.
    reach: m, of the farthest vertex from the middle of the surface and, above a plane, of its image.
    plane: a rigid plane near the body, or None for a free field.
    housing: content hash of the reduced housing whose modes and residual motions the columns are, or empty.
    cancellation: (n_f, n_column, n_column) N s/m, hermitian: ½ q̇ᴴ … q̇ is a power that bounds what the mesh leaves where
        parts of a motion cancel each other, or None where that is not known.
    wall_waves: (n_column, n_column) ρc ∫ (h ∇φ_i/2π)·(h ∇φ_j/2π) dS N s/m, h the mean edge: its form over that of the
        plane waves is the square of mean edges to a wave on the walls; or None where that is not known.
    """

    frequency: FloatArray
    waves: ComplexArray
    plane_wave_resistance: FloatArray
    air: Air
    reach: float
    plane: RigidPlane | None = None
    housing: str = ""
    cancellation: ComplexArray | None = None
    wall_waves: FloatArray | None = None

    def __post_init__(self) -> None:
        frequency = frequencies(self)
        waves = array(self, "waves", complex, (len(frequency), None, None))
        array(self, "plane_wave_resistance", float, (waves.shape[2], waves.shape[2]))
        if self.cancellation is not None:
            array(self, "cancellation", complex, (len(frequency), waves.shape[2], waves.shape[2]))
        if self.wall_waves is not None:
            array(self, "wall_waves", float, (waves.shape[2], waves.shape[2]))

    def waves_at(self, master: int) -> ComplexArray:
        """The waves (n_row, n_column) of a master without the rows that are zero at its end."""
        used = np.flatnonzero(self.waves[master].any(axis=1))
        return self.waves[master, : used[-1] + 1 if len(used) else 0]


@dataclass(frozen=True, eq=False)
class SolvedBand(HandOff):
    """What a stage found at a few consecutive frequencies, kept until the stage is done.

    frequency: (n_f,) Hz.  values: (n_f, n) complex, those of a frequency one after the other.  shape: (n_axis,) of the
    values of one frequency.
    """

    frequency: FloatArray
    values: ComplexArray
    shape: IntArray

    def __post_init__(self) -> None:
        frequency = frequencies(self)
        shape = array(self, "shape", np.int64, (None,))
        array(self, "values", complex, (len(frequency), int(np.prod(shape))))
