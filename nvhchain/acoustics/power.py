"""Radiated sound power from the intensity on the surface or from a microphone array."""

from __future__ import annotations

from concurrent.futures import Executor

import numpy as np
from numpy.typing import ArrayLike

from nvhchain.acoustics.direct import galerkin_pressure, solve_direct
from nvhchain.acoustics.efficiency import equivalent_radiated_power
from nvhchain.acoustics.rayleigh import rayleigh_field
from nvhchain.acoustics.transfer import made_by
from nvhchain.conventions import Air, Progress
from nvhchain.errors import require
from nvhchain.fidelity import STANDARD, AcousticsFidelity
from nvhchain.handoff import FieldPressure, FloatArray, RigidPlane, SoundPower, SurfaceVelocity

ARRAYS = ("ISO 3744", "ISO 3745")
"""Standards whose microphone positions are known: engineering and precision grade."""

# Azimuths in degrees of the positions of ISO 3745:2012, from the equator up: annex D (sphere, upper half; the other
# half lies opposite) and annex E (hemisphere).
_SPHERE_AZIMUTH = (180, 300, 60, 120, 240, 0, 60, 180, 300, 0)
_HEMISPHERE_AZIMUTH = (*_SPHERE_AZIMUTH, 120, 240, 300, 60, 180, 240, 0, 120, 180, 300)


def array_points(
    radius: float,
    centre: ArrayLike = (0.0, 0.0, 0.0),
    *,
    reflecting_plane: RigidPlane | bool = False,
    standard: str = "ISO 3744",
) -> FloatArray:
    """Microphone positions on a sphere or, above a reflecting plane, on a hemisphere, each for the same area, m.

    standard: `ISO 3744` (2010, table B.1): three rings of six at z/r = 0.15, 0.45 and 0.75 and two at the top, on the
    sphere with their mirror images (40 in all); `ISO 3745` (2012): 20 positions at 20 equally spaced heights.
    reflecting_plane: the hemisphere stands on this plane, about the foot of `centre` on it (True: on the plane
    z = centre z); without it the array is a whole sphere for a source in a free field.
    """
    require(radius > 0, f"array radius {radius:g} m must be positive")
    require(standard in ARRAYS, f"array standard {standard!r} is unknown: choose from {', '.join(ARRAYS)}")
    half = bool(reflecting_plane)
    if standard == "ISO 3744":
        height = np.repeat([0.15, 0.45, 0.75, 1.0], [6, 6, 6, 2])
        azimuth = np.radians(np.arange(20) * 60.0)
    else:
        azimuth = np.radians(_HEMISPHERE_AZIMUTH if half else _SPHERE_AZIMUTH)
        height = (np.arange(len(azimuth)) + 0.5) / len(azimuth)
    across = np.sqrt(1.0 - height**2)
    unit = np.stack([across * np.cos(azimuth), across * np.sin(azimuth), height], axis=1)
    if not half:
        opposite = [1.0, 1.0, -1.0] if standard == "ISO 3744" else [-1.0, -1.0, -1.0]
        unit = np.concatenate([unit, unit * opposite])
    middle = np.asarray(centre, dtype=float)
    if isinstance(reflecting_plane, RigidPlane):
        normal = np.asarray(reflecting_plane.normal)
        middle = middle - reflecting_plane.height(middle[None])[0] * normal
        first = np.cross(np.roll(np.eye(3)[np.abs(normal).argmax()], 1), normal)
        first /= np.linalg.norm(first)
        unit = unit @ np.stack([first, np.cross(normal, first), normal])
    return middle + radius * unit


def array_power(pressure: FieldPressure, radius: float, air: Air, *, reflecting_plane: bool = False) -> SoundPower:
    """Sound power from the mean square pressure over an array of `array_points`: W = ⟨p²⟩ S/(ρc), ISO 3744:2010.

    pressure: at the array's positions.  radius: m.  reflecting_plane: S is a hemisphere instead of a sphere.
    Assumes the array in the far field (ISO 3744: radius at least twice the source's size, no less than λ/4 or so).
    """
    area = (2.0 if reflecting_plane else 4.0) * np.pi * radius**2
    mean_square = 0.5 * (np.abs(pressure.pressure) ** 2).mean(axis=1)
    return SoundPower(
        pressure.frequency.copy(), mean_square * area / air.impedance, provenance=dict(pressure.provenance)
    )


def sound_power(
    surface_velocity: SurfaceVelocity,
    *,
    air: Air = Air(),  # noqa: B008 (frozen)
    fidelity: AcousticsFidelity = STANDARD.acoustics,
    engine: str = "fused",
    plane: RigidPlane | None = None,
    array_radius: float | None = None,
    array_standard: str = "ISO 3744",
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> SoundPower:
    """Sound power that a vibrating surface radiates into a free field or above a plane, W = ½ Re ∫ p v_n* dS.

    array_radius: m; without it the intensity on the surface is integrated, with it the pressure is taken at the
    positions of `array_standard` on a sphere of this radius about the surface's centre, or on a hemisphere on the plane
    (`array_points`), as a measurement would.
    fidelity.radiation: `rayleigh` needs an array, as it knows no pressure on the surface; `equivalent_radiated_power`
    is a power by itself.  The other arguments and errors are those of `transfer_vectors`.
    """
    if fidelity.radiation == "equivalent_radiated_power":
        return equivalent_radiated_power(surface_velocity, air)
    require(
        fidelity.radiation == "boundary_elements" or array_radius is not None,
        "the Rayleigh integral knows no pressure on the surface: give array_radius, or use boundary_elements",
    )
    if array_radius is None:
        # Integrals over the surface want the best fit, not the vertex values.
        pressure = galerkin_pressure(
            surface_velocity,
            None,
            air=air,
            fidelity=fidelity,
            engine=engine,
            plane=plane,
            executor=executor,
            progress=progress,
        )
        surface, velocity = surface_velocity.surface, surface_velocity.normal_velocity
        intensity = 0.5 * np.real(pressure[:, surface.triangles].mean(axis=2) * velocity.conj())
        power = SoundPower(surface_velocity.frequency, intensity @ surface.areas)
    else:
        vertices = surface_velocity.surface.vertices
        middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
        points = array_points(array_radius, middle, reflecting_plane=plane or False, standard=array_standard)
        if fidelity.radiation == "rayleigh":
            field = rayleigh_field(surface_velocity, points, air, fidelity.field_near_ratio, plane)
        else:
            field = solve_direct(
                surface_velocity,
                points,
                air=air,
                fidelity=fidelity,
                engine=engine,
                plane=plane,
                executor=executor,
                progress=progress,
            )
        power = array_power(field, array_radius, air, reflecting_plane=plane is not None)
    return power.replace(provenance=made_by("sound_power", fidelity, engine))
