"""What a case asks for → what has to be modelled, what is skipped and why, and what it takes."""

from nvhchain.scene.casting import forced
from nvhchain.scene.checks import check_driven, check_file, check_held, check_knobs, preflight, stages_to_make
from nvhchain.scene.planned import Plan, Stage
from nvhchain.scene.planning import plan

__all__ = [
    "Plan",
    "Stage",
    "check_driven",
    "check_file",
    "check_held",
    "check_knobs",
    "forced",
    "plan",
    "preflight",
    "stages_to_make",
]
