"""What results are called in which version of REXS; what REXS has no name for gets one of our own."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from exugear.exchange.rexs.additions import OWN, Addition, AdditionValue, unit_in
from fe_ste.tools.display import Displayed

Version = tuple[int, int]

NAMES: Mapping[str, Sequence[tuple[Version, str]]] = {
    # of gears
    "reference_diameter": [((1, 1), "reference_circle_diameter"), ((2, 0), "reference_diameter_cylindrical_gear")],
    "base_diameter": [((1, 1), "base_circle_diameter"), ((2, 0), "base_diameter")],
    "axial_pitch": [((1, 1), "axial_pitch")],
    "normal_tooth_thickness": [
        ((1, 2), "normal_tooth_thickness_at_pitch_diameter"),
        ((1, 5), "normal_tooth_thickness_at_reference_diameter"),
    ],
    "transverse_tooth_thickness": [
        ((1, 2), "tooth_thickness_at_pitch_diameter"),
        ((1, 5), "transverse_tooth_thickness_at_reference_diameter"),
    ],
    "root_form_diameter": [((1, 2), "root_form_diameter")],
    "normal_tooth_thickness_at_tip_diameter": [((1, 5), "normal_tooth_thickness_at_tip_diameter")],
    # of shafts
    "rotational_speed": [((1, 0), "rotational_speed")],
    "node_positions": [((1, 1), "u_coordinates_of_beam_nodes")],
    "displacement_u": [((1, 1), "displacement_u_of_nodes")],
    "displacement_v": [((1, 1), "displacement_v_of_nodes")],
    "displacement_w": [((1, 1), "displacement_w_of_nodes")],
    # of a gear in a stage
    "pitch_diameter": [((1, 0), "pitch_diameter")],
    "working_pressure_angle": [((1, 1), "operating_pressure_angle_in_the_transverse_section")],
    "active_root_diameter": [((1, 1), "usable_root_circle_diameter"), ((2, 0), "active_root_diameter")],
    "active_tip_diameter": [((1, 1), "usable_addendum_circle_diameter"), ((2, 0), "active_tip_diameter")],
    "tip_clearance": [((1, 2), "tip_clearance")],
    "mesh_positions": [((1, 5), "rotational_meshing_position")],
    # of a stage
    "gear_ratio": [((1, 1), "gear_ratio")],
    "transverse_contact_ratio": [((1, 1), "radial_contact_ratio")],
    "overlap_ratio": [((1, 1), "overlap_contact_ratio")],
    "total_contact_ratio": [((1, 3), "total_contact_ratio")],
    "length_of_path_of_contact": [((1, 3), "length_of_path_of_contact")],
    "tangential_force_at_base_circle": [
        ((1, 3), "nominal_tangential_force_at_base_circle"),
        ((2, 0), "nominal_tangential_force_at_base_diameter"),
    ],
    "face_load_factor": [((1, 1), "face_load_factor_flank"), ((2, 0), "face_load_factor_contact_stress")],
    "mesh_stiffness": [((1, 5), "meshing_stiffness_characteristic")],
    # of bearings; until 1.5 the unit of a life is not told
    "basic_rating_life": [((1, 6), "nominal_rating_life_rotations_iso_281_2007")],
    "reference_rating_life": [
        ((1, 6), "nominal_reference_rating_life_rotations_din_26281"),
        ((1, 7), "nominal_reference_rating_life_rotations_iso_16281_2008"),
    ],
    "contact_pressure": [((1, 3), "maximum_hertzian_pressure_inner_ring")],
}
"""Names by version from which on they hold; found in the lists of attributes of REXS 1.0 to 2.0."""


def name_in(key: str, version: Version) -> str:
    """Name of a result in a version.

    Examples
    --------
    >>> name_in("base_diameter", (1, 4)), name_in("base_diameter", (2, 0)), name_in("base_diameter", (1, 0))
    ('base_circle_diameter', 'base_diameter', 'custom_exugear_base_diameter')
    """
    known = [name for since, name in NAMES.get(key, ()) if since <= version]
    if known:
        return known[-1]
    return OWN + key


def stiffness_names(version: Version) -> Iterator[tuple[str, int, int, str, float]]:
    """Entries of a bearing's stiffness: name, row and column over (u, v, w) and angles about them, unit, SI to unit."""
    forces = (("f_u", 0), ("f_v", 1), ("f_w", 2), ("m_v", 4), ("m_w", 5))
    motions = (
        ("d_u", 0),
        ("d_v", 1),
        ("d_w", 2),
        ("rot_v", 4),
        ("rot_w", 5),
    )
    for force, row in forces:
        for motion, column in motions:
            turned = row > 3, column > 3
            unit = {(False, False): "N / m", (False, True): "N / rad", (True, False): "N"}.get(turned, "N mm / rad")
            end = f"{force}_{motion}"
            if version < (1, 1):
                old = motion if motion.startswith("d_") else f"d_{motion[-1]}_rot"
                end = f"d{force.upper()[0]}_{force[-1]}_{old}"
            yield f"operating_point_stiffness_{end}", row, column, unit, 1e3 if all(turned) else 1.0


@dataclass
class Results(Displayed, line=": {additions!n} attributes"):
    """Attributes gathered for a file."""

    version: Version
    """(int, int) of REXS."""
    additions: list[Addition] = field(default_factory=list)

    def put(
        self, component: int, key: str, unit: str, value: AdditionValue | None, load_case: int | None = None
    ) -> None:
        """Keep a result under the name that REXS has for it, or one of our own; None is left out."""
        if value is not None:
            self.put_named(component, name_in(key, self.version), unit, value, load_case)

    def put_own(self, component: int, key: str, unit: str, value: AdditionValue, load_case: int | None = None) -> None:
        """Keep what REXS has no name for."""
        self.put_named(component, OWN + key, unit, value, load_case)

    def put_named(
        self, component: int, name: str, unit: str, value: AdditionValue, load_case: int | None = None
    ) -> None:
        """Keep a result under a name."""
        value = tuple(map(float, value)) if isinstance(value, tuple) else value
        value = float(value) if isinstance(value, int | float) else value
        self.additions.append(Addition(component, name, unit_in(unit, self.version), value, load_case))
