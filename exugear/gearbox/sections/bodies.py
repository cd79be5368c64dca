"""Sections on bodies: position, inertia, and the shape, solid or matrices that make them flexible."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from exugear.gearbox.sections import entries as q
from exugear.gearbox.sections.entries import MOST_PLANETS, FileName, Name, Point, Section, check_wall
from exugear.gearbox.sections.gears import MaterialSection


def _check_triangle(axial: float, transverse: float) -> None:
    """Raise an error for moments of inertia (kg m2) that no rigid body has."""
    if axial > 2.0 * transverse:
        raise ValueError(
            f"axial {axial} kg m2 exceeds twice the transverse {transverse} kg m2: "
            "no rigid body has such inertias (triangle inequality)"
        )


class InertiaSection(Section):
    """Mass properties of a body in one inertia set; moments about its centre of mass."""

    mass_kg: q.MassKg | None = None
    """Mass; optional for a spin-only body."""
    axial_kg_m2: q.InertiaKgM2
    """Moment of inertia about the axis."""
    transverse_kg_m2: q.InertiaKgM2 | None = None
    """Moment of inertia across the axis, about the centre of mass."""
    centre_of_mass_z_mm: q.PlaceMm | None = None
    """Axial position of the centre of mass."""

    @model_validator(mode="after")
    def _triangle(self) -> InertiaSection:
        if self.transverse_kg_m2 is not None:
            _check_triangle(self.axial_kg_m2, self.transverse_kg_m2)
        return self


class ShaftSectionSection(Section):
    """A piece of a shaft: a cylinder, or a cone if a diameter at its end is specified."""

    length_mm: q.LengthMm
    """Length."""
    outer_diameter_mm: q.LengthMm
    """Outer diameter."""
    inner_diameter_mm: q.BoreMm = 0.0
    """Bore."""
    outer_diameter_end_mm: q.LengthMm | None = None
    """Outer diameter of a cone at its +z end."""
    inner_diameter_end_mm: q.BoreMm | None = None
    """Diameter of a conical bore at its +z end."""

    @model_validator(mode="after")
    def _has_wall(self) -> ShaftSectionSection:
        check_wall(self.inner_diameter_mm, self.outer_diameter_mm, "inner_diameter_mm")
        ends = (self.inner_diameter_end_mm, self.outer_diameter_end_mm)
        starts = (self.inner_diameter_mm, self.outer_diameter_mm)
        inner, outer = (start if end is None else end for start, end in zip(starts, ends, strict=True))
        check_wall(inner, outer, "inner_diameter_end_mm")
        return self


class BlankSection(Section):
    """Mass that a gear or bearing adds to its seat on the shaft: a rigid ring about the centre of the seat."""

    mass_kg: q.MassKg
    """Mass."""
    axial_kg_m2: q.InertiaKgM2
    """Moment of inertia about the axis."""
    transverse_kg_m2: q.InertiaKgM2
    """Moment of inertia across the axis."""

    @model_validator(mode="after")
    def _triangle(self) -> BlankSection:
        _check_triangle(self.axial_kg_m2, self.transverse_kg_m2)
        return self


class ShapeSection(Section):
    """A stepped shaft that begins at `start_z_mm`; its gears, bearings and torque position become its seats.

    The keys of `blanks` are the gear, bearing or mount at the same seat, or `torque`. Blanks contribute to the inertia
    that follows from the shape, in every variant.
    """

    start_z_mm: q.PlaceMm
    """Axial position at which the first piece begins."""
    sections: Annotated[tuple[ShaftSectionSection, ...], Field(strict=False, min_length=1, max_length=200)]
    """Pieces from there towards +z."""
    torque_z_mm: q.PlaceMm | None = None
    """Axial position of torques, and of couplings without a seat."""
    material: MaterialSection = MaterialSection()
    """Elastic material, steel by default."""
    blanks: dict[Name, BlankSection] = {}
    """Rigid rings at its seats, by gear, bearing or mount; `torque` for the position of torques."""


class SolidSeatSection(Section):
    """Seat on a solid: a band of a cylinder along z, or a flat ring normal to z (`inner_diameter_mm`).

    Position, and diameter and width if they are known, are by default those of the gear, bearing or mount. `sectors`
    divides the cylinder into equal seats, the first centred on +x. `same_as` names the seat of another bearing in the
    same bore.
    """

    diameter_mm: q.LengthMm | None = None
    """Diameter of the cylinder, or outer diameter of a flat ring."""
    width_mm: q.LengthMm | None = None
    """Width of the cylinder along z."""
    inner_diameter_mm: q.BoreMm | None = None
    """Inner diameter of a flat ring normal to z; without it the seat is a cylinder."""
    position_mm: Point | None = None
    """Centre of the seat; that of the gear, bearing or mount by default."""
    sectors: q.Sectors | None = None
    """Number of equal seats into which the cylinder is divided; an odd number."""
    same_as: Name | None = None
    """Seat of another bearing in the same bore; cannot be combined with other keys."""

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


class DampedBodySection(Section):
    """Damping of one flexible body: keys of `solid` and `external`."""

    loss_factor: q.LossFactor | None = None
    """Structural damping of a fixed body: each free mode has the damping ratio loss_factor / 2."""
    damping_time_s: q.DampingTimeS | None = None
    """Ratio of damping to stiffness of this body; by default that of `damping.body_time_s`."""

    @model_validator(mode="after")
    def _either(self) -> DampedBodySection:
        if self.loss_factor is not None and self.damping_time_s is not None:
            raise ValueError("set either loss_factor or damping_time_s")
        return self


class SolidSection(DampedBodySection):
    """A body of arbitrary shape from a file in the folder of the gearbox file, in the axes of the gearbox.

    Geometry (.step, .stp, .brep, or the script .geo, which needs permission to run) is meshed with tetrahedra by gmsh;
    a mesh (.msh, .inp, .bdf, .nas, .vtu, .vtk) is used unchanged. `torque_seat` names the seat at which torques act.
    The keys of `blanks` are seats.
    """

    file: FileName
    """Geometry or mesh in the folder of the gearbox file."""
    length_unit_mm: q.LengthUnitMm = 1.0
    """Unit of length of the file."""
    element_size_mm: q.ElementSizeMm | None = None
    """Maximum element size of the generated mesh."""
    elements_around: q.ElementsAround = 12
    """Number of elements around a full circle."""
    band_Hz: q.FrequencyHz | None = None
    """Cut-off frequency of the exact normal modes; `elasticity.band_Hz` by default."""
    torque_seat: Name | None = None
    """Seat at which torques act."""
    material: MaterialSection = MaterialSection()
    """Elastic material, steel by default."""
    seats: dict[Name, SolidSeatSection] = {}
    """Seats by gear, bearing or mount."""
    blanks: dict[Name, BlankSection] = {}
    """Rigid rings at its seats, by seat."""


class ExternalSeatSection(Section):
    """Interface node of a gear, bearing or mount, for a body from matrices.

    By default it is the only node at the position of the gear, bearing or mount. `sector_nodes` are the equal sectors
    of an internal gear, each the mean motion of its sector about the centre of the gear. `same_as` names the seat of
    another bearing in the same bore.
    """

    node: q.NodeNumber | None = None
    """Number of the node."""
    position_mm: Point | None = None
    """Position at which the node is looked for, in the coordinates of the gearbox."""
    sector_nodes: Annotated[tuple[q.NodeNumber, ...], Field(strict=False, max_length=63)] = ()
    """Numbers of the nodes of equal sectors, an odd number, the first about +x, then on towards +y."""
    same_as: Name | None = None
    """Seat of another bearing in the same bore; cannot be combined with other keys."""

    @model_validator(mode="after")
    def _one_kind(self) -> ExternalSeatSection:
        if len(self.model_fields_set) > 1:
            raise ValueError("set one of node, position_mm, sector_nodes and same_as")
        count = len(self.sector_nodes)
        if "sector_nodes" in self.model_fields_set and (count < 3 or count % 2 == 0):
            raise ValueError("sector_nodes must be an odd number of at least 3, so that interpolation is smooth")
        if len(set(self.sector_nodes)) < count:
            raise ValueError("sector_nodes has a node twice")
        return self


class ExternalSection(DampedBodySection):
    """A body of another finite-element program as mass and stiffness matrices on interface nodes.

    The files are in the folder of the gearbox file: one with both matrices, or `stiffness` and `mass`; formats follow
    from their endings (.npz, .csv, .mtx, .op4, .pch, .bdf). The body is free, without supports. Its coordinates become
    those of the gearbox by `turn_deg`, then `shift_mm`.
    """

    file: FileName | None = None
    """File with both matrices."""
    stiffness: FileName | None = None
    """File with the stiffness matrix."""
    mass: FileName | None = None
    """File with the mass matrix."""
    gyroscopic: FileName | None = None
    """File with the gyroscopic matrix of a shaft per rad/s about +z of the gearbox, antisymmetric, both triangles."""
    recovery: FileName | None = None
    """File (.npz) with the outer surface of a fixed body and its motion by the coordinates, for its sound power."""
    recovery_matrix: FileName | None = None
    """File (.op4) with the recovery matrix MUG1 of the points of this surface, if it has no `displacement`."""
    band_Hz: q.FrequencyHz | None = None
    """Cut-off frequency of the modal coordinates, for the sound power; `elasticity.band_Hz` by default."""
    nodes: FileName | None = None
    """File with the positions of the nodes (.csv, .inp, .npz, .pch, .bdf), if the matrices have none."""
    stiffness_name: Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]{0,15}$")] | None = None
    """Name of the stiffness matrix in a Nastran file; by default `KAAX` or another usual name."""
    mass_name: Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]{0,15}$")] | None = None
    """Name of the mass matrix in a Nastran file; by default `MAAX` or another usual name."""
    units: Literal["SI", "mm-t-s", "mm-kg-ms", "mm-kg-s", "inch-lbf-s"]
    """Unit system of the files: length, mass (with `inch-lbf-s` force), time."""
    shift_mm: Point = (0.0, 0.0, 0.0)
    """Position of the origin of the files in the gearbox."""
    turn_deg: Annotated[tuple[q.AngleDeg, q.AngleDeg, q.AngleDeg], Field(strict=False)] = (0.0, 0.0, 0.0)
    """Rotations about the axes x, y and z of the gearbox, in this order."""
    constraint: Literal["rbe2", "rbe3"] | None = None
    """How interface nodes are connected to their surfaces; `rbe2` makes seats too stiff, which is stated with results.
    """
    torque_seat: Name | None = None
    """Seat at which torques act."""
    stated_mass_kg: q.MassKg | None = None
    """Mass according to the other program, which is compared."""
    stated_centre_mm: Point | None = None
    """Centre of mass according to the other program in the axes of the files, which is compared."""
    seats: dict[Name, ExternalSeatSection] = {}
    """Seats by gear, bearing or mount."""

    @model_validator(mode="after")
    def _files(self) -> ExternalSection:
        apart = (self.stiffness is not None, self.mass is not None)
        if self.file is not None and any(apart):
            raise ValueError("set either file, or stiffness and mass")
        if self.file is None and not all(apart):
            raise ValueError("requires its matrices; set file, or stiffness and mass")
        if self.recovery_matrix is not None and self.recovery is None:
            raise ValueError("recovery_matrix requires points, normals and areas of the surface; set recovery")
        return self


class BodySection(Section):
    """A rigid body rotating about +z, a set of equal planets, a spin-only inertia or a fixed housing.

    `flexibility` selects the model of the body in the variant `flexible`. "elastic" uses its shape, solid or matrices
    in a suitable frame: stationary for a fixed body, rotating with a planet carrier, and non-rotating for all others.
    "nonrotating" requires the latter and is refused for fixed bodies and carriers, as is "ffrf", a floating frame
    (Exudyn only).
    """

    axis_position_mm: Annotated[tuple[q.PlaceMm, q.PlaceMm], Field(strict=False)] | None = None
    """Position of the axis, x and y. Planets have the three next keys instead; it is optional for a spin-only body and
    for a fixed body without gears. Such a body is shown at a coupled body, or else at the origin.
    """
    carrier: Name | None = None
    """Body that carries the planets."""
    orbit_radius_mm: q.LengthMm | None = None
    """Distance between the axes of planets and carrier."""
    planet_angles_deg: Annotated[tuple[q.AngleDeg, ...], Field(strict=False, max_length=MOST_PLANETS)] = ()
    """Angular positions of the planets at zero angle of the carrier; one body for each."""
    gears_z_mm: dict[Name, q.PlaceMm] = {}
    """Gears on the body, by name: axial position of the middle of the face width."""
    fixed: bool = False
    """Whether the body is stationary, as a housing."""
    spin_only: bool = False
    """Whether the body has only rotational inertia and no position, as a brake disc or a generator."""
    enabled: bool = True
    """Whether the body is included; elements that connect only to it are excluded with it."""
    inertia: dict[Name, InertiaSection] = {}
    """Mass properties by inertia set; by default they follow from shape, blanks and gears."""
    flexibility: Literal["none", "elastic", "nonrotating", "ffrf"] = "none"
    """Model of the body in the variant `flexible`."""
    shape: ShapeSection | None = None
    """Stepped shaft, for a flexible body."""
    solid: SolidSection | None = None
    """Solid of arbitrary shape, for a flexible body."""
    external: ExternalSection | None = None
    """Matrices of another finite-element program, for a flexible body."""

    @model_validator(mode="after")
    def _place(self) -> BodySection:
        if [self.shape, self.solid, self.external].count(None) < 2:
            raise ValueError("set one of shape, solid and external")
        if self.flexibility != "none" and [self.shape, self.solid, self.external].count(None) == 3:
            raise ValueError(
                f"flexibility {self.flexibility!r} requires a shape; add a [.shape], [.solid] or [.external] table"
            )
        if self.external is not None and self.flexibility == "ffrf":
            raise ValueError(
                "flexibility 'ffrf' requires mass integrals, which matrices on nodes do not have; set 'elastic'"
            )
        for key, part in (("solid", self.solid), ("external", self.external)):
            if part is not None and part.loss_factor is not None and not self.fixed:
                raise ValueError(
                    f"{key}.loss_factor: damping ratios of single modes are for a fixed body; set damping_time_s"
                )
        if self.external is not None and (self.spin_only or self.carrier is not None):
            raise ValueError(
                "external matrices are for a body on a fixed axis or a fixed body, not a spin-only or planet body; "
                "describe it by its inertia"
            )
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
