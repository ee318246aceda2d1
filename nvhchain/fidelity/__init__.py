"""Every accuracy knob: one frozen class per stage and three presets.

A fidelity value changes how close the answer is; a case value changes what the answer is.
"""

from nvhchain.fidelity.acoustics import PRECISIONS, RADIATIONS, SOLVERS, AcousticsFidelity
from nvhchain.fidelity.dynamics import MESH_LEVELS, DynamicsFidelity
from nvhchain.fidelity.gear import BODIES, GearFidelity
from nvhchain.fidelity.housing import HousingFidelity
from nvhchain.fidelity.lumped import LUMPED, LumpedFidelity
from nvhchain.fidelity.presets import DRAFT, PRESETS, REFERENCE, STANDARD, Fidelity

__all__ = [
    "BODIES",
    "DRAFT",
    "LUMPED",
    "MESH_LEVELS",
    "PRECISIONS",
    "PRESETS",
    "RADIATIONS",
    "REFERENCE",
    "SOLVERS",
    "STANDARD",
    "AcousticsFidelity",
    "DynamicsFidelity",
    "Fidelity",
    "GearFidelity",
    "HousingFidelity",
    "LumpedFidelity",
]
