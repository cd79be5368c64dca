"""Attributes of REXS with their units, keys of the gearbox file and names in the versions; types of components.

Import and export read these tables: a new attribute gets a row in `READ`, a new result one in `RESULTS`. The function
`entries_of` of `exugear.exchange.rexs.to_case.notes` converts rows with a key.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from exugear.gearbox.units import unit_of, unit_of_key

LEAST_VERSION = (1, 0)
LAST_VERSION = (2, 0)
"""Supported versions; names changed in between, as the tables below list."""
OWN = "custom_exugear_"
"""Prefix of attributes for which REXS has no name; other programs ignore them."""


class Row(NamedTuple):
    """An attribute that is read; those without a key enter conversions of several attributes."""

    attribute: str
    """Current name."""
    unit: str = "none"
    """Unit in which it is read, and of values without a unit, because some programs omit it."""
    key: str = ""
    """Key of the gearbox file for the same quantity."""
    older: str = ""
    """Name in older versions."""
    scale: float = 1.0
    """Factor to the quantity of the key, such as 6 from Ra to Rz (ISO 6336-2)."""

    @property
    def factor(self) -> float:
        """Factor from the unit to the quantity of the key in its unit."""
        source = unit_of(self.unit)
        target = unit_of_key(self.key)
        if source is None or target is None:
            return self.scale
        return float(f"{self.scale * source.factor / target.factor:.15g}")


READ: Mapping[str, Sequence[Row]] = {
    "gear": (
        Row("normal_module", "mm", "normal_module_mm"),
        Row("face_width", "mm", "face_width_mm"),
        Row("helix_angle_reference_diameter", "deg", "helix_angle_deg"),
        Row("normal_pressure_angle", "deg", "normal_pressure_angle_deg"),
        Row("tip_diameter", "mm", "tip_diameter_mm"),
        Row("root_diameter", "mm", "root_diameter_mm"),
        Row("tip_form_diameter", "mm"),
        Row("root_form_diameter", "mm", "root_form_diameter_mm"),
        Row("chordal_tooth_thickness_upper_deviation", "mm", "upper_allowance_um"),
        Row("chordal_tooth_thickness_lower_deviation", "mm", "lower_allowance_um"),
        Row("chordal_transverse_tooth_thickness_upper_deviation", "mm", "upper_allowance_um"),
        Row("chordal_transverse_tooth_thickness_lower_deviation", "mm", "lower_allowance_um"),
        Row("upper_backlash_allowance_referenced_to_span", "mm", "upper_allowance_um"),
        Row("lower_backlash_allowance_referenced_to_span", "mm", "lower_allowance_um"),
        Row("base_diameter", "mm", older="base_circle_diameter"),
        Row("reference_diameter_cylindrical_gear", "mm", older="reference_circle_diameter"),
    ),
    "flank": (
        Row("addendum_modification_coefficient", key="profile_shift"),
        Row("normal_pressure_angle", "deg", "normal_pressure_angle_deg"),
        Row("tooth_tip_chamfer", "mm", "tip_chamfer_mm"),
    ),
    "tool": (
        Row("addendum_coefficient_reference_profile", key="dedendum"),
        Row("tip_corner_radius_factor_reference_profile", key="tip_radius", older="tip_radius_factor"),
        Row("tip_corner_radius_cutter", "mm"),
        Row("protuberance_amount", "mm"),
        Row("protuberance_amount_factor"),
        Row("protuberance_angle", "deg"),
        Row("machining_allowance", "mm"),
    ),
    "modification": (
        Row("tip_relief_depth", "mm", "tip_relief_um"),
        Row("tip_relief_datum_diameter", "mm"),
        Row("tip_relief_evaluation_reference", "mm"),
        Row("root_relief_depth", "mm", "root_relief_um"),
        Row("root_relief_datum_diameter", "mm"),
        Row("root_relief_evaluation_reference", "mm"),
        Row("profile_crowning_at_tip", "mm", "profile_crowning_um"),
        Row("profile_crowning_at_root", "mm", "profile_crowning_um"),
        Row("helix_crowning_amount_datum_face", "mm", "lead_crowning_um"),
        Row("helix_crowning_amount_non_datum_face", "mm", "lead_crowning_um"),
        Row("coordinate_where_helix_crowning_is_specified_datum_face", "mm"),
        Row("coordinate_where_helix_crowning_is_specified_non_datum_face", "mm"),
    ),
    "unsigned": (
        Row("helix_slope", "mm", "helix_slope_um"),
        Row("profile_slope", "mm", "profile_slope_um"),
        Row("profile_twist", "mm", "twist_um"),
    ),
    "stage": (
        Row("center_distance", "mm", "centre_distance_mm"),
        Row("common_face_width", "mm", "common_face_width_mm"),
        Row("rotating_angle_around_neg_u_axis", "deg"),
    ),
    "dynamic factors": (
        Row("dynamic_factor_iso_6336_2006", key="dynamic_factor"),
        Row("dynamic_factor_din_3990_1987", key="dynamic_factor"),
    ),
    "material": (
        Row("elastic_modulus", "MPa", "youngs_modulus_GPa"),
        Row("poisson_ratio", key="poissons_ratio"),
        Row("density", "kg / m^3", "density_kg_per_m3"),
    ),
    "strength": (
        Row("endurance_limit_flank", "MPa", "sigma_H_lim_MPa"),
        Row("endurance_limit_root", "MPa", "sigma_F_lim_MPa"),
    ),
    "roughness": (
        Row("averaged_peak_to_valley_height_flank", "mum", "roughness_Rz_um"),
        Row("mean_peak_to_valley_roughness_flank_iso_4287_1997", "mum", "roughness_Rz_um"),
        Row("arithmetic_average_roughness_flank", "mum", "roughness_Ra_um"),
        Row("arithmetic_mean_roughness_flank_iso_4287_1997", "mum", "roughness_Ra_um"),
        Row("averaged_peak_to_valley_height_root", "mum", "root_roughness_Rz_um"),
        Row("mean_peak_to_valley_roughness_root_iso_4287_1997", "mum", "root_roughness_Rz_um"),
        Row("arithmetic_average_roughness_root", "mum", "root_roughness_Rz_um", scale=6.0),
        Row("arithmetic_mean_roughness_root_iso_4287_1997", "mum", "root_roughness_Rz_um", scale=6.0),
    ),
    "tolerance class": (
        Row("tolerance_class_according_to_iso_1328_2013", key="tolerance_class"),
        Row("global_tolerance_class_iso_1328_2013", key="tolerance_class"),
    ),
    "section": (
        Row("u_coordinate_on_shaft", "mm"),
        Row("length", "mm", "length_mm"),
        Row("outer_diameter_begin", "mm", "outer_diameter_mm"),
        Row("outer_diameter_end", "mm", "outer_diameter_end_mm"),
        Row("inner_diameter_begin", "mm", "inner_diameter_mm"),
        Row("inner_diameter_end", "mm", "inner_diameter_end_mm"),
    ),
    "bearing size": (
        Row("inner_diameter", "mm", "bore_mm"),
        Row("outer_diameter", "mm", "outer_diameter_mm"),
        Row("width", "mm", "width_mm"),
    ),
    "clearance": (Row("operating_radial_bearing_clearance", "mm", "radial_clearance_mm", older="radial_backlash"),),
    "row distance": (Row("distance_between_bearing_rows", "mm", "row_distance_mm"),),
    "preload": (
        Row("preload_distance", "mm", "axial_preload_um"),
        Row("operating_axial_bearing_clearance", "mm", "axial_preload_um", "axial_backlash", -1.0),
    ),
    "bearing": (
        Row("pressure_angle", "deg", "contact_angle_deg"),
        Row("u_coordinate_on_shaft_inner_side", "mm"),
        Row("u_coordinate_on_shaft_outer_side", "mm"),
    ),
    "radial rating": (
        Row("radial_dynamic_load_rating", "kN", "dynamic_rating_kN", older="dynamic_capacity"),
        Row("radial_static_load_rating", "kN", "static_rating_kN", older="static_capacity"),
        Row("fatigue_limit_load", "kN", "fatigue_load_limit_kN"),
    ),
    "axial rating": (
        Row("axial_dynamic_load_rating", "kN", "dynamic_rating_kN"),
        Row("axial_static_load_rating", "kN", "static_rating_kN"),
        Row("fatigue_limit_load", "kN", "fatigue_load_limit_kN"),
    ),
    "rolling element": (
        Row("diameter_of_rolling_element", "mm", "element_diameter_mm"),
        Row("length_of_rolling_element", "mm", "element_length_mm"),
    ),
    "bearing row": (Row("reference_diameter_rolling_bearing", "mm", "pitch_diameter_mm", older="reference_diameter"),),
    "radii": (
        Row("roller_crowning_radius", "mm"),
        Row("raceway_radius_of_inner_ring", "mm"),
        Row("raceway_radius_of_outer_ring", "mm"),
    ),
    "stiffness": (
        Row("radial_stiffness", "N / m", "radial_N_per_m"),
        Row("axial_stiffness", "N / m", "axial_N_per_m"),
        Row("bending_stiffness", "N mm / rad", "tilt_N_m_per_rad"),
    ),
    "torsion": (Row("rotational_stiffness", "N mm / rad", "stiffness_N_m_per_rad"),),
    "load": (
        Row("force_u_direction", "N"),
        Row("force_v_direction", "N"),
        Row("force_w_direction", "N"),
        Row("torque_around_u_axis", "N m"),
        Row("torque_around_v_axis", "N m"),
        Row("torque_around_w_axis", "N m"),
        Row("power", "kW"),
        Row("rotational_speed", "1 / min"),
    ),
    "viscosity": (
        Row("viscosity_at_40_degree_celsius", "mm^2 / s", "viscosity_40_mm2_per_s"),
        Row("viscosity_at_100_degree_celsius", "mm^2 / s", "viscosity_100_mm2_per_s"),
    ),
    "oil density": (Row("density_at_15_degree_celsius", "kg / m^3", "density_15_kg_per_m3"),),
    "operation": (
        Row("operating_time_fraction", "%", older="load_duration_fraction"),
        Row("operating_time", "h"),
        Row("temperature_lubricant", "C", "temperature_C"),
        Row("gravitational_acceleration", "m / s^2"),
    ),
}
"""Attributes by the part to which they belong.

Those of "unsigned" have the name of their component's type and an undefined sign: database and schema of REXS (1.2 to
2.0.0) permit both signs and call it an amount. No public text defines at which end of the flank a positive value
removes material. A wrong sign would be worse than no value.
"""
_ROWS = [row for rows in READ.values() for row in rows]
UNITS = {row.attribute: row.unit for row in _ROWS}
"""Unit in which each attribute is read."""
ATTRIBUTES = {row.older: row.attribute for row in _ROWS if row.older}
"""Current name of an attribute by its old name, for those that are read."""

Version = tuple[int, int]


class Result(NamedTuple):
    """A result with its unit and its names by the version that introduced them; without a name it gets a custom one."""

    unit: str
    names: Mapping[Version, str] = {}


RESULTS: Mapping[str, Result] = {
    # of gears
    "reference_diameter": Result(
        "mm", {(1, 1): "reference_circle_diameter", (2, 0): "reference_diameter_cylindrical_gear"}
    ),
    "base_diameter": Result("mm", {(1, 1): "base_circle_diameter", (2, 0): "base_diameter"}),
    "axial_pitch": Result("mm", {(1, 1): "axial_pitch"}),
    "normal_tooth_thickness": Result(
        "mm",
        {(1, 2): "normal_tooth_thickness_at_pitch_diameter", (1, 5): "normal_tooth_thickness_at_reference_diameter"},
    ),
    "transverse_tooth_thickness": Result(
        "mm", {(1, 2): "tooth_thickness_at_pitch_diameter", (1, 5): "transverse_tooth_thickness_at_reference_diameter"}
    ),
    "normal_tooth_thickness_at_tip_diameter": Result("mm", {(1, 5): "normal_tooth_thickness_at_tip_diameter"}),
    "root_form_diameter": Result("mm", {(1, 2): "root_form_diameter"}),
    "tip_diameter": Result("mm"),
    "root_diameter": Result("mm"),
    "profile_shift": Result("none"),
    "tooth_thinning": Result("mm"),
    "tool_tip_radius": Result("none"),
    # of shafts
    "rotational_speed": Result("1 / min", {(1, 0): "rotational_speed"}),
    "node_positions": Result("mm", {(1, 1): "u_coordinates_of_beam_nodes"}),
    "displacement_u": Result("mum", {(1, 1): "displacement_u_of_nodes"}),
    "displacement_v": Result("mum", {(1, 1): "displacement_v_of_nodes"}),
    "displacement_w": Result("mum", {(1, 1): "displacement_w_of_nodes"}),
    # of a gear in a stage
    "pitch_diameter": Result("mm", {(1, 0): "pitch_diameter"}),
    "working_pressure_angle": Result("deg", {(1, 1): "operating_pressure_angle_in_the_transverse_section"}),
    "active_root_diameter": Result("mm", {(1, 1): "usable_root_circle_diameter", (2, 0): "active_root_diameter"}),
    "active_tip_diameter": Result("mm", {(1, 1): "usable_addendum_circle_diameter", (2, 0): "active_tip_diameter"}),
    "tip_clearance": Result("mm", {(1, 2): "tip_clearance"}),
    "mesh_positions": Result("deg", {(1, 5): "rotational_meshing_position"}),
    # of a stage
    "gear_ratio": Result("none", {(1, 1): "gear_ratio"}),
    "transverse_contact_ratio": Result("none", {(1, 1): "radial_contact_ratio"}),
    "overlap_ratio": Result("none", {(1, 1): "overlap_contact_ratio"}),
    "total_contact_ratio": Result("none", {(1, 3): "total_contact_ratio"}),
    "length_of_path_of_contact": Result("mm", {(1, 3): "length_of_path_of_contact"}),
    "transverse_backlash": Result("mm"),
    "tangential_force_at_base_circle": Result(
        "N", {(1, 3): "nominal_tangential_force_at_base_circle", (2, 0): "nominal_tangential_force_at_base_diameter"}
    ),
    "face_load_factor": Result("none", {(1, 1): "face_load_factor_flank", (2, 0): "face_load_factor_contact_stress"}),
    "mesh_stiffness": Result("N / mm", {(1, 5): "meshing_stiffness_characteristic"}),
    "mean_mesh_stiffness": Result("N / mm"),
    "mesh_cycle_positions": Result("none"),
    "transmission_error": Result("mum"),
    "transmission_error_peak_to_peak": Result("mum"),
    "contact_pressure_maximum": Result("MPa"),
    "load_along_face": Result("N / mm"),
    "load_along_face_positions_from_middle": Result("mm"),
    # of bearings; up to 1.5 the unit of a life is not defined
    "radial_load": Result("kN"),
    "axial_load": Result("kN"),
    "basic_rating_life": Result("MRev", {(1, 6): "nominal_rating_life_rotations_iso_281_2007"}),
    "reference_rating_life": Result(
        "MRev",
        {
            (1, 6): "nominal_reference_rating_life_rotations_din_26281",
            (1, 7): "nominal_reference_rating_life_rotations_iso_16281_2008",
        },
    ),
    "contact_pressure": Result("MPa", {(1, 3): "maximum_hertzian_pressure_inner_ring"}),
}
"""Results by their own names, from the attribute lists of REXS 1.0 to 2.0."""

TYPES = {
    "flank_geometry": "cylindrical_gear_flank",
    "stage_gear_data": "cylindrical_stage_gear_data",
    "fixed_coupling": "coupling",
}
"""Current name of a component type by its old name."""
ROLES = {"side_1": "inner_part", "side_2": "outer_part"}
"""Current name of a role in a relation by its old name."""
RELATIONS = {"coupling": "side", "ordered_assembly": "assembly"}
"""Relations that are read as others: an old name, and assemblies in an order."""
OTHER_GEARS = {"bevel": "bevel gears", "worm": "worm gears", "hypoid": "hypoid gears"}
"""Prefixes of the types of gears that are not cylindrical."""
GEARS = ("cylindrical_gear", "ring_gear")
BEARINGS = ("concept_bearing", "rolling_bearing_with_catalog_geometry", "rolling_bearing_with_detailed_geometry")
PLAIN_BEARINGS = ("hydrodynamic_radial_plain_bearing", "slide_bearing")
JOINING = (
    *("coupling", "switchable_coupling", "cylindrical_interference_fit", "tapered_interference_fit"),
    *("feather_key_connection", "involute_spline_connection"),
)
"""Types of components that can rigidly connect their inner and outer part."""
IMPORTED_MODIFICATIONS = ("tip_relief", "root_relief", "profile_crowning", "helix_crowning")
MODIFICATIONS = (
    *IMPORTED_MODIFICATIONS,
    *("triangular_tip_relief", "triangular_root_relief", "profile_slope", "profile_twist", "helix_slope"),
    *("end_relief_datum_face", "end_relief_non_datum_face", "topographical_modification"),
)
TYPES_OF_ROLES: Mapping[tuple[str, str], Sequence[str]] = {
    ("stage", "gear_1"): GEARS,
    ("stage", "gear_2"): GEARS,
    ("stage", "stage"): ("cylindrical_stage",),
    **{
        (relation, role): (role,)
        for relation in ("planet_shaft", "planet_pin", "planet_carrier_shaft")
        for role in ("shaft", "planetary_stage")
    },
    ("side", "assembly"): (*BEARINGS, *PLAIN_BEARINGS, *JOINING),
}
"""Required type of a component with a role in a relation; a wrong id refers to a component of another type."""
READ_TYPES = frozenset(
    (*GEARS, *BEARINGS, *PLAIN_BEARINGS, *JOINING, *MODIFICATIONS, "gear_unit", "gear_casing", "shaft", "shaft_section")
    + ("side_plate", "planet_carrier", "planetary_stage", "cylindrical_stage", "cylindrical_gear_flank")
    + ("cylindrical_gear_manufacturing_settings", "rack_shaped_tool", "cutter_wheel_tool", "material")
    + ("rolling_bearing_row", "rolling_element", "external_load", "lubricant")
)
"""Types of components from which data are read."""
TYPES_WITHOUT_EFFECT = frozenset(
    ("assembly_group", "cylindrical_stage_gear_data", "element_list", "involute_spline_gear_hub")
    + ("involute_spline_gear_shaft", "joint_section", "meshing_contact_stage_data_set")
    + ("notch_effect_shaft_hub_connection", "point_list", "reduction_point", "shaft_shoulder")
    + ("shaft_shoulder_with_undercut",)
)
"""Types of components that group or rate others; they have no mass or stiffness and carry no load."""

# Words as values

ROLLING_TYPES = {
    "angular_contact_ball_bearing": "angular_contact_ball",
    "axial_self_aligning_roller_bearing": "thrust_spherical_roller",
    "four_point_contact_ball_bearing": "four_point_ball",
    "radial_grooved_ball_bearing": "deep_groove_ball",
    "radial_needle_roller_bearing": "needle_roller",
    "radial_roller_bearing": "cylindrical_roller",
    "radial_self-aligning_ball_bearing": "self_aligning_ball",
    "radial_self_aligning_ball_bearing": "self_aligning_ball",
    "radial_self_aligning_roller_bearing": "spherical_roller",
    "radial_spherical_roller_bearing": "spherical_roller",
    "radial_tapered_roller_bearing": "tapered_roller",
}
"""Types of rolling bearings, REXS to exugear."""
SHAPES = {"linear": "linear", "parabolic": "parabolic", "circular": "parabolic"}
"""Shapes of a relief, REXS to exugear; a circle and its parabola differ by the square of depth over length."""
