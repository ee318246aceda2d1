"""Directivity of a radiating body at field points, with a check that they lie in the far field."""

from __future__ import annotations

import numpy as np

from nvhchain.acoustics.radiation.efficiency import directivity_index
from nvhchain.acoustics.radiation.microphones import NEAREST, source_dimension
from nvhchain.acoustics.waves.multipoles import plane_foot
from nvhchain.conventions import Air
from nvhchain.errors import require
from nvhchain.handoff import Directivity, FieldPressure, RigidPlane, SoundAccuracy, SoundPower, Surface, warn_of
from nvhchain.kinds import checked


@checked
def directivity(
    pressure: FieldPressure, power: SoundPower, surface: Surface, air: Air, *, plane: RigidPlane | None = None
) -> Directivity:
    """Compute the directivity of a radiating surface at its field points, at the lines that radiate.

    Parameters
    ----------
    pressure : FieldPressure
        Sound pressure (Pa) at the field points.
    power : SoundPower
        Sound power (W) at the same lines.
    surface : Surface
        Radiating surface. Distances count from its middle or, above a plane, from the foot of its middle on the plane.
    air : Air
        Density and speed of sound.
    plane : RigidPlane, optional
        Reflecting plane.

    Returns
    -------
    Directivity
        Directivity index (dB), see `directivity_index`. The accuracy states `near_field_db`, the level that the near
        field adds to a dipole at the nearest point and the lowest line: 10 lg(1 + 1/(kr)²).

    Raises
    ------
    InputError
        If the lines differ or nothing is radiated.

    Warns
    -----
    AccuracyWarning
        If a point is nearer than a quarter of a wavelength at the lowest line, or nearer than twice the source's
        dimension (ISO 3744). The index depends on the distance there.
    """
    loud = power.power > 0
    require(bool(loud.any()), "nothing is radiated at any line: directivity needs a power")
    lines = np.flatnonzero(loud)
    heard = pressure
    if len(pressure.frequency) == len(loud):
        heard = pressure.replace(frequency=pressure.frequency[lines], pressure=pressure.pressure[lines])
    radiated = power.replace(frequency=power.frequency[lines], power=power.power[lines])
    centre = plane_foot(surface, plane)
    index = directivity_index(heard, radiated, centre, air, plane=plane)
    told = _far_field(surface, heard, centre, air, plane)
    warn_of(told)
    return Directivity(
        heard.frequency,
        heard.points,
        index,
        power.input_speed,
        power.accuracy | pressure.accuracy | told,
        provenance=power.provenance | pressure.provenance | {"stage": "acoustics.directivity"},
    )


def _far_field(
    surface: Surface, pressure: FieldPressure, centre: np.ndarray, air: Air, plane: RigidPlane | None
) -> SoundAccuracy:
    """Return the near-field error at the nearest point, and the distance that is needed."""
    distance = np.linalg.norm(pressure.points - centre, axis=1)
    nearest, lowest = int(distance.argmin()), float(pressure.frequency[0])
    r = float(distance[nearest])
    kr = 2 * np.pi * lowest / air.speed_of_sound * r
    return SoundAccuracy(
        nearest_point=nearest,
        nearest_distance=r,
        needed_distance=max(0.25 * air.speed_of_sound / lowest, NEAREST * source_dimension(surface, plane)),
        near_field_db=float(10 * np.log10(1 + kr**-2)),
    )
