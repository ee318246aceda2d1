"""Reference contact: both gears as finite elements with refined flanks, no analytical local part, no friction."""

from benchmarks.gear.reference.alignment import realigned
from benchmarks.gear.reference.contact_cells import CoarseGear, TouchingTeeth, coarse_gear, touching_teeth
from benchmarks.gear.reference.loaded_pair import Carried, ReferenceMesh, carried, pair_compliance, reference_mesh
from benchmarks.gear.reference.pressure import PressureField, pressed
from benchmarks.gear.reference.resolution import ReferenceResolution

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
