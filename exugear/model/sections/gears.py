"""Sections on gears: geometry, material, modification, pairs, errors of wheels and of planets' pins."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from exugear.model.sections import quantities as q
from exugear.model.sections.entries import FileName, Name, Section


class RackSection(Section):
    """Basic rack of one gear, as factors of the normal module (ISO 53)."""

    addendum: q.RackHeight = 1.0
    dedendum: q.RackHeight = 1.25
    tip_radius: q.RackRadius = 0.38


class MaterialSection(Section):
    """Elastic material of a gear."""

    youngs_modulus_GPa: q.YoungsModulusGPa = 206.0
    poissons_ratio: q.PoissonsRatio = 0.3
    density_kg_per_m3: q.Density = 7850.0


class ModificationSection(Section):
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


class GearSection(Section):
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


class PairSection(Section):
    """Two gears that mesh: `pinion` is the smaller one (the planet against a ring)."""

    pinion: Name
    gear: Name
    centre_distance_mm: q.LengthMm
    table: bool = True


class DeviationSection(Section):
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


class PinSection(Section):
    """Position error of a planet's pin in its carrier."""

    body: Name
    radial_um: q.PlaceErrorUm = 0.0
    tangential_um: q.PlaceErrorUm = 0.0
