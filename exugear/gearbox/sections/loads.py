"""Sections on measured loads and on rating: what acts on a gearbox over its life, and what its gears withstand."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from exugear.gearbox.sections import entries as q
from exugear.gearbox.sections.entries import Entries, FileName, Name, Section, Text

ChannelName = Annotated[str, Field(pattern=r"^[^\x00-\x1f\x7f]+$", max_length=100)]
"""Name of a channel, as the file of loads writes it; capitals do not matter."""
_CurvePoint = Annotated[tuple[q.LoadCycles, q.LifeFactor], Field(strict=False)]
Curve = Annotated[tuple[_CurvePoint, ...], Field(strict=False, min_length=2, max_length=20)]
"""Life factor over load cycles, straight between its points in logarithms."""


FilePattern = Annotated[str, Field(pattern=r"^[^\x00-\x1f\x7f]+$", max_length=1000)]
"""Names of files below the folder of the gearbox file, with `*` and `?` for what differs."""


class WindSection(Section):
    """How long the wind blows at each speed: a Weibull distribution, for files of one wind speed each."""

    mean_m_per_s: q.WindSpeed
    """Mean of the wind speed over the years."""
    shape: q.WeibullShape = 2.0
    """Exponent of the distribution; 2 is Rayleigh's."""
    bin_m_per_s: q.WindSpeed = 2.0
    """Width of the bins of wind speed, the first about 0; files of one bin share its hours by their length."""
    hours_per_year: q.HoursPerYear = 8766.0
    """Hours of all wind speeds together."""


class SourceSection(Section):
    """One file of loads, or many of one kind, and how often in a year they happen."""

    file: FileName | None = None
    """OpenFAST output (`.outb`, `.out`), a table (`.csv`) or load cases (`.rexs`), beside the gearbox file."""
    files: FilePattern | None = None
    """Many series instead, such as `dlc/*.outb`: all that fit, each with the same channels."""
    kind: Literal["fatigue", "extreme"] = "fatigue"
    """Whether it wears the gearbox out, or only its largest values count."""
    case: Text = ""
    """Words for people, such as the design load case."""
    hours_per_year: q.HoursPerYear | None = None
    """How long it acts in a year, many files together, by their length; or one of the next keys. A table of counted
    loads needs none: its hours are then those of the life."""
    events_per_year: q.EventsPerYear | None = None
    """How often each file happens in a year as a whole, from what is skipped on."""
    hours_table: FileName | None = None
    """Table `file,hours_per_year` with a line for each of `files`, by its name without folder."""
    wind: ChannelName | None = None
    """Channel of the wind speed, whose mean says which hours of `[loads.wind]` a file has."""
    skip_s: q.SkippedS | None = None
    """Beginning of a series that is left out, such as a start from rest; 0 for none, to be stated."""
    torque: ChannelName | None = None
    """Channel of the torque on the body; in tables with commas `BODY_N_m` by default."""
    speed: ChannelName | None = None
    """Channel of the speed of the body; in tables with commas `BODY_rpm` by default."""
    hub_forces: Annotated[tuple[ChannelName, ChannelName, ChannelName], Field(strict=False)] | None = None
    """Channels of the force on the body along x, y and z of the gearbox, axes that stand still; `-` before a name turns
    its sense."""
    hub_moments: Annotated[tuple[ChannelName, ChannelName], Field(strict=False)] | None = None
    """Channels of the moments on the body about x and y, likewise."""
    torque_factor: q.ChannelFactor = 1.0
    """Factor on the torque: a sign for the sense of the body, or the scale of another machine."""
    hub_factor: q.ChannelFactor = 1.0
    """Factor on forces and moments of the hub."""
    speed_factor: q.ChannelFactor = 1.0
    """Factor on the speed."""
    partial_factor: q.PartialFactor | None = None
    """Factor of safety on the loads of an extreme source."""

    @model_validator(mode="after")
    def _how_often(self) -> SourceSection:
        ways = ("hours_per_year", "events_per_year", "hours_table", "wind")
        given = sum(getattr(self, way) is not None for way in ways)
        if (self.file is None) == (self.files is None):
            raise ValueError("a source requires file or files; set one of them")
        if self.hours_table is not None and self.files is None:
            raise ValueError("hours_table applies to files; set hours_per_year for a single file")
        counted = self.file is not None and self.file.lower().endswith(".csv") and not given
        if self.kind == "fatigue" and given != 1 and not counted:
            raise ValueError(f"a fatigue source requires one of {', '.join(ways)}")
        if self.kind == "fatigue" and self.partial_factor is not None:
            raise ValueError("partial_factor applies to extreme sources only; remove the key")
        if self.kind == "extreme" and (given or self.partial_factor is None):
            raise ValueError(f"an extreme source requires partial_factor, and none of {', '.join(ways)}")
        if 0.0 in (self.torque_factor, self.speed_factor):
            raise ValueError("torque_factor and speed_factor must not be 0")
        return self


class LoadsSection(Section):
    """Loads over the life of the gearbox, from files of turbines or test benches."""

    body: Name
    """Body on which the torques act, with whose speed they turn."""
    life_years: q.LifeYears
    """Time for which the gearbox is rated."""
    bins: q.LoadBins = 64
    """Bins of torque of either sign, from zero to the largest."""
    bin_value: Literal["mean", "upper"] = "mean"
    """Torque that stands for a bin: the mean of its revolutions, or its upper edge, which adds damage."""
    wind: WindSection | None = None
    """Wind of the site, for sources that name its channel."""
    sources: Annotated[Entries[SourceSection], Field(min_length=1)]
    """Files by name."""

    @model_validator(mode="after")
    def _wind(self) -> LoadsSection:
        asked = [name for name, source in self.sources.items() if source.wind is not None]
        if asked and self.wind is None:
            raise ValueError(f"sources.{asked[0]}.wind requires the section [loads.wind] with mean_m_per_s")
        if self.wind is not None and not asked:
            raise ValueError("wind: no source has a channel of the wind speed; set wind = ... in a source")
        return self


class StrengthSection(Section):
    """What a gear withstands, by ISO 6336; numbers of its material from ISO 6336-5 or from tests."""

    sigma_H_lim_MPa: q.StressMPa
    """Allowable stress number for contact."""
    sigma_F_lim_MPa: q.StressMPa
    """Nominal stress number for bending; the plain test gear withstands twice as much (Y_ST = 2)."""
    curve: Literal["case_hardened", "through_hardened"] | None = None
    """S-N curves by name, those of ISO 6336-6; or the next two keys. The name says whose running in, notch sensitivity
    and size factor count by the standard; those of case-hardened steel with own curves."""
    contact_curve: Curve | None = None
    """Life factor Z_NT over load cycles."""
    bending_curve: Curve | None = None
    """Life factor Y_NT over load cycles."""
    roughness_Rz_um: q.RoughnessUm | None = None
    """Mean peak-to-valley roughness Rz of the flanks; or the next key."""
    roughness_Ra_um: q.MeanRoughnessUm | None = None
    """Arithmetic mean roughness Ra of the flanks; Rz is six times as much (ISO 6336-2)."""
    root_factor: q.StrengthFactor | None = None
    """Product of the relative notch sensitivity, surface and size factors of the root (Y_drelT Y_RrelT Y_X); or the
    next key."""
    root_roughness_Rz_um: q.RoughnessUm | None = None
    """Roughness Rz of the roots, from which these factors follow by ISO 6336-3."""
    tolerance_class: q.ToleranceClass | None = None
    """Flank tolerance class (ISO 1328-1:2013) of the gear; load factors by the standard need that of both gears."""
    mean_stress_factor: q.StrengthFactor | None = None
    """Y_M of gears whose teeth bend both ways, such as planets and idlers; they need it."""

    @model_validator(mode="before")
    @classmethod
    def _renamed(cls, content: Any) -> Any:
        if isinstance(content, dict) and "roughness_um" in content:
            raise ValueError(
                f"roughness_um = {content['roughness_um']}: renamed; set roughness_Rz_um, or roughness_Ra_um for Ra"
            )
        return content

    @model_validator(mode="after")
    def _roughness(self) -> StrengthSection:
        if (self.roughness_Rz_um is None) == (self.roughness_Ra_um is None):
            raise ValueError("set one of roughness_Rz_um and roughness_Ra_um")
        if (self.root_factor is None) == (self.root_roughness_Rz_um is None):
            raise ValueError("set one of root_factor and root_roughness_Rz_um")
        return self

    @model_validator(mode="after")
    def _curves(self) -> StrengthSection:
        own = (self.contact_curve is not None, self.bending_curve is not None)
        if (self.curve is None) != all(own) or (self.curve is not None and any(own)):
            raise ValueError("set curve, or contact_curve and bending_curve")
        for key in ("contact_curve", "bending_curve"):
            points = getattr(self, key) or ()
            cycles = [point[0] for point in points]
            factors = [point[1] for point in points]
            if cycles != sorted(set(cycles)) or factors != sorted(factors, reverse=True):
                raise ValueError(f"{key}: cycles must increase and factors must not increase")
        return self


class RatingSection(Section):
    """How gears are rated, and what they withstand."""

    edition: Literal["ISO 6336:2019", "ISO 6336:2006"] = "ISO 6336:2019"
    """Edition of the standard, named in every output; its year alone is enough. The rating sheet shows what differs by
    more than 1 % in the other edition."""
    f_ZCa: q.AuxiliaryFactor | None = None
    """Auxiliary factor of the contact stress of helical gears (ISO 6336-2:2019), of pairs of which a gear has a
    `modification`: less than 1.2 where that suits load and deformation. Others have 1.2."""
    dynamic_factor: q.LoadFactorK | None = None
    """K_v of all meshes, as stated; or one of the next two keys and the least one."""
    dynamic_factor_run: Name | None = None
    """Load case whose run gives K_v over speed: largest over mean force of each mesh within 20 cycles."""
    dynamic_factor_steady: Literal["linear", "parametric", "nonlinear"] | None = None
    """Level of the steady response that gives K_v over speed, by the same windows."""
    minimum_dynamic_factor: q.LoadFactorK | None = None
    """Least K_v beside a run or a response: without errors of the wheels these have too little."""
    application_factor: q.LoadFactorK = 1.0
    """K_A on the nominal load of `exugear check --rating`, where there is no section `[loads]`: counted loads have what
    they have."""
    nominal_hours: q.NominalHours | None = None
    """Hours at that load and rated speed; without them the longest life of the S-N curves is asked for."""
    viscosity_40_mm2_per_s: q.Viscosity | None = None
    """Kinematic viscosity of the oil at 40 degrees Celsius, where there is no section `[lubricant]`."""
    carrier_angles: q.CarrierAngles = 12
    """Angles of the input at which the static balance is taken."""
    gears: Entries[StrengthSection] = {}
    """What gears withstand, by name of the gear; others are not rated."""
    minimum_S_H: q.SafetyFactor = 1.0
    """Safety against pitting that is asked for, over the life and under the largest load; rules for machines ask for
    more than 1."""
    minimum_S_F: q.SafetyFactor = 1.0
    """Safety against breakage that is asked for, likewise."""
    minimum_S_0: q.SafetyFactor = 1.0
    """Static safety of bearings that is asked for."""

    @field_validator("edition", mode="before")
    @classmethod
    def _edition_of_year(cls, value: Any) -> Any:
        return f"ISO 6336:{value}" if str(value) in ("2006", "2019") else value

    @model_validator(mode="after")
    def _edition(self) -> RatingSection:
        if self.f_ZCa is not None and self.edition == "ISO 6336:2006":
            raise ValueError(
                f"f_ZCa = {self.f_ZCa:g}: {self.edition} does not have this factor; remove the key, or set edition"
            )
        return self

    @model_validator(mode="after")
    def _dynamic_factor(self) -> RatingSection:
        sources = (self.dynamic_factor, self.dynamic_factor_run, self.dynamic_factor_steady)
        stated = self.dynamic_factor is not None
        least = self.minimum_dynamic_factor is not None
        if sum(source is not None for source in sources) != 1 or stated == least:
            raise ValueError(
                "set dynamic_factor, or minimum_dynamic_factor with dynamic_factor_run or dynamic_factor_steady"
            )
        return self


# Section on the oil of a gearbox: what flanks and bearings are rated with

Cleanliness = Literal["extreme", "high", "normal", "slight", "typical", "severe", "very_severe"]


class LubricantSection(Section):
    """The oil of the gearbox."""

    viscosity_40_mm2_per_s: q.Viscosity
    """Kinematic viscosity at 40 degrees Celsius."""
    viscosity_100_mm2_per_s: q.HotViscosity | None = None
    """Kinematic viscosity at 100 degrees Celsius; modified lives of bearings need it."""
    temperature_C: q.OilTemperature | None = None
    """Of the oil in service; modified lives of bearings need it."""
    cleanliness: Cleanliness | None = None
    """How clean it is by ISO 281:2007, table 13, where `slight` to `severe` are degrees of contamination; modified
    lives of bearings need it."""

    @model_validator(mode="after")
    def _viscosities(self) -> LubricantSection:
        hot = self.viscosity_100_mm2_per_s
        if hot is not None and hot >= self.viscosity_40_mm2_per_s:
            raise ValueError(
                f"viscosity_100_mm2_per_s = {hot:g} must be below viscosity_40_mm2_per_s = "
                f"{self.viscosity_40_mm2_per_s:g}"
            )
        return self
