"""Names of REXS 1.0 to 1.7 in terms of REXS 2.0.

Numbers of attributes are the same in all versions; the pairs below follow from the published lists of changes.
"""

from __future__ import annotations

COMPONENTS = {"flank_geometry": "cylindrical_gear_flank", "stage_gear_data": "cylindrical_stage_gear_data"}
"""Component until 1.2 → component from 1.3 on."""

ATTRIBUTES = {
    # 1.0 → 1.1
    "clearance_class": "radial_clearance_class",
    "significant_width_outer": "significant_contact_length_outer_ring",
    "significant_width_inner": "significant_contact_length_inner_ring",
    "running_path_radius_of_outer_ring": "raceway_radius_of_outer_ring",
    "running_path_radius_of_inner_ring": "raceway_radius_of_inner_ring",
    "initial_load": "preload_force",
    "initial_load_shift": "preload_distance",
    "dynamic_capacity": "radial_dynamic_load_rating",
    "static_capacity": "radial_static_load_rating",
    "axial_backlash": "operating_axial_bearing_clearance",
    "radial_backlash": "operating_radial_bearing_clearance",
    "operating_point_stiffness_dF_u_d_u": "operating_point_stiffness_f_u_d_u",
    "operating_point_stiffness_dF_v_d_v": "operating_point_stiffness_f_v_d_v",
    "operating_point_stiffness_dF_w_d_w": "operating_point_stiffness_f_w_d_w",
    "din_3967_deviation_tolerance_series": "tooth_thickness_deviation_tolerance_series_din_3967_1978",
    # 1.1 → 1.2
    "bottom_clearance_factor": "tip_clearance_factor",
    # 1.2 → 1.3
    "load_duration": "operating_time",
    "load_duration_fraction": "operating_time_fraction",
    # 1.4 → 1.5
    "tooth_thickness_at_pitch_diameter": "transverse_tooth_thickness_at_reference_diameter",
    # 1.7 → 2.0
    "tip_radius_factor": "tip_corner_radius_factor_reference_profile",
    "tip_radius": "tip_corner_radius_reference_profile",
    "helix_angle_base_circle": "helix_angle_base_diameter",
    "reference_circle_diameter": "reference_diameter_cylindrical_gear",
    "base_circle_diameter": "base_diameter",
    "usable_root_circle_diameter": "active_root_diameter",
    "usable_addendum_circle_diameter": "active_tip_diameter",
    "nominal_tangential_force_at_reference_circle": "nominal_tangential_force_at_reference_diameter",
    "addendum_basic_profile": "tooth_tip_height",
}
"""Attribute of an earlier version → attribute of 2.0."""

_BEARING = {"name": "catalogue_designation"}
_ROW = {"reference_diameter": "reference_diameter_rolling_bearing"}
_GEAR_1_4 = {"normal_tooth_thickness_at_pitch_diameter": "normal_tooth_thickness_at_reference_diameter"}
"""Attributes that have another meaning in other components or later versions."""

VALUES = {"radial_self-aligning_ball_bearing": "radial_self_aligning_ball_bearing"}


def component_name(name: str) -> str:
    """Return the name of a component in REXS 2.0."""
    return COMPONENTS.get(name, name)


def attribute_name(name: str, component: str, version: tuple[int, int]) -> str:
    """Return the name of an attribute in REXS 2.0.

    component: component by its name in 2.0.
    Returns name; unknown ones are returned as they are.
    """
    if component.startswith("rolling_bearing_with") and version < (1, 1):
        name = _BEARING.get(name, name)
    if component == "rolling_bearing_row":
        name = _ROW.get(name, name)
    if version < (1, 5):
        name = _GEAR_1_4.get(name, name)
    return ATTRIBUTES.get(name, name)
