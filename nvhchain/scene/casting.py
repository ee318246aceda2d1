"""What the housing takes: its finite elements, its modes and the area that radiates."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from math import pi, sqrt
from pathlib import Path

from nvhchain import housing, interop
from nvhchain.case import GearboxCase, HousingModel, ModalResults
from nvhchain.errors import require
from nvhchain.fem.modal_model import ModalModel
from nvhchain.fem.solid_model import SolidModel
from nvhchain.fidelity import Fidelity
from nvhchain.housing.reduction import bending_wavelength
from nvhchain.scene.planned import BASE_MEGABYTES, Stage

# Estimates: processor seconds and megabytes per unit of work, fitted to the runs in docs/measured/chain/plan.md and
# docs/measured/chain/plan_knobs.md, which benchmarks/chain/plan.py measures again.
_UNKNOWNS_PER_AREA = 1.3e3
_UNKNOWNS_EXPONENT = 1.4
_SECONDS_PER_UNKNOWN = 1.69e-4
_SECONDS_PER_UNKNOWN_AND_MODE = 4e-7
_SECONDS_PER_SAMPLE = 8.9e-6
_MEGABYTES_PER_THOUSAND_UNKNOWNS = 1.75
_FILL_EXPONENT = 1.35
_MODES_AT_6_KHZ = 60
_EDGES_OF_PLAIN_WALLS, _EDGES_OF_RIBBED_WALLS = 4.3, 6.6


def extent(case: GearboxCase, fidelity: Fidelity, ready: Collection[str]) -> tuple[float, float]:
    """Area of the radiating surface, m², and unknowns of the finite elements; a housing's file is read for it."""
    for name in ("housing", "surface_velocity"):
        if isinstance(ready, Mapping) and name in ready:
            return float(ready[name].surface.areas.sum()), 0.0
    if not isinstance(case.housing, housing.Casting):
        model = model_of_file(case, case.housing, ready)
        return housing.model_extent(model) if isinstance(model, SolidModel) else (housing.modal_extent(model), 0.0)
    area = housing.envelope_area(case.housing)
    return area, _UNKNOWNS_PER_AREA * area / fidelity.housing.element_size**_UNKNOWNS_EXPONENT


def model_of_file(
    case: GearboxCase, given: HousingModel | ModalResults, ready: Collection[str] = ()
) -> SolidModel | ModalModel:
    """The model in the file of the case's housing.

    Raises InputError for a file that cannot be read, without a bearing's seat or with modes that end below the band,
    and for a housing that nothing holds, unless its forces or the housing are `ready`.
    """
    path = Path(case.folder) / given.file
    if isinstance(given, ModalResults):
        modes = interop.read_modal_model(path, units=given.units)
        housing.seat_rows(modes, case.seats, {seat.name: seat.node for seat in given.seats})
        housing.check_modes(modes, case.band.high)
        _check_held(
            case, f"{modes.source} has a rigid motion", not housing.has_rigid_motion(modes, case.band.high), ready
        )
        return modes
    model = interop.read_solid_model(path, units=given.units, spc=given.spc)
    housing.bearing_seats(model, case.seats, {seat.name: seat.nodes for seat in given.seats})
    held = bool(model.held.any()) or any(rigid.held.any() for rigid in model.rigid_sets)
    _check_held(case, f"{model.source} holds no freedom", held, ready)
    return model


def _check_held(case: GearboxCase, why: str, held: bool, ready: Collection[str]) -> None:
    require(
        held or len(forced(ready)) > 0 or "housing" in ready,
        f"{case.name}: {why}: nothing holds the housing, whose rigid motion no bearing takes: hold it where it is "
        "bolted, or give the run its bearing forces",
    )


def forced(ready: Collection[str]) -> set[str]:
    """Ready-made hand-offs that make the time integration needless."""
    return {"bearing_forces", "force_spectrum", "surface_velocity"}.intersection(ready)


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


def housing_stage(case: GearboxCase, fidelity: Fidelity, unknowns: float, faces: int) -> Stage:
    """Reduction of the housing.  unknowns: of its finite elements.  faces: that radiate."""
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
        unknowns * (_SECONDS_PER_UNKNOWN + _SECONDS_PER_UNKNOWN_AND_MODE * modes_in_reach(case, fidelity))
        + _SECONDS_PER_SAMPLE * faces * fidelity.housing.samples_per_face**2,
        BASE_MEGABYTES + _MEGABYTES_PER_THOUSAND_UNKNOWNS * (1e-3 * unknowns) ** _FILL_EXPONENT,
        {"unknowns": unknowns, "modes": modes_in_reach(case, fidelity)},
    )
