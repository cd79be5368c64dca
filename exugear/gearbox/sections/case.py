"""The gearbox file as it is written: loads, settings, and the whole of its sections, unit in the key.

The models of this room know no mechanics. They refuse unknown keys, values of the wrong type and values that no
gearbox can have (:mod:`exugear.gearbox.sections.entries`). :mod:`exugear.gearbox.gearbox` turns them into SI data
and checks them against each other.
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
)
from exugear.gearbox.sections.entries import (
    LONGEST_VALUE,
    MOST_ENTRIES,
    Entries,
    FileName,
    Name,
    Section,
    Text,
)
from exugear.gearbox.sections.gears import DeviationSection, GearSection, PairSection, PinSection
from exugear.gearbox.sections.loads import LoadsSection, LubricantSection, RatingSection


class LoadCaseSection(Section):
    """Torques on the gearbox and, when speed-driven, the prescribed speed of one body."""

    torques_N_m: dict[Name, q.TorqueNm] = {}
    """Constant torques on the gearbox by body, positive about +z."""
    torque_series: FileName | None = None
    """CSV file of torques over time, beside the gearbox file."""
    duration_s: q.DurationS = 30.0
    """Simulated time."""
    start_speed_rpm: q.SpeedRpm = 0.0
    """Speed of the overall input at the start."""
    start_speeds_rpm: dict[Name, q.SpeedRpm] = {}
    """Speeds of further bodies at the start, of a train with several degrees of freedom; else its locked ones stand."""
    driven_body: Name | None = None
    """Body whose speed is prescribed; with the two keys that follow."""
    end_speed_rpm: q.SpeedRpm | None = None
    """Speed of that body at the end; it changes evenly."""
    drive_stiffness_N_m_per_rad: q.CouplingStiffness | None = None
    """Torsional spring between the drive and that body."""
    description: Text = ""
    """Words for people."""

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
    """Constant force and moment on a body, in the axes of the gearbox: the thrust of a propeller, a belt, a rotor.

    It acts in static states, runs, steady responses and lives alike, whatever the torques are, as weight does; in the
    variant `rigid` ideal joints take it. Where an elastic shaft has it, a seat is made there; on a solid it acts at
    the seat of its name if there is one, else at the main seat with its moment about that.
    """

    body: Name
    """Body that it acts on; no planet, and none that only spins."""
    z_mm: q.PlaceMm
    """Place along the axis of the body where it acts."""
    force_N: Annotated[tuple[q.ForceN, q.ForceN, q.ForceN], Field(strict=False)] = (0.0, 0.0, 0.0)
    """Force along x, y and z."""
    moment_N_m: Annotated[tuple[q.TorqueNm, q.TorqueNm], Field(strict=False)] = (0.0, 0.0)
    """Moment about x and y; torques about z stand in `[static_load]` and `[load_cases]`."""
    description: Text = ""
    """Words for people."""

    @model_validator(mode="after")
    def _acts(self) -> ForceSection:
        if not any((*self.force_N, *self.moment_N_m)):
            raise ValueError("set force_N = [x, y, z] or moment_N_m = [x, y], not all zero")
        return self


class OverallSection(Section):
    """Which spins the overall transmission error compares, and where its length is taken."""

    input: Name
    """Body whose angle counts as the input."""
    output: Name
    """Body whose angle counts as the output."""
    output_gear: Name | None = None
    """Gear whose base circle turns the angle into a length; needed where there are gears, else it is taken at 1 m."""


class StaticLoadSection(Section):
    """The static state that fixes loaded flanks and the load of the STE tables."""

    torques_N_m: dict[Name, q.TorqueNm]
    """Torques on the gearbox by body, positive about +z."""
    locked: Annotated[tuple[Name, ...], Field(strict=False, max_length=MOST_ENTRIES)]
    """Bodies that are held against these torques: as many as the train has degrees of freedom."""


class DampingSection(Section):
    """Damping: a share of critical damping of each mode, or times in proportion to stiffness, c = time * k.

    `modal_percent` replaces the times of meshes, bearings and couplings. Dampers with stated values and elastic bodies
    count towards it. Measured gearboxes have 1 to 4 % at most frequencies.
    """

    modal_percent: q.ModalDamping | None = None
    """Damping of every mode in percent of critical: one value, or pairs of frequency (Hz) and percent."""
    modal_modes: Annotated[tuple[q.ModalPoint, ...], Field(strict=False, max_length=MOST_ENTRIES)] = ()
    """Damping of single modes: pairs of the mode's frequency (Hz) and percent of critical."""
    modal_band_percent: Annotated[tuple[q.ModalPercent, q.ModalPercent], Field(strict=False)] | None = None
    """Minimum and maximum plausible damping of all modes, for amplitude bands; by default half and twice the value."""
    bearing_time_s: q.DampingTimeS = 4e-6
    """Damping of bearings over their stiffness."""
    mesh_time_s: q.DampingTimeS = 4e-6
    """Damping of meshes over their stiffness."""
    coupling_time_s: q.DampingTimeS = 4e-6
    """Damping of couplings over their stiffness."""
    body_time_s: q.DampingTimeS = 1e-6
    """Damping of elastic bodies over their stiffness."""

    @model_validator(mode="after")
    def _check_modal(self) -> DampingSection:
        """Refuse times that modal damping replaces, and tables and bands in the wrong order."""
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
    """How finely elastic bodies are described (variant `flexible`).

    Normal modes of each body up to `band_Hz` are exact; mass scaling brings those above `limit_Hz` down to it, so
    that a solver's step is not ruled by it.
    """

    band_Hz: q.FrequencyHz = 4500.0
    """Own vibrations of each elastic body are exact up to here."""
    limit_Hz: q.FrequencyHz = 9000.0
    """No own vibration is faster: what was above is slowed down to it by added mass."""

    @model_validator(mode="after")
    def _order(self) -> ElasticitySection:
        if self.limit_Hz <= self.band_Hz:
            raise ValueError(f"limit_Hz must be above band_Hz = {self.band_Hz:g}")
        return self


class HousingSection(Section):
    """Factor on bearing stiffness that stands for the housing seat in series; not where the housing is elastic."""

    factor: q.SeatFactor = 1.0
    """Share of a deflection that the bearing takes; the rest is the seat's."""


_Vector = Annotated[tuple[q.Acceleration, q.Acceleration, q.Acceleration], Field(strict=False)]


class GravitySection(Section):
    """Weight as an acceleration vector in the model's axes; off by default."""

    acceleration_m_per_s2: _Vector = (0.0, 0.0, 0.0)
    """Vector in the axes of the gearbox."""


_ServiceSpeed = Annotated[q.SpeedRpm, Field(ge=0.0)]


class OperationSection(Section):
    """How the gearbox works in service; what a report sets its speeds against."""

    rated_speed_rpm: Annotated[q.SpeedRpm, Field(gt=0.0)] | None = None
    """Speed of the overall input at rated power, without sign."""
    speed_range_rpm: Annotated[tuple[_ServiceSpeed, _ServiceSpeed], Field(strict=False)] | None = None
    """Lowest and highest speed of the overall input in service, without sign; 0.5 to 1.25 of rated by default."""

    @model_validator(mode="after")
    def _rising(self) -> OperationSection:
        if self.speed_range_rpm is not None and not self.speed_range_rpm[0] < self.speed_range_rpm[1]:
            raise ValueError(f"speed_range_rpm = {list(self.speed_range_rpm)}: set the lower speed first")
        return self


class ReportSection(Section):
    """What a report looks for: modes near a frequency that was measured or published."""

    reference_frequency_Hz: q.FrequencyHz | None = None
    """Frequency near which modes are shown, such as a measured one."""


_Factors = Annotated[tuple[q.LoadFactor, ...], Field(strict=False, max_length=50)]
_Offsets = Annotated[tuple[q.OffsetUm, ...], Field(strict=False, max_length=50)]


class SteSection(Section):
    """Settings of the finite-element tables; the axes are those of a table with ``grid``."""

    positions: q.Positions = 50
    """Positions over the mesh cycle."""
    method: Literal["superelement", "nonlinear"] = "superelement"
    """Method of `exugear ste` without `--method`."""
    grid: bool = False
    """Whether tables go over load, centre distance and misalignment."""
    torque_factors: _Factors = (0.05, 0.2, 0.5, 1.0, 2.0, 3.0)
    """Loads of a grid over the static torque of the pair; 1 among them."""
    centre_distance_offsets_um: _Offsets | None = None
    """Centre distances of a grid less that of the pair; 0 among them. Without it they follow from the static state."""
    misalignment_um: _Offsets | None = None
    """Openings of a grid at the +z end over the common face width; 0 among them. Without it as above."""

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
"""Words for a name: short, since tables and diagrams hold them."""
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
    "pins",
)
"""Tables whose entries may have a label."""


def labels_in_use(content: Mapping[str, Any]) -> dict[str, Any]:
    """Labels in the content of a gearbox file whose entries are there."""
    known = {name for table in NAMED_TABLES for name in content.get(table, {})}
    return {name: words for name, words in content.get("labels", {}).items() if name in known}


class GearboxFile(Section):
    """The whole gearbox file."""

    name: Annotated[Text, Field(max_length=200)]
    """Title of the gearbox, for pages and pictures."""
    default_inertias: Name
    """Inertia set that verbs take unless another is asked for; one of those under the bodies."""
    overall: OverallSection
    """What the overall transmission error compares."""
    static_load: StaticLoadSection
    """Static state that fixes loaded flanks, tables and operating points of bearings."""
    gears: Entries[GearSection] = {}
    """Toothed wheels by name."""
    pairs: Entries[PairSection] = {}
    """Pairs of gears that mesh, by name; each gets a table."""
    bodies: Entries[BodySection]
    """Bodies by name."""
    meshes: Entries[MeshSection] = {}
    """Pairs at work between bodies, by name."""
    load_cases: Entries[LoadCaseSection]
    """Load cases in time, by name; the first is the default."""
    forces: Entries[ForceSection] = {}
    """Constant forces and moments on bodies, by name."""
    joints: Entries[JointSection] = {}
    """Ideal joints of the variant `rigid`, by name."""
    bearings: Entries[BearingSection] = {}
    """Bearings of the variants `bushing` and `flexible`, by name."""
    mounts: Entries[MountSection] = {}
    """Elastic supports on the ground, by name."""
    couplings: Entries[CouplingSection] = {}
    """Torsional springs between bodies, by name."""
    deviations: Entries[DeviationSection] = {}
    """Errors of wheels, by name."""
    pins: Entries[PinSection] = {}
    """Errors of planets' pins, by name."""
    damping: DampingSection = DampingSection()
    """Damping: a share of critical damping of each mode, or times in proportion to stiffness."""
    elasticity: ElasticitySection = ElasticitySection()
    """How finely elastic bodies are described."""
    housing: HousingSection = HousingSection()
    """Seats of bearings where the housing is not elastic."""
    gravity: GravitySection = GravitySection()
    """Weight."""
    operation: OperationSection = OperationSection()
    """How the gearbox works in service."""
    report: ReportSection = ReportSection()
    """What a report looks for."""
    labels: Annotated[dict[Name, Label], Field(max_length=MOST_ENTRIES)] = {}
    """Words for people by name of a body, bearing, pair or other entry; pages show them instead of the name."""
    ste: SteSection = SteSection()
    """Tables of the transmission error."""
    loads: LoadsSection | None = None
    """Loads over the life of the gearbox."""
    rating: RatingSection | None = None
    """How gears are rated."""
    lubricant: LubricantSection | None = None
    """The oil."""

    @model_validator(mode="after")
    def _labels_of_entries(self) -> GearboxFile:
        known = {name for table in NAMED_TABLES for name in getattr(self, table)}
        for name in self.labels:
            if name not in known:
                raise ValueError(f"labels.{name}: no entry of that name; labels are for {', '.join(NAMED_TABLES)}")
        return self

    def __repr__(self) -> str:
        """Return one short line: the title, and how many entries the tables have."""
        tables = ("gears", "pairs", "bodies", "meshes", "bearings", "load_cases")
        counts = ", ".join(f"{len(getattr(self, table))} {table}" for table in tables)
        title = self.name if len(self.name) <= LONGEST_VALUE else f"{self.name[: LONGEST_VALUE - 1]}…"
        return f"<GearboxFile {title!r}: {counts}>"
