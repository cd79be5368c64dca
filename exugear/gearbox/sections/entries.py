"""Common definitions of all sections of a gearbox file: kinds of quantities, names, texts, tables of named entries.

An impossible value is an error: no gearbox has it, or the program could not handle the result. A possible but unusual
value is a warning: most often it has a wrong unit or a wrong digit. Both limits belong to a range.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import UnionType
from typing import Annotated, Any, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Field, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from fe_ste.tools.display import html_table


@dataclass(frozen=True)
class Range:
    """Range of a kind of quantity, as metadata of an annotated type."""

    least: float
    most: float
    """Limits of possible values."""
    usual: tuple[float, float] | None = None
    """Limits of usual values; by default all possible ones. Zero is always usual if possible: it disables a feature."""
    why: str = ""
    """Reason for the limits."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Check the range after the type."""
        return core_schema.no_info_after_validator_function(self.checked, handler(source))

    def __get_pydantic_json_schema__(self, source: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Add the range to the JSON schema."""
        return {**handler(source), "minimum": self.least, "maximum": self.most}

    def checked(self, value: float) -> float:
        """Return a value, or raise an error if it is impossible, including NaN."""
        if not self.least <= value <= self.most:
            raise PydanticCustomError(
                "range", "{text}", {"text": f"must lie between {self.least:g} and {self.most:g}{self._reason}"}
            )
        return value

    def warning(self, value: float) -> str:
        """Return a warning about an unusual value; empty if it is usual."""
        if self.usual is None or self.usual[0] <= value <= self.usual[1] or value == 0.0:
            return ""
        return f"unusual, most lie between {self.usual[0]:g} and {self.usual[1]:g}; check the unit"

    @property
    def _reason(self) -> str:
        return f" ({self.why})" if self.why else ""


def _symmetric_range(limit: float, usual: float, why: str = "") -> Range:
    return Range(-limit, limit, (-usual, usual), why)


# Watch gears have modules of 0.05 mm, the largest mill and ship gears 60 mm and 12 m.
Teeth = Annotated[int, Range(5, 2000, (5, 600), "below 5 lie worms, above 2000 racks")]
ModuleMm = Annotated[float, Range(0.05, 100.0, (0.2, 50.0))]
PressureAngleDeg = Annotated[float, Range(10.0, 35.0, (14.0, 30.0))]
HelixAngleDeg = Annotated[float, _symmetric_range(50.0, 45.0)]
ProfileShift = Annotated[float, _symmetric_range(5.0, 2.0, "in normal modules")]
RackHeight = Annotated[float, Range(0.05, 5.0, (0.4, 2.0), "in normal modules")]
RackRadius = Annotated[float, Range(0.0, 1.0, (0.0, 0.6), "in normal modules")]
FaceWidthMm = Annotated[float, Range(0.1, 5000.0, (1.0, 1500.0))]
ThinningMm = Annotated[float, Range(0.0, 50.0, (0.0, 3.0))]
AllowanceUm = Annotated[float, Range(-20000.0, 0.0, (-3000.0, 0.0), "allowances take off, as in DIN 3967")]
AllowanceRangeUm = Annotated[float, Range(0.0, 20000.0, (0.0, 2000.0))]
ChamferMm = Annotated[float, Range(0.0, 50.0, (0.0, 10.0))]
RollLengthMm = Annotated[float, Range(1e-3, 1000.0, (0.01, 200.0))]
RollAngleDeg = Annotated[float, Range(1e-3, 120.0)]

# Flanks are ground to micrometres; 1 mm of relief is large even for the largest gear.
RemovedUm = Annotated[float, Range(0.0, 3000.0, (0.0, 500.0), "micrometres removed from a flank")]
SlopeUm = Annotated[float, _symmetric_range(3000.0, 500.0, "micrometres over a flank")]
PitchUm = Annotated[float, _symmetric_range(3000.0, 500.0, "ISO 1328 ends at 0.5 mm")]
RunoutUm = Annotated[float, Range(0.0, 3000.0, (0.0, 500.0), "ISO 1328 ends at 0.5 mm")]
PlaceErrorUm = Annotated[float, _symmetric_range(5000.0, 500.0)]

# Materials, from foams to osmium, from rubber to diamond.
YoungsModulusGPa = Annotated[float, Range(0.1, 1500.0, (1.0, 700.0))]
PoissonsRatio = Annotated[float, Range(0.0, 0.49, (0.15, 0.45), "elements lock near 0.5")]
Density = Annotated[float, Range(500.0, 25000.0, (900.0, 20000.0), "kg/m3")]

# Positions and sizes of shafts and housings.
LengthMm = Annotated[float, Range(0.01, 1e5, (0.1, 2e4))]
BoreMm = Annotated[float, Range(0.0, 1e5, (0.0, 2e4))]
PlaceMm = Annotated[float, _symmetric_range(1e5, 3e4)]
LengthUnitMm = Annotated[float, Range(1e-3, 1e3, why="1 for millimetres, 1000 for metres")]
ElementSizeMm = Annotated[float, Range(0.2, 5000.0, (1.0, 500.0), "finer meshes fill any memory")]
ElementsAround = Annotated[int, Range(6, 400, (6, 120), "finer meshes fill any memory")]
Sectors = Annotated[int, Range(3, 63, (3, 31), "each is a seat of six coordinates")]
NodeNumber = Annotated[int, Range(-(10**9), 10**9, why="numbers of nodes in a finite-element model")]
AngleDeg = Annotated[float, Range(-3600.0, 3600.0, (-720.0, 720.0))]
ShaftOrder = Annotated[float, Range(0.5, 2000.0, (0.5, 500.0), "periods per revolution, a whole number or a half")]
PolePairs = Annotated[int, Range(1, 200, (1, 60))]
RippleNm = Annotated[float, Range(0.0, 1e9, (0.0, 1e7), "amplitude, zero to peak")]
RipplePercent = Annotated[float, Range(0.0, 1000.0, (0.0, 100.0), "percent of the static torque; above it, teeth part")]
SpeedExponent = Annotated[float, Range(0.0, 6.0, (0.0, 3.0), "power of the speed, 2 for a propeller")]
UnbalanceGMm = Annotated[
    float, Range(1e-9, 1e13, (1e-3, 1e10), "mass times distance; 1 kg mm are 1000 g mm, 1 kg m are 1e6 g mm")
]
Phase = Annotated[float, _symmetric_range(1000.0, 10.0, "in mesh cycles")]

# Masses, from watch gears to the rotors of hydro generators.
MassKg = Annotated[float, Range(1e-6, 1e7, (1e-4, 1e6))]
InertiaKgM2 = Annotated[float, Range(1e-12, 1e10, (1e-9, 1e9))]

# Supports. A solid steel block of a metre has 2e11 N/m and 2e10 N m/rad.
Stiffness = Annotated[float, Range(0.0, 1e13, (1.0, 1e12), "N/m or N m/rad")]
StiffnessEntry = Annotated[float, _symmetric_range(1e13, 1e12, "N/m, N or N m/rad")]
MeshStiffness = Annotated[float, Range(1.0, 1e13, (1e5, 1e12), "N/m on the line of action, of the whole face")]
MeshStiffnessWave = Annotated[float, _symmetric_range(1e13, 1e12, "N/m on the line of action, of the whole face")]
CouplingStiffness = Annotated[float, Range(1e-3, 1e13, (1e-2, 1e12), "N m/rad")]
CouplingDamping = Annotated[float, Range(0.0, 1e9, (0.0, 1e7), "N m s/rad")]
DampingTimeS = Annotated[
    float, Range(0.0, 1e-2, (0.0, 1e-3), "stiffness times it is the damping: 1 ms is critical at 320 Hz")
]
LossFactor = Annotated[
    float, Range(0.0, 1.0, (1e-4, 0.3), "share of the strain energy lost per radian; welded steel 0.001, bolted 0.02")
]
ModalPercent = Annotated[
    float, Range(0.01, 20.0, (0.3, 10.0), "percent of critical damping; measured gearboxes have 1 to 4 %")
]
ModalPoint = Annotated[tuple[Annotated[float, Range(0.0, 1e5)], ModalPercent], Field(strict=False)]
ModalDamping = ModalPercent | Annotated[tuple[ModalPoint, ...], Field(strict=False, min_length=1, max_length=1000)]
Friction = Annotated[float, Range(0.0, 0.5, (0.0, 0.12), "lubricated gears have 0.02 to 0.1")]
ContactAngleDeg = Annotated[float, Range(0.0, 59.0, (0.0, 52.0))]
ClearanceMm = Annotated[float, Range(-1.0, 5.0, (-0.2, 1.0), "on the diameter")]
RingTemperatureK = Annotated[
    float, Range(-100.0, 100.0, (-30.0, 30.0), "inner rings are usually 5 to 10 K hotter than outer rings")
]
RollingRows = Annotated[int, Range(1, 8, (1, 6))]
RollingElements = Annotated[int, Range(3, 1000, (5, 300), "balls or rollers of one row")]
GrooveRatio = Annotated[
    float, Range(0.5001, 1.0, (0.505, 0.6), "radius of the groove over the ball's diameter; at 0.5 no ball rolls")
]
Osculation = Annotated[float, Range(0.5, 0.9999, (0.93, 0.995), "radius of the barrel's outline over the raceway's")]
ProfileShare = Annotated[float, Range(0.0, 1.0, why="share of half the roller's length")]
AxialPreloadUm = Annotated[float, _symmetric_range(2000.0, 200.0)]
RatingKN = Annotated[float, Range(1e-3, 1e6, (0.1, 5e4))]
SealSpeed = Annotated[float, Range(0.1, 200.0, (1.0, 60.0), "m/s of the shaft under the lip")]
SpeedLimitRpm = Annotated[float, Range(0.1, 1e6, (10.0, 1e5), "limiting speed of the bearing's catalogue")]
RadialLoadKN = Annotated[float, Range(0.0, 1e5, (0.0, 2e4))]
AxialLoadKN = Annotated[float, _symmetric_range(1e5, 2e4)]
SeatFactor = Annotated[float, Range(1e-3, 1.0)]

# Loads, from watches to the largest wind turbines (3e7 N m).
TorqueNm = Annotated[float, _symmetric_range(1e9, 1e8)]
ForceN = Annotated[float, _symmetric_range(1e9, 1e8)]
DurationS = Annotated[float, Range(1e-9, 1e6, (1e-2, 3600.0))]
SpeedRpm = Annotated[float, _symmetric_range(1e6, 1e5)]
Acceleration = Annotated[float, _symmetric_range(1000.0, 20.0, "m/s2")]

# Life loads and rating.
HOURS_PER_YEAR = 8766.0
HoursPerYear = Annotated[float, Range(0.0, HOURS_PER_YEAR, why="a year has 8766 hours")]
EventsPerYear = Annotated[float, Range(0.0, 1e7, (0.0, 1e5))]
WindSpeed = Annotated[float, Range(0.1, 100.0, (0.5, 15.0))]
WeibullShape = Annotated[float, Range(0.5, 10.0, (1.5, 3.0))]
SkippedS = Annotated[float, Range(0.0, 1e6, (0.0, 3600.0))]
ChannelFactor = Annotated[float, _symmetric_range(1e6, 1e3)]
PartialFactor = Annotated[float, Range(0.5, 5.0, (1.0, 2.0))]
LifeYears = Annotated[float, Range(1e-4, 200.0, (1.0, 50.0))]
LoadBins = Annotated[int, Range(1, 10000, (16, 1000))]
LoadCycles = Annotated[float, Range(1.0, 1e13)]
LifeFactor = Annotated[float, Range(0.1, 10.0, (0.5, 5.0))]
StressMPa = Annotated[float, Range(10.0, 5000.0, (100.0, 2000.0))]
RoughnessUm = Annotated[float, Range(0.1, 100.0, (0.5, 20.0), "Rz, six times Ra")]
MeanRoughnessUm = Annotated[float, Range(0.02, 20.0, (0.1, 3.0), "Ra, a sixth of Rz")]
OilTemperature = Annotated[float, Range(-50.0, 250.0, (0.0, 120.0))]
StrengthFactor = Annotated[float, Range(0.1, 2.0, (0.5, 1.3))]
LoadFactorK = Annotated[float, Range(1.0, 10.0, (1.0, 2.0))]
AuxiliaryFactor = Annotated[float, Range(1.0, 1.2, None, "f_ZCa is 1.2 without flank modification")]
Viscosity = Annotated[float, Range(1.0, 5000.0, (15.0, 1000.0), "mm2/s at 40 degrees Celsius")]
HotViscosity = Annotated[float, Range(0.5, 1000.0, (2.0, 100.0), "mm2/s at 100 degrees Celsius")]
HeatConductance = Annotated[float, Range(0.01, 1e6, (1.0, 1e4), "W/K from the oil to the surroundings")]
OilDensity = Annotated[float, Range(500.0, 2000.0, (800.0, 1100.0), "kg/m3 at 15 degrees Celsius")]
CarrierAngles = Annotated[int, Range(1, 360, (4, 72))]
ToleranceClass = Annotated[int, Range(1, 11)]
NominalHours = Annotated[float, Range(0.01, 1e7, (100.0, 3e5))]
SafetyFactor = Annotated[float, Range(0.5, 10.0, (1.0, 3.0))]

# Measurements.
PulsesPerRevolution = Annotated[int, Range(1, 100_000, (1, 10_000))]
WindowRevolutions = Annotated[float, Range(1.0, 1000.0, (4.0, 64.0), "revolutions of the shaft with the tacho")]
MeasuredHarmonics = Annotated[int, Range(1, 20)]
FullScale = Annotated[float, Range(1e-12, 1e12, None, "value of a channel at full scale, in its unit")]
DirectionComponent = Annotated[float, Range(-1e6, 1e6)]

# Numerical settings.
FrequencyHz = Annotated[float, Range(1.0, 1e6, (10.0, 1e5))]
Positions = Annotated[int, Range(8, 2000, (8, 500))]
LoadFactor = Annotated[float, Range(1e-3, 20.0, (1e-2, 10.0))]
OffsetUm = Annotated[float, _symmetric_range(5000.0, 1000.0)]


def unusual_values(model: BaseModel) -> Iterator[tuple[str, float, str]]:
    """Yield key, value and warning of each unusual value of a model."""
    for key, value, limits in quantities(model):
        if warning := limits.warning(value):
            yield key, value, warning


def quantities(model: BaseModel) -> Iterator[tuple[str, float, Range]]:
    """Yield key, value and range of each number of a model that has a range."""
    yield from _quantities(model, type(model), (), "")


def _quantities(value: Any, kind: Any, metadata: tuple[Any, ...], key: str) -> Iterator[tuple[str, float, Range]]:
    """Yield key, value and range of each quantity in a validated value of an annotated type."""
    if get_origin(kind) is Annotated:
        kind, *more = get_args(kind)
        yield from _quantities(value, kind, (*metadata, *more), key)
    elif isinstance(value, BaseModel):
        for name, field in type(value).model_fields.items():
            where = f"{key}.{name}" if key else name
            yield from _quantities(value.__dict__[name], field.annotation, tuple(field.metadata), where)
    elif get_origin(kind) in (Union, UnionType):
        branches = [branch for branch in get_args(kind) if branch is not type(None)]
        fitting = [branch for branch in branches if isinstance(value, tuple) == (_plain(branch) is tuple)]
        yield from _quantities(value, branches[0] if len(branches) == 1 else fitting[0], metadata, key)
    elif isinstance(value, Mapping):
        for name, entry in value.items():
            yield from _quantities(entry, get_args(kind)[1], (), f"{key}.{name}")
    elif isinstance(value, tuple):
        kinds = get_args(kind)
        for number, entry in enumerate(value):
            yield from _quantities(entry, kinds[0 if kinds[-1] is Ellipsis else number], (), f"{key}.{number}")
    elif isinstance(value, int | float) and math.isfinite(value):
        yield from ((key, value, limits) for limits in metadata if isinstance(limits, Range))


def _plain(kind: Any) -> Any:
    """Outermost type without annotations."""
    while get_origin(kind) is Annotated:
        kind = get_args(kind)[0]
    return get_origin(kind) or kind


GROUND = "ground"
"""Name of the stationary environment, used in place of a body."""
MOST_ENTRIES = 500
"""Maximum number of entries of a table such as [bearings]."""
MOST_PLANETS = 40
"""Maximum number of planets of a set."""
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", max_length=80)]
"""Name of a part; names of results folders and files contain up to three of them."""
Text = Annotated[str, Field(pattern=r"^[^\x00-\x08\x0b-\x1f\x7f]*$", max_length=2000)]
"""Text for the user: no control characters except tabs and line ends."""
FileName = Annotated[str, Field(pattern=r"^[^\x00-\x1f\x7f]+$", max_length=1000)]
"""Path of a file, relative to the folder of the gearbox file."""
Entry = TypeVar("Entry")
Entries = Annotated[dict[Name, Entry], Field(max_length=MOST_ENTRIES)]
"""Table of named entries."""
Point = Annotated[tuple[PlaceMm, PlaceMm, PlaceMm], Field(strict=False)]
"""Position in space. Arrays of a file are lists; their values are not converted."""
LONGEST_LINE = 200
"""Maximum number of characters of a section shown as a line."""
LONGEST_VALUE = 40
"""Maximum number of characters of one of its values."""


class Section(BaseModel):
    """A table of the gearbox file; frozen, with strict keys and types."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    def __repr__(self) -> str:
        """Return one short line with the keys that were specified."""
        line = f"<{type(self).__name__}: {', '.join(f'{key} = {value}' for key, value in self._given().items())}>"
        return line if len(line) <= LONGEST_LINE else f"{line[: LONGEST_LINE - 2]}…>"

    def __str__(self) -> str:
        """Return the line of `repr`."""
        return repr(self)

    def _repr_html_(self) -> str:
        return html_table(type(self).__name__, self._given())

    def _given(self) -> dict[str, str]:
        """Return the specified values as short texts."""
        fields = (key for key in type(self).model_fields if key in self.model_fields_set)
        return {key: _shown(getattr(self, key)) for key in fields}


def _shown(value: Any) -> str:
    """Return a value as a short text; for tables and long arrays the number of entries."""
    if isinstance(value, Section):
        return "a table"
    if isinstance(value, Mapping) or (isinstance(value, tuple) and len(value) > 3):
        return f"{len(value)} entries"
    text = repr(value)
    return text if len(text) <= LONGEST_VALUE else f"{text[: LONGEST_VALUE - 1]}…"


def check_wall(inner: float, outer: float, keys: str) -> None:
    """Raise an error for a ring without a wall; `keys` names the inner diameter.

    Raises
    ------
    ValueError
        The inner diameter is not below the outer one.
    """
    if inner >= outer:
        raise ValueError(f"{keys} = {inner:g} must be below outer_diameter_mm = {outer:g}")
