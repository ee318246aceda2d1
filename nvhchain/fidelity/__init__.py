"""Every accuracy knob: one frozen class per part of the chain, and three presets.

A fidelity value changes the accuracy of the answer; a case value changes the answer itself.
"""

from nvhchain.fidelity.acoustics import AcousticsFidelity
from nvhchain.fidelity.dynamics import DynamicsFidelity
from nvhchain.fidelity.gear import GearFidelity
from nvhchain.fidelity.housing import HousingFidelity
from nvhchain.fidelity.knob import Knobs, Sweep, declared, knob
from nvhchain.fidelity.lumped import LUMPED, LumpedFidelity
from nvhchain.fidelity.presets import DRAFT, PRESETS, REFERENCE, STANDARD, Fidelity

__all__ = ["Fidelity"]
