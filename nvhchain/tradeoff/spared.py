"""Knobs without effect, since their result is supplied or comes from a file."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from nvhchain.case import RADIATED, Case, GearboxCase
from nvhchain.fidelity import STANDARD
from nvhchain.scene import Scene

_BETWEEN_MASTERS = {"interpolation_points", "interpolation_poles"}
"""Fields of the acoustics that supplied transfer vectors still need."""


def spared(stage: str, fields: Sequence[str], case: Case, given: Collection[str]) -> bool:
    """Return True for a knob without effect.

    `stage` is its part of the fidelity and `given` names the supplied hand-offs.
    """
    if stage == "acoustics":
        return _of_the_acoustics(set(fields), case, given)
    if all(step.knobs != stage for step in Scene(case, STANDARD, given).steps):
        return True
    return stage == "housing" and isinstance(case, GearboxCase) and not case.housing.unused_knobs.isdisjoint(fields)


def _of_the_acoustics(fields: set[str], case: Case, given: Collection[str]) -> bool:
    if "transfer_vectors" in given and not RADIATED.intersection(case.quantities):
        return fields.isdisjoint(_BETWEEN_MASTERS)
    meshed = {"housing", "surface_velocity", "transfer_vectors"}.intersection(given)
    return "elements_per_wavelength" in fields and (case.states_surface or bool(meshed))
