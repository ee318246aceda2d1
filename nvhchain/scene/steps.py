"""Step table: the computations of a run, their order and their inputs.

Each row is one step and the hand-off that it makes. The order of `STEPS` is that of a run. The chain, the plan, the
checks before a run, supplied hand-offs and the trade-off planner read this table. docs/developers/add_a_step.md
explains how to add a row.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from typing import Any, Generic, Literal, TypeVar

from nvhchain.case import Case, GearboxCase, Quantity
from nvhchain.fidelity import AcousticsFidelity, DynamicsFidelity, Fidelity, GearFidelity, HousingFidelity
from nvhchain.handoff import (
    BearingForces,
    Directivity,
    FieldPressure,
    ForceSpectrum,
    HandOff,
    LoadDistribution,
    MeshLaw,
    NoiseTransferFunctions,
    PressureHistory,
    RadiationEfficiency,
    RadiationResistance,
    ReducedHousing,
    SoundPower,
    SurfaceVelocity,
    TransferVectors,
)
from nvhchain.scene.modelling import decided, plain

H_co = TypeVar("H_co", covariant=True)

Knobs = GearFidelity | DynamicsFidelity | HousingFidelity | AcousticsFidelity


@dataclass(frozen=True)
class Scene:
    """A case at a fidelity, and the hand-offs that are supplied to its run.

    case: gearbox or radiator. Options that are `auto` are decided (`nvhchain.scene.modelling`), and off where the
        forces are supplied.
    fidelity: knobs.
    supplied: names of the supplied hand-offs, as arguments of `run`, or the hand-offs by name.
    """

    case: Case
    fidelity: Fidelity
    supplied: Collection[str] = ()

    def __post_init__(self) -> None:
        settled = decided(self.case, self.fidelity) if self.computes_forces else plain(self.case)
        object.__setattr__(self, "case", settled)

    @property
    def gearbox(self) -> GearboxCase:
        """Case of a step that only gearboxes need."""
        assert isinstance(self.case, GearboxCase)
        return self.case

    @property
    def power_uses_modes(self) -> bool:
        """True where the sound power is that of the housing's modes, not of one surface velocity."""
        solved = self.fidelity.acoustics.radiation == "boundary_elements"
        return solved and not self.case.states_velocity and SURFACE_VELOCITY.name not in self.supplied

    @property
    def spread_evenly(self) -> bool:
        """True at the level of radiation that has a power but neither phase nor transfer vectors."""
        return self.fidelity.acoustics.radiation == "equivalent_radiated_power"

    @property
    def steps(self) -> tuple[Step[Any], ...]:
        """Steps that this run computes, in their order: needed by a quantity of the case and not supplied.

        A cheap step that takes only supplied hand-offs comes first, so that bad input is refused before long work.
        """
        needed = self._needed()
        return tuple(
            sorted((step for step in STEPS if step in needed), key=lambda step: not self._takes_supplied(step))
        )

    @property
    def computes_forces(self) -> bool:
        """True where this run computes bearing forces, on which the options of a gearbox act."""
        return BEARING_FORCES in self._needed(force_needs=False)

    def _needed(self, *, force_needs: bool = True) -> set[Step[Any]]:
        """Return the steps that are needed; those of the bearing forces only with `force_needs`."""
        needed: set[Step[Any]] = set()

        def need(step: Step[Any]) -> None:
            if step.name not in self.supplied and step not in needed:
                needed.add(step)
                for other in step.needs(self) if force_needs or step is not BEARING_FORCES else ():
                    need(other)

        answers = _RUN_UP_ANSWERS if self.case.running_up else _ANSWERS
        for quantity in self.case.quantities:
            need(answers[quantity])
        return needed

    def _takes_supplied(self, step: Step[Any]) -> bool:
        """Return True for a step without knobs whose inputs are all supplied."""
        inputs = step.needs(self)
        return step.knobs is None and bool(inputs) and all(other.name in self.supplied for other in inputs)

    def knobs(self, step: Step[Any]) -> Knobs | None:
        """Return the part of the fidelity that a step takes, or None."""
        fidelity = self.fidelity
        parts: dict[str, Knobs] = {
            "gear": fidelity.gear,
            "dynamics": fidelity.dynamics,
            "housing": fidelity.housing,
            "acoustics": fidelity.acoustics,
        }
        return parts[step.knobs] if step.knobs else None


Needs = Callable[[Scene], tuple["Step[Any]", ...]]


@dataclass(frozen=True, eq=False)
class Step(Generic[H_co]):
    """One row of the table; `Step[H]` makes an H.

    name: name of the hand-off in arguments of `run` and fields of `Result`.
    kind: class of the hand-off.
    needs: function of the scene: steps whose hand-offs this one takes.
    code: package whose code makes the hand-off; a change there invalidates cached results.
    knobs: part of the fidelity that the step takes.
    shared: True for load-independent operators, which several cases may share.
    can_be_supplied: True where a run can start from the hand-off.
    repeats_by_stage: True where each gear stage has its own hand-off.
    file: name on disk and on the console, where it is not `name`.
    timed_as: step whose measured time replaces that of this one in a sweep without it.
    """

    name: str
    kind: type[HandOff]
    needs: Needs
    code: str
    knobs: Literal["gear", "dynamics", "housing", "acoustics"] | None = None
    shared: bool = False
    can_be_supplied: bool = False
    repeats_by_stage: bool = False
    file: str = ""
    timed_as: Step[Any] | None = field(default=None, repr=False)

    def file_of(self, gear_stage: str = "") -> str:
        """Name of the file without key and suffix; `gear_stage` is the gear stage where each has its own."""
        return "_".join([self.file or self.name, *([gear_stage] if self.repeats_by_stage else [])])

    def makes(self, file: str) -> bool:
        """Return True for the name of this step's file, whatever the gear stage."""
        return file == self.file_of() if not self.repeats_by_stage else file.startswith(self.file_of())


def _nothing(scene: Scene) -> tuple[Step[Any], ...]:
    return ()


def _misaligned_by_load(scene: Scene) -> tuple[Step[Any], ...]:
    options = scene.gearbox.options
    return (HOUSING,) if options.loaded_misalignment and not options.rigid_housing else ()


def _modal_power_needs(scene: Scene) -> tuple[Step[Any], ...]:
    return (HOUSING, FORCE_SPECTRUM)


HOUSING: Step[ReducedHousing] = Step(
    "housing", ReducedHousing, _nothing, code="housing", knobs="housing", shared=True, can_be_supplied=True
)

MESH_LAWS: Step[tuple[MeshLaw, ...]] = Step(
    "mesh_laws",
    MeshLaw,
    lambda scene: (*_misaligned_by_load(scene), *((LOAD_DISTRIBUTIONS,) if scene.gearbox.options.tilt else ())),
    code="gear",
    knobs="gear",
    shared=True,
    can_be_supplied=True,
    repeats_by_stage=True,
    file="mesh_law",
)

LOAD_DISTRIBUTIONS: Step[tuple[LoadDistribution, ...]] = Step(
    "load_distributions",
    LoadDistribution,
    _misaligned_by_load,
    code="gear",
    knobs="gear",
    shared=True,
    can_be_supplied=True,
    repeats_by_stage=True,
    file="load_distribution",
    timed_as=MESH_LAWS,
)


def _bearing_forces_need(scene: Scene) -> tuple[Step[Any], ...]:
    options = scene.gearbox.options
    acting = (LOAD_DISTRIBUTIONS,) if options.load_distribution else ()
    return (MESH_LAWS, *acting, *(() if options.rigid_housing else (HOUSING,)))


BEARING_FORCES: Step[BearingForces] = Step(
    "bearing_forces", BearingForces, _bearing_forces_need, code="dynamics", knobs="dynamics", can_be_supplied=True
)

FORCE_SPECTRUM: Step[ForceSpectrum] = Step(
    "force_spectrum", ForceSpectrum, lambda scene: (BEARING_FORCES,), code="spectrum", can_be_supplied=True
)

SURFACE_VELOCITY: Step[SurfaceVelocity] = Step(
    "surface_velocity",
    SurfaceVelocity,
    lambda scene: () if scene.case.states_velocity else (HOUSING, FORCE_SPECTRUM),
    code="housing",
    can_be_supplied=True,
)

TRANSFER_VECTORS: Step[TransferVectors] = Step(
    "transfer_vectors",
    TransferVectors,
    lambda scene: (HOUSING,) if scene.case.running_up else (SURFACE_VELOCITY,),
    code="acoustics",
    knobs="acoustics",
    shared=True,
    can_be_supplied=True,
)


PRESSURE: Step[FieldPressure] = Step(
    "pressure",
    FieldPressure,
    lambda scene: (SURFACE_VELOCITY, *(() if scene.spread_evenly else (TRANSFER_VECTORS,))),
    code="acoustics",
    knobs="acoustics",
)

RADIATION_RESISTANCE: Step[RadiationResistance] = Step(
    "radiation_resistance",
    RadiationResistance,
    _modal_power_needs,
    code="acoustics",
    knobs="acoustics",
    shared=True,
    timed_as=TRANSFER_VECTORS,
)

SOUND_POWER: Step[SoundPower] = Step(
    "sound_power",
    SoundPower,
    lambda scene: (RADIATION_RESISTANCE, *_modal_power_needs(scene)) if scene.power_uses_modes else (SURFACE_VELOCITY,),
    code="acoustics",
    knobs="acoustics",
    timed_as=TRANSFER_VECTORS,
)

RADIATION_EFFICIENCY: Step[RadiationEfficiency] = Step(
    "radiation_efficiency",
    RadiationEfficiency,
    lambda scene: (SOUND_POWER, *SOUND_POWER.needs(scene)),
    code="acoustics",
)

DIRECTIVITY: Step[Directivity] = Step(
    "directivity", Directivity, lambda scene: (SOUND_POWER, PRESSURE, SURFACE_VELOCITY), code="acoustics"
)

NOISE_TRANSFER_FUNCTIONS: Step[NoiseTransferFunctions] = Step(
    "noise_transfer_functions",
    NoiseTransferFunctions,
    lambda scene: (TRANSFER_VECTORS, HOUSING, BEARING_FORCES),
    code="acoustics",
    knobs="acoustics",
    shared=True,
)

PRESSURE_HISTORY: Step[PressureHistory] = Step(
    "pressure_history",
    PressureHistory,
    lambda scene: (NOISE_TRANSFER_FUNCTIONS, BEARING_FORCES),
    code="acoustics",
    timed_as=PRESSURE,
)

STEPS: tuple[Step[Any], ...] = (
    HOUSING,
    LOAD_DISTRIBUTIONS,
    MESH_LAWS,
    BEARING_FORCES,
    FORCE_SPECTRUM,
    SURFACE_VELOCITY,
    TRANSFER_VECTORS,
    PRESSURE,
    RADIATION_RESISTANCE,
    SOUND_POWER,
    RADIATION_EFFICIENCY,
    DIRECTIVITY,
    NOISE_TRANSFER_FUNCTIONS,
    PRESSURE_HISTORY,
)
"""All steps in the order of a run: each comes after those that it needs."""

_ANSWERS: dict[Quantity, Step[Any]] = {
    "bearing_forces": FORCE_SPECTRUM,
    "surface_velocity": SURFACE_VELOCITY,
    "pressure": PRESSURE,
    "sound_power": SOUND_POWER,
    "radiation_efficiency": RADIATION_EFFICIENCY,
    "directivity": DIRECTIVITY,
}
"""Quantity of a case → the step that computes it at constant speed."""

_RUN_UP_ANSWERS: dict[Quantity, Step[Any]] = _ANSWERS | {"bearing_forces": BEARING_FORCES, "pressure": PRESSURE_HISTORY}
"""Quantity of a case → the step that computes it in a run-up."""
