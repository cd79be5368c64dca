"""Sections on bodies: place, inertia, and the shape or solid that makes them elastic."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from exugear.model.sections import quantities as q
from exugear.model.sections.entries import MOST_PLANETS, FileName, Name, Point, Section, check_wall
from exugear.model.sections.gears import MaterialSection


class InertiaSection(Section):
    """Mass properties of a body in one inertia set; moments about its centre of mass."""

    mass_kg: q.MassKg | None = None
    axial_kg_m2: q.InertiaKgM2
    transverse_kg_m2: q.InertiaKgM2 | None = None
    centre_of_mass_z_mm: q.PlaceMm | None = None

    @model_validator(mode="after")
    def _triangle(self) -> InertiaSection:
        if self.transverse_kg_m2 is not None and self.axial_kg_m2 > 2.0 * self.transverse_kg_m2:
            raise ValueError(
                f"axial {self.axial_kg_m2} kg m2 exceeds twice the transverse {self.transverse_kg_m2} kg m2: "
                "no rigid body has such inertias (triangle inequality)"
            )
        return self


class ShaftSectionSection(Section):
    """A cylindrical piece of a shaft."""

    length_mm: q.LengthMm
    outer_diameter_mm: q.LengthMm
    inner_diameter_mm: q.BoreMm = 0.0

    @model_validator(mode="after")
    def _has_wall(self) -> ShaftSectionSection:
        check_wall(self.inner_diameter_mm, self.outer_diameter_mm, "inner_diameter_mm")
        return self


class BlankSection(Section):
    """What a gear or bearing puts on its seat beyond the shaft itself: a rigid ring about the seat's centre."""

    mass_kg: q.MassKg
    axial_kg_m2: q.InertiaKgM2
    transverse_kg_m2: q.InertiaKgM2

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

    `blanks` are by the name of the gear or bearing.
    """

    start_z_mm: q.PlaceMm
    sections: Annotated[tuple[ShaftSectionSection, ...], Field(strict=False, min_length=1, max_length=200)]
    torque_z_mm: q.PlaceMm | None = None
    material: MaterialSection = MaterialSection()
    blanks: dict[Name, BlankSection] = {}


class SolidSeatSection(Section):
    """Where something sits on a solid: a band of a cylinder along z, or a flat ring across z (`inner_diameter_mm`).

    The seat of a gear, bearing or mount takes its place, and as far as they are known its diameter and width, from
    there. `sectors` divides the cylinder into equal seats, the first in the middle of +x. `same_as` names the seat
    that a second bearing in the same bore sits on.
    """

    diameter_mm: q.LengthMm | None = None
    width_mm: q.LengthMm | None = None
    inner_diameter_mm: q.BoreMm | None = None
    position_mm: Point | None = None
    sectors: q.Sectors | None = None
    same_as: Name | None = None

    @model_validator(mode="after")
    def _kind(self) -> SolidSeatSection:
        if self.same_as is not None and self.model_fields_set != {"same_as"}:
            raise ValueError("same_as stands alone: the seat that it names has the dimensions")
        if self.inner_diameter_mm is not None:
            if self.width_mm is not None:
                raise ValueError("a flat seat (inner_diameter_mm) has no width_mm")
            if self.diameter_mm is None or self.diameter_mm <= self.inner_diameter_mm:
                raise ValueError("a flat seat needs a diameter_mm above its inner_diameter_mm")
        if self.sectors is not None and self.sectors % 2 == 0:
            raise ValueError("sectors must be odd: what lies between them is then smooth")
        return self


class SolidSection(Section):
    """A body of any shape from a file beside the gearbox file, in the gearbox's axes.

    Geometry (.step, .stp, .brep, or the script .geo, which needs permission to run) is meshed with tetrahedra by gmsh;
    a mesh (.msh, .inp, .vtu, .vtk) is taken as it is. `torque_seat` names the seat where torques
    act. `blanks` are by seat.
    """

    file: FileName
    length_unit_mm: q.LengthUnitMm = 1.0
    element_size_mm: q.ElementSizeMm | None = None
    elements_around: q.ElementsAround = 12
    band_Hz: q.FrequencyHz | None = None
    torque_seat: Name | None = None
    material: MaterialSection = MaterialSection()
    seats: dict[Name, SolidSeatSection] = {}
    blanks: dict[Name, BlankSection] = {}


class BodySection(Section):
    """A rigid body turning about +z, a set of equal planets, a spin-only inertia or a fixed housing.

    `flexibility` says what the variant `flexible` makes of it: "elastic" takes its shape or solid in the frame that
    suits it, on the ground for a fixed body, turning with it for one that carries planets, and for all others one
    that does not turn. "nonrotating" names the last and is refused for the others, as is "ffrf", a frame that floats
    with the body (Exudyn only).
    """

    axis_position_mm: Annotated[tuple[q.PlaceMm, q.PlaceMm], Field(strict=False)] | None = None
    carrier: Name | None = None
    orbit_radius_mm: q.LengthMm | None = None
    planet_angles_deg: Annotated[tuple[q.AngleDeg, ...], Field(strict=False, max_length=MOST_PLANETS)] = ()
    wheels_z_mm: dict[Name, q.PlaceMm] = {}
    fixed: bool = False
    spin_only: bool = False
    enabled: bool = True
    inertia: dict[Name, InertiaSection] = {}
    flexibility: Literal["none", "elastic", "nonrotating", "ffrf"] = "none"
    shape: ShapeSection | None = None
    solid: SolidSection | None = None

    @model_validator(mode="after")
    def _place(self) -> BodySection:
        if self.shape is not None and self.solid is not None:
            raise ValueError("give a shape or a solid, not both")
        if self.flexibility != "none" and self.shape is None and self.solid is None:
            raise ValueError(f"flexibility {self.flexibility!r} needs a shape: give a [.shape] or a [.solid] table")
        if self.flexibility in ("nonrotating", "ffrf") and self.fixed:
            raise ValueError(f"flexibility {self.flexibility!r} is for bodies that turn: a fixed body takes 'elastic'")
        if self.shape is not None and (self.fixed or self.spin_only or self.carrier is not None):
            raise ValueError("a shape is for a turning body on a fixed axis, not a fixed, spin-only or planet body")
        if self.solid is not None and (self.spin_only or self.carrier is not None):
            raise ValueError("a solid is for a body on a fixed axis or a fixed body, not a spin-only or planet body")
        planet = (self.carrier is not None, self.orbit_radius_mm is not None, bool(self.planet_angles_deg))
        if any(planet) and not all(planet):
            raise ValueError("a planet needs all of carrier, orbit_radius_mm and planet_angles_deg")
        if all(planet) == (self.axis_position_mm is not None):
            raise ValueError("give either axis_position_mm = [x, y] or the three keys of a planet")
        if self.fixed and self.inertia:
            raise ValueError("a fixed body has no inertia: leave the section out or set fixed = false")
        if self.spin_only and self.wheels_z_mm:
            raise ValueError("a spin-only body carries no gears: it has no position in space")
        if not self.fixed and not self.inertia:
            raise ValueError("a moving body needs an inertia table, e.g. [bodies.NAME.inertia.assemblies]")
        return self
