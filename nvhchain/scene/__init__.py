"""The steps that a case takes, their costs, and refusals before a run."""

from nvhchain.scene.checks import check_case, check_knobs, preflight
from nvhchain.scene.modelling import Modelling, decided, modelled, modelled_alike
from nvhchain.scene.planned import Plan, PlannedStep
from nvhchain.scene.planning import option_lines, plan, planned_steps
from nvhchain.scene.steps import Scene

__all__: list[str] = []
