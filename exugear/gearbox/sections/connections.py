"""Sections on what joins bodies: joints, bearings, mounts, couplings, meshes."""

from __future__ import annotations

import itertools
from typing import Annotated, Literal, Self

from pydantic import Discriminator, Field, Tag, model_validator

from exugear.gearbox.sections import entries as q
from exugear.gearbox.sections.entries import (
    GROUND,
    MOST_PLANETS,
    Name,
    Point,
    Section,
    Text,
    check_wall,
)


class JointSection(Section):
    """Ideal joint that leaves the spin about z free (used by the variant `rigid`)."""

    body: Name
    """Body that turns."""
    on: Name = GROUND
    """What it turns on: `ground`, a fixed body, a planet's carrier."""
    z_mm: q.PlaceMm
    """Place along the axis."""


_MatrixRow = Annotated[tuple[q.StiffnessEntry, ...], Field(strict=False, max_length=6)]


Matrix = Annotated[tuple[_MatrixRow, ...], Field(strict=False, max_length=6)]


def _check_matrix(section: Section, matrix: Matrix | None) -> None:
    """Refuse a matrix that is not 6x6, or that isotropic entries are combined with."""
    if matrix is not None and [len(row) for row in matrix] != [6] * 6:
        raise ValueError("matrix: specify 6 rows of 6 numbers, in the order x y z rx ry rz")
    others = section.model_fields_set - {"matrix"}
    if matrix is not None and others:
        raise ValueError(f"matrix: cannot be combined with {', '.join(sorted(others))}; remove one or the other")


class StiffnessSection(Section):
    """6x6 stiffness of a connector about its place: isotropic entries or the full matrix."""

    radial_N_per_m: q.Stiffness = 0.0
    """Against displacement across the axis."""
    axial_N_per_m: q.Stiffness = 0.0
    """Against displacement along the axis."""
    tilt_N_m_per_rad: q.Stiffness = 0.0
    """Against tilting."""
    torsion_N_m_per_rad: q.Stiffness = 0.0
    """Against rotation about the axis."""
    matrix: Matrix | None = None
    """Full 6x6 matrix instead, rows x y z rx ry rz, N/m, N and N m/rad."""

    @model_validator(mode="after")
    def _shape(self) -> Self:
        _check_matrix(self, self.matrix)
        return self


class ConnectorDampingSection(Section):
    """6x6 viscous damping of a connector about its place: isotropic entries or the full matrix."""

    radial_N_s_per_m: q.Stiffness = 0.0
    """Against velocity across the axis."""
    axial_N_s_per_m: q.Stiffness = 0.0
    """Against velocity along the axis."""
    tilt_N_m_s_per_rad: q.Stiffness = 0.0
    """Against the rate of tilting."""
    torsion_N_m_s_per_rad: q.Stiffness = 0.0
    """Against the rate of rotation about the axis."""
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
"""Roller profile by name, or drops (micrometres) over shares of half the length."""
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
        ("only ball bearings have grooves, and self-aligning ones have a sphere"),
    ),
    "osculation": (_BARRELS, "only for barrel rollers"),
    "profile": (_PROFILED, "not for ball bearings; for barrel rollers it follows from the osculation"),
    "row_count": (_RADIAL | _SELF_ALIGNING, "two rows with a contact angle form an X or O arrangement"),
    "ribs": (_CYLINDERS, "only cylindrical roller bearings have ribs that locate the shaft"),
    "rib_contact_mm": (_CYLINDERS, "only cylindrical roller bearings have ribs that locate the shaft"),
    "locates_towards": (_ANGULAR | {"thrust_spherical_roller"}, "it locates the shaft in both directions or in none"),
    "axial_preload_um": (_ANGULAR, "only a pair with contact angles can be preloaded axially"),
}
"""Keys of a catalogue section that only some types have, and why."""
CONTACT_ANGLES_DEG: dict[str, tuple[float, float]] = {
    "tapered_roller": (5.0, 45.0),
    "spherical_roller": (2.0, 25.0),
    "angular_contact_ball": (5.0, 45.0),
    "self_aligning_ball": (2.0, 25.0),
    "four_point_ball": (10.0, 45.0),
    "thrust_spherical_roller": (40.0, 58.0),
}
"""Contact angles that can be, by type; other types have none. Beyond 45 degrees it is a thrust bearing, of which
one type is known."""


ROUNDING_MM = 1e-6
"""What sums of lengths in millimetres may differ by."""


class CatalogueSection(Section):
    """Boundary dimensions of a rolling bearing, and what is known of its inside; the rest is estimated from them.

    With `radial_load_kN` the stiffness is that under this load; without, that under the load of the statics.
    """

    type: BearingType
    """Type of the bearing."""
    designation: Text = ""
    """Words for people; `check` compares bore and outer diameter with those of ISO 15 and 355."""
    bore_mm: q.LengthMm
    """Bore."""
    outer_diameter_mm: q.LengthMm
    """Outer diameter."""
    width_mm: q.LengthMm
    """Width of one bearing."""
    contact_angle_deg: q.ContactAngleDeg | None = None
    """Contact angle; that of the type by default."""
    arrangement: Literal["single", "X", "O", "tandem"] = "single"
    """How two bearings of a pair stand to each other."""
    locates_towards: Literal["+z", "-z"] = "+z"
    """Which way of the inner ring a single bearing, or a tandem, holds."""
    ribs: Literal["none", "+z", "-z", "both"] = "none"
    """Which way of the inner ring the ribs of cylindrical rollers hold: "+z" a ring that is pushed towards +z."""
    rib_contact_mm: q.LengthMm | None = None
    """Length of the contact of a roller's end with a rib."""
    row_count: q.RollingRows | None = None
    """Rows of one bearing."""
    row_distance_mm: q.BoreMm | None = None
    """Distance of the middles of two rows; by type and arrangement by default."""
    full_complement: bool = False
    """Whether it has no cage."""
    element_count: q.RollingElements | None = None
    """Balls or rollers of one row; as many as usual by default."""
    element_diameter_mm: q.LengthMm | None = None
    """Diameter of balls or rollers, of cones and barrels in their middle."""
    element_length_mm: q.LengthMm | None = None
    """Effective length of rollers."""
    pitch_diameter_mm: q.LengthMm | None = None
    """Diameter of the circle of their centres."""
    inner_groove_ratio: q.GrooveRatio | None = None
    """Radius of the inner groove over the ball's diameter."""
    outer_groove_ratio: q.GrooveRatio | None = None
    """Radius of the outer groove over the ball's diameter."""
    osculation: q.Osculation | None = None
    """Radius of a barrel's outline over that of the raceway."""
    profile: Profile = "standard"
    """Profile of rollers: that of ISO/TS 16281, straight, or a table of drops."""
    radial_clearance_mm: q.ClearanceMm = 0.0
    """Clearance on the diameter, as mounted and warm; negative for preload."""
    axial_preload_um: q.AxialPreloadUm = 0.0
    """Approach of both rows against line-to-line contact; negative for play."""
    dynamic_rating_kN: q.RatingKN | None = None
    """Dynamic load rating as the catalogue prints it, of a pair that of both; by ISO 281 by default."""
    static_rating_kN: q.RatingKN | None = None
    """Static load rating as the catalogue prints it, of a pair that of both; by ISO 76 by default."""
    fatigue_load_limit_kN: q.RatingKN | None = None
    """Fatigue load limit C_u (P_u) as the catalogue prints it, of a pair that of both; by ISO 281 by default."""
    radial_load_kN: q.RadialLoadKN | None = None
    """Load that the stiffness belongs to; that of the statics by default."""
    axial_load_kN: q.AxialLoadKN | None = None
    """Axial load beside it."""

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
        # Needle cages without rings: bore to outer diameter is two needles.
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
    """Compliant support (variants `bushing` and `flexible`): given 6x6 or from catalogue dimensions.

    Beside a `catalogue`, `stiffness` is a floor: it holds the directions that the rollers leave free. One of which
    only the `designation` is known waits for either of them; until then the variant `rigid` alone runs.
    """

    body: Name
    """Body on its inner ring, or outer (`outer_ring`)."""
    on: Name = GROUND
    """The other body; `ground`, a fixed body, a carrier, another shaft."""
    z_mm: q.PlaceMm
    """Place of the middle along the axis."""
    housing_factor_applies: bool = True
    """Whether its seat yields by `housing.factor`."""
    model: Literal["linear", "iso16281"] = "linear"
    """Whether it is linear at its load, or follows its rows."""
    cage: Literal["averaged", "turning"] = "averaged"
    """Whether the elements of a non-linear bearing stand at the mean stiffness, or pass as the rings turn."""
    outer_ring: Literal["body", "on"] | None = None
    """Which of the two carries the outer ring; planets do by default, other bodies do not."""
    designation: Text = ""
    """Words for people; a bearing with nothing else holds only in the variant `rigid`, until it gets its data."""
    stiffness: StiffnessSection | None = None
    """Stiffness given, or floor beside a catalogue."""
    catalogue: CatalogueSection | None = None
    """Catalogue data."""
    damping: ConnectorDampingSection | None = None
    """Damping; in proportion to the stiffness by default."""

    @model_validator(mode="after")
    def _source(self) -> BearingSection:
        if not self.is_known and not self.designation:
            raise ValueError("add a [.stiffness] table or a [.catalogue] table")
        return self

    @property
    def is_known(self) -> bool:
        """Whether more than its designation is known."""
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
    """Elastic support of the gearbox on the ground; there where a fixed body is elastic, which else is the ground.

    A body that only bearings and mounts hold, such as a bearing pedestal, is held by its mounts in every variant on
    bearings; one of them, or of its bearings on what stands, has torsion.

    One that stands for a body (`instead_of`) steps aside when that body is enabled.
    """

    body: Name
    """Body that is held."""
    instead_of: Name | None = None
    """Body for which it stands while that is not enabled."""
    position_mm: Point
    """Place."""
    stiffness: StiffnessSection
    """Stiffness."""
    damping: ConnectorDampingSection | None = None
    """Damping; in proportion to the stiffness by default."""


class CouplingSection(Section):
    """Torsional spring between the spins of two bodies on one axis; one that stands still holds the other.

    It acts at the `seat` of elastic bodies, a bearing's name, and where torques act on those without such a seat. One
    that stands for a body (`instead_of`) steps aside when that body is enabled.
    """

    bodies: Annotated[tuple[Name, Name], Field(strict=False)]
    """The two bodies."""
    seat: Name | None = None
    """Bearing on whose seat of elastic bodies it acts."""
    instead_of: Name | None = None
    """Body for which it stands while that is not enabled."""
    stiffness_N_m_per_rad: q.CouplingStiffness
    """Torsional stiffness."""
    damping_N_m_s_per_rad: q.CouplingDamping | None = None
    """Torsional damping; in proportion to the stiffness by default."""


Phases = Annotated[
    Annotated[q.Phase, Tag("one")]
    | Annotated[tuple[q.Phase, ...], Field(strict=False, max_length=MOST_PLANETS), Tag("each")],
    Discriminator(lambda value: "each" if isinstance(value, list | tuple) else "one"),
]
"""One phase for all meshes of a set, or one for each."""


class MeshSection(Section):
    """A gear pair at work between two bodies; a planet set gives one mesh per planet."""

    pair: Name
    """Pair of gears."""
    pinion_body: Name
    """Body of the pinion."""
    gear_body: Name
    """Body of the gear."""
    frame: Name | None = None
    """Body in whose axes the line of centres stands still; follows from the bodies by default."""
    position_angle_deg: q.AngleDeg | None = None
    """Direction from pinion to gear in that frame; follows from the bodies by default."""
    phase: Phases | None = None
    """Position in the mesh cycle at zero angles; follows from teeth and places by default."""
