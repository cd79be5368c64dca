"""Sections on bodies: place, inertia, and the shape or solid that makes them elastic."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from exugear.gearbox.sections import entries as q
from exugear.gearbox.sections.entries import (
    MOST_PLANETS,
    FileName,
    Name,
    Point,
    Section,
    check_wall,
)
from exugear.gearbox.sections.gears import MaterialSection


class InertiaSection(Section):
    """Mass properties of a body in one inertia set; moments about its centre of mass."""

    mass_kg: q.MassKg | None = None
    """Mass; a body that only spins needs none."""
    axial_kg_m2: q.InertiaKgM2
    """Moment of inertia about the axis."""
    transverse_kg_m2: q.InertiaKgM2 | None = None
    """Moment of inertia across the axis, about the centre of mass."""
    centre_of_mass_z_mm: q.PlaceMm | None = None
    """Place of the centre of mass."""

    @model_validator(mode="after")
    def _triangle(self) -> InertiaSection:
        if self.transverse_kg_m2 is not None and self.axial_kg_m2 > 2.0 * self.transverse_kg_m2:
            raise ValueError(
                f"axial {self.axial_kg_m2} kg m2 exceeds twice the transverse {self.transverse_kg_m2} kg m2: "
                "no rigid body has such inertias (triangle inequality)"
            )
        return self


class ShaftSectionSection(Section):
    """A piece of a shaft: a cylinder, or a cone where a diameter at its end is given."""

    length_mm: q.LengthMm
    """Length."""
    outer_diameter_mm: q.LengthMm
    """Outer diameter."""
    inner_diameter_mm: q.BoreMm = 0.0
    """Bore."""
    outer_diameter_end_mm: q.LengthMm | None = None
    """Outer diameter at its +z end, of a cone."""
    inner_diameter_end_mm: q.BoreMm | None = None
    """Bore at its +z end, of a conical bore."""

    @model_validator(mode="after")
    def _has_wall(self) -> ShaftSectionSection:
        check_wall(self.inner_diameter_mm, self.outer_diameter_mm, "inner_diameter_mm")
        ends = (self.inner_diameter_end_mm, self.outer_diameter_end_mm)
        starts = (self.inner_diameter_mm, self.outer_diameter_mm)
        inner, outer = (start if end is None else end for start, end in zip(starts, ends, strict=True))
        check_wall(inner, outer, "inner_diameter_end_mm")
        return self


class BlankSection(Section):
    """What a gear or bearing puts on its seat beyond the shaft itself: a rigid ring about the seat's centre."""

    mass_kg: q.MassKg
    """Mass."""
    axial_kg_m2: q.InertiaKgM2
    """Moment of inertia about the axis."""
    transverse_kg_m2: q.InertiaKgM2
    """Moment of inertia across the axis."""

    @model_validator(mode="after")
    def _triangle(self) -> BlankSection:
        if self.axial_kg_m2 > 2.0 * self.transverse_kg_m2:
            raise ValueError(
                f"axial {self.axial_kg_m2} kg m2 exceeds twice the transverse {self.transverse_kg_m2} kg m2: "
                "no rigid body has such inertias (triangle inequality)"
            )
        return self


class ShapeSection(Section):
    """A stepped shaft, from `start_z_mm` on; its gears and bearings, and where torques act, become its seats.

    `blanks` are by the name of the gear, bearing or mount that they sit with, or `torque`. They count in the inertia
    that follows from the shape, in every variant.
    """

    start_z_mm: q.PlaceMm
    """Where the first piece begins."""
    sections: Annotated[tuple[ShaftSectionSection, ...], Field(strict=False, min_length=1, max_length=200)]
    """Pieces from there on, towards +z."""
    torque_z_mm: q.PlaceMm | None = None
    """Place where torques act, and couplings without a seat."""
    material: MaterialSection = MaterialSection()
    """Elastic material, steel by default."""
    blanks: dict[Name, BlankSection] = {}
    """Rigid rings on its seats, by gear, bearing or mount; `torque` for the place where torques act."""


class SolidSeatSection(Section):
    """Where something sits on a solid: a band of a cylinder along z, or a flat ring across z (`inner_diameter_mm`).

    The seat of a gear, bearing or mount takes its place, and as far as they are known its diameter and width, from
    there. `sectors` divides the cylinder into equal seats, the first in the middle of +x. `same_as` names the seat
    that a second bearing in the same bore sits on.
    """

    diameter_mm: q.LengthMm | None = None
    """Diameter of the cylinder, outer diameter of a flat ring."""
    width_mm: q.LengthMm | None = None
    """Width of the cylinder along z."""
    inner_diameter_mm: q.BoreMm | None = None
    """Inner diameter: makes it a flat ring across z."""
    position_mm: Point | None = None
    """Middle of the seat; that of the gear, bearing or mount by default."""
    sectors: q.Sectors | None = None
    """Equal seats that the cylinder is divided into, an odd number."""
    same_as: Name | None = None
    """Seat of another bearing in the same bore; stands alone."""

    @model_validator(mode="after")
    def _kind(self) -> SolidSeatSection:
        if self.same_as is not None and self.model_fields_set != {"same_as"}:
            raise ValueError("same_as cannot be combined with other keys: the dimensions of the other seat apply")
        if self.inner_diameter_mm is not None:
            if self.width_mm is not None:
                raise ValueError("a flat seat (inner_diameter_mm) has no width_mm")
            if self.diameter_mm is None or self.diameter_mm <= self.inner_diameter_mm:
                raise ValueError("a flat seat requires a diameter_mm above its inner_diameter_mm")
        if self.sectors is not None and self.sectors % 2 == 0:
            raise ValueError("sectors must be odd, so that interpolation between them is smooth")
        return self


class SolidSection(Section):
    """A body of any shape from a file beside the gearbox file, in the gearbox's axes.

    Geometry (.step, .stp, .brep, or the script .geo, which needs permission to run) is meshed with tetrahedra by gmsh;
    a mesh (.msh, .inp, .vtu, .vtk) is taken as it is. `torque_seat` names the seat where torques
    act. `blanks` are by seat.
    """

    file: FileName
    """Geometry or mesh beside the gearbox file."""
    length_unit_mm: q.LengthUnitMm = 1.0
    """Unit of length of the file."""
    element_size_mm: q.ElementSizeMm | None = None
    """Largest element of the mesh that is made."""
    elements_around: q.ElementsAround = 12
    """Elements around a full circle."""
    band_Hz: q.FrequencyHz | None = None
    """Own vibrations are exact up to here; `elasticity.band_Hz` by default."""
    torque_seat: Name | None = None
    """Seat where torques act."""
    material: MaterialSection = MaterialSection()
    """Elastic material, steel by default."""
    seats: dict[Name, SolidSeatSection] = {}
    """Seats by gear, bearing or mount."""
    blanks: dict[Name, BlankSection] = {}
    """Rigid rings on its seats, by seat."""


class BodySection(Section):
    """A rigid body turning about +z, a set of equal planets, a spin-only inertia or a fixed housing.

    `flexibility` says what the variant `flexible` makes of it: "elastic" takes its shape or solid in the frame that
    suits it, on the ground for a fixed body, turning with it for one that carries planets, and for all others one
    that does not turn. "nonrotating" names the last and is refused for the others, as is "ffrf", a frame that floats
    with the body (Exudyn only).
    """

    axis_position_mm: Annotated[tuple[q.PlaceMm, q.PlaceMm], Field(strict=False)] | None = None
    """Place of the axis, x and y; planets have the three keys that follow instead, a spin-only body or a fixed one
    without gears may have none. It is then shown where a body is that a coupling joins it to, else at the origin."""
    carrier: Name | None = None
    """Body that carries the planets."""
    orbit_radius_mm: q.LengthMm | None = None
    """Distance of the planets' axes from the carrier's."""
    planet_angles_deg: Annotated[tuple[q.AngleDeg, ...], Field(strict=False, max_length=MOST_PLANETS)] = ()
    """Places of the planets at zero angle of the carrier; one body for each."""
    gears_z_mm: dict[Name, q.PlaceMm] = {}
    """Gears on the body, by name: place of the middle of the face."""
    fixed: bool = False
    """Whether it stands still: the housing."""
    spin_only: bool = False
    """Whether it only spins, without a place in space: a brake disc, a generator."""
    enabled: bool = True
    """Whether it takes part; what is joined to it alone steps aside with it."""
    inertia: dict[Name, InertiaSection] = {}
    """Mass properties by inertia set; those that follow from shape, blanks and gears by default."""
    flexibility: Literal["none", "elastic", "nonrotating", "ffrf"] = "none"
    """What the variant `flexible` makes of it."""
    shape: ShapeSection | None = None
    """Stepped shaft, for elasticity."""
    solid: SolidSection | None = None
    """Body of any shape, for elasticity."""

    @model_validator(mode="after")
    def _place(self) -> BodySection:
        if self.shape is not None and self.solid is not None:
            raise ValueError("set a shape or a solid, not both")
        if self.flexibility != "none" and self.shape is None and self.solid is None:
            raise ValueError(f"flexibility {self.flexibility!r} requires a shape; add a [.shape] or a [.solid] table")
        if self.flexibility in ("nonrotating", "ffrf") and self.fixed:
            raise ValueError(f"flexibility {self.flexibility!r} is for rotating bodies; set 'elastic' for a fixed body")
        if self.shape is not None and (self.fixed or self.spin_only or self.carrier is not None):
            raise ValueError("a shape is for a rotating body on a fixed axis, not a fixed, spin-only or planet body")
        if self.solid is not None and (self.spin_only or self.carrier is not None):
            raise ValueError("a solid is for a body on a fixed axis or a fixed body, not a spin-only or planet body")
        planet = (self.carrier is not None, self.orbit_radius_mm is not None, bool(self.planet_angles_deg))
        if any(planet) and not all(planet):
            raise ValueError("a planet requires carrier, orbit_radius_mm and planet_angles_deg")
        placeless = self.spin_only or (self.fixed and not self.gears_z_mm)
        if all(planet) == (self.axis_position_mm is not None) and (all(planet) or not placeless):
            raise ValueError("set either axis_position_mm = [x, y] or the three keys of a planet")
        if self.fixed and self.inertia:
            raise ValueError("a fixed body has no inertia; remove the section or set fixed = false")
        if self.spin_only and self.gears_z_mm:
            raise ValueError("a spin-only body has no position in space and cannot carry gears")
        follows = self.shape is not None or (self.gears_z_mm and self.carrier is not None)
        if not self.fixed and not self.inertia and not follows:
            raise ValueError(
                "a moving body requires an inertia table, e.g. [bodies.NAME.inertia.assemblies], or a shape from "
                "which its inertia is computed; the inertia of a planet is computed from its gears"
            )
        return self
