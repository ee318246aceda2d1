"""The frozen objects that cross the borders between stages; each checks itself when it is made.

Leading axis frequency or time, C-contiguous float64/complex128 arrays, SI units (Hz on frequency axes).
"""

from __future__ import annotations

import dataclasses
import hashlib
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nvhchain.conventions import Air
from nvhchain.errors import InputError, require

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
IntArray = NDArray[np.int64]


def _array(owner: object, name: str, dtype: Any, shape: tuple[int | None, ...]) -> Any:
    """Replace field `name` by a read-only, finite, C-contiguous array of `dtype` and `shape` (None: any length)."""
    kind = type(owner).__name__
    given = getattr(owner, name)
    if np.iscomplexobj(given) and np.dtype(dtype).kind != "c":
        raise InputError(f"{kind}.{name} is complex, but must be real: take its real part explicitly")
    try:
        value = np.ascontiguousarray(given, dtype=dtype)
    except (TypeError, ValueError) as error:
        raise InputError(f"{kind}.{name} is not a numeric array: {error}") from None
    if value.ndim != len(shape) or any(n is not None and n != m for n, m in zip(shape, value.shape, strict=False)):
        wanted = ", ".join("any" if n is None else str(n) for n in shape)
        raise InputError(f"{kind}.{name} has shape {value.shape}, but ({wanted}) is needed")
    if value.dtype.kind in "fc" and not np.isfinite(value).all():
        bad = int(np.argmin(np.isfinite(value)))
        raise InputError(f"{kind}.{name} holds a value that is not finite (flat index {bad}): remove or repair it")
    if value is given or value.base is not None:
        value = value.copy()
    value.flags.writeable = False
    object.__setattr__(owner, name, value)
    return value


def _increasing(owner: object, name: str, minimum: float | None = None) -> None:
    """Check that the one-dimensional field `name` is not empty, strictly increasing and not below `minimum`."""
    kind, axis = type(owner).__name__, getattr(owner, name)
    require(len(axis) > 0, f"{kind}.{name} is empty: at least one value is needed")
    if len(axis) > 1 and not (np.diff(axis) > 0).all():
        at = int(np.argmin(np.diff(axis) > 0))
        raise InputError(
            f"{kind}.{name} must increase strictly, but goes {axis[at]:g} → {axis[at + 1]:g} at index {at}: sort it"
        )
    if minimum is not None and axis[0] < minimum:
        raise InputError(f"{kind}.{name} starts at {axis[0]:g}, below the lowest admissible value {minimum:g}")


def _names(owner: object, name: str, count: int | None = None) -> None:
    """Turn field `name` into a tuple of distinct strings."""
    kind, value = type(owner).__name__, tuple(getattr(owner, name))
    require(all(isinstance(v, str) and v for v in value), f"{kind}.{name} must be non-empty strings, got {value}")
    require(len(set(value)) == len(value), f"{kind}.{name} repeats a name: {value}")
    require(count is None or len(value) == count, f"{kind}.{name} has {len(value)} names, but {count} are needed")
    object.__setattr__(owner, name, value)


@dataclass(frozen=True, eq=False)
class HandOff:
    """What all hand-offs share: identity by content and the record of how they were made.

    provenance: what made the object (package version, stage, fidelity), stored with it and not part of its identity.
    """

    provenance: dict[str, Any] = field(default_factory=dict, kw_only=True, repr=False)

    @cached_property
    def content_hash(self) -> str:
        """SHA-256 over names, shapes and bytes of every field but the provenance."""
        digest = hashlib.sha256(type(self).__name__.encode())
        for f in dataclasses.fields(self):
            if f.name == "provenance":
                continue
            value = getattr(self, f.name)
            if value is None:
                continue  # what is absent leaves the identity of objects made before the field existed
            digest.update(f.name.encode())
            if isinstance(value, np.ndarray):
                digest.update(f"{value.dtype}{value.shape}".encode())
                digest.update(value.tobytes())
            elif isinstance(value, HandOff):
                digest.update(value.content_hash.encode())
            else:
                digest.update(repr(value).encode())
        return digest.hexdigest()

    def replace(self, **changes: Any) -> Any:
        """A new object with some fields changed and checked again."""
        return dataclasses.replace(self, **changes)


@dataclass(frozen=True, eq=False)
class MeshLaw(HandOff):
    """Force of a gear mesh against position and deflection: F(θ, δ), periodic in θ.

    angle: (n_angle,) rad, wheel angle from 0, one body period, end point left out.
    deflection: (n_defl,) m, δ = (r_bP φ_P − r_bG φ_G) cos β_b, > 0 closes the drive flank; need not be uniform.
    force: (n_angle, n_defl) N along the flank normal, never falling with δ, > 0 on the drive flank, 0 in the
        backlash gap, < 0 on the back flank; outside the tabulated range the end slope continues.
    period: rad of wheel angle after which the law repeats.  teeth: (z_pinion, z_wheel).
    base_radius: (2,) m, pinion and wheel.  base_helix_angle: rad, > 0 where the pinion is right-handed.
    working_pressure_angle: rad, transverse.  centre_distance, face_width: m.
    """

    angle: FloatArray
    deflection: FloatArray
    force: FloatArray
    period: float
    teeth: tuple[int, int]
    base_radius: FloatArray
    base_helix_angle: float
    working_pressure_angle: float
    centre_distance: float
    face_width: float

    def __post_init__(self) -> None:
        angle = _array(self, "angle", float, (None,))
        deflection = _array(self, "deflection", float, (None,))
        force = _array(self, "force", float, (len(angle), len(deflection)))
        _array(self, "base_radius", float, (2,))
        _increasing(self, "angle", 0.0)
        _increasing(self, "deflection")
        object.__setattr__(self, "teeth", tuple(int(z) for z in self.teeth))
        for name in ("period", "base_helix_angle", "working_pressure_angle", "centre_distance", "face_width"):
            object.__setattr__(self, name, float(getattr(self, name)))
        require(len(self.teeth) == 2 and min(self.teeth) > 0, f"MeshLaw.teeth = {self.teeth}: two positive counts")
        require(bool((self.base_radius > 0).all()), "MeshLaw.base_radius must be positive")
        require(len(deflection) >= 2, "MeshLaw.deflection needs at least two values")
        require(
            0 < self.period <= 2 * np.pi * self.teeth[0] * (1 + 1e-9) and angle[-1] < self.period,
            f"MeshLaw.period = {self.period:g} rad must be positive and beyond the last angle {angle[-1]:g}",
        )
        fall = np.diff(force, axis=1)
        worst = float(fall.min(initial=0.0))
        require(
            worst >= -1e-9 * float(np.abs(force).max(initial=0.0)),
            f"MeshLaw.force falls by {-worst:g} N between neighbouring deflections: it must never fall with deflection",
        )


@dataclass(frozen=True, eq=False)
class BearingForces(HandOff):
    """Bearing force histories, as they act on the housing.

    time: (n_t,) s, uniform.  force: (n_t, n_bearing, 3) N.  names: n_bearing.  positions: (n_bearing, 3) m.
    input_speed: (n_t,) rad/s of the input shaft (a scalar is spread over the record).
    periodic: True when the record covers whole common periods of a steady state.
    mesh_deflection: (n_t, n_mesh) m, dynamic deflection δ of each mesh; empty when not recorded.
    """

    time: FloatArray
    force: FloatArray
    names: tuple[str, ...]
    positions: FloatArray
    input_speed: FloatArray
    periodic: bool = False
    mesh_deflection: FloatArray = field(default_factory=lambda: np.empty((0, 0)))

    def __post_init__(self) -> None:
        time = _array(self, "time", float, (None,))
        force = _array(self, "force", float, (len(time), None, 3))
        _names(self, "names", force.shape[1])
        _array(self, "positions", float, (force.shape[1], 3))
        if np.ndim(self.input_speed) == 0:
            object.__setattr__(self, "input_speed", np.full(len(time), self.input_speed, dtype=float))
        _array(self, "input_speed", float, (len(time),))
        if np.size(self.mesh_deflection) == 0:
            object.__setattr__(self, "mesh_deflection", np.empty((len(time), 0)))
        _array(self, "mesh_deflection", float, (len(time), None))
        _increasing(self, "time")
        require(len(time) >= 2, f"BearingForces.time has {len(time)} samples: at least 2 are needed")
        step = np.diff(time)
        jitter = float(np.abs(step - step.mean()).max() / step.mean())
        require(
            jitter < 1e-4,
            f"BearingForces.time is not uniform (steps differ by {100 * jitter:.3g} % of the mean): resample it first",
        )

    @property
    def sample_rate(self) -> float:
        """Samples per second, Hz."""
        return float((len(self.time) - 1) / (self.time[-1] - self.time[0]))

    def in_order(self, names: tuple[str, ...]) -> FloatArray:
        """Force (n_t, 3 n_bearing) N with the bearings in the order of `names`, which must be the same ones."""
        return np.asarray(_in_order(self.force, self.names, names).reshape(len(self.time), -1))


@dataclass(frozen=True, eq=False)
class ForceSpectrum(HandOff):
    """Bearing force spectra, single-sided complex peak amplitudes under e^{+jωt}.

    frequency: (n_f,) Hz.  force: (n_f, n_bearing, 3) N.  names: n_bearing.
    input_speed: rad/s of the input shaft at constant speed, 0 when it varies.
    """

    frequency: FloatArray
    force: ComplexArray
    names: tuple[str, ...]
    input_speed: float = 0.0

    def __post_init__(self) -> None:
        frequency = _array(self, "frequency", float, (None,))
        force = _array(self, "force", complex, (len(frequency), None, 3))
        _names(self, "names", force.shape[1])
        _increasing(self, "frequency", 0.0)
        object.__setattr__(self, "input_speed", float(self.input_speed))

    def in_order(self, names: tuple[str, ...]) -> ComplexArray:
        """Force (n_f, 3 n_bearing) N with the bearings in the order of `names`, which must be the same ones."""
        return _in_order(self.force, self.names, names).reshape(len(self.frequency), -1)


def _in_order(force: Any, given: tuple[str, ...], names: tuple[str, ...]) -> Any:
    """Forces (n, n_bearing, 3) of the bearings `given` in the order of `names`."""
    unknown, missing = sorted(set(given) - set(names)), sorted(set(names) - set(given))
    require(
        not unknown and not missing,
        f"bearing names differ: the housing has {', '.join(names)}; unknown to it: "
        f"{', '.join(unknown) or 'none'}; without force: {', '.join(missing) or 'none'}",
    )
    return force[:, [given.index(name) for name in names]]


@dataclass(frozen=True, eq=False)
class Surface(HandOff):
    """A closed triangulated surface (one or more bodies) with outward normals.

    vertices: (n_v, 3) m.  triangles: (n_face, 3) vertex indices, counter-clockwise seen from outside.
    """

    vertices: FloatArray
    triangles: IntArray

    def __post_init__(self) -> None:
        vertices = _array(self, "vertices", float, (None, 3))
        if np.asarray(self.triangles).dtype.kind not in "iu":
            raise InputError("Surface.triangles must hold whole vertex indices")
        triangles = _array(self, "triangles", np.int64, (None, 3))
        require(len(triangles) >= 4, f"Surface has {len(triangles)} triangles: a closed surface needs at least 4")
        require(
            triangles.min() >= 0 and triangles.max() < len(vertices),
            f"Surface.triangles refer to vertices {triangles.min()}…{triangles.max()}, but there are {len(vertices)}",
        )
        require(
            len(np.unique(triangles)) == len(vertices),
            "Surface.vertices holds vertices that no triangle uses: remove them",
        )
        area = self.areas
        smallest = int(np.argmin(area))
        require(
            area[smallest] > 1e-12 * area.mean(),
            f"Surface triangle {smallest} has no area ({area[smallest]:.3g} m²): remove degenerate triangles",
        )
        self._check_closed()
        volume = self.volume
        require(
            volume > 0,
            f"Surface encloses {volume:.3g} m³: its normals point inward; flip the triangles (swap two columns)",
        )

    def _check_closed(self) -> None:
        edges = self.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        n = len(self.vertices)
        forward, backward = edges[:, 0] * n + edges[:, 1], edges[:, 1] * n + edges[:, 0]
        unique, count = np.unique(forward, return_counts=True)
        undirected, sides = np.unique(np.minimum(forward, backward), return_counts=True)
        open_edges = int((sides == 1).sum())
        require(
            open_edges == 0,
            f"Surface is open: {open_edges} edges belong to one triangle only; close it (cap the openings)",
        )
        require(
            bool((sides == 2).all()),
            f"Surface has {int((sides > 2).sum())} edges shared by more than two triangles: make it a manifold",
        )
        require(
            bool((count == 1).all()) and len(undirected) * 2 == len(unique),
            "Surface triangles are not oriented alike: neighbours must run along a common edge in opposite directions",
        )

    @cached_property
    def _cross(self) -> FloatArray:
        a, b, c = (self.vertices[self.triangles[:, i]] for i in range(3))
        return np.cross(b - a, c - a)

    @cached_property
    def areas(self) -> FloatArray:
        """(n_face,) m²."""
        return np.asarray(0.5 * np.linalg.norm(self._cross, axis=1))

    @cached_property
    def normals(self) -> FloatArray:
        """(n_face, 3) outward unit normals."""
        return np.asarray(self._cross / (2.0 * self.areas[:, None]))

    @cached_property
    def centroids(self) -> FloatArray:
        """(n_face, 3) m."""
        return np.asarray(self.vertices[self.triangles].mean(axis=1))

    @cached_property
    def longest_edges(self) -> FloatArray:
        """(n_face,) m, the longest edge of every triangle."""
        corners = self.vertices[self.triangles]
        return np.asarray(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1))

    @cached_property
    def volume(self) -> float:
        """Enclosed volume, m³; positive for outward normals."""
        centre = self.vertices.mean(axis=0)
        return float(np.einsum("ij,ij->", self._cross, self.centroids - centre) / 6.0)


@dataclass(frozen=True, eq=False)
class ReducedHousing(HandOff):
    """A housing as grounded normal modes plus residual flexibility at its bearing seats.

    natural_frequency: (n_mode,) Hz.  modal_damping: (n_mode,) fraction of critical.
    seat_shapes: (n_mode, n_bearing, 3) kg^-½, mass-normalised.  normal_shapes: (n_mode, n_face) kg^-½, outward.
    seat_residual: (n_bearing, 3, n_bearing, 3) m/N.  face_residual: (n_bearing, 3, n_face) m/N, outward.
    names: n_bearing.  positions: (n_bearing, 3) m.  surface: the radiating surface.
    """

    natural_frequency: FloatArray
    modal_damping: FloatArray
    seat_shapes: FloatArray
    normal_shapes: FloatArray
    seat_residual: FloatArray
    face_residual: FloatArray
    names: tuple[str, ...]
    positions: FloatArray
    surface: Surface

    def __post_init__(self) -> None:
        frequency = _array(self, "natural_frequency", float, (None,))
        n_mode, n_face = len(frequency), len(self.surface.triangles)
        damping = _array(self, "modal_damping", float, (n_mode,))
        seats = _array(self, "seat_shapes", float, (n_mode, None, 3))
        n_bearing = seats.shape[1]
        _array(self, "normal_shapes", float, (n_mode, n_face))
        residual = _array(self, "seat_residual", float, (n_bearing, 3, n_bearing, 3))
        _array(self, "face_residual", float, (n_bearing, 3, n_face))
        _names(self, "names", n_bearing)
        _array(self, "positions", float, (n_bearing, 3))
        require(
            bool((frequency >= 0).all() and (np.diff(frequency) >= 0).all()),
            "ReducedHousing.natural_frequency must be sorted and not negative",
        )
        require(
            bool(((damping >= 0) & (damping < 1)).all()),
            "ReducedHousing.modal_damping must lie in 0 … 1 (fraction of critical damping)",
        )
        matrix = residual.reshape(3 * n_bearing, -1)
        require(
            bool(np.abs(matrix - matrix.T).max(initial=0.0) <= 1e-6 * np.abs(matrix).max(initial=0.0)),
            "ReducedHousing.seat_residual must be symmetric",
        )

    def receptance(self, frequency: FloatArray, *, structural: bool = False) -> ComplexArray:
        """Modal coordinate per modal force (n_f, n_mode) s² at `frequency` (n_f,) Hz.

        1/(ω_r² − ω² + 2jζω_rω), or 1/(ω_r²(1 + 2jζ) − ω²) with `structural` damping of loss factor 2ζ.
        """
        omega = 2 * np.pi * np.asarray(frequency)[:, None]
        natural = 2 * np.pi * self.natural_frequency
        loss = 2j * self.modal_damping * natural * (natural if structural else omega)
        return np.asarray(1.0 / (natural**2 - omega**2 + loss))


@dataclass(frozen=True, eq=False)
class SurfaceVelocity(HandOff):
    """Outward normal velocity of every face.

    frequency: (n_f,) Hz.  normal_velocity: (n_f, n_face) complex m/s, peak.  surface: the radiating surface.
    """

    frequency: FloatArray
    normal_velocity: ComplexArray
    surface: Surface

    def __post_init__(self) -> None:
        frequency = _array(self, "frequency", float, (None,))
        _increasing(self, "frequency", 0.0)
        _array(self, "normal_velocity", complex, (len(frequency), len(self.surface.triangles)))


@dataclass(frozen=True)
class RigidPlane:
    """A rigid plane that reflects all sound; bodies and field points lie on the side its normal points to.

    point: m, any point of the plane.  normal: any length, into the air; kept with unit length.
    """

    point: tuple[float, float, float]
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
    """

    frequency: FloatArray
    points: FloatArray
    vectors: ComplexArray
    surface: Surface
    air: Air
    plane: RigidPlane | None = None
    image_vectors: ComplexArray | None = None

    def __post_init__(self) -> None:
        frequency = _array(self, "frequency", float, (None,))
        points = _array(self, "points", float, (None, 3))
        _increasing(self, "frequency", 0.0)
        require(len(points) > 0, "TransferVectors.points is empty: at least one field point is needed")
        shape = (len(frequency), len(points), len(self.surface.triangles))
        _array(self, "vectors", complex, shape)
        require(
            (self.plane is None) == (self.image_vectors is None),
            "TransferVectors.image_vectors belong to a plane: give both or neither",
        )
        if self.image_vectors is not None:
            _array(self, "image_vectors", complex, shape)

    def unfolded(self) -> TransferVectors:
        """The same vectors without a plane, to the points and then to their mirror images (2 n_point in all).

        The pressure at a point is the sum of both. Each part has the one phase of its own path, which interpolation
        between masters removes. Without a plane: the vectors themselves.
        """
        if self.plane is None or self.image_vectors is None:
            return self
        return TransferVectors(
            self.frequency,
            np.concatenate([self.points, self.plane.mirror(self.points)]),
            np.concatenate([self.vectors - self.image_vectors, self.image_vectors], axis=1),
            self.surface,
            self.air,
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
        frequency = _array(self, "frequency", float, (None,))
        points = _array(self, "points", float, (None, 3))
        _increasing(self, "frequency", 0.0)
        _array(self, "modes", complex, (len(frequency), len(points), None))
        residual = _array(self, "residual", complex, (len(frequency), len(points), None, 3))
        _names(self, "names", residual.shape[2])


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
        frequency = _array(self, "frequency", float, (None,))
        points = _array(self, "points", float, (None, 3))
        _increasing(self, "frequency", 0.0)
        functions = _array(self, "functions", complex, (len(frequency), len(points), None, 3))
        _names(self, "names", functions.shape[2])


@dataclass(frozen=True, eq=False)
class FieldPressure(HandOff):
    """Sound pressure at field points.

    frequency: (n_f,) Hz.  points: (n_point, 3) m.  pressure: (n_f, n_point) complex Pa, peak.
    input_speed: rad/s of the input shaft at constant speed, 0 when there is none.
    """

    frequency: FloatArray
    points: FloatArray
    pressure: ComplexArray
    input_speed: float = 0.0

    def __post_init__(self) -> None:
        frequency = _array(self, "frequency", float, (None,))
        points = _array(self, "points", float, (None, 3))
        _increasing(self, "frequency", 0.0)
        _array(self, "pressure", complex, (len(frequency), len(points)))
        object.__setattr__(self, "input_speed", float(self.input_speed))


@dataclass(frozen=True, eq=False)
class PressureHistory(HandOff):
    """Sound pressure in time at field points.

    time: (n_t,) s, uniform.  points: (n_point, 3) m.  pressure: (n_t, n_point) Pa.
    input_speed: (n_t,) rad/s of the input shaft (a scalar is spread over the record).
    """

    time: FloatArray
    points: FloatArray
    pressure: FloatArray
    input_speed: FloatArray

    def __post_init__(self) -> None:
        time = _array(self, "time", float, (None,))
        points = _array(self, "points", float, (None, 3))
        _increasing(self, "time")
        require(len(time) >= 2, f"PressureHistory.time has {len(time)} samples: at least 2 are needed")
        _array(self, "pressure", float, (len(time), len(points)))
        if np.ndim(self.input_speed) == 0:
            object.__setattr__(self, "input_speed", np.full(len(time), self.input_speed, dtype=float))
        _array(self, "input_speed", float, (len(time),))


@dataclass(frozen=True, eq=False)
class SurfacePressure(HandOff):
    """Sound pressure at the vertices of the radiating surface.

    frequency: (n_f,) Hz.  pressure: (n_f, n_v) complex Pa, peak.  surface: the radiating surface.
    """

    frequency: FloatArray
    pressure: ComplexArray
    surface: Surface

    def __post_init__(self) -> None:
        frequency = _array(self, "frequency", float, (None,))
        _array(self, "pressure", complex, (len(frequency), len(self.surface.vertices)))


@dataclass(frozen=True, eq=False)
class SoundPower(HandOff):
    """Time-averaged radiated sound power.  frequency: (n_f,) Hz.  power: (n_f,) W."""

    frequency: FloatArray
    power: FloatArray

    def __post_init__(self) -> None:
        frequency = _array(self, "frequency", float, (None,))
        _array(self, "power", float, (len(frequency),))


HAND_OFFS: dict[str, type[HandOff]] = {
    cls.__name__: cls
    for cls in (
        MeshLaw,
        BearingForces,
        ForceSpectrum,
        ReducedHousing,
        Surface,
        SurfaceVelocity,
        TransferVectors,
        ModalTransferVectors,
        NoiseTransferFunctions,
        FieldPressure,
        PressureHistory,
        SurfacePressure,
        SoundPower,
    )
}
"""Every hand-off by name, as `store` writes it."""
