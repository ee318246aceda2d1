"""Directivity of a radiating body at field points, with a check that they lie in the far field."""

from __future__ import annotations

import numpy as np

from nvhchain.acoustics.radiation.efficiency import directivity_index
from nvhchain.acoustics.radiation.microphones import NEAREST, source_dimension
from nvhchain.acoustics.waves.multipoles import plane_foot
from nvhchain.conventions import Air
from nvhchain.errors import require, warn_caller
from nvhchain.handoff import Directivity, FieldPressure, RigidPlane, SoundPower, Surface
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
        Directivity index (dB), see `directivity_index`. The provenance holds `near_field_dB`, the level that the near
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
    provenance = power.provenance | pressure.provenance | {"stage": "acoustics.directivity"} | told
    return Directivity(heard.frequency, heard.points, index, power.input_speed, provenance=provenance)


def _far_field(
    surface: Surface, pressure: FieldPressure, centre: np.ndarray, air: Air, plane: RigidPlane | None
) -> dict[str, float]:
    """Return the near-field error for the provenance, and warn of points that are too near."""
    distance = np.linalg.norm(pressure.points - centre, axis=1)
    nearest, lowest = int(distance.argmin()), float(pressure.frequency[0])
    r, dimension = float(distance[nearest]), source_dimension(surface, plane)
    kr = 2 * np.pi * lowest / air.speed_of_sound * r
    near = float(10 * np.log10(1 + kr**-2))
    if kr < 0.5 * np.pi or r < NEAREST * dimension:
        far = max(0.25 * air.speed_of_sound / lowest, NEAREST * dimension)
        warn_caller(
            f"field point {nearest} is {r:.3g} m from the source's middle, {r / dimension:.2g} times its dimension "
            f"and {r * lowest / air.speed_of_sound:.2g} wavelengths at {lowest:.4g} Hz: the directivity of a dipole "
            f"is {near:.2g} dB too high there, and single parts of the surface are heard; take {far:.3g} m or more"
        )
    return {"near_field_dB": near}
