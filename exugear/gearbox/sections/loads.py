"""Sections on life loads and rating: loads over the life of a gearbox, strength of its gears, and its oil."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from exugear.gearbox.sections import entries as q
from exugear.gearbox.sections.entries import Entries, FileName, Name, Section, Text

ChannelName = Annotated[str, Field(pattern=r"^[^\x00-\x1f\x7f]+$", max_length=100)]
"""Name of a channel in a load file; upper and lower case are equivalent."""
_CurvePoint = Annotated[tuple[q.LoadCycles, q.LifeFactor], Field(strict=False)]
Curve = Annotated[tuple[_CurvePoint, ...], Field(strict=False, min_length=2, max_length=20)]
"""Life factor over load cycles, interpolated linearly in logarithms."""


FilePattern = Annotated[str, Field(pattern=r"^[^\x00-\x1f\x7f]+$", max_length=1000)]
"""File names below the folder of the gearbox file, with the wildcards `*` and `?`."""


_Torques = Annotated[tuple[q.TorqueNm, ...], Field(strict=False, min_length=1, max_length=1000)]
_Speeds = Annotated[tuple[q.SpeedRpm, ...], Field(strict=False, min_length=1, max_length=1000)]
_Hours = Annotated[tuple[q.NominalHours, ...], Field(strict=False, min_length=1, max_length=1000)]


class WindSection(Section):
    """Weibull distribution of the wind speed, for load files of one wind speed each."""

    mean_m_per_s: q.WindSpeed
    """Long-term mean of the wind speed."""
    shape: q.WeibullShape = 2.0
    """Shape parameter of the distribution; 2 is a Rayleigh distribution."""
    bin_m_per_s: q.WindSpeed = 2.0
    """Width of the wind speed bins, the first centred at 0; files of one bin share its hours in proportion to their
    length.
    """
    hours_per_year: q.HoursPerYear = q.HOURS_PER_YEAR
    """Total hours of all wind speeds."""


class SourceSection(Section):
    """One load file, many of one kind, or operating points, and their duration or number of occurrences per year."""

    file: FileName | None = None
    """OpenFAST output (`.outb`, `.out`), a table (`.csv`) or load cases (`.rexs`), in the folder of the gearbox file.
    """
    files: FilePattern | None = None
    """Many time series instead, such as `dlc/*.outb`: all matching files, with identical channels."""
    torque_N_m: _Torques | None = None
    """Operating points instead of a file: torques on the body, with `speed_rpm` and `hours` of the same length."""
    speed_rpm: _Speeds | None = None
    """Speed of the body at each operating point."""
    hours: _Hours | None = None
    """Hours of each operating point in the whole life; with `hours_per_year` they are relative."""
    kind: Literal["fatigue", "extreme"] = "fatigue"
    """Whether the source contributes to fatigue damage, or only its extreme values are used."""
    case: Text = ""
    """Description for the user, such as the design load case."""
    hours_per_year: q.HoursPerYear | None = None
    """Hours per year, for many files shared in proportion to their length; or one of the next keys. Not needed for a
    table of counted loads, whose hours are then those of the life.
    """
    events_per_year: q.EventsPerYear | None = None
    """Number of occurrences of each file per year, as a whole after the skipped part."""
    hours_table: FileName | None = None
    """Table `file,hours_per_year` with a row for each of `files`, by its name without folder."""
    wind: ChannelName | None = None
    """Channel of the wind speed; its mean assigns the file to the hours of `[loads.wind]`."""
    skip_s: q.SkippedS | None = None
    """Skipped part at the start of a time series, such as a start-up; required, 0 for none."""
    torque: ChannelName | None = None
    """Channel of the torque on the body; in CSV tables `BODY_N_m` by default."""
    speed: ChannelName | None = None
    """Channel of the speed of the body; in CSV tables `BODY_rpm` by default."""
    hub_forces: Annotated[tuple[ChannelName, ChannelName, ChannelName], Field(strict=False)] | None = None
    """Channels of the force on the body along x, y and z of the gearbox, in stationary axes; a `-` before a name
    reverses the sign.
    """
    hub_moments: Annotated[tuple[ChannelName, ChannelName], Field(strict=False)] | None = None
    """Channels of the moments on the body about x and y, with the same conventions."""
    torque_factor: q.ChannelFactor = 1.0
    """Factor on the torque: a sign for the sense of rotation, or the scale of another machine."""
    hub_factor: q.ChannelFactor = 1.0
    """Factor on forces and moments of the hub."""
    speed_factor: q.ChannelFactor = 1.0
    """Factor on the speed."""
    partial_factor: q.PartialFactor | None = None
    """Partial safety factor on the loads of an extreme source."""

    @model_validator(mode="after")
    def _how_often(self) -> SourceSection:
        ways = ("hours_per_year", "events_per_year", "hours_table", "wind")
        given = sum(getattr(self, way) is not None for way in ways)
        points = (self.torque_N_m, self.speed_rpm, self.hours)
        stated = [point for point in points if point is not None]
        if (self.file is not None) + (self.files is not None) + bool(stated) != 1:
            raise ValueError("a source requires file, files, or torque_N_m with speed_rpm and hours; set one of them")
        if stated and len({len(own) for own in stated}) + len(points) - len(stated) != 1:
            raise ValueError("torque_N_m, speed_rpm and hours must be stated together, with as many values")
        if self.hours_table is not None and self.files is None:
            raise ValueError("hours_table applies to files; set hours_per_year for a single file")
        table = bool(stated) or (self.file is not None and self.file.lower().endswith(".csv"))
        counted = table and not given
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
    """Loads over the life of the gearbox, from files of wind turbine simulations or test benches."""

    body: Name
    """Body on which the torques act, and to which the speeds belong."""
    life_years: q.LifeYears
    """Design life of the gearbox."""
    bins: q.LoadBins = 64
    """Number of torque bins for each sign, from zero to the maximum."""
    bin_value: Literal["mean", "upper"] = "mean"
    """Torque that represents a bin: the mean over its revolutions, or its upper edge, which is conservative."""
    hub_z_mm: q.PlaceMm | None = None
    """Position along the axis of the body at which hub forces and moments act. By default it is the centre of mass of a
    rigid body and the main seat of a flexible one."""
    wind: WindSection | None = None
    """Wind distribution of the site, for sources with a wind channel."""
    sources: Annotated[Entries[SourceSection], Field(min_length=1)]
    """Load files by name."""

    @model_validator(mode="after")
    def _wind(self) -> LoadsSection:
        asked = [name for name, source in self.sources.items() if source.wind is not None]
        if asked and self.wind is None:
            raise ValueError(f"sources.{asked[0]}.wind requires the section [loads.wind] with mean_m_per_s")
        if self.wind is not None and not asked:
            raise ValueError("wind: no source has a channel of the wind speed; set wind = ... in a source")
        return self

    @model_validator(mode="after")
    def _hub(self) -> LoadsSection:
        with_hub = any(source.hub_forces or source.hub_moments for source in self.sources.values())
        if self.hub_z_mm is not None and not with_hub:
            raise ValueError(
                f"hub_z_mm = {self.hub_z_mm:g}: no source has hub loads; set hub_forces or hub_moments in a source"
            )
        return self

    @model_validator(mode="after")
    def _hours(self) -> LoadsSection:
        yearly = sum(
            sum(source.hours or ()) / self.life_years if source.hours_per_year is None else source.hours_per_year
            for source in self.sources.values()
        )
        if yearly > q.HOURS_PER_YEAR * (1.0 + 1e-9):
            raise ValueError(
                f"sources: {yearly:.6g} hours per year in total; a year has {q.HOURS_PER_YEAR:g}: reduce hours or "
                "hours_per_year, or increase life_years"
            )
        return self


class StrengthSection(Section):
    """Strength of a gear according to ISO 6336; material data from ISO 6336-5 or from tests."""

    sigma_H_lim_MPa: q.StressMPa
    """Allowable stress number for contact."""
    sigma_F_lim_MPa: q.StressMPa
    """Nominal stress number for bending; the strength of the unnotched test gear is twice as large (Y_ST = 2)."""
    curve: Literal["case_hardened", "through_hardened"] | None = None
    """S-N curves of ISO 6336-6 by name; or the next two keys. The name also selects the method for running-in, notch
    sensitivity and size factor; own curves use that of case-hardened steel.
    """
    contact_curve: Curve | None = None
    """Life factor Z_NT over load cycles."""
    bending_curve: Curve | None = None
    """Life factor Y_NT over load cycles."""
    roughness_Rz_um: q.RoughnessUm | None = None
    """Mean peak-to-valley roughness Rz of the flanks; or the next key."""
    roughness_Ra_um: q.MeanRoughnessUm | None = None
    """Arithmetic mean roughness Ra of the flanks; Rz is taken as six times Ra (ISO 6336-2)."""
    root_factor: q.StrengthFactor | None = None
    """Product of the relative notch sensitivity, surface and size factors of the root (Y_drelT Y_RrelT Y_X); or the
    next key."""
    root_roughness_Rz_um: q.RoughnessUm | None = None
    """Roughness Rz of the roots, from which these factors follow according to ISO 6336-3."""
    tolerance_class: q.ToleranceClass | None = None
    """Flank tolerance class (ISO 1328-1:2013) of the gear; load factors according to the standard require it for both
    gears.
    """
    mean_stress_factor: q.StrengthFactor | None = None
    """Mean stress factor Y_M, required for gears with reversed tooth bending, such as planets and idler gears."""

    @model_validator(mode="after")
    def _roughness(self) -> StrengthSection:
        if (self.roughness_Rz_um is None) == (self.roughness_Ra_um is None):
            raise ValueError("set one of roughness_Rz_um and roughness_Ra_um")
        if (self.root_factor is None) == (self.root_roughness_Rz_um is None):
            raise ValueError("set one of root_factor and root_roughness_Rz_um")
        return self

    @model_validator(mode="after")
    def _curves(self) -> StrengthSection:
        curves = (self.contact_curve is not None, self.bending_curve is not None)
        if (self.curve is None) != all(curves) or (self.curve is not None and any(curves)):
            raise ValueError("set curve, or contact_curve and bending_curve")
        for key in ("contact_curve", "bending_curve"):
            points = getattr(self, key) or ()
            cycles = [point[0] for point in points]
            factors = [point[1] for point in points]
            if cycles != sorted(set(cycles)) or factors != sorted(factors, reverse=True):
                raise ValueError(f"{key}: cycles must increase and factors must not increase")
        return self


class RatingSection(Section):
    """Rating settings and the strength of the gears."""

    edition: Literal["ISO 6336:2019", "ISO 6336:2006"] = "ISO 6336:2019"
    """Edition of the standard, listed in every output; the year (2019, 2006) is also accepted. The rating sheet also
    lists values that differ by more than 1 % in the other edition."""
    f_ZCa: q.AuxiliaryFactor | None = None
    """Auxiliary factor of the contact stress of helical gears (ISO 6336-2:2019) for pairs with a `modification`; less
    than 1.2 requires a modification that suits load and deflection. Other helical gears have 1.2."""
    dynamic_factor: q.LoadFactorK | None = None
    """Specified K_v of all meshes for `exugear life`; or one of the next two keys together with
    `minimum_dynamic_factor`. The rating sheet takes it only for pairs without `tolerance_class` of both gears; of other
    pairs it computes K_v to method B."""
    dynamic_factor_run: Name | None = None
    """Load case whose run determines K_v over speed: maximum divided by mean force of each mesh within 20 cycles."""
    dynamic_factor_steady: Literal["linear", "parametric", "nonlinear"] | None = None
    """Method of the steady-state response that determines K_v over speed, with the same windows."""
    minimum_dynamic_factor: q.LoadFactorK | None = None
    """Minimum K_v with a run or steady-state response: without deviations of the gears these underestimate K_v."""
    application_factor: q.LoadFactorK = 1.0
    """K_A on the nominal load of `exugear check --rating` without a section `[loads]`; counted loads already include
    it.
    """
    nominal_hours: q.NominalHours | None = None
    """Hours at nominal load and rated speed; by default the longest life of the S-N curves is required."""
    viscosity_40_mm2_per_s: q.Viscosity | None = None
    """Kinematic viscosity of the oil at 40 degrees Celsius, if there is no section `[lubricant]`."""
    carrier_angles: q.CarrierAngles = 12
    """Number of input angles at which the static equilibrium is solved."""
    gears: Entries[StrengthSection] = {}
    """Strength of gears, by name of the gear; other gears are not rated."""
    minimum_S_H: q.SafetyFactor = 1.0
    """Required safety factor for pitting, over the life and under the maximum load; machine-specific standards require
    more than 1.
    """
    minimum_S_F: q.SafetyFactor = 1.0
    """Required safety factor for tooth root breakage, over the life and under the maximum load."""
    minimum_S_0: q.SafetyFactor = 1.0
    """Required static safety factor of bearings."""

    @field_validator("edition", mode="before")
    @classmethod
    def _edition_of_year(cls, value: Any) -> Any:
        return f"ISO 6336:{value}" if str(value) in ("2006", "2019") else value

    @model_validator(mode="after")
    def _edition(self) -> RatingSection:
        if self.f_ZCa is not None and self.edition == "ISO 6336:2006":
            raise ValueError(
                f"f_ZCa = {self.f_ZCa:g}: {self.edition} does not have this factor; remove the key or set edition"
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


Cleanliness = Literal["extreme", "high", "normal", "slight", "typical", "severe", "very_severe"]


class LubricantSection(Section):
    """The oil of the gearbox."""

    viscosity_40_mm2_per_s: q.Viscosity
    """Kinematic viscosity at 40 degrees Celsius."""
    viscosity_100_mm2_per_s: q.HotViscosity | None = None
    """Kinematic viscosity at 100 degrees Celsius; required for modified bearing life."""
    temperature_C: q.OilTemperature | None = None
    """Temperature of the oil in service; required for modified bearing life."""
    ambient_C: q.OilTemperature | None = None
    """Ambient temperature: the oil temperature follows from it and the losses; instead of `temperature_C`."""
    conductance_W_per_K: q.HeatConductance | None = None
    """Heat flow from the oil to the surroundings per kelvin, of housing and cooler; with `ambient_C`."""
    density_15_kg_per_m3: q.OilDensity | None = None
    """Density of the oil at 15 degrees Celsius; 890 kg/m3 by default."""
    cleanliness: Cleanliness | None = None
    """Cleanliness according to ISO 281:2007, table 13, where `slight` to `severe` are degrees of contamination;
    required for modified bearing life.
    """

    @model_validator(mode="after")
    def _viscosities(self) -> LubricantSection:
        if (self.ambient_C is None) != (self.conductance_W_per_K is None):
            raise ValueError("set ambient_C and conductance_W_per_K together, or neither")
        if self.ambient_C is not None and self.temperature_C is not None:
            raise ValueError("temperature_C and ambient_C exclude each other; remove one of them")
        hot = self.viscosity_100_mm2_per_s
        if hot is not None and hot >= self.viscosity_40_mm2_per_s:
            raise ValueError(
                f"viscosity_100_mm2_per_s = {hot:g} must be below viscosity_40_mm2_per_s = "
                f"{self.viscosity_40_mm2_per_s:g}"
            )
        return self
