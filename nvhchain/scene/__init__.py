"""The steps that a case takes, their costs, and refusals before a run."""

from typing import TYPE_CHECKING

from nvhchain.runtime.deferred import deferred

if TYPE_CHECKING:
    from nvhchain.scene.checks import check_case, check_knobs, preflight
    from nvhchain.scene.modelling import Modelling, decided, modelled, modelled_alike
    from nvhchain.scene.planned import Plan, PlannedStep
    from nvhchain.scene.planning import option_lines, plan, planned_steps
    from nvhchain.scene.steps import Scene
else:
    __getattr__, __dir__ = deferred(__name__, __file__)

__all__: list[str] = []
