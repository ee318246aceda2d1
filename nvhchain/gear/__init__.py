"""Gears: geometry, finite element bodies, contact and mesh laws."""

from nvhchain.gear.blank import Differential, Slots, Solid
from nvhchain.gear.body import GearBody, MassProperties, mass_properties
from nvhchain.gear.compliance import FlankCompliance, flank_compliance
from nvhchain.gear.geometry import GearGeometry
from nvhchain.gear.mesh_law import mesh_law
from nvhchain.gear.pair import GearPair
from nvhchain.gear.transmission_error import quasi_static_transmission_error

__all__ = [
    "Differential",
    "FlankCompliance",
    "GearBody",
    "GearGeometry",
    "GearPair",
    "MassProperties",
    "Slots",
    "Solid",
    "flank_compliance",
    "mass_properties",
    "mesh_law",
    "quasi_static_transmission_error",
]
