"""What a case asks for → what has to be modelled, what is skipped and why, and what it takes."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from math import ceil, inf, lcm, log10, pi, sqrt
from pathlib import Path

import psutil

from nvhchain import acoustics, housing, interop
from nvhchain.advice import advice
from nvhchain.case import HEARD, RADIATED, Case, GearboxCase, HousingModel, ModalResults, RadiatorCase
from nvhchain.errors import InputError, ResourceError
from nvhchain.fidelity import STANDARD, Fidelity, GearFidelity
from nvhchain.gear import GearBody, VolumeMesh
from nvhchain.housing.reduction import bending_wavelength, check_bending_resolution
from nvhchain.radiator import radiator_faces

# Estimates: processor seconds and megabytes per unit of work, fitted to the runs in docs/measured/plan.md, which
# benchmarks/plan.py measures again.
_BASE_MEGABYTES = 390.0
_SECONDS_PER_STAGE = 0.1
_SECONDS_PER_TOOTH_LAYER = 1.36e-2
_SECONDS_PER_LOADED_TOOTH = 4.5e-4
_MESH_GROWTH = 0.65
_SECONDS_PER_CONTACT = 1.0e-8
_MEGABYTES_PER_TOOTH_LAYER = 3.3
_MEMORY_GROWTH = 0.35
_MEGABYTES_PER_UNKNOWN = 11e-3
_UNKNOWNS_PER_AREA = 1.3e3
_UNKNOWNS_EXPONENT = 1.4
_SECONDS_PER_UNKNOWN = 1.05e-4
_SECONDS_PER_UNKNOWN_AND_MODE = 1.06e-6
_MEGABYTES_PER_THOUSAND_UNKNOWNS = 1.75
_FILL_EXPONENT = 1.35
_MODES_AT_6_KHZ = 60
_EDGES_OF_PLAIN_WALLS, _EDGES_OF_RIBBED_WALLS = 4.3, 6.6
_SECONDS_PER_STEP_AND_MODE = 7e-9
_SETTLING_PERIODS = 4
_SECONDS_PER_SYSTEM = 0.1
_SECONDS_PER_PAIR = 9.3e-8
_SECONDS_PER_LU = 4e-11
_SECONDS_PER_PAIR_AND_SHAPE = 3e-9
_MASTERS_AT_LEAST = 6
_MASTERS_PER_RADIAN = 0.45
_MASTERS_PER_DECADE = 0.48
_TRIANGLES_PER_AREA = 2.83
_TRIANGLES_PER_BORE = 100
_SECONDS_PER_LINE_AND_FACE = 3e-8


@dataclass(frozen=True)
class Stage:
    """One stage of the plan.

    seconds: of all processors, user and system.  megabytes: resident at the peak.  Both are estimates.
    counts: how much of what is modelled, as far as it is estimated.
    """

    name: str
    models: str
    seconds: float
    megabytes: float
    counts: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Plan:
    """Stages in order, what is left out with the reason, and options of the case that its gearbox would notice."""

    case: str
    fidelity: str
    stages: tuple[Stage, ...]
    skipped: tuple[str, ...]
    advice: tuple[str, ...] = ()

    @property
    def seconds(self) -> float:
        """Estimated processor time of all stages when nothing is found on disk."""
        return sum(stage.seconds for stage in self.stages)

    @property
    def megabytes(self) -> float:
        """Estimated peak memory: of the largest stage."""
        return max(stage.megabytes for stage in self.stages)

    def __str__(self) -> str:
        width = max(len(stage.name) for stage in self.stages)
        lines = [f"{self.case} at fidelity {self.fidelity}", "modelled:"]
        lines += [
            f"  {stage.name:<{width}}  {stage.seconds:6.0f} s {stage.megabytes:7.0f} MB  {stage.models}"
            for stage in self.stages
        ]
        lines += ["skipped:", *(f"  {reason}" for reason in self.skipped)]
        lines += ["would be noticed:", *(f"  {why}" for why in self.advice)] if self.advice else []
        lines += [f"in all about {self.seconds:.0f} s of processor time, {self.megabytes:.0f} MB at the peak"]
        return "\n".join(lines)


def plan(case: Case, *, fidelity: Fidelity = STANDARD) -> Plan:
    """What will be modelled for `case`, what is skipped and why, memory and time (estimates)."""
    return _plan(case, fidelity, ())


def _plan(case: Case, fidelity: Fidelity, ready: Collection[str]) -> Plan:
    if isinstance(case, RadiatorCase):
        faces, area = radiator_faces(case, fidelity.acoustics)
        given = Stage(
            "surface", f"{faces} triangles with the velocity of the case", _SECONDS_PER_STAGE, _BASE_MEGABYTES
        )
        return Plan(
            case.name,
            fidelity.name,
            tuple(
                [given]
                + [_transfer_vectors(case, fidelity, faces, area)] * (not HEARD.isdisjoint(case.quantities))
                + [_sound_power(case, fidelity, faces, area)] * (not RADIATED.isdisjoint(case.quantities))
            ),
            ("gears, dynamics and housing: the surface velocity is given in the case",),
        )
    area, unknowns = _extent(case, fidelity, ready)
    stages = [_housing(case, fidelity, unknowns), *_mesh_laws(case, fidelity), _dynamics(case, fidelity)]
    if HEARD.intersection(case.quantities):
        stages.append(_transfer_vectors(case, fidelity, _faces(case, fidelity, area), area))
    if RADIATED.intersection(case.quantities):
        stages.append(_sound_power(case, fidelity, _faces(case, fidelity, area), area))
    if {"surface_velocity", *HEARD}.intersection(case.quantities):
        stages.append(_radiation(case, fidelity, area))
    return Plan(case.name, fidelity.name, tuple(stages), _skipped(case, fidelity), advice(case))


def preflight(case: Case, fidelity: Fidelity, given: Collection[str] = (), *, in_files: bool = False) -> None:
    """Refuse before any work starts what the stages to come cannot do (`check_knobs`), too little memory too.

    given: names of the hand-offs that are ready-made, as `run` calls them, or the hand-offs by name; their stages are
    not looked at, and a foreign housing whose surface is among them is not read.
    in_files: the bearing forces go to files piece by piece, whatever their length.
    """
    check_knobs(case, fidelity, given)
    if not isinstance(case, GearboxCase):
        return
    forced = _forced(given)
    along = case.options.tilt or case.options.load_distribution
    if not forced and fidelity.dynamics.mesh_level == "contact" and along:
        raise InputError(
            f"{case.name} asks for friction, shuttling or tilt, which the mesh level `contact` does not have: use the "
            "level `table`, or leave them out of the options"
        )
    skipped = {
        "housing": {"housing", "surface_velocity"}.intersection(given),
        "mesh law": forced or {"mesh_laws"}.intersection(given),
        "bearing forces": forced or in_files,
        "transfer vectors": {"transfer_vectors"}.intersection(given),
    }
    needed, largest, free = 0.0, "", float(psutil.virtual_memory().available)
    for stage in _plan(case, fidelity, given).stages:
        if not any(stage.name.startswith(name) for name, reasons in skipped.items() if reasons):
            needed, largest = max((needed, largest), (1e6 * stage.megabytes, stage.name))
    if needed > free:
        long = case.operation.ramp is not None and largest == "bearing forces"
        raise ResourceError(
            f"{case.name} at fidelity {fidelity.name} needs about {needed / 1e9:.1f} GB for its {largest}, "
            f"{free / 1e9:.1f} GB are free: choose a lower fidelity or lower the upper frequency"
            + long
            * ", shorten the ramp, or write its bearing forces to files with `nvhchain record`"
        )


def check_knobs(case: Case, fidelity: Fidelity, given: Collection[str] = ()) -> None:
    """Refuse (InputError) knobs that are too coarse for the band, or know less than is asked for.

    given: as `preflight` takes it.
    """
    radiated = sorted(RADIATED.intersection(case.quantities))
    if radiated and fidelity.acoustics.radiation == "rayleigh":
        raise InputError(
            f"{case.name} asks for {', '.join(radiated)}, but the Rayleigh integral knows no pressure on the surface: "
            "choose radiation = boundary_elements" + " or equivalent_radiated_power" * (radiated == ["sound_power"])
        )
    if {"radiation_efficiency", "directivity"}.intersection(radiated) and (
        fidelity.acoustics.radiation == "equivalent_radiated_power"
    ):
        raise InputError(
            f"{case.name} asks for {', '.join(radiated)}, but the equivalent radiated power has an efficiency of 1 in "
            "all directions by its definition: choose radiation = boundary_elements"
        )
    check_held(case, given)
    if not isinstance(case, GearboxCase):
        return
    dynamics = fidelity.dynamics
    longest = 1.0 / (dynamics.samples_per_period * case.band.high)
    if not _forced(given) and dynamics.time_step > longest * (1 + 1e-9):
        raise InputError(
            f"time step {1e6 * dynamics.time_step:.4g} µs does not sample {case.band.high:g} Hz with "
            f"{dynamics.samples_per_period:g} points per period: at most {1e6 * longest:.4g} µs, or lower band.high"
        )
    if isinstance(case.housing, housing.Casting) and not {"housing", "surface_velocity"}.intersection(given):
        check_bending_resolution(case.housing, case.band.high, fidelity.housing)


def check_held(case: Case, given: Collection[str] = ()) -> None:
    """Refuse (InputError) a gearbox in a casting that nothing holds, unless forces or the housing are given.

    given: as `preflight` takes it.
    """
    free = isinstance(case, GearboxCase) and isinstance(case.housing, housing.Casting) and case.housing.bolts == 0
    if free and not _forced(given) and "housing" not in given:
        raise InputError(
            f"{case.name}: housing bolts = 0: nothing holds the casting, whose rigid motion no bearing takes: "
            "give it bolts, or the run its bearing forces"
        )


def _forced(given: Collection[str]) -> set[str]:
    """Ready-made hand-offs that make the time integration needless."""
    return {"bearing_forces", "force_spectrum", "surface_velocity"}.intersection(given)


def _mesh_laws(case: GearboxCase, fidelity: Fidelity) -> list[Stage]:
    knobs, stages = fidelity.gear, []
    for stage, pair in zip(case.stages, case.pairs, strict=True):
        bodies = (pair.pinion, pair.wheel)
        meshes = lcm(*(body.sector for body in bodies))
        layers = [body.geometry.teeth * knobs.width_layers for body in bodies]
        fineness = knobs.profile_elements / knobs.row_aspect
        held = fineness**_MESH_GROWTH * (knobs.bodies == "elements")
        loaded = sum((body.sector - 1) * layer for body, layer in zip(bodies, layers, strict=True))
        contacts = meshes * knobs.angles_per_mesh * knobs.deflections * (3 * knobs.slices) ** 2
        described = " and ".join(
            f"{body.geometry.teeth} teeth {type(body.blank).__name__.lower()} ({body.sector} by symmetry)"
            for body in bodies
        )
        stages.append(
            Stage(
                f"mesh law {stage.name}",
                f"{described}; {meshes * knobs.angles_per_mesh} angles × {knobs.deflections} deflections, "
                f"{knobs.slices} slices",
                held * (_SECONDS_PER_TOOTH_LAYER * sum(layers) + _SECONDS_PER_LOADED_TOOTH * loaded)
                + _SECONDS_PER_CONTACT * contacts,
                _BASE_MEGABYTES + max(_gear_megabytes(body, knobs) for body in bodies),
                {"teeth": sum(body.sector for body in bodies)},
            )
        )
    return stages


def _gear_megabytes(body: GearBody, knobs: GearFidelity) -> float:
    """Of a gear's finite elements: of its own mesh, or of a mesh of another program, which is solved as a whole."""
    if knobs.bodies != "elements":
        return 0.0
    if isinstance(body.blank, VolumeMesh):
        return _MEGABYTES_PER_UNKNOWN * 3 * len(body.blank.nodes)
    fineness = knobs.profile_elements / knobs.row_aspect
    return _MEGABYTES_PER_TOOTH_LAYER * body.geometry.teeth * knobs.width_layers * fineness**_MEMORY_GROWTH


def _modes(case: GearboxCase, fidelity: Fidelity) -> float:
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


def _extent(case: GearboxCase, fidelity: Fidelity, ready: Collection[str]) -> tuple[float, float]:
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


def _kept_modes(case: GearboxCase, fidelity: Fidelity) -> str:
    tolerance = fidelity.housing.truncation_tolerance_db
    if tolerance and isinstance(case.housing, housing.Casting | HousingModel):
        return f"the fewest modes that keep to {tolerance:g} dB"
    return f"modes to {fidelity.housing.mode_ratio * case.band.high:g} Hz"


def _housing(case: GearboxCase, fidelity: Fidelity, unknowns: float) -> Stage:
    top = fidelity.housing.mode_ratio * case.band.high
    if isinstance(case.housing, ModalResults):
        return Stage("housing", f"the modes to {top:g} Hz in {case.housing.file}", 10.0, _BASE_MEGABYTES)
    elements = f"{1e3 * fidelity.housing.element_size:g} mm elements"
    if isinstance(case.housing, HousingModel):
        elements = f"the mesh in {case.housing.file}"
    return Stage(
        "housing",
        f"about {unknowns / 1e3:.0f} k unknowns of {elements}; {_kept_modes(case, fidelity)}, "
        f"residual flexibility of {len(case.bearings)} seats",
        unknowns * (_SECONDS_PER_UNKNOWN + _SECONDS_PER_UNKNOWN_AND_MODE * _modes(case, fidelity)),
        _BASE_MEGABYTES + _MEGABYTES_PER_THOUSAND_UNKNOWNS * (1e-3 * unknowns) ** _FILL_EXPONENT,
        {"unknowns": unknowns, "modes": _modes(case, fidelity)},
    )


def _recorded_time(case: GearboxCase) -> float:
    """s of bearing forces: the ramp, or whole turns of the slowest shaft."""
    if case.operation.ramp is not None:
        return case.operation.ramp.duration
    turns = 1 / min(case.shaft_orders.values())
    return max(1 / case.band.resolution, 2 * pi * float(turns) / case.operation.input_speed)


def _dynamics(case: GearboxCase, fidelity: Fidelity) -> Stage:
    steps = _recorded_time(case) / fidelity.dynamics.time_step
    run = steps * (1 if case.operation.ramp else _SETTLING_PERIODS)
    unknowns = 6 * len(case.shafts) + _modes(case, fidelity)
    return Stage(
        "bearing forces",
        f"{len(case.shafts)} shafts of 6 unknowns, about {_modes(case, fidelity):.0f} housing modes in the loop, "
        f"{len(case.stages)} tabulated meshes; steps of {1e6 * fidelity.dynamics.time_step:g} µs",
        _SECONDS_PER_STAGE + _SECONDS_PER_STEP_AND_MODE * run * unknowns,
        _BASE_MEGABYTES + 8e-6 * steps * (3 * len(case.bearings) + 2) * 6,
    )


def _faces(case: GearboxCase, fidelity: Fidelity, area: float) -> int:
    size = acoustics.required_element_size(case.band.high, case.air, fidelity.acoustics)
    return ceil(_TRIANGLES_PER_AREA * area / size**2 + _TRIANGLES_PER_BORE * len(case.bearings))


def _transfer_vectors(case: Case, fidelity: Fidelity, faces: int, area: float) -> Stage:
    knobs = fidelity.acoustics
    described = (
        f"about {faces} triangles at {knobs.elements_per_wavelength:g} per wavelength, {len(case.field_points)} "
        "field point(s)"
    )
    if knobs.radiation == "equivalent_radiated_power":
        return Stage("radiated power", f"{described}, plane waves from every face", _SECONDS_PER_STAGE, _BASE_MEGABYTES)
    masters = _masters(case, fidelity, area)
    if knobs.radiation == "rayleigh":
        return Stage("transfer vectors", f"{described}, Rayleigh integral", _SECONDS_PER_STAGE, _BASE_MEGABYTES)
    return Stage(
        "transfer vectors",
        f"{described}, about {masters} master frequencies, engine {case.engine}",
        masters * _system_seconds(faces, fidelity),
        _BASE_MEGABYTES
        + 1e-6
        * acoustics.estimate_memory(
            faces // 2,
            faces,
            case.engine,
            knobs,
            points=len(case.field_points) * (1 if case.reflecting_plane is None else 2),
            frequencies=masters,
        ),
        {"triangles": faces, "masters": masters},
    )


def _system_seconds(faces: int, fidelity: Fidelity) -> float:
    """Of matrices and factors at one frequency; twice the Gauss order is four times the points of a pair."""
    pairs = faces**2 * (fidelity.acoustics.quadrature_order / 2) ** 2
    return _SECONDS_PER_SYSTEM + _SECONDS_PER_PAIR * pairs + _SECONDS_PER_LU * (faces / 2) ** 3


def _sound_power(case: Case, fidelity: Fidelity, faces: int, area: float) -> Stage:
    """Solutions for every mode and seat direction at masters, or for one velocity at every line."""
    knobs = fidelity.acoustics
    if knobs.radiation != "boundary_elements":
        return Stage("sound power", f"about {faces} triangles, {knobs.radiation}", _SECONDS_PER_STAGE, _BASE_MEGABYTES)
    shapes = 1.0
    if isinstance(case, RadiatorCase):
        systems = len(case.frequencies)
        described = f"{systems} lines"
    else:
        systems = _masters(case, fidelity, area)
        shapes = _modes(case, fidelity) + 3 * len(case.bearings)
        described = f"about {systems} master frequencies, {shapes:.0f} modes and seat directions"
    seconds = systems * (_system_seconds(faces, fidelity) + _SECONDS_PER_PAIR_AND_SHAPE * shapes * faces**2)
    return Stage(
        "radiation resistance" if shapes > 1 else "sound power",
        f"about {faces} triangles, {described}, engine {case.engine}",
        seconds,
        _BASE_MEGABYTES + 1e-6 * acoustics.estimate_memory(faces // 2, faces, case.engine, knobs),
        {"triangles": faces, "masters": systems, "shapes": shapes},
    )


def _masters(case: Case, fidelity: Fidelity, area: float) -> int:
    """Master frequencies: they grow with the band times the body's size and with the digits that are asked of them, or
    are the lines where those are few."""
    if isinstance(case, RadiatorCase):
        band, lines = case.frequencies[-1] - case.frequencies[0], float(len(case.frequencies))
    else:
        band, lines = case.band.high - case.band.low, inf
    radians = 2 * pi * band / case.air.speed_of_sound * sqrt(area / pi)
    digits = max(0.5, 1 + _MASTERS_PER_DECADE * log10(0.5 / fidelity.acoustics.master_tolerance_db))
    return int(min(lines, ceil(digits * (_MASTERS_AT_LEAST + _MASTERS_PER_RADIAN * radians))))


def _radiation(case: GearboxCase, fidelity: Fidelity, area: float) -> Stage:
    lines = (case.band.high - case.band.low) / case.band.resolution
    faces = _faces(case, fidelity, area)
    points = len(case.field_points) if HEARD.intersection(case.quantities) else 0
    band = f"from {case.band.low:g} to {case.band.high:g} Hz"
    if case.operation.ramp is not None:
        name, models = "pressure", f"noise transfer functions {band}, convolved with the bearing forces"
    elif points:
        name, models = "velocity, pressure", f"about {lines:.0f} lines {band}, forced response and dot products"
    else:
        name, models = "velocity", f"about {lines:.0f} lines {band}, forced response"
    return Stage(
        name,
        models,
        _SECONDS_PER_STAGE + _SECONDS_PER_LINE_AND_FACE * lines * faces * (1 + points),
        _BASE_MEGABYTES + 3 * 16e-6 * lines * faces,
    )


def _skipped(case: GearboxCase, fidelity: Fidelity) -> tuple[str, ...]:
    reasons = [
        f"{gear.name}: loads on {gear.geometry.teeth - gear.body.sector} of {gear.geometry.teeth} teeth, "
        "alike by the symmetry of its blank"
        for gear in case.gears
    ]
    reasons += [
        f"of the housing all but {_kept_modes(case, fidelity)}: their flexibility is kept as residual",
        f"lines outside {case.band.low:g}…{case.band.high:g} Hz",
        "acoustic load on the housing: one-way coupling",
    ]
    if RADIATED.intersection(case.quantities):
        reasons.append("radiation resistance between masters: interpolated")
    if HEARD.intersection(case.quantities):
        reasons.append("transfer vectors between masters: interpolated; points that are not asked for")
    else:
        reasons.append("transfer vectors and sound pressure: not asked for")
    if case.quantities == ("bearing_forces",):
        reasons.append("motion of the housing's surface: not asked for")
    return tuple(reasons)
