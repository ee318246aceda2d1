"""Knobs without effect, since their result is supplied or comes from a file."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from nvhchain.case import RADIATED, Case, GearboxCase
from nvhchain.fidelity import STANDARD
from nvhchain.scene import Scene

_INTERPOLATION_KNOBS = {"interpolation_points", "interpolation_poles"}
"""Fields of the acoustics that supplied transfer vectors still need."""


def is_unused(package: str, fields: Sequence[str], case: Case, supplied: Collection[str]) -> bool:
    """Return True for a knob without effect.

    `package` is its part of the fidelity and `supplied` names the supplied hand-offs.
    """
    if package == "acoustics":
        return _unused_in_acoustics(set(fields), case, supplied)
    if all(step.knobs != package for step in Scene(case, STANDARD, supplied).steps):
        return True
    return package == "housing" and isinstance(case, GearboxCase) and not case.housing.unused_knobs.isdisjoint(fields)


def _unused_in_acoustics(fields: set[str], case: Case, supplied: Collection[str]) -> bool:
    if "transfer_vectors" in supplied and not RADIATED.intersection(case.quantities):
        return fields.isdisjoint(_INTERPOLATION_KNOBS)
    meshed = {"housing", "surface_velocity", "transfer_vectors"}.intersection(supplied)
    return "elements_per_wavelength" in fields and (case.states_surface or bool(meshed))
