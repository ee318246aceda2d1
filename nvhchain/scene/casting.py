"""What the housing takes: its finite elements, its modes and the area that radiates."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from math import pi, sqrt
from pathlib import Path

from nvhchain import housing, interop
from nvhchain.case import GearboxCase, HousingModel, ModalResults
from nvhchain.fidelity import Fidelity
from nvhchain.housing.reduction import bending_wavelength
from nvhchain.scene.planned import BASE_MEGABYTES, Stage

# Estimates: processor seconds and megabytes per unit of work, fitted to the runs in docs/measured/plan.md, which
# benchmarks/plan.py measures again.
_UNKNOWNS_PER_AREA = 1.3e3
_UNKNOWNS_EXPONENT = 1.4
_SECONDS_PER_UNKNOWN = 1.05e-4
_SECONDS_PER_UNKNOWN_AND_MODE = 1.06e-6
_MEGABYTES_PER_THOUSAND_UNKNOWNS = 1.75
_FILL_EXPONENT = 1.35
_MODES_AT_6_KHZ = 60
_EDGES_OF_PLAIN_WALLS, _EDGES_OF_RIBBED_WALLS = 4.3, 6.6


def extent(case: GearboxCase, fidelity: Fidelity, ready: Collection[str]) -> tuple[float, float]:
    """Area of the radiating surface, m², and unknowns of the finite elements; a housing's file is read for it."""
    for name in ("housing", "surface_velocity"):
        if isinstance(ready, Mapping) and name in ready:
            return float(ready[name].surface.areas.sum()), 0.0
    path = Path(case.folder)
    if isinstance(case.housing, HousingModel):
        model = case.housing
        return housing.model_extent(interop.read_solid_model(path / model.file, units=model.units, spc=model.spc))
    if isinstance(case.housing, ModalResults):
        modes = interop.read_modal_model(path / case.housing.file, units=case.housing.units)
        return housing.modal_extent(modes), 0.0
    area = housing.envelope_area(case.housing)
    return area, _UNKNOWNS_PER_AREA * area / fidelity.housing.element_size**_UNKNOWNS_EXPONENT


def modes_in_reach(case: GearboxCase, fidelity: Fidelity) -> float:
    """Modes of the casting up to the limit of the reduction.

    As a plate of the outer walls' area has them (H. Weyl 1911: π A/λ², less in proportion to the length of the held
    edges over the wavelength); of a housing from a file only that they grow about with frequency.
    """
    top = fidelity.housing.mode_ratio * case.band.high
    if not isinstance(case.housing, housing.Casting):
        return _MODES_AT_6_KHZ * top / 6250.0
    free = pi * housing.envelope_area(case.housing) / bending_wavelength(case.housing, top) ** 2
    ribbed = case.housing.side_ribs > 0 or case.housing.spokes > 0
    return max(1.0, free - (_EDGES_OF_RIBBED_WALLS if ribbed else _EDGES_OF_PLAIN_WALLS) * sqrt(free))


def kept_modes(case: GearboxCase, fidelity: Fidelity) -> str:
    """Which modes of the housing are kept, in words."""
    tolerance = fidelity.housing.truncation_tolerance_db
    if tolerance and isinstance(case.housing, housing.Casting | HousingModel):
        return f"the fewest modes that keep to {tolerance:g} dB"
    return f"modes to {fidelity.housing.mode_ratio * case.band.high:g} Hz"


def housing_stage(case: GearboxCase, fidelity: Fidelity, unknowns: float) -> Stage:
    """Reduction of the housing.  unknowns: of its finite elements."""
    top = fidelity.housing.mode_ratio * case.band.high
    if isinstance(case.housing, ModalResults):
        return Stage("housing", f"the modes to {top:g} Hz in {case.housing.file}", 10.0, BASE_MEGABYTES)
    elements = f"{1e3 * fidelity.housing.element_size:g} mm elements"
    if isinstance(case.housing, HousingModel):
        elements = f"the mesh in {case.housing.file}"
    return Stage(
        "housing",
        f"about {unknowns / 1e3:.0f} k unknowns of {elements}; {kept_modes(case, fidelity)}, "
        f"residual flexibility of {len(case.bearings)} seats",
        unknowns * (_SECONDS_PER_UNKNOWN + _SECONDS_PER_UNKNOWN_AND_MODE * modes_in_reach(case, fidelity)),
        BASE_MEGABYTES + _MEGABYTES_PER_THOUSAND_UNKNOWNS * (1e-3 * unknowns) ** _FILL_EXPONENT,
        {"unknowns": unknowns, "modes": modes_in_reach(case, fidelity)},
    )
