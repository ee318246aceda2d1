"""Gears: drawings, finite elements, compliance, contact, mesh laws, root strain, displacement and stress."""

from typing import TYPE_CHECKING

from nvhchain.runtime.deferred import deferred

if TYPE_CHECKING:
    from nvhchain.gear.compliance.analytic import SliceCompliance, slice_compliance
    from nvhchain.gear.compliance.body_modes import COARSE, body_modes
    from nvhchain.gear.compliance.flank_compliance import (
        FlankCompliance,
        compliance_at_points,
        flank_compliance,
        flank_flexibility,
    )
    from nvhchain.gear.contact.contact_lines import ContactLines, contact_lines, lever_arms, sliding_sense
    from nvhchain.gear.contact.engagement import Engagement, close_edges, engaged_reach, slice_count
    from nvhchain.gear.deviations.drawn import drawn_deviations
    from nvhchain.gear.deviations.flanks import GearDeviations, Ghost, ToothFlanks
    from nvhchain.gear.deviations.pairs import PairDeviations
    from nvhchain.gear.deviations.tolerances import FlankTolerances, flank_tolerances, standard_tolerance
    from nvhchain.gear.drawing.backlash import normal_backlash, set_backlash
    from nvhchain.gear.drawing.blank import SOLID, Blank, Differential, Holes, Slots, Solid, ThinRim
    from nvhchain.gear.drawing.body import GearBody, mass_properties
    from nvhchain.gear.drawing.geometry import GearGeometry
    from nvhchain.gear.drawing.measures import base_tangent_length, dimension_over_balls, sizes
    from nvhchain.gear.drawing.micro_geometry import Flank, MicroGeometry, Relief
    from nvhchain.gear.drawing.pair import GearPair, Misalignment, nominal_centre_distance
    from nvhchain.gear.drawing.thickness import MeasuredThickness
    from nvhchain.gear.drawing.tooth_root import Protuberance
    from nvhchain.gear.drawing.volume_mesh import VolumeMesh
    from nvhchain.gear.elements.gear_mesh import bricks_over_even
    from nvhchain.gear.elements.mesh_files import read_gear_mesh, write_gear_mesh
    from nvhchain.gear.elements.whole_mesh import whole_mesh
    from nvhchain.gear.field.gear_field import gear_field
    from nvhchain.gear.laws.contact_pressure import largest_contact_pressure
    from nvhchain.gear.laws.deviated_law import deviated_mesh_law
    from nvhchain.gear.laws.deviated_load import deviated_load_distribution
    from nvhchain.gear.laws.load_distribution import load_distribution, mesh_period
    from nvhchain.gear.laws.mesh_law import engaged, law_load, mesh_law, pair_compliances, tabulated
    from nvhchain.gear.laws.tooth_pairs import tooth_pairs
    from nvhchain.gear.laws.transmission_error import (
        LoadedMesh,
        deflection_at_force,
        loaded_mesh,
        loaded_transmission_error,
        quasi_static_transmission_error,
    )
    from nvhchain.gear.root_strain.modes import PINION, WHEEL, nodal_force_strain, root_strain_modes
    from nvhchain.gear.root_strain.places import RootElement, StrainGauge, von_mises
else:
    __getattr__, __dir__ = deferred(__name__, __file__)

__all__ = [
    "Flank",
    "GearBody",
    "GearGeometry",
    "GearPair",
    "Holes",
    "MeasuredThickness",
    "MicroGeometry",
    "Protuberance",
    "Relief",
    "Slots",
    "Solid",
    "ThinRim",
    "gear_field",
    "mesh_law",
    "nominal_centre_distance",
    "quasi_static_transmission_error",
    "set_backlash",
    "sizes",
    "write_gear_mesh",
]
