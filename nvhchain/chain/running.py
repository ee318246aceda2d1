"""Run in progress: its hand-offs and their folders."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

from nvhchain.case import Case, GearboxCase
from nvhchain.chain.loaded import Compliances, balanced, compliances, gear_bodies, loaded_case
from nvhchain.conventions import Progress
from nvhchain.dynamics import Gearbox
from nvhchain.fidelity import Fidelity, Knobs
from nvhchain.files.result_cache import ResultCache
from nvhchain.handoff import MeshLaw, ReducedHousing, ToothPairs
from nvhchain.scene.steps import HOUSING, Scene, Step

H = TypeVar("H")

OPERATORS = "operators"
"""Folder of shared operators in that of a comparison or study."""


@dataclass
class Run:
    """A scene and the hand-offs that its steps have made so far.

    scene: case, fidelity and supplied hand-offs.
    spine: result cache of the load case.
    shared: result cache of load-independent operators.
    executor: executor of mesh-law blocks and frequency bands.
    hand_offs: step → its hand-off; supplied ones from the start.
    laws_as_drawn: number of a stage → its mesh law without deviations.
    tooth_pairs: number of a stage → what deviations need of its pair as drawn.
    """

    scene: Scene
    spine: ResultCache = field(default_factory=lambda: ResultCache(None))
    shared: ResultCache = field(default_factory=lambda: ResultCache(None))
    executor: Executor | None = None
    hand_offs: dict[Step[Any], Any] = field(default_factory=dict)
    laws_as_drawn: dict[int, MeshLaw] = field(default_factory=dict)
    tooth_pairs: dict[int, ToothPairs] = field(default_factory=dict)

    def __getitem__(self, step: Step[H]) -> H:
        """Return the hand-off of a step."""
        made: H = self.hand_offs[step]
        return made

    def get(self, step: Step[H]) -> H | None:
        """Return the hand-off of a step, or None where this run does not have it."""
        return self.hand_offs.get(step)

    @cached_property
    def loaded(self) -> GearboxCase:
        """Gearbox with the misalignment by its load, if its options ask for that."""
        if not self.gearbox.options.models("loaded_misalignment"):
            return self.gearbox
        return loaded_case(self.gearbox, self.housing_in_loop, self.fidelity, self.compliances)

    @cached_property
    def gearbox_at_load(self) -> Gearbox:
        """Gearbox with its gears, which may vibrate, and with the stiffness of its bearings at their static load."""
        case = self.gearbox
        box = case.gearbox_with_gears
        if case.load_dependent:
            box = balanced(case, self.housing_in_loop, self.fidelity).gearbox
        if case.options.models("gear_body_modes"):
            box = replace(box, gear_bodies=gear_bodies(case, self.fidelity.gear, self.shared))
        return box

    @cached_property
    def compliances(self) -> tuple[Compliances, ...]:
        """Flank compliances of every stage."""
        return compliances(self.gearbox, self.fidelity, self.shared)

    @property
    def housing_in_loop(self) -> ReducedHousing | None:
        """Housing that moves with the shafts; None where the seats are rigid."""
        return None if self.gearbox.options.rigid_housing else self[HOUSING]

    @property
    def case(self) -> Case:
        """Case of the run."""
        return self.scene.case

    @property
    def gearbox(self) -> GearboxCase:
        """Case of a gearbox run."""
        return self.scene.gearbox

    @property
    def fidelity(self) -> Fidelity:
        """Fidelity of the run."""
        return self.scene.fidelity

    def cached(
        self,
        step: Step[Any],
        inputs: Sequence[Any],
        compute: Callable[[Progress], Any],
        *,
        gear_stage: str = "",
        knobs: Knobs | None = None,
    ) -> Any:
        """Return the hand-off of a step: cached on disk if its inputs have not changed, else computed.

        `gear_stage` is the name of the gear stage for steps with one hand-off each. `knobs` are those of the scene if
        omitted.
        """
        cache, name = self._place(step, gear_stage)
        return cache.cached(name, step.kind, step.code, inputs, compute, fidelity=knobs or self.scene.knobs(step))

    def cached_in_parts(
        self, step: Step[Any], inputs: Sequence[Any], compute: Callable[[Progress, Path | None], Any]
    ) -> Any:
        """Return the hand-off of a step like `cached`; `compute` also takes a folder for checkpoints."""
        cache, name = self._place(step)
        return cache.cached_in_parts(name, step.kind, step.code, inputs, compute, fidelity=self.scene.knobs(step))

    def _place(self, step: Step[Any], gear_stage: str = "") -> tuple[ResultCache, str]:
        """Return result cache and file name of a step's hand-off."""
        name = step.file_of(gear_stage)
        return (self.shared, f"{name}-{{key}}") if step.shared else (self.spine, name)
