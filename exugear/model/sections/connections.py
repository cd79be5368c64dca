"""Sections on what joins bodies: joints, bearings, mounts, couplings, meshes."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from exugear.model.sections import quantities as q
from exugear.model.sections.entries import GROUND, MOST_PLANETS, Name, Point, Section, Text, check_wall


class JointSection(Section):
    """Ideal joint that leaves the spin about z free (used by the variant `rigid`)."""

    body: Name
    on: Name = GROUND
    z_mm: q.PlaceMm


_MatrixRow = Annotated[tuple[q.StiffnessEntry, ...], Field(strict=False, max_length=6)]


class StiffnessSection(Section):
    """6x6 stiffness (or damping) of a bearing, about its place: isotropic entries or the full matrix."""

    radial_N_per_m: q.Stiffness = 0.0
    axial_N_per_m: q.Stiffness = 0.0
    tilt_N_m_per_rad: q.Stiffness = 0.0
    torsion_N_m_per_rad: q.Stiffness = 0.0
    matrix: Annotated[tuple[_MatrixRow, ...], Field(strict=False, max_length=6)] | None = None

    @model_validator(mode="after")
    def _shape(self) -> StiffnessSection:
        if self.matrix is not None and [len(row) for row in self.matrix] != [6] * 6:
            raise ValueError("matrix needs 6 rows of 6 numbers (N/m, N, N m/rad; order x y z rx ry rz)")
        others = self.model_fields_set - {"matrix"}
        if self.matrix is not None and others:
            raise ValueError(f"matrix stands alone: leave {', '.join(sorted(others))} out, or give no matrix")
        return self


class CatalogueSection(Section):
    """Boundary dimensions and operating load from which ISO/TS 16281 gives a bearing's stiffness."""

    type: Literal["cylindrical_roller", "tapered_roller"]
    designation: Text = ""
    bore_mm: q.LengthMm
    outer_diameter_mm: q.LengthMm
    width_mm: q.LengthMm
    contact_angle_deg: q.ContactAngleDeg = 0.0
    arrangement: Literal["single", "X", "O", "tandem"] = "single"
    row_distance_mm: q.BoreMm | None = None
    full_complement: bool = False
    radial_clearance_mm: q.ClearanceMm = 0.0
    radial_load_kN: q.RadialLoadKN
    axial_load_kN: q.AxialLoadKN = 0.0

    @model_validator(mode="after")
    def _has_wall(self) -> CatalogueSection:
        check_wall(self.bore_mm, self.outer_diameter_mm, "bore_mm")
        return self


class BearingSection(Section):
    """Compliant support (variants `bushing` and `flexible`): given 6x6 or from catalogue dimensions.

    Beside a `catalogue`, `stiffness` is a floor: it holds the directions that the rollers leave free.
    """

    body: Name
    on: Name = GROUND
    z_mm: q.PlaceMm
    housing_factor_applies: bool = True
    stiffness: StiffnessSection | None = None
    catalogue: CatalogueSection | None = None
    damping: StiffnessSection | None = None

    @model_validator(mode="after")
    def _source(self) -> BearingSection:
        if self.stiffness is None and self.catalogue is None:
            raise ValueError("give a [.stiffness] table or a [.catalogue] table")
        return self


class MountSection(Section):
    """Elastic support of the gearbox on the ground; there where a fixed body is elastic, which else is the ground.

    One that stands for a body (`instead_of`) steps aside when that body is enabled.
    """

    body: Name
    instead_of: Name | None = None
    position_mm: Point
    stiffness: StiffnessSection
    damping: StiffnessSection | None = None


class CouplingSection(Section):
    """Torsional spring between the spins of two bodies on one axis.

    It acts at the `seat` of elastic bodies, a bearing's name, and where torques act on those without such a seat. One
    that stands for a body (`instead_of`) steps aside when that body is enabled.
    """

    bodies: Annotated[tuple[Name, Name], Field(strict=False)]
    seat: Name | None = None
    instead_of: Name | None = None
    stiffness_N_m_per_rad: q.CouplingStiffness
    damping_N_m_s_per_rad: q.CouplingDamping | None = None


Phases = Annotated[
    Annotated[q.Phase, Tag("one")]
    | Annotated[tuple[q.Phase, ...], Field(strict=False, max_length=MOST_PLANETS), Tag("each")],
    Discriminator(lambda value: "each" if isinstance(value, list | tuple) else "one"),
]
"""One phase for all meshes of a set, or one for each."""


class MeshSection(Section):
    """A gear pair at work between two bodies; a planet set gives one mesh per planet."""

    pair: Name
    pinion_body: Name
    gear_body: Name
    frame: Name | None = None
    position_angle_deg: q.AngleDeg | None = None
    phase: Phases | None = None
