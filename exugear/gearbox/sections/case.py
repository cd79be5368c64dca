"""The gearbox file as it is written: loads, settings, and the complete set of sections, with units in the keys.

The models of this package contain no mechanics. They refuse unknown keys, values of the wrong type and impossible
values (:mod:`exugear.gearbox.sections.entries`). :mod:`exugear.gearbox.gearbox` converts them to SI data and checks
their consistency.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from exugear.gearbox.sections import entries as q
from exugear.gearbox.sections.bodies import BodySection
from exugear.gearbox.sections.connections import (
    BearingSection,
    CouplingSection,
    JointSection,
    MeshSection,
    MountSection,
    SealSection,
)
from exugear.gearbox.sections.entries import LONGEST_VALUE, MOST_ENTRIES, Entries, FileName, Name, Section, Text
from exugear.gearbox.sections.excitations import ExcitationSection
from exugear.gearbox.sections.gears import DeviationSection, GearSection, PairSection, PinSection
from exugear.gearbox.sections.loads import LoadsSection, LubricantSection, RatingSection
from exugear.gearbox.sections.measurements import MeasurementSection
from fe_ste.transmission_error.cycle import DEFAULT_POSITIONS


class LoadCaseSection(Section):
    """Torques on the gearbox and, when speed-driven, the prescribed speed of one body."""

    torques_N_m: dict[Name, q.TorqueNm] = {}
    """Constant torques on the gearbox by body, positive about +z."""
    torque_series: FileName | None = None
    """CSV file of torques over time, in the folder of the gearbox file: `time_s`, and `BODY_N_m` for each loaded body;
    linear between rows.
    """
    duration_s: q.DurationS = 30.0
    """Simulated time."""
    start_speed_rpm: q.SpeedRpm = 0.0
    """Speed of the overall input at the start."""
    start_speeds_rpm: dict[Name, q.SpeedRpm] = {}
    """Initial speeds of further bodies in a train with several degrees of freedom; by default its locked bodies are at
    standstill.
    """
    driven_body: Name | None = None
    """Body whose speed is prescribed; requires the next two keys."""
    end_speed_rpm: q.SpeedRpm | None = None
    """Speed of that body at the end; the speed changes linearly."""
    drive_stiffness_N_m_per_rad: q.CouplingStiffness | None = None
    """Torsional spring between the drive and that body."""
    description: Text = ""
    """Description for the user."""

    @model_validator(mode="after")
    def _drive(self) -> LoadCaseSection:
        drive = (
            self.driven_body is not None,
            self.end_speed_rpm is not None,
            self.drive_stiffness_N_m_per_rad is not None,
        )
        if any(drive) and not all(drive):
            raise ValueError(
                "a speed-driven load case requires driven_body, end_speed_rpm and drive_stiffness_N_m_per_rad"
            )
        if not self.torques_N_m and self.torque_series is None and not any(drive):
            raise ValueError("set torques_N_m, torque_series or driven_body")
        return self


class ForceSection(Section):
    """Constant force and moment on a body, in the axes of the gearbox: propeller thrust, belt forces, rotor loads.

    It acts in static states, runs, steady-state responses and life calculations, independently of the torques, as
    weight does. In the variant `rigid` ideal joints react it. On a flexible shaft a seat is added at its position. On a
    solid it acts at the seat with its name if one exists, or else at the main seat, with its moment about that seat.
    """

    body: Name
    """Body on which it acts; not a planet or a spin-only body."""
    z_mm: q.PlaceMm
    """Position along the axis of the body."""
    force_N: Annotated[tuple[q.ForceN, q.ForceN, q.ForceN], Field(strict=False)] = (0.0, 0.0, 0.0)
    """Force along x, y and z."""
    moment_N_m: Annotated[tuple[q.TorqueNm, q.TorqueNm], Field(strict=False)] = (0.0, 0.0)
    """Moment about x and y; torques about z are specified in `[static_load]` and `[load_cases]`."""
    description: Text = ""
    """Description for the user."""

    @model_validator(mode="after")
    def _acts(self) -> ForceSection:
        if not any((*self.force_N, *self.moment_N_m)):
            raise ValueError("set force_N = [x, y, z] or moment_N_m = [x, y], not all zero")
        return self


class OverallSection(Section):
    """Rotations that the overall transmission error compares, and the gear at which it is converted to a length."""

    input: Name
    """Body whose angle is the input."""
    output: Name
    """Body whose angle is the output."""
    output_gear: Name | None = None
    """Gear whose base radius converts the angle to a length; required if there are gears, otherwise the radius is 1 m.
    """


class StaticLoadSection(Section):
    """The static state that determines the loaded flanks and the load of the STE tables."""

    torques_N_m: dict[Name, q.TorqueNm]
    """Torques on the gearbox by body, positive about +z."""
    locked: Annotated[tuple[Name, ...], Field(strict=False, max_length=MOST_ENTRIES)]
    """Bodies that react these torques: as many as the train has degrees of freedom."""


class DampingSection(Section):
    """Modal damping in percent of critical, or stiffness-proportional damping with c = time * k.

    `modal_percent` replaces the times of meshes, bearings and couplings. It includes the damping of dampers with
    specified values and of flexible bodies. Measured gearboxes have 1 to 4 % at most frequencies. Models with a
    flexible body that turns with planets have the times.
    """

    modal_percent: q.ModalDamping | None = None
    """Damping of every mode in percent of critical: one value, or pairs of frequency (Hz) and percent."""
    modal_modes: Annotated[tuple[q.ModalPoint, ...], Field(strict=False, max_length=MOST_ENTRIES)] = ()
    """Damping of single modes: pairs of the mode's frequency (Hz) and percent of critical."""
    modal_band_percent: Annotated[tuple[q.ModalPercent, q.ModalPercent], Field(strict=False)] | None = None
    """Minimum and maximum plausible damping of all modes, for amplitude bands; by default half and twice the value."""
    bearing_time_s: q.DampingTimeS = 4e-6
    """Ratio of damping to stiffness of bearings."""
    mesh_time_s: q.DampingTimeS = 4e-6
    """Ratio of damping to stiffness of meshes."""
    coupling_time_s: q.DampingTimeS = 4e-6
    """Ratio of damping to stiffness of couplings."""
    body_time_s: q.DampingTimeS = 1e-6
    """Ratio of damping to stiffness of flexible bodies."""
    tooth_friction: q.Friction = 0.0
    """Coefficient of friction of the teeth in runs and steady-state responses; `exugear losses` lists estimates."""

    @model_validator(mode="after")
    def _check_modal(self) -> DampingSection:
        """Raise an error for times that modal damping replaces, and for tables and bands in the wrong order."""
        if self.modal_percent is None:
            for key in ("modal_modes", "modal_band_percent"):
                if key in self.model_fields_set:
                    raise ValueError(f"{key} requires modal_percent; add modal_percent = 2.0, or remove {key}")
            return self
        for key in ("bearing_time_s", "mesh_time_s"):
            if key in self.model_fields_set:
                raise ValueError(f"{key} has no effect where modal_percent states the damping; remove one of them")
        if not isinstance(self.modal_percent, float):
            frequencies = [frequency for frequency, _ in self.modal_percent]
            if sorted(set(frequencies)) != frequencies:
                raise ValueError("modal_percent: frequencies must increase from pair to pair")
        if self.modal_band_percent is not None and not self.modal_band_percent[0] < self.modal_band_percent[1]:
            raise ValueError("modal_band_percent: the first value must be smaller than the second")
        return self


class ElasticitySection(Section):
    """Modal resolution of flexible bodies (variant `flexible`).

    Normal modes of each body up to `band_Hz` are exact. Mass scaling lowers the frequencies above `limit_Hz` to this
    limit, so that they do not determine the time step of a solver.
    """

    band_Hz: q.FrequencyHz = 4500.0
    """Cut-off frequency: the normal modes of each flexible body are exact up to here."""
    limit_Hz: q.FrequencyHz = 9000.0
    """Upper limit of the normal mode frequencies; higher ones are lowered to it by added mass."""

    @model_validator(mode="after")
    def _order(self) -> ElasticitySection:
        if self.limit_Hz <= self.band_Hz:
            raise ValueError(f"limit_Hz must be above band_Hz = {self.band_Hz:g}")
        return self


class HousingSection(Section):
    """Factor on bearing stiffness for the compliance of the housing seat in series; not used for a flexible housing."""

    factor: q.SeatFactor = 1.0
    """Fraction of the deflection that occurs in the bearing; the rest occurs in the seat."""


_Vector = Annotated[tuple[q.Acceleration, q.Acceleration, q.Acceleration], Field(strict=False)]


class GravitySection(Section):
    """Weight as an acceleration vector; off by default."""

    acceleration_m_per_s2: _Vector = (0.0, 0.0, 0.0)
    """Acceleration vector in the axes of the gearbox."""


_ServiceSpeed = Annotated[q.SpeedRpm, Field(ge=0.0)]


class OperationSection(Section):
    """Operating speeds in service, with which a report compares its resonance speeds."""

    rated_speed_rpm: Annotated[q.SpeedRpm, Field(gt=0.0)] | None = None
    """Speed of the overall input at rated power, without sign."""
    speed_range_rpm: Annotated[tuple[_ServiceSpeed, _ServiceSpeed], Field(strict=False)] | None = None
    """Minimum and maximum speed of the overall input in service, without sign; 0.5 to 1.25 of rated by default."""

    @model_validator(mode="after")
    def _rising(self) -> OperationSection:
        if self.speed_range_rpm is not None and not self.speed_range_rpm[0] < self.speed_range_rpm[1]:
            raise ValueError(f"speed_range_rpm = {list(self.speed_range_rpm)}: set the lower speed first")
        return self


class ReportSection(Section):
    """Settings of rankings and reports: the deciding quantity, and a measured or published frequency."""

    quantity: Literal["transmission_error", "bearing_force", "acceleration", "sound_power"] | None = None
    """Quantity by which resonances are ranked. By default the acceleration at the mounts of a flexible housing, or else
    the bearing force, or with ideal joints the transmission error. ``sound_power`` is the surface velocity of a
    flexible housing."""
    reference_frequency_Hz: q.FrequencyHz | None = None
    """Frequency near which modes are listed, such as a measured one."""


_Factors = Annotated[tuple[q.LoadFactor, ...], Field(strict=False, max_length=50)]
_Offsets = Annotated[tuple[q.OffsetUm, ...], Field(strict=False, max_length=50)]


class SteSection(Section):
    """Settings of the finite-element tables; the axes apply to tables with ``grid``."""

    positions: q.Positions = DEFAULT_POSITIONS
    """Number of positions over the mesh cycle."""
    method: Literal["superelement", "nonlinear"] = "superelement"
    """Method of `exugear ste` without `--method`."""
    grid: bool = False
    """Whether tables extend over load, centre distance and misalignment."""
    torque_factors: _Factors = (0.05, 0.2, 0.5, 1.0, 2.0, 3.0)
    """Loads of a grid relative to the static torque of the pair; must include 1."""
    centre_distance_offsets_um: _Offsets | None = None
    """Centre distances of a grid minus that of the pair; must include 0. By default they follow from the static state.
    """
    misalignment_um: _Offsets | None = None
    """Misalignments of a grid as the gap at the +z end over the common face width; must include 0. By default they
    follow from the static state.
    """

    @model_validator(mode="after")
    def _axes(self) -> SteSection:
        for key, values, static in (
            ("torque_factors", self.torque_factors, 1.0),
            ("centre_distance_offsets_um", self.centre_distance_offsets_um, 0.0),
            ("misalignment_um", self.misalignment_um, 0.0),
        ):
            if values is None:
                continue
            if list(values) != sorted(set(values)):
                raise ValueError(f"{key} = {list(values)}: values must increase")
            if static not in values:
                raise ValueError(f"{key} = {list(values)}: must include {static}, the static state")
        return self


Label = Annotated[Text, Field(min_length=1, max_length=80)]
"""Short text for a name, used in tables and diagrams."""
NAMED_TABLES = (
    "bodies",
    "bearings",
    "joints",
    "mounts",
    "couplings",
    "meshes",
    "pairs",
    "gears",
    "load_cases",
    "forces",
    "excitations",
    "pins",
)
"""Tables whose entries may have a label."""


def labels_in_use(content: Mapping[str, Any]) -> dict[str, Any]:
    """Labels in the content of a gearbox file whose entries exist."""
    known = {name for table in NAMED_TABLES for name in content.get(table, {})}
    return {name: words for name, words in content.get("labels", {}).items() if name in known}


class GearboxFile(Section):
    """The complete gearbox file."""

    name: Annotated[Text, Field(max_length=200)]
    """Title of the gearbox, for pages and pictures."""
    default_inertias: Name = "shapes"
    """Inertia set that commands use by default; one of the sets of the bodies.

    Not needed where the inertia of every body follows from its shape.
    """
    overall: OverallSection
    """Input and output of the overall transmission error."""
    static_load: StaticLoadSection
    """Static state that determines loaded flanks, tables and operating points of bearings."""
    gears: Entries[GearSection] = {}
    """Gears by name."""
    pairs: Entries[PairSection] = {}
    """Pairs of meshing gears, by name; each has a table."""
    bodies: Entries[BodySection]
    """Bodies by name."""
    meshes: Entries[MeshSection] = {}
    """Meshes of gear pairs between bodies, by name."""
    load_cases: Entries[LoadCaseSection]
    """Load cases in time, by name; the first is the default."""
    forces: Entries[ForceSection] = {}
    """Constant forces and moments on bodies, by name."""
    excitations: Entries[ExcitationSection] = {}
    """Torques that vary with the angle of a body, by name."""
    joints: Entries[JointSection] = {}
    """Ideal joints of the variant `rigid`, by name."""
    bearings: Entries[BearingSection] = {}
    """Bearings of the variants `bushing` and `flexible`, by name."""
    mounts: Entries[MountSection] = {}
    """Elastic supports on the ground, by name."""
    couplings: Entries[CouplingSection] = {}
    """Torsional springs between bodies, by name."""
    seals: Entries[SealSection] = {}
    """Radial shaft seals, by name; they matter for losses only."""
    deviations: Entries[DeviationSection] = {}
    """Deviations of gears, by name."""
    pins: Entries[PinSection] = {}
    """Position errors of planet pins, by name."""
    damping: DampingSection = DampingSection()
    """Modal damping, or stiffness-proportional damping."""
    elasticity: ElasticitySection = ElasticitySection()
    """Modal resolution of flexible bodies."""
    housing: HousingSection = HousingSection()
    """Bearing seats in a housing that is not flexible."""
    gravity: GravitySection = GravitySection()
    """Weight."""
    operation: OperationSection = OperationSection()
    """Operating speeds in service."""
    report: ReportSection = ReportSection()
    """Reference values of a report."""
    labels: Annotated[dict[Name, Label], Field(max_length=MOST_ENTRIES)] = {}
    """Labels by name of a body, bearing, pair or other entry; pages show them instead of the name."""
    ste: SteSection = SteSection()
    """Tables of the transmission error."""
    loads: LoadsSection | None = None
    """Loads over the life of the gearbox."""
    rating: RatingSection | None = None
    """Rating of gears and bearings."""
    lubricant: LubricantSection | None = None
    """Oil."""
    measurements: Entries[MeasurementSection] = {}
    """Recorded run-ups of a test rig, by name."""

    @model_validator(mode="after")
    def _labels_of_entries(self) -> GearboxFile:
        known = {name for table in NAMED_TABLES for name in getattr(self, table)}
        for name in self.labels:
            if name not in known:
                raise ValueError(f"labels.{name}: no entry of that name; labels are for {', '.join(NAMED_TABLES)}")
        return self

    def __repr__(self) -> str:
        """Return one short line: the title, and the number of entries of the tables."""
        tables = ("gears", "pairs", "bodies", "meshes", "bearings", "load_cases")
        counts = ", ".join(f"{len(getattr(self, table))} {table}" for table in tables)
        title = self.name if len(self.name) <= LONGEST_VALUE else f"{self.name[: LONGEST_VALUE - 1]}…"
        return f"<GearboxFile {title!r}: {counts}>"
