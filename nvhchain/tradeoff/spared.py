"""Knobs that have nothing to do, since what they make is ready-made or comes from a file."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from nvhchain.case import RADIATED, Case, GearboxCase, HousingModel, ModalResults, SurfaceFile
from nvhchain.scene import forced

_OF_OWN_ELEMENTS = {"element_size", "elements_per_turn"}
"""Fields of the housing that decide on elements made here."""

_OF_OWN_MODES = {*_OF_OWN_ELEMENTS, "truncation_tolerance_db"}
"""Those, and what modes of another program do not know."""

_BETWEEN_MASTERS = {"interpolation_points", "interpolation_poles"}
"""Fields of the acoustics that ready-made transfer vectors still need."""


def spared(stage: str, fields: Sequence[str], case: Case, given: Collection[str]) -> bool:
    """Whether a knob of these fields of a stage turns nothing.  given: names of ready-made hand-offs, as of `run`."""
    if stage == "acoustics":
        return _of_the_acoustics(set(fields), case, given)
    if not isinstance(case, GearboxCase):
        return True
    if forced(given) and stage in ("gear", "dynamics"):
        return True
    if stage == "gear":
        distributed = case.options.load_distribution and "load_distributions" not in given
        return "mesh_laws" in given and not distributed
    if stage == "housing":
        ready = {"housing", "surface_velocity"}.intersection(given)
        foreign = isinstance(case.housing, HousingModel) and not _OF_OWN_ELEMENTS.isdisjoint(fields)
        foreign |= isinstance(case.housing, ModalResults) and not _OF_OWN_MODES.isdisjoint(fields)
        return bool(ready) or foreign
    return False


def _of_the_acoustics(fields: set[str], case: Case, given: Collection[str]) -> bool:
    if "transfer_vectors" in given and not RADIATED.intersection(case.quantities):
        return fields.isdisjoint(_BETWEEN_MASTERS)
    if isinstance(case, GearboxCase):
        shaped = isinstance(case.housing, ModalResults) and case.housing.surface is not None
    else:
        shaped = isinstance(case.body, SurfaceFile)
    ready = {"housing", "surface_velocity", "transfer_vectors"}.intersection(given)
    return "elements_per_wavelength" in fields and (shaped or bool(ready))
