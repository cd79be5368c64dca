"""Sections on connections of bodies: joints, bearings, mounts, couplings, meshes."""

from __future__ import annotations

import itertools
from typing import Annotated, Any, Literal, Self

from pydantic import Discriminator, Field, Tag, model_validator

from exugear.gearbox.sections import entries as q
from exugear.gearbox.sections.designations import boundary_of
from exugear.gearbox.sections.entries import GROUND, MOST_PLANETS, Name, Point, Section, Text, check_wall


class JointSection(Section):
    """Ideal joint that permits rotation about z (used by the variant `rigid`)."""

    body: Name
    """Body that rotates."""
    on: Name = GROUND
    """Supporting body: `ground`, a fixed body, or the carrier of a planet."""
    z_mm: q.PlaceMm
    """Position along the axis."""


_MatrixRow = Annotated[tuple[q.StiffnessEntry, ...], Field(strict=False, max_length=6)]


Matrix = Annotated[tuple[_MatrixRow, ...], Field(strict=False, max_length=6)]


def _check_matrix(section: Section, matrix: Matrix | None) -> None:
    """Raise an error for a matrix that is not 6x6, or that is combined with isotropic entries."""
    if matrix is not None and [len(row) for row in matrix] != [6] * 6:
        raise ValueError("matrix: specify 6 rows of 6 numbers, in the order x y z rx ry rz")
    others = section.model_fields_set - {"matrix"}
    if matrix is not None and others:
        raise ValueError(f"matrix: cannot be combined with {', '.join(sorted(others))}; remove one or the other")


class StiffnessSection(Section):
    """6x6 stiffness of a connector about its position: isotropic entries or the full matrix."""

    radial_N_per_m: q.Stiffness = 0.0
    """Stiffness for displacement normal to the axis."""
    axial_N_per_m: q.Stiffness = 0.0
    """Stiffness for displacement along the axis."""
    tilt_N_m_per_rad: q.Stiffness = 0.0
    """Stiffness for tilting."""
    torsion_N_m_per_rad: q.Stiffness = 0.0
    """Stiffness for rotation about the axis."""
    matrix: Matrix | None = None
    """Full 6x6 matrix instead, rows x y z rx ry rz, N/m, N and N m/rad."""

    @model_validator(mode="after")
    def _shape(self) -> Self:
        _check_matrix(self, self.matrix)
        return self


class ConnectorDampingSection(Section):
    """6x6 viscous damping of a connector about its position: isotropic entries or the full matrix."""

    radial_N_s_per_m: q.Stiffness = 0.0
    """Damping for velocity normal to the axis."""
    axial_N_s_per_m: q.Stiffness = 0.0
    """Damping for velocity along the axis."""
    tilt_N_m_s_per_rad: q.Stiffness = 0.0
    """Damping for the rate of tilting."""
    torsion_N_m_s_per_rad: q.Stiffness = 0.0
    """Damping for the rate of rotation about the axis."""
    matrix: Matrix | None = None
    """Full 6x6 matrix instead, rows x y z rx ry rz, N s/m, N s and N m s/rad."""

    @model_validator(mode="after")
    def _shape(self) -> Self:
        _check_matrix(self, self.matrix)
        return self


Profile = Annotated[
    Annotated[Literal["standard", "none"], Tag("name")]
    | Annotated[
        tuple[Annotated[tuple[q.ProfileShare, q.RemovedUm], Field(strict=False)], ...],
        Field(strict=False, min_length=2, max_length=200),
        Tag("table"),
    ],
    Discriminator(lambda value: "name" if isinstance(value, str) else "table"),
]
"""Roller profile by name, or profile drops (micrometres) over fractions of the half length."""
BearingType = Literal[
    "cylindrical_roller",
    "needle_roller",
    "tapered_roller",
    "spherical_roller",
    "deep_groove_ball",
    "angular_contact_ball",
    "self_aligning_ball",
    "four_point_ball",
    "thrust_spherical_roller",
]
"""Types of rolling bearings that a catalogue section can describe."""
_BARRELS = frozenset({"spherical_roller", "thrust_spherical_roller"})
_ROLLERS = _BARRELS | {"cylindrical_roller", "needle_roller", "tapered_roller"}
_BALLS = frozenset({"deep_groove_ball", "angular_contact_ball", "self_aligning_ball", "four_point_ball"})
_ANGULAR = frozenset({"tapered_roller", "angular_contact_ball"})
_SELF_ALIGNING = frozenset({"spherical_roller", "self_aligning_ball"})
_PROFILED = frozenset({"cylindrical_roller", "needle_roller", "tapered_roller"})
_PAIRED = frozenset({"cylindrical_roller", "needle_roller", "tapered_roller", "angular_contact_ball"})
_CYLINDERS = frozenset({"cylindrical_roller", "needle_roller"})
_RADIAL = frozenset({"cylindrical_roller", "needle_roller", "deep_groove_ball"})
TYPES_OF_KEYS: dict[str, tuple[frozenset[str], str]] = {
    "element_length_mm": (_ROLLERS, "not for ball bearings"),
    "inner_groove_ratio": (_BALLS, "roller raceways have no groove"),
    "outer_groove_ratio": (
        _BALLS - _SELF_ALIGNING,
        "only ball bearings have grooves, and self-aligning ones have a sphere",
    ),
    "osculation": (_BARRELS, "only for barrel rollers"),
    "profile": (_PROFILED, "not for ball bearings; for barrel rollers it follows from the osculation"),
    "row_count": (_RADIAL | _SELF_ALIGNING, "two rows with a contact angle form an X or O arrangement"),
    "ribs": (_CYLINDERS, "only cylindrical roller bearings have ribs that locate the shaft"),
    "rib_contact_mm": (_CYLINDERS, "only cylindrical roller bearings have ribs that locate the shaft"),
    "locates_towards": (_ANGULAR | {"thrust_spherical_roller"}, "it locates the shaft in both directions or in none"),
    "axial_preload_um": (_ANGULAR, "only a pair with contact angles can be preloaded axially"),
}
"""Keys of a catalogue section that are valid for some types only, with the reason."""
CONTACT_ANGLES_DEG: dict[str, tuple[float, float]] = {
    "tapered_roller": (5.0, 45.0),
    "spherical_roller": (2.0, 25.0),
    "angular_contact_ball": (5.0, 45.0),
    "self_aligning_ball": (2.0, 25.0),
    "four_point_ball": (10.0, 45.0),
    "thrust_spherical_roller": (40.0, 58.0),
}
"""Permitted contact angles by type; other types have none. Bearings above 45 degrees are thrust bearings, of which one
type is supported.
"""


ROUNDING_MM = 1e-6
"""Tolerance for sums of lengths in millimetres."""


class CatalogueSection(Section):
    """Boundary dimensions and known internal geometry of a rolling bearing; unknown data are estimated.

    The stiffness is that at `radial_load_kN`, or by default that at the static load.
    """

    type: BearingType
    """Type of the bearing."""
    designation: Text = ""
    """Designation such as "6307". If the program has its dimensions (ISO 15, ISO 355), type, bore, outer diameter and
    width follow from it; `check` compares stated ones.
    """
    series: Text = ""
    """Series whose constants the frictional moment takes; by default that of the designation."""
    bore_mm: q.LengthMm
    """Bore."""
    outer_diameter_mm: q.LengthMm
    """Outer diameter."""
    width_mm: q.LengthMm
    """Width of one bearing."""
    contact_angle_deg: q.ContactAngleDeg | None = None
    """Contact angle; that of the type by default."""
    arrangement: Literal["single", "X", "O", "tandem"] = "single"
    """Arrangement of the two bearings of a pair."""
    locates_towards: Literal["+z", "-z"] = "+z"
    """Axial locating direction of a single bearing or a tandem: direction in which the inner ring is restrained."""
    ribs: Literal["none", "+z", "-z", "both"] = "none"
    """Direction in which the ribs of cylindrical rollers restrain the inner ring: "+z" if it is pushed towards +z."""
    rib_contact_mm: q.LengthMm | None = None
    """Length of the contact between roller end and rib."""
    row_count: q.RollingRows | None = None
    """Number of rows of one bearing."""
    row_distance_mm: q.BoreMm | None = None
    """Distance between the middles of two rows; by default from type and arrangement."""
    full_complement: bool = False
    """Whether the bearing has no cage."""
    element_count: q.RollingElements | None = None
    """Number of balls or rollers of one row; by default a usual number."""
    element_diameter_mm: q.LengthMm | None = None
    """Diameter of balls or rollers; for tapered and barrel rollers at their middle."""
    element_length_mm: q.LengthMm | None = None
    """Effective length of rollers."""
    pitch_diameter_mm: q.LengthMm | None = None
    """Pitch diameter of the rolling elements."""
    inner_groove_ratio: q.GrooveRatio | None = None
    """Radius of the inner groove divided by the ball diameter."""
    outer_groove_ratio: q.GrooveRatio | None = None
    """Radius of the outer groove divided by the ball diameter."""
    osculation: q.Osculation | None = None
    """Profile radius of a barrel roller divided by that of the raceway."""
    profile: Profile = "standard"
    """Profile of rollers: that of ISO/TS 16281, straight, or a table of profile drops."""
    radial_clearance_mm: q.ClearanceMm = 0.0
    """Diametral clearance, mounted and with both rings at one temperature; negative for preload."""
    inner_ring_hotter_K: q.RingTemperatureK = 0.0
    """Temperature of the inner ring above that of the outer ring, which reduces clearance or adds preload."""
    axial_preload_um: q.AxialPreloadUm = 0.0
    """Axial approach of both rows relative to zero clearance; negative for clearance."""
    dynamic_rating_kN: q.RatingKN | None = None
    """Dynamic load rating of the catalogue, for a pair that of both bearings; according to ISO 281 by default."""
    static_rating_kN: q.RatingKN | None = None
    """Static load rating of the catalogue, for a pair that of both bearings; according to ISO 76 by default."""
    fatigue_load_limit_kN: q.RatingKN | None = None
    """Fatigue load limit C_u (P_u) of the catalogue, for a pair that of both bearings; according to ISO 281 by default.
    """
    speed_limit_rpm: q.SpeedLimitRpm | None = None
    """Limiting speed of the catalogue, inner relative to outer ring, above which `check` warns."""
    radial_load_kN: q.RadialLoadKN | None = None
    """Radial load at which the stiffness applies; by default that of the static state."""
    axial_load_kN: q.AxialLoadKN | None = None
    """Axial load in addition to the radial load."""

    @model_validator(mode="before")
    @classmethod
    def _completed_by_designation(cls, content: Any) -> Any:
        if not isinstance(content, dict) or not isinstance(content.get("designation"), str):
            return content
        keys = ("type", "bore_mm", "outer_diameter_mm", "width_mm")
        if all(key in content for key in keys):
            return content
        known = boundary_of(content["designation"])
        if known is not None:
            values = (known.type, known.bore, known.outer, known.width)
            return dict(zip(keys, values, strict=True)) | content
        if not any(key in content for key in keys):
            raise ValueError(
                f"designation = {content['designation']!r}: the program has no dimensions of it; set type, bore_mm, "
                "outer_diameter_mm and width_mm"
            )
        return content

    @model_validator(mode="after")
    def _keys_of_the_type(self) -> CatalogueSection:
        for key, (types, why) in TYPES_OF_KEYS.items():
            if key in self.model_fields_set and getattr(self, key) is not None and self.type not in types:
                raise ValueError(f"{key} is not applicable to type = {self.type!r}: {why}; remove the key")
        if self.arrangement != "single" and self.type not in _PAIRED:
            raise ValueError(
                f"arrangement = {self.arrangement!r} is not applicable to type = {self.type!r}; set 'single'"
            )
        if self.type in _ANGULAR and self.arrangement in ("X", "O") and "locates_towards" in self.model_fields_set:
            raise ValueError(
                f"locates_towards is not applicable to arrangement = {self.arrangement!r}, which locates in both "
                "directions; remove the key"
            )
        if self.rib_contact_mm is not None and self.ribs == "none":
            raise ValueError("rib_contact_mm requires ribs = '+z', '-z' or 'both'")
        if self.axial_preload_um != 0.0 and self.arrangement not in ("X", "O"):
            raise ValueError("axial_preload_um requires arrangement = 'X' or 'O'; a single bearing has none")
        if self.static_rating_kN and (self.fatigue_load_limit_kN or 0.0) >= self.static_rating_kN:
            raise ValueError(
                f"fatigue_load_limit_kN = {self.fatigue_load_limit_kN:g} must be below static_rating_kN = "
                f"{self.static_rating_kN:g}; usual: about 1/22 of it for ball bearings, 1/8 for roller bearings"
            )
        if self.axial_load_kN is not None and self.radial_load_kN is None:
            raise ValueError("axial_load_kN without radial_load_kN: set both, or none to use the static load")
        return self

    @model_validator(mode="after")
    def _rows(self) -> CatalogueSection:
        rows = self.row_count or (2 if self.type in _SELF_ALIGNING else 1)
        if self.type in _SELF_ALIGNING and (rows > 2 or self.row_distance_mm is not None):
            raise ValueError(f"type = {self.type!r} has one or two rows; contact_angle_deg defines their distance")
        if self.type in _SELF_ALIGNING and rows == 1 and self.contact_angle_deg is not None:
            raise ValueError("contact_angle_deg is not applicable to row_count = 1 (row in the middle); remove the key")
        if rows > 1 and self.arrangement != "single":
            raise ValueError(
                f"row_count = {rows} requires arrangement = 'single'; set the number of rows of the whole bearing"
            )
        if self.row_distance_mm is not None and rows == 1 and self.arrangement == "single":
            raise ValueError(
                "row_distance_mm requires a second row: row_count = 2, or arrangement 'X', 'O' or 'tandem'"
            )
        return self

    @model_validator(mode="after")
    def _dimensions(self) -> CatalogueSection:
        check_wall(self.bore_mm, self.outer_diameter_mm, "bore_mm")
        height = 0.5 * (self.outer_diameter_mm - self.bore_mm)
        # Needle cages without rings: outer diameter minus bore is two needle diameters.
        most = height + ROUNDING_MM if self.type == "needle_roller" else height - ROUNDING_MM
        if self.element_diameter_mm is not None and self.element_diameter_mm > most:
            raise ValueError(
                f"element_diameter_mm = {self.element_diameter_mm:g} must be below the {height:g} mm "
                "between bore_mm and outer_diameter_mm"
            )
        if self.element_length_mm is not None and self.element_length_mm > self.width_mm:
            raise ValueError(
                f"element_length_mm = {self.element_length_mm:g} must not be above width_mm = {self.width_mm:g}"
            )
        if self.pitch_diameter_mm is not None and not self.bore_mm < self.pitch_diameter_mm < self.outer_diameter_mm:
            raise ValueError(
                f"pitch_diameter_mm = {self.pitch_diameter_mm:g} must lie between bore_mm = {self.bore_mm:g} "
                f"and outer_diameter_mm = {self.outer_diameter_mm:g}"
            )
        return self

    @model_validator(mode="after")
    def _contact_angle(self) -> CatalogueSection:
        angle = self.contact_angle_deg
        if angle is None:
            return self
        if self.type not in CONTACT_ANGLES_DEG:
            if angle != 0.0:
                raise ValueError(
                    f"contact_angle_deg = {angle:g} is not applicable to type = {self.type!r}; remove the key"
                )
            return self
        least, most = CONTACT_ANGLES_DEG[self.type]
        if not least <= angle <= most:
            raise ValueError(
                f"contact_angle_deg = {angle:g} must lie between {least:g} and {most:g} for type = {self.type!r}"
            )
        return self

    @model_validator(mode="after")
    def _profile_table(self) -> CatalogueSection:
        if isinstance(self.profile, str):
            return self
        shares = [share for share, _ in self.profile]
        if shares[0] != 0.0 or any(later <= earlier for earlier, later in itertools.pairwise(shares)):
            raise ValueError(f"profile: fractions of half the length = {shares} must start at 0 and increase, up to 1")
        return self


class BearingSection(Section):
    """Compliant support (variants `bushing` and `flexible`): 6x6 stiffness, or from catalogue dimensions.

    With `catalogue` data, `stiffness` is a minimum for the directions in which the rollers carry no load. A bearing
    with a `designation` only needs one of the two before variants other than `rigid` can run.
    """

    body: Name
    """Body on the inner ring, or on the outer ring (`outer_ring`)."""
    on: Name = GROUND
    """The other body: `ground`, a fixed body, a carrier, another shaft."""
    z_mm: q.PlaceMm
    """Axial position of the middle."""
    housing_factor_applies: bool = True
    """Whether the housing stiffness factor `housing.factor` applies to its seat."""
    model: Literal["linear", "iso16281"] = "linear"
    """Linear model at the static load, or nonlinear model of the rolling elements."""
    cage: Literal["averaged", "turning"] = "averaged"
    """Cage of a nonlinear bearing: mean stiffness over the cage positions, or rolling elements that orbit with the
    rings.
    """
    outer_ring: Literal["body", "on"] | None = None
    """Body that carries the outer ring; by default a planet does, other bodies do not."""
    designation: Text = ""
    """Designation, which stands for a [.catalogue] table if the program has its dimensions; other bearings without data
    can be used only in the variant `rigid`.
    """
    stiffness: StiffnessSection | None = None
    """Specified stiffness, or minimum stiffness with catalogue data."""
    catalogue: CatalogueSection | None = None
    """Catalogue data."""
    damping: ConnectorDampingSection | None = None
    """Damping; proportional to the stiffness by default."""

    @model_validator(mode="before")
    @classmethod
    def _completed_by_designation(cls, content: Any) -> Any:
        if not isinstance(content, dict) or {"stiffness", "catalogue"} & set(content):
            return content
        designation = content.get("designation")
        if isinstance(designation, str) and boundary_of(designation) is not None:
            return content | {"catalogue": {"designation": designation}}
        return content

    @model_validator(mode="after")
    def _source(self) -> BearingSection:
        if not self.is_known and not self.designation:
            raise ValueError("add a [.stiffness] table or a [.catalogue] table")
        return self

    @property
    def is_known(self) -> bool:
        """Whether more than the designation is specified."""
        return self.stiffness is not None or self.catalogue is not None

    @model_validator(mode="after")
    def _law(self) -> BearingSection:
        if self.model == "iso16281" and self.catalogue is None:
            raise ValueError("model = 'iso16281' requires a [.catalogue] table with the rolling elements")
        if self.model == "iso16281" and self.catalogue is not None and self.catalogue.radial_load_kN is not None:
            raise ValueError(
                "model = 'iso16281' uses the computed load; remove catalogue.radial_load_kN and .axial_load_kN"
            )
        if self.model != "iso16281" and "cage" in self.model_fields_set:
            raise ValueError(f"cage = {self.cage!r} requires model = 'iso16281'")
        return self


class MountSection(Section):
    """Elastic support of the gearbox on the ground; active if the fixed body is flexible, else that is the ground.

    A body that only bearings and mounts support, such as a bearing pedestal, is supported by its mounts in every
    variant with bearings. One of these mounts, or of the bearings on stationary bodies, must have torsional stiffness.

    A mount that replaces a body (`instead_of`) is disabled if that body is enabled.
    """

    body: Name
    """Supported body."""
    instead_of: Name | None = None
    """Body that it replaces while that body is not enabled."""
    position_mm: Point
    """Position."""
    stiffness: StiffnessSection
    """Stiffness."""
    damping: ConnectorDampingSection | None = None
    """Damping; proportional to the stiffness by default."""


class CouplingSection(Section):
    """Torsional spring between two bodies on one axis; if one body is fixed, the spring restrains the other.

    It acts at the `seat` of flexible bodies, a bearing name, and at the torque position of bodies without this seat. A
    coupling that replaces a body (`instead_of`) is disabled if that body is enabled.
    """

    bodies: Annotated[tuple[Name, Name], Field(strict=False)]
    """The two bodies."""
    seat: Name | None = None
    """Bearing at whose seat it acts on flexible bodies."""
    instead_of: Name | None = None
    """Body that it replaces while that body is not enabled."""
    stiffness_N_m_per_rad: q.CouplingStiffness
    """Torsional stiffness."""
    damping_N_m_s_per_rad: q.CouplingDamping | None = None
    """Torsional damping; proportional to the stiffness by default."""


class SealSection(Section):
    """Radial shaft seal, whose friction `exugear losses` includes."""

    body: Name
    """Shaft on which the lip slides."""
    on: Name = GROUND
    """Body that holds the seal: `ground`, a fixed body, a carrier, another shaft."""
    diameter_mm: q.LengthMm
    """Diameter of the shaft under the lip."""
    speed_limit_m_per_s: q.SealSpeed = 14.0
    """Permissible circumferential speed, above which `check` warns; 14 m/s is usual in catalogues for nitrile rubber
    (NBR), other materials permit more.
    """


Phases = Annotated[
    Annotated[q.Phase, Tag("one")]
    | Annotated[tuple[q.Phase, ...], Field(strict=False, max_length=MOST_PLANETS), Tag("each")],
    Discriminator(lambda value: "each" if isinstance(value, list | tuple) else "one"),
]
"""One phase for all meshes of a set, or one per mesh."""


class MeshSection(Section):
    """A mesh of a gear pair between two bodies; a planet set has one mesh per planet."""

    pair: Name
    """Pair of gears."""
    pinion_body: Name
    """Body of the pinion."""
    gear_body: Name
    """Body of the gear."""
    frame: Name | None = None
    """Body with which the line of centres rotates; by default it follows from the bodies."""
    position_angle_deg: q.AngleDeg | None = None
    """Direction from pinion to gear in that frame; by default it follows from the bodies."""
    phase: Phases | None = None
    """Position in the mesh cycle at zero angles; by default it follows from tooth numbers and positions."""
