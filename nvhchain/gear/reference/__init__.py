"""Reference contact: both gears as finite elements with refined flanks, no analytical local part, no friction."""

from nvhchain.gear.reference.alignment import realigned
from nvhchain.gear.reference.contact_cells import CoarseGear, TouchingTeeth, coarse_gear, touching_teeth
from nvhchain.gear.reference.loaded_pair import Carried, ReferenceMesh, carried, pair_compliance, reference_mesh
from nvhchain.gear.reference.pressure import PressureField, pressed
from nvhchain.gear.reference.resolution import ReferenceResolution

__all__ = [
    "Carried",
    "CoarseGear",
    "PressureField",
    "ReferenceMesh",
    "ReferenceResolution",
    "TouchingTeeth",
    "carried",
    "coarse_gear",
    "pair_compliance",
    "pressed",
    "realigned",
    "reference_mesh",
    "touching_teeth",
]
