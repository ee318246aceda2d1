"""The chain: the only file that knows the order of the stages.

A spine of signals (mesh force → bearing force → surface velocity → pressure) runs past load-independent operators
(mesh laws, reduced housing, transfer vectors), which are computed once, kept in a file and found again.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from nvhchain.case import Case, GearboxCase, Quantity, RadiatorCase
from nvhchain.chain import steps, supplied
from nvhchain.chain.given_forces import tell_of_forces, tell_of_spectrum
from nvhchain.chain.result import Result
from nvhchain.dynamics import Recording
from nvhchain.errors import InputError
from nvhchain.fidelity import STANDARD, Fidelity
from nvhchain.files.hdf5 import writable_folder
from nvhchain.files.shelf import Shelf, Unwatched, Watcher
from nvhchain.handoff import (
    BearingForces,
    Directivity,
    FieldPressure,
    ForceSpectrum,
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
from nvhchain.kinds import checked
from nvhchain.scene import preflight


@checked
def run(
    case: Case,
    *,
    fidelity: Fidelity = STANDARD,
    out: str | Path | None = None,
    operators: str | Path | None = None,
    mesh_laws: Sequence[MeshLaw] | None = None,
    load_distributions: Sequence[LoadDistribution] | None = None,
    bearing_forces: BearingForces | None = None,
    force_spectrum: ForceSpectrum | None = None,
    housing: ReducedHousing | None = None,
    surface_velocity: SurfaceVelocity | None = None,
    transfer_vectors: TransferVectors | None = None,
    executor: Executor | None = None,
    watcher: Watcher | None = None,
) -> Result:
    """What a case asks for (its `quantities`), and all that it takes on the way.

    out: folder for the hand-offs; finished stages in it whose inputs have not changed are found, not computed.
    operators: folder for mesh laws, housing and transfer vectors, which several cases may share (default: `out`).
    Any hand-off may be given ready-made; it is then used as it is, and what only it needed is not computed.
    executor: takes mesh-law blocks and frequency bands.  watcher: is told when stages begin, advance and end.

    Raises InputError for what cannot be used, SolverError for a stage that did not reach its residual.
    """
    chain = _prepared(
        case,
        fidelity,
        out,
        operators,
        executor,
        watcher,
        mesh_laws=mesh_laws,
        load_distributions=load_distributions,
        bearing_forces=bearing_forces,
        force_spectrum=force_spectrum,
        housing=housing,
        surface_velocity=surface_velocity,
        transfer_vectors=transfer_vectors,
    )
    for quantity in case.quantities:
        chain.make(quantity)
    if isinstance(case, GearboxCase):  # now that nothing was refused
        if bearing_forces is not None:
            tell_of_forces(case, bearing_forces)
        if force_spectrum is not None:
            tell_of_spectrum(case, force_spectrum)
    names = [field.name for field in fields(Result)]
    made = {name: value for name, value in vars(chain).items() if name in names}
    return Result(**made)


@checked
def record(
    case: Case,
    *,
    fidelity: Fidelity = STANDARD,
    out: str | Path,
    operators: str | Path | None = None,
    mesh_laws: Sequence[MeshLaw] | None = None,
    load_distributions: Sequence[LoadDistribution] | None = None,
    housing: ReducedHousing | None = None,
    executor: Executor | None = None,
    watcher: Watcher | None = None,
) -> Recording:
    """Bearing forces of a run-up of any length, in files of `out`/bearing_forces; memory does not grow with it.

    Stopped, the same call goes on from the last file. Other arguments and errors are those of `run`; of the case's
    quantities only the bearing forces are made.
    """
    if not isinstance(case, GearboxCase) or case.operation.ramp is None:
        raise InputError(f"{case.name} has no run-up to record: give its operation a ramp, or use `run`")
    chain = _prepared(
        replace(case, quantities=("bearing_forces",)),
        fidelity,
        out,
        operators,
        executor,
        watcher,
        in_files=True,
        mesh_laws=mesh_laws,
        load_distributions=load_distributions,
        housing=housing,
    )
    return chain.recording(Path(out) / "bearing_forces")


def _prepared(
    case: Case,
    fidelity: Fidelity,
    out: str | Path | None,
    operators: str | Path | None,
    executor: Executor | None,
    watcher: Watcher | None,
    *,
    in_files: bool = False,
    **handed_in: Any,
) -> _Chain:
    """The chain of a run whose case, fidelity and ready-made hand-offs (None: not given) go together."""
    given = {
        name: tuple(value) if name in ("mesh_laws", "load_distributions") else value
        for name, value in handed_in.items()
        if value is not None
    }
    preflight(case, fidelity, given, in_files=in_files)
    supplied.check(case, fidelity, given)
    watcher = watcher or Unwatched()
    spine = Shelf(writable_folder(out, "out") if out else None, watcher)
    shared = Shelf(writable_folder(operators, "operators") if operators else spine.folder, watcher)
    return _Chain(case, fidelity, given, spine, shared, executor)


class _Chain:
    """The hand-offs of one run by name: each is the given one, or is made, once, when something asks for it."""

    def __init__(
        self,
        case: Case,
        fidelity: Fidelity,
        given: dict[str, Any],
        spine: Shelf,
        shared: Shelf,
        executor: Executor | None,
    ) -> None:
        self.case, self.fidelity = case, fidelity
        self._spine, self._shared, self._executor = spine, shared, executor
        self.given = tuple(given)
        vars(self).update(given)

    def make(self, quantity: Quantity) -> None:
        """Have what the case calls by this name."""
        running_up = self._running_up
        answers = {
            "bearing_forces": "bearing_forces" if running_up else "force_spectrum",
            "surface_velocity": "surface_velocity",
            "pressure": "pressure_history" if running_up else "pressure",
            "sound_power": "sound_power",
            "radiation_efficiency": "radiation_efficiency",
            "directivity": "directivity",
        }
        getattr(self, answers[quantity])

    @property
    def _running_up(self) -> bool:
        return isinstance(self.case, GearboxCase) and self.case.operation.ramp is not None

    @property
    def _gearbox(self) -> GearboxCase:
        assert isinstance(self.case, GearboxCase)
        return self.case

    @cached_property
    def housing(self) -> ReducedHousing:
        return steps.reduced_housing(self._gearbox, self.fidelity, self._shared)

    @cached_property
    def mesh_laws(self) -> tuple[MeshLaw, ...]:
        options = self._gearbox.options
        shared = self._compliances if options.tilt or options.load_distribution else None
        laws = steps.mesh_laws(self._under_load, self.fidelity, self._shared, self._executor, shared)
        if not options.tilt:
            return laws
        return tuple(
            law.replace(tilt_ratio=of.tilt_ratio) for law, of in zip(laws, self.load_distributions, strict=True)
        )

    @cached_property
    def _under_load(self) -> GearboxCase:
        """The case with the misalignment that its load brings, where it asks for that."""
        case = self._gearbox
        return steps.under_load(case, self._in_the_loop, self.fidelity) if case.options.loaded_misalignment else case

    @property
    def _in_the_loop(self) -> ReducedHousing | None:
        """The housing that the gearbox runs in; None: rigid seats."""
        return None if self._gearbox.options.rigid_housing else self.housing

    @cached_property
    def _compliances(self) -> tuple[steps.Compliances, ...]:
        return steps.compliances(self._under_load, self.fidelity)

    @cached_property
    def load_distributions(self) -> tuple[LoadDistribution, ...]:
        case, shared = self._under_load, self._compliances
        return steps.load_distributions(case, self.fidelity, self._shared, self._executor, shared)

    @property
    def _acting(self) -> tuple[LoadDistribution, ...]:
        """Load distributions that bring forces of their own."""
        return self.load_distributions if self._gearbox.options.load_distribution else ()

    @cached_property
    def bearing_forces(self) -> BearingForces:
        housing, laws, case = self._in_the_loop, self.mesh_laws, self._under_load
        return steps.bearing_forces(case, laws, housing, self.fidelity, self._spine, self._acting)

    def recording(self, folder: Path) -> Recording:
        """`bearing_forces` in files of `folder`."""
        housing, laws, case = self._in_the_loop, self.mesh_laws, self._under_load
        return steps.recording(case, laws, housing, self.fidelity, folder, self._spine.watcher, self._acting)

    @cached_property
    def force_spectrum(self) -> ForceSpectrum:
        return steps.force_spectrum(self._gearbox, self.bearing_forces, self._spine)

    @cached_property
    def surface_velocity(self) -> SurfaceVelocity:
        if isinstance(self.case, RadiatorCase):
            return steps.given_velocity(self.case, self.fidelity, self._spine)
        forces = self.force_spectrum
        return steps.surface_velocity(self.housing, forces, self._spine)

    @cached_property
    def transfer_vectors(self) -> TransferVectors:
        if self._running_up:
            surface, lines = self.housing.surface, None
        else:
            surface, lines = self.surface_velocity.surface, self.surface_velocity.frequency
        return steps.transfer_vectors(self.case, surface, lines, self.fidelity, self._shared, self._executor)

    @cached_property
    def pressure(self) -> FieldPressure:
        velocity = self.surface_velocity
        forces = vars(self).get("force_spectrum")
        if self.fidelity.acoustics.radiation == "equivalent_radiated_power":
            return steps.equivalent_pressure(self.case, velocity, forces, self._spine)
        return steps.pressure(self.transfer_vectors, velocity, forces, self.fidelity, self._spine)

    @cached_property
    def radiation_resistance(self) -> RadiationResistance:
        forces = self.force_spectrum
        return steps.radiation_resistance(
            self._gearbox, self.housing, forces, self.fidelity, self._shared, self._executor
        )

    @property
    def _by_modes(self) -> bool:
        """Whether the power is that of the housing's modes: unless only a velocity is given or the level takes nothing
        else."""
        cheap = self.fidelity.acoustics.radiation != "boundary_elements"
        return not (cheap or isinstance(self.case, RadiatorCase) or "surface_velocity" in self.given)

    @cached_property
    def sound_power(self) -> SoundPower:
        if not self._by_modes:
            velocity = self.surface_velocity
            forces = vars(self).get("force_spectrum")
            return steps.sound_power(self.case, velocity, forces, self.fidelity, self._spine, self._executor)
        forces = self.force_spectrum
        return steps.modal_power(self.radiation_resistance, self.housing, forces, self.fidelity, self._spine)

    @cached_property
    def radiation_efficiency(self) -> RadiationEfficiency:
        power = self.sound_power
        if not self._by_modes:
            return steps.radiation_efficiency(self.case, power, self.surface_velocity, self._spine)
        return steps.modal_efficiency(power, self.radiation_resistance, self.housing, self.force_spectrum, self._spine)

    @cached_property
    def directivity(self) -> Directivity:
        power, pressure = self.sound_power, self.pressure
        return steps.directivity(self.case, pressure, power, self.surface_velocity.surface, self._spine)

    @cached_property
    def noise_transfer_functions(self) -> NoiseTransferFunctions:
        forces = self.bearing_forces
        return steps.noise_transfer_functions(
            self._gearbox, self.transfer_vectors, self.housing, forces, self.fidelity, self._shared
        )

    @cached_property
    def pressure_history(self) -> PressureHistory:
        return steps.pressure_history(self.noise_transfer_functions, self.bearing_forces, self._spine)
