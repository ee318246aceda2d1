"""Gears: geometry, finite element bodies, contact and mesh laws."""

from nvhchain.gear.analytic import SliceCompliance, slice_compliance
from nvhchain.gear.blank import SOLID, Blank, Differential, Holes, Slots, Solid, ThinRim
from nvhchain.gear.body import GearBody, MassProperties, mass_properties
from nvhchain.gear.closing_edges import with_closing_edges
from nvhchain.gear.compliance import FlankCompliance, flank_compliance
from nvhchain.gear.contact_lines import ContactLines, contact_lines
from nvhchain.gear.engagement import Engagement, engaged_reach, slice_count
from nvhchain.gear.friction import lever_arms, sliding_sense
from nvhchain.gear.geometry import GearGeometry
from nvhchain.gear.iso6336 import IsoStiffness, iso_stiffness
from nvhchain.gear.load_distribution import load_distribution
from nvhchain.gear.mesh import bricks_over_even
from nvhchain.gear.mesh_files import read_gear_mesh, write_gear_mesh
from nvhchain.gear.mesh_law import engaged, mesh_law, pair_compliances, tabulated
from nvhchain.gear.micro_geometry import Flank, MicroGeometry, Relief
from nvhchain.gear.pair import GearPair, nominal_centre_distance
from nvhchain.gear.root_strain import PINION, WHEEL, RootStrainModes, nodal_force_strain, root_strain_modes
from nvhchain.gear.root_strain_places import RootElement, RootPlace, StrainGauge, von_mises
from nvhchain.gear.separation import Misalignment
from nvhchain.gear.transmission_error import (
    LoadedMesh,
    deflection_at_force,
    loaded_mesh,
    loaded_transmission_error,
    quasi_static_transmission_error,
)
from nvhchain.gear.volume_mesh import VolumeMesh
from nvhchain.gear.whole_mesh import whole_mesh

__all__ = [
    "PINION",
    "SOLID",
    "WHEEL",
    "Blank",
    "ContactLines",
    "Differential",
    "Engagement",
    "Flank",
    "FlankCompliance",
    "GearBody",
    "GearGeometry",
    "GearPair",
    "Holes",
    "IsoStiffness",
    "LoadedMesh",
    "MassProperties",
    "MicroGeometry",
    "Misalignment",
    "Relief",
    "RootElement",
    "RootPlace",
    "RootStrainModes",
    "SliceCompliance",
    "Slots",
    "Solid",
    "StrainGauge",
    "ThinRim",
    "VolumeMesh",
    "bricks_over_even",
    "contact_lines",
    "deflection_at_force",
    "engaged",
    "engaged_reach",
    "flank_compliance",
    "iso_stiffness",
    "lever_arms",
    "load_distribution",
    "loaded_mesh",
    "loaded_transmission_error",
    "mass_properties",
    "mesh_law",
    "nodal_force_strain",
    "nominal_centre_distance",
    "pair_compliances",
    "quasi_static_transmission_error",
    "read_gear_mesh",
    "root_strain_modes",
    "slice_compliance",
    "slice_count",
    "sliding_sense",
    "tabulated",
    "von_mises",
    "whole_mesh",
    "with_closing_edges",
    "write_gear_mesh",
]
