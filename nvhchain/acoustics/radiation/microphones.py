"""Microphone arrays of the sound power standards: positions, sound power and the error of the near field."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from nvhchain.acoustics.surfaces.clustering import diameter
from nvhchain.acoustics.surfaces.surface import real_numbers
from nvhchain.acoustics.waves.multipoles import plane_axes
from nvhchain.conventions import Air
from nvhchain.errors import require, warn_caller
from nvhchain.handoff import FieldPressure, FloatArray, RigidPlane, SoundAccuracy, SoundPower, Surface, warn_of
from nvhchain.kinds import checked

ARRAYS = ("ISO 3744", "ISO 3745")
"""Standards with known microphone positions: engineering and precision grade."""

NEAREST = 2.0
"""Smallest radius of an array in characteristic source dimensions, ISO 3744:2010 and ISO 3745:2012."""

_FEWEST = 6
"""Smallest number of positions of an array."""

_ROUND = 1e-6
"""Tolerance of positions on their sphere, relative to its radius and their distance from the origin."""

_UNEVEN = 0.1
"""Tolerance of the mean of positions against that of their sphere or hemisphere, in radii: 0.005 for ISO 3744."""

# Azimuths (degrees) of the positions of ISO 3745:2012, from the equator up. Annex D: sphere, upper half; the other half
# lies opposite. Annex E: hemisphere.
_SPHERE_AZIMUTH = (180, 300, 60, 120, 240, 0, 60, 180, 300, 0)
_HEMISPHERE_AZIMUTH = (*_SPHERE_AZIMUTH, 120, 240, 300, 60, 180, 240, 0, 120, 180, 300)


@checked
def array_points(
    radius: float,
    centre: ArrayLike = (0.0, 0.0, 0.0),
    *,
    reflecting_plane: RigidPlane | bool = False,
    standard: str = "ISO 3744",
) -> FloatArray:
    """Return microphone positions on a sphere or, above a reflecting plane, on a hemisphere.

    radius: radius of the array (m).
    centre (3,): centre of the array (m).
    reflecting_plane: plane on which the hemisphere stands, about the foot of `centre` on it. True stands for the plane
    z = centre z. Without a plane, the array is a whole sphere for a source in a free field.
    standard: `ISO 3744` (2010, table B.1): three rings of six at z/r = 0.15, 0.45 and 0.75, and two positions at the
    top. The sphere adds their mirror images (40 in all). `ISO 3745` (2012): 20 positions at 20 equally spaced heights.
    Returns (n_point, 3): positions (m), each for the same area.
    """
    _check_radius(radius)
    require(standard in ARRAYS, f"array standard {standard!r} is unknown: choose from {', '.join(ARRAYS)}")
    middle = real_numbers(centre, "coordinates of the array's centre")
    require(
        middle.shape == (3,) and bool(np.isfinite(middle).all()),
        f"centre {np.asarray(centre).tolist()} of the array: three finite coordinates in m are needed",
    )
    half = bool(reflecting_plane)
    if standard == "ISO 3744":
        height = np.repeat([0.15, 0.45, 0.75, 1.0], [6, 6, 6, 2])
        azimuth = np.radians(np.arange(20) * 60.0)
    else:
        azimuth = np.radians(_HEMISPHERE_AZIMUTH if half else _SPHERE_AZIMUTH)
        height = (np.arange(len(azimuth)) + 0.5) / len(azimuth)
    ring_radius = np.sqrt(1.0 - height**2)
    unit = np.stack([ring_radius * np.cos(azimuth), ring_radius * np.sin(azimuth), height], axis=1)
    if not half:
        opposite = [1.0, 1.0, -1.0] if standard == "ISO 3744" else [-1.0, -1.0, -1.0]
        unit = np.concatenate([unit, unit * opposite])
    if isinstance(reflecting_plane, RigidPlane):
        middle = middle - reflecting_plane.height(middle[None])[0] * np.asarray(reflecting_plane.normal)
        unit = unit @ plane_axes(reflecting_plane)
    return middle + radius * unit


@checked
def array_power(pressure: FieldPressure, radius: float, air: Air, *, reflecting_plane: bool = False) -> SoundPower:
    """Compute sound power from the mean square pressure over an array: W = ⟨p²⟩ S/(ρc), ISO 3744:2010.

    pressure: sound pressure (Pa) at the positions of `array_points`.
    radius: radius of the array (m).
    reflecting_plane: S is the area of a hemisphere instead of a sphere.
    Returns power (W). The accuracy states `array_sampling_db`, the largest standard error of the mean over the
    positions. It also holds `array_near_field_db`, the level that the near field adds to a dipole at the lowest line:
    10 lg(1 + 1/(kr)²).

    The standards' corrections for background noise and room (K1, K2) are zero in a computed field. The value of ρc is
    that of `air`, so that the reference conditions of ISO 3745 (C1, C2) do not enter. The near field adds nothing to a
    monopole and more to higher orders than to a dipole.
    """
    _check_radius(radius)
    _check_positions(pressure.points, radius, reflecting_plane)
    area = (2.0 if reflecting_plane else 4.0) * np.pi * radius**2
    square = 0.5 * np.abs(pressure.pressure) ** 2
    mean_square = square.mean(axis=1)
    loud = np.flatnonzero((mean_square > 0) & (pressure.frequency > 0))
    told = SoundAccuracy()
    if len(loud):
        scatter = square[loud].std(axis=1) / (mean_square[loud] * np.sqrt(square.shape[1]))
        lowest = float(pressure.frequency[loud[0]])
        kr = 2 * np.pi * lowest / air.speed_of_sound * radius
        told = SoundAccuracy(
            lowest_frequency=lowest,
            array_radius=radius,
            array_needed_radius=0.25 * air.speed_of_sound / lowest,
            array_near_field_db=float(10 * np.log10(1 + kr**-2)),
            array_sampling_db=float(10 * np.log10(1 + scatter.max())),
        )
        warn_of(told)
    return SoundPower(
        pressure.frequency.copy(),
        mean_square * area / air.impedance,
        accuracy=pressure.accuracy | told,
        provenance=pressure.provenance,
    )


def source_dimension(surface: Surface, plane: RigidPlane | None) -> float:
    """Return the characteristic source dimension d₀ (m): half the diagonal of the reference box (ISO 3744:2010).

    Above a reflecting plane, the box stands on the plane and includes its mirror image.
    """
    if plane is None:
        return 0.5 * diameter(surface.vertices)
    extent = np.ptp(surface.vertices @ plane_axes(plane)[:2].T, axis=0)
    return float(np.linalg.norm([*(0.5 * extent), plane.height(surface.vertices).max()]))


def check_array(
    surface: Surface, radius: float, plane: RigidPlane | None, highest: float, air: Air, standard: str
) -> None:
    """Warn of an array that is too near to the source or too coarse for it.

    An AccuracyWarning names a `radius` (m) below `NEAREST` source dimensions. Another one names positions that may miss
    the lobes of the source at the frequency `highest` (Hz).

    The mean square pressure of a source of dimension d₀ oscillates over the height as e^{2jkd₀ cos θ} at most.
    Positions Δ radii apart in height alias this to a constant at k d₀ Δ = π. The power of a monopole high above a plane
    errs by 0.5 dB up to three quarters of that, where the warning begins. At k d₀ Δ = π it errs by up to 14 dB (closed
    form).
    """
    _check_radius(radius)
    dimension = source_dimension(surface, plane)
    if radius < NEAREST * dimension:
        warn_caller(
            f"array radius {radius:g} m is {radius / dimension:.2g} times the source's dimension of {dimension:.3g} m, "
            f"{NEAREST:g} times are needed (ISO 3744): its positions see single parts of the surface; take "
            f"{NEAREST * dimension:.3g} m or more",
            kind="array radius",
        )
    step = 0.3 if standard == "ISO 3744" else 0.1 if plane is None else 0.05
    resolved = 0.375 * air.speed_of_sound / (dimension * step)
    if highest > resolved:
        warn_caller(
            f"the positions of {standard} lie {step:g} radii apart in height, which resolves the lobes of a source of "
            f"{dimension:.3g} m up to {resolved:.4g} Hz; {highest:.4g} Hz asked: the power of a tone may be several dB "
            f"off above; take {'ISO 3745 or ' if step == 0.3 else ''}the power from the surface",
            kind="array positions",
        )


def _check_positions(points: FloatArray, radius: float, half: bool) -> None:
    """Raise InputError unless points (n_point, 3) m lie on a sphere of `radius` m.

    They must be spread evenly over all of the sphere or, if `half`, over one half.
    """
    remedy = "take the pressure at array_points of the same radius"
    require(len(points) >= _FEWEST, f"{len(points)} positions make no array, {_FEWEST} are needed: {remedy}")
    middle = points.mean(axis=0)
    offset = points - middle
    # |x − c|² − |c|² is the same at all points of a sphere with any centre c
    columns = np.concatenate([2.0 * offset, np.ones((len(points), 1))], axis=1)
    centre = np.linalg.lstsq(columns, (offset**2).sum(axis=1), rcond=None)[0][:3]
    distance = np.linalg.norm(offset - centre, axis=1)
    require(
        float(np.abs(distance - radius).max()) <= _ROUND * (radius + float(np.abs(points).max())),
        f"positions lie {distance.min():.6g} to {distance.max():.6g} m from the middle of the sphere that fits them "
        f"best, not {radius:g} m: {remedy}",
    )
    uneven, even = float(np.linalg.norm(centre)) / radius, 0.5 if half else 0.0
    require(
        abs(uneven - even) < _UNEVEN,
        f"the positions' mean is {uneven:.3g} radii from their sphere's centre, {even:g} are needed where they are "
        f"spread over {'half' if half else 'all'} of it: {remedy}{'' if half else ', or give reflecting_plane'}",
    )


def _check_radius(radius: float) -> None:
    require(0 < radius < np.inf, f"array radius {radius:g} m must be positive and finite")
