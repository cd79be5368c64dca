"""The gearbox file as it is written: pydantic models of the TOML sections, unit in the key.

Nothing here knows mechanics. The models refuse unknown keys, values of the wrong type and values that no gearbox can
have (:mod:`exugear.model.quantities`); :mod:`exugear.model.gearbox` turns them into SI data and checks them against
each other.
"""

from __future__ import annotations

from typing import Annotated, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, model_validator

from exugear.model import quantities as q

GROUND = "ground"
MOST_ENTRIES = 500
"""Most entries of a table such as [bearings]."""
MOST_PLANETS = 40
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", max_length=80)]
"""Name of a part; results folders and files are named by them, by up to three in one name."""
Text = Annotated[str, Field(pattern=r"^[^\x00-\x08\x0b-\x1f\x7f]*$", max_length=2000)]
"""Words for people: no control characters but tabs and line ends."""
FileName = Annotated[str, Field(pattern=r"^[^\x00-\x1f\x7f]+$", max_length=1000)]
Entry = TypeVar("Entry")
Entries = Annotated[dict[Name, Entry], Field(max_length=MOST_ENTRIES)]
"""Table of named entries."""
Point = Annotated[tuple[q.PlaceMm, q.PlaceMm, q.PlaceMm], Field(strict=False)]
"""Arrays of a file are lists; nothing in them is converted."""


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


def _wall(inner: float, outer: float, keys: str) -> None:
    if inner >= outer:
        raise ValueError(f"{keys} = {inner:g} must be below outer_diameter_mm = {outer:g}")


class RackSection(_Section):
    """Basic rack of one gear, as factors of the normal module (ISO 53)."""

    addendum: q.RackHeight = 1.0
    dedendum: q.RackHeight = 1.25
    tip_radius: q.RackRadius = 0.38


class MaterialSection(_Section):
    """Elastic material of a gear."""

    youngs_modulus_GPa: q.YoungsModulusGPa = 206.0
    poissons_ratio: q.PoissonsRatio = 0.3
    density_kg_per_m3: q.Density = 7850.0


class ModificationSection(_Section):
    """Material removed from both flanks of every tooth; lengths in roll length, +z as in the gearbox."""

    tip_relief_um: q.RemovedUm = 0.0
    tip_relief_length_mm: q.RollLengthMm | None = None
    tip_relief_start_roll_deg: q.RollAngleDeg | None = None
    tip_relief_shape: Literal["linear", "parabolic"] = "linear"
    root_relief_um: q.RemovedUm = 0.0
    root_relief_length_mm: q.RollLengthMm | None = None
    root_relief_start_roll_deg: q.RollAngleDeg | None = None
    root_relief_shape: Literal["linear", "parabolic"] = "linear"
    profile_crowning_um: q.RemovedUm = 0.0
    lead_crowning_um: q.RemovedUm = 0.0
    profile_slope_um: q.SlopeUm = 0.0
    helix_slope_um: q.SlopeUm = 0.0
    twist_um: q.SlopeUm = 0.0
    topography: FileName | None = None

    @model_validator(mode="after")
    def _starts(self) -> ModificationSection:
        for kind in ("tip", "root"):
            given = (getattr(self, f"{kind}_relief_length_mm"), getattr(self, f"{kind}_relief_start_roll_deg"))
            wanted = 1 if getattr(self, f"{kind}_relief_um") > 0.0 else 0
            if sum(value is not None for value in given) != wanted:
                raise ValueError(
                    f"a {kind} relief needs {kind}_relief_um and one of {kind}_relief_length_mm and "
                    f"{kind}_relief_start_roll_deg"
                )
        return self


class GearSection(_Section):
    """One toothed wheel; helix angle signed, right hand positive."""

    teeth: q.Teeth
    normal_module_mm: q.ModuleMm
    normal_pressure_angle_deg: q.PressureAngleDeg = 20.0
    helix_angle_deg: q.HelixAngleDeg = 0.0
    profile_shift: q.ProfileShift = 0.0
    face_width_mm: q.FaceWidthMm
    held_diameter_mm: q.LengthMm
    internal: bool = False
    tooth_thinning_mm: q.ThinningMm = 0.0
    tip_diameter_mm: q.LengthMm | None = None
    root_diameter_mm: q.LengthMm | None = None
    rack: RackSection = RackSection()
    material: MaterialSection = MaterialSection()
    modification: ModificationSection | None = None


class PairSection(_Section):
    """Two gears that mesh: `pinion` is the smaller one (the planet against a ring)."""

    pinion: Name
    gear: Name
    centre_distance_mm: q.LengthMm
    table: bool = True


class InertiaSection(_Section):
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


class ShaftSectionSection(_Section):
    """A cylindrical piece of a shaft."""

    length_mm: q.LengthMm
    outer_diameter_mm: q.LengthMm
    inner_diameter_mm: q.BoreMm = 0.0

    @model_validator(mode="after")
    def _has_wall(self) -> ShaftSectionSection:
        _wall(self.inner_diameter_mm, self.outer_diameter_mm, "inner_diameter_mm")
        return self


class BlankSection(_Section):
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


class ShapeSection(_Section):
    """A stepped shaft, from `start_z_mm` on; its gears and bearings, and where torques act, become its seats.

    `blanks` are by the name of the gear or bearing.
    """

    start_z_mm: q.PlaceMm
    sections: Annotated[tuple[ShaftSectionSection, ...], Field(strict=False, min_length=1, max_length=200)]
    torque_z_mm: q.PlaceMm | None = None
    material: MaterialSection = MaterialSection()
    blanks: dict[Name, BlankSection] = {}


class SolidSeatSection(_Section):
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


class SolidSection(_Section):
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


class BodySection(_Section):
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


class JointSection(_Section):
    """Ideal joint that leaves the spin about z free (used by the variant `rigid`)."""

    body: Name
    on: Name = GROUND
    z_mm: q.PlaceMm


_MatrixRow = Annotated[tuple[q.StiffnessEntry, ...], Field(strict=False, max_length=6)]


class StiffnessSection(_Section):
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


class CatalogueSection(_Section):
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
        _wall(self.bore_mm, self.outer_diameter_mm, "bore_mm")
        return self


class BearingSection(_Section):
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


class MountSection(_Section):
    """Elastic support of the gearbox on the ground; there where a fixed body is elastic, which else is the ground.

    One that stands for a body (`instead_of`) steps aside when that body is enabled.
    """

    body: Name
    instead_of: Name | None = None
    position_mm: Point
    stiffness: StiffnessSection
    damping: StiffnessSection | None = None


class CouplingSection(_Section):
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


class MeshSection(_Section):
    """A gear pair at work between two bodies; a planet set gives one mesh per planet."""

    pair: Name
    pinion_body: Name
    gear_body: Name
    frame: Name | None = None
    position_angle_deg: q.AngleDeg | None = None
    phase: Phases | None = None


class DeviationSection(_Section):
    """Errors of one wheel that return with each of its revolutions."""

    body: Name
    gear: Name | None = None
    cumulative_pitch_um: Annotated[tuple[q.PitchUm, ...], Field(strict=False, max_length=2000)] = ()
    runout_um: q.RunoutUm = 0.0
    runout_angle_deg: q.AngleDeg = 0.0

    @model_validator(mode="after")
    def _something(self) -> DeviationSection:
        if not self.cumulative_pitch_um and not self.runout_um:
            raise ValueError("give cumulative_pitch_um, one number for each tooth, or runout_um")
        return self


class PinSection(_Section):
    """Position error of a planet's pin in its carrier."""

    body: Name
    radial_um: q.PlaceErrorUm = 0.0
    tangential_um: q.PlaceErrorUm = 0.0


class LoadCaseSection(_Section):
    """Torques on the gearbox and, when speed-driven, the prescribed speed of one body."""

    torques_N_m: dict[Name, q.TorqueNm] = {}
    torque_series: FileName | None = None
    duration_s: q.DurationS = 30.0
    start_speed_rpm: q.SpeedRpm = 0.0
    driven_body: Name | None = None
    end_speed_rpm: q.SpeedRpm | None = None
    drive_stiffness_N_m_per_rad: q.CouplingStiffness | None = None
    description: Text = ""

    @model_validator(mode="after")
    def _drive(self) -> LoadCaseSection:
        drive = (
            self.driven_body is not None,
            self.end_speed_rpm is not None,
            self.drive_stiffness_N_m_per_rad is not None,
        )
        if any(drive) and not all(drive):
            raise ValueError("a speed-driven case needs driven_body, end_speed_rpm and drive_stiffness_N_m_per_rad")
        if not self.torques_N_m and self.torque_series is None and not any(drive):
            raise ValueError("give torques_N_m, torque_series or a driven_body")
        return self


class OverallSection(_Section):
    """Which spins the overall transmission error compares, and where its length is taken."""

    input: Name
    output: Name
    output_gear: Name


class StaticLoadSection(_Section):
    """The static state that fixes loaded flanks and the load of the STE tables."""

    torques_N_m: dict[Name, q.TorqueNm]
    locked: Annotated[tuple[Name, ...], Field(strict=False, max_length=MOST_ENTRIES)]


class DampingSection(_Section):
    """Stiffness-proportional damping times: c = time * k."""

    bearing_time_s: q.DampingTimeS = 4e-6
    mesh_time_s: q.DampingTimeS = 4e-6
    coupling_time_s: q.DampingTimeS = 4e-6
    body_time_s: q.DampingTimeS = 1e-6


class ElasticitySection(_Section):
    """How finely elastic bodies are described (variant `flexible`).

    Vibrations of each body up to `band_Hz` are kept exactly; what vibrates above `limit_Hz` is slowed down to it, so
    that a solver's step is not ruled by it.
    """

    band_Hz: q.FrequencyHz = 4500.0
    limit_Hz: q.FrequencyHz = 9000.0

    @model_validator(mode="after")
    def _order(self) -> ElasticitySection:
        if self.limit_Hz <= self.band_Hz:
            raise ValueError(f"limit_Hz must be above band_Hz = {self.band_Hz:g}")
        return self


class HousingSection(_Section):
    """Factor on bearing stiffness that stands for the housing seat in series; not where the housing is elastic."""

    factor: q.SeatFactor = 1.0


_Vector = Annotated[tuple[q.Acceleration, q.Acceleration, q.Acceleration], Field(strict=False)]


class GravitySection(_Section):
    """Weight as an acceleration vector in the model's axes; off by default."""

    acceleration_m_per_s2: _Vector = (0.0, 0.0, 0.0)


class ReportSection(_Section):
    """What a report looks for: modes near a frequency that was measured or published."""

    reference_frequency_Hz: q.FrequencyHz | None = None


_Factors = Annotated[tuple[q.LoadFactor, ...], Field(strict=False, max_length=50)]
_Offsets = Annotated[tuple[q.OffsetUm, ...], Field(strict=False, max_length=50)]


class SteSection(_Section):
    """Settings of the finite-element tables; the axes are those of a table with ``grid``."""

    positions: q.Positions = 50
    method: Literal["superelement", "nonlinear"] = "superelement"
    grid: bool = False
    torque_factors: _Factors = (0.05, 0.2, 0.5, 1.0, 2.0, 3.0)
    centre_distance_offsets_um: _Offsets = (-100.0, -50.0, 0.0, 50.0, 100.0)
    misalignment_um: _Offsets = (-60.0, -30.0, 0.0, 30.0, 60.0)

    @model_validator(mode="after")
    def _axes(self) -> SteSection:
        for key, values, static in (
            ("torque_factors", self.torque_factors, 1.0),
            ("centre_distance_offsets_um", self.centre_distance_offsets_um, 0.0),
            ("misalignment_um", self.misalignment_um, 0.0),
        ):
            if list(values) != sorted(set(values)):
                raise ValueError(f"{key} = {list(values)}: values must rise")
            if static not in values:
                raise ValueError(f"{key} = {list(values)}: {static} must be among them, the static state")
        return self


class CaseFile(_Section):
    """The whole gearbox file."""

    name: Annotated[Text, Field(max_length=200)]
    default_inertias: Name
    overall: OverallSection
    static_load: StaticLoadSection
    gears: Entries[GearSection]
    pairs: Entries[PairSection]
    bodies: Entries[BodySection]
    meshes: Entries[MeshSection]
    load_cases: Entries[LoadCaseSection]
    joints: Entries[JointSection] = {}
    bearings: Entries[BearingSection] = {}
    mounts: Entries[MountSection] = {}
    couplings: Entries[CouplingSection] = {}
    deviations: Entries[DeviationSection] = {}
    pins: Entries[PinSection] = {}
    damping: DampingSection = DampingSection()
    elasticity: ElasticitySection = ElasticitySection()
    housing: HousingSection = HousingSection()
    gravity: GravitySection = GravitySection()
    report: ReportSection = ReportSection()
    ste: SteSection = SteSection()
