"""Sections on gears: geometry, material, modification, pairs, deviations of gears and planet pins."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from exugear.gearbox.sections import entries as q
from exugear.gearbox.sections.entries import FileName, Name, Section


class RackSection(Section):
    """Basic rack of one gear, as factors of the normal module (ISO 53)."""

    addendum: q.RackHeight = 1.0
    """Addendum of the gear's tooth in normal modules."""
    dedendum: q.RackHeight = 1.25
    """Dedendum of the gear's tooth in normal modules."""
    tip_radius: q.RackRadius = 0.38
    """Tip radius of the tool, which generates the root fillet, in normal modules."""


class CutterSection(Section):
    """Pinion-type cutter of a ring gear; without it the root fillet is an arc with the rack's tip radius.

    Normal module, pressure angle and helix angle are those of the ring gear. Specify the tip by at most one of two
    keys; by default it reaches the root circle of the ring gear, which follows from `root_diameter_mm` or the rack.
    """

    teeth: q.Teeth
    """Number of teeth of the cutter (z_0)."""
    tip_radius: q.RackRadius
    """Tip corner radius of the cutter in the transverse section, in normal modules (rho_a0*)."""
    profile_shift: q.ProfileShift = 0.0
    """Profile shift of the cutter (x_0) in normal modules; it decreases as the cutter is reground."""
    addendum: q.RackHeight | None = None
    """Addendum of the cutter (h_a0*) in normal modules."""
    tip_diameter_mm: q.LengthMm | None = None
    """Tip diameter of the cutter (d_a0), instead of the addendum."""

    @model_validator(mode="after")
    def _one_tip(self) -> CutterSection:
        if self.addendum is not None and self.tip_diameter_mm is not None:
            raise ValueError("set addendum or tip_diameter_mm, not both: each defines the tip of the cutter")
        return self


class MaterialSection(Section):
    """Elastic material."""

    youngs_modulus_GPa: q.YoungsModulusGPa = 206.0
    """Young's modulus."""
    poissons_ratio: q.PoissonsRatio = 0.3
    """Poisson's ratio."""
    density_kg_per_m3: q.Density = 7850.0
    """Density."""


class ModificationSection(Section):
    """Material removed from both flanks of every tooth; lengths in roll length, +z as in the gearbox."""

    tip_relief_um: q.RemovedUm = 0.0
    """Material removed at the tip."""
    tip_relief_length_mm: q.RollLengthMm | None = None
    """Roll length of the tip relief from the tip; or the next key."""
    tip_relief_start_roll_deg: q.RollAngleDeg | None = None
    """Roll angle at which the tip relief begins."""
    tip_relief_shape: Literal["linear", "parabolic"] = "linear"
    """Shape of the tip relief towards the tip."""
    root_relief_um: q.RemovedUm = 0.0
    """Material removed at the root."""
    root_relief_length_mm: q.RollLengthMm | None = None
    """Roll length of the root relief from the root form diameter; or the next key."""
    root_relief_start_roll_deg: q.RollAngleDeg | None = None
    """Roll angle at which the root relief begins."""
    root_relief_shape: Literal["linear", "parabolic"] = "linear"
    """Shape of the root relief towards the root."""
    profile_crowning_um: q.RemovedUm = 0.0
    """Material removed at tip and root by a parabola over the roll length."""
    lead_crowning_um: q.RemovedUm = 0.0
    """Material removed at both ends by a parabola over the face."""
    profile_slope_um: q.SlopeUm = 0.0
    """Material removed at the tip, linear over the roll length; negative: at the root."""
    helix_slope_um: q.SlopeUm = 0.0
    """Material removed at the +z end, linear over the face; negative: at the -z end."""
    twist_um: q.SlopeUm = 0.0
    """Difference of the helix slopes, tip minus root."""
    topography: FileName | None = None
    """CSV file of material removed over radius and face width, in the folder of the gearbox file."""

    @property
    def removes_material(self) -> bool:
        """Whether any of the amounts differs from zero."""
        amounts = (value for key, value in self if key.endswith("_um"))
        return self.topography is not None or any(amounts)

    @model_validator(mode="after")
    def _starts(self) -> ModificationSection:
        for kind in ("tip", "root"):
            given = (getattr(self, f"{kind}_relief_length_mm"), getattr(self, f"{kind}_relief_start_roll_deg"))
            starts = sum(value is not None for value in given)
            relieved = getattr(self, f"{kind}_relief_um") > 0.0
            # A study may vary the amount from zero, which is stated then.
            stated_zero = not relieved and f"{kind}_relief_um" in self.model_fields_set
            if starts > 1 or (relieved and not starts) or (starts and not relieved and not stated_zero):
                raise ValueError(
                    f"a {kind} relief requires {kind}_relief_um and one of {kind}_relief_length_mm and {kind}"
                    "_relief_start_roll_deg"
                )
        return self


class ToothThicknessSection(Section):
    """Allowances of the tooth thickness on the reference circle, normal section, negative (DIN 3967: A_sne, A_sni).

    Teeth are computed with the mean allowance, which thins them in the transverse section by its amount divided by the
    cosine of the helix angle. The limits determine the minimum and maximum backlash that `exugear check` reports.
    """

    upper_allowance_um: q.AllowanceUm
    """Upper allowance, closer to zero, for the thickest tooth."""
    lower_allowance_um: q.AllowanceUm | None = None
    """Lower allowance, for the thinnest tooth; or the next key."""
    tolerance_um: q.AllowanceRangeUm | None = None
    """Tolerance, upper minus lower allowance (DIN 3967: T_sn), instead of the lower allowance."""

    @model_validator(mode="after")
    def _two_ends(self) -> ToothThicknessSection:
        if (self.lower_allowance_um is None) == (self.tolerance_um is None):
            raise ValueError("set lower_allowance_um or tolerance_um in addition to upper_allowance_um")
        if self.lower_allowance_um is not None and self.lower_allowance_um > self.upper_allowance_um:
            raise ValueError(
                f"lower_allowance_um = {self.lower_allowance_um:g} must not be above upper_allowance_um = "
                f"{self.upper_allowance_um:g}: both are negative"
            )
        return self


class GearSection(Section):
    """One gear; helix angle signed, right hand positive."""

    teeth: q.Teeth
    """Number of teeth, positive for rings, too."""
    normal_module_mm: q.ModuleMm
    """Normal module."""
    normal_pressure_angle_deg: q.PressureAngleDeg = 20.0
    """Normal pressure angle."""
    helix_angle_deg: q.HelixAngleDeg = 0.0
    """Helix angle at the reference circle; right hand positive, for a ring gear as for the meshing planet."""
    profile_shift: q.ProfileShift = 0.0
    """Profile shift in normal modules; positive for a larger gear, also for a ring gear."""
    profile_shift_from_centre_distance: bool = False
    """Whether the profile shift follows from zero backlash at the centre distance, given that of the mating gear."""
    face_width_mm: q.FaceWidthMm
    """Face width."""
    held_diameter_mm: q.LengthMm
    """Diameter fixed in the finite-element model: bore of an external gear, outside of the rim of a ring gear. The body
    between it and the teeth deflects with them: with 20 and 30 mm instead of 45 and 90 mm, the mesh stiffness of the
    template `pair` is 399 instead of 743 N/µm.
    """
    internal: bool = False
    """Whether the gear is a ring gear with internal teeth."""
    tooth_thinning_mm: q.ThinningMm = 0.0
    """Reduction of the tooth thickness on the reference circle, for backlash."""
    tooth_thickness: ToothThicknessSection | None = None
    """Allowances of the tooth thickness, instead of the reduction."""
    tip_diameter_mm: q.LengthMm | None = None
    """Tip diameter; from rack and profile shift by default."""
    fitted_tip: bool = False
    """Whether the tip is shortened as far as mating gears require: tip clearance of the rack, distance to their
    fillets.
    """
    root_diameter_mm: q.LengthMm | None = None
    """Root diameter; from rack and profile shift by default."""
    tip_form_diameter_mm: q.LengthMm | None = None
    """Tip form diameter (d_Fa), at which a chamfer or rounding ends the flank; the tip diameter by default. Contact
    ends there.
    """
    tip_chamfer_mm: q.ChamferMm = 0.0
    """Height of a tip chamfer, instead of the tip form diameter."""
    root_form_diameter_mm: q.LengthMm | None = None
    """Root form diameter (d_Ff), if the flank ends before its fillet begins, as after grinding. Contact ends there."""
    rack: RackSection = RackSection()
    """Basic rack, ISO 53 A by default."""
    cutter: CutterSection | None = None
    """Cutter of a ring gear, which generates its root fillet."""
    material: MaterialSection = MaterialSection()
    """Elastic material, steel by default."""
    modification: ModificationSection | None = None
    """Material removed from both flanks of every tooth."""

    @model_validator(mode="after")
    def _one_tip_form(self) -> GearSection:
        if self.tip_form_diameter_mm is not None and self.tip_chamfer_mm:
            raise ValueError("set tip_form_diameter_mm or tip_chamfer_mm, not both: each defines the end of the flank")
        if self.profile_shift_from_centre_distance and self.profile_shift:
            raise ValueError("set profile_shift or profile_shift_from_centre_distance = true, not both")
        if self.tooth_thickness is not None and self.tooth_thinning_mm:
            raise ValueError(
                "set tooth_thinning_mm or a [.tooth_thickness] table, not both: each reduces the tooth thickness"
            )
        if self.cutter is not None and not self.internal:
            raise ValueError(
                "a cutter is for ring gears (internal = true); the root of other gears is generated by their rack"
            )
        own_tip = self.cutter is not None and {"addendum", "tip_diameter_mm"} & self.cutter.model_fields_set
        if own_tip and self.root_diameter_mm is not None:
            raise ValueError(f"root_diameter_mm follows from cutter.{min(own_tip)}; remove one of them")
        return self


_Waves = Annotated[tuple[q.MeshStiffnessWave, ...], Field(strict=False, max_length=100)]
_Cycle = Annotated[tuple[q.MeshStiffness, ...], Field(strict=False, min_length=2, max_length=2000)]


class MeshStiffnessSection(Section):
    """Mesh stiffness specified in the file, for textbook models; no table is computed for the pair.

    It is the stiffness of the whole face width, force divided by deflection along the transverse line of action. It is
    constant, a Fourier series over the mesh cycle, or sampled over the mesh cycle.
    """

    mean_N_per_m: q.MeshStiffness | None = None
    """Mean over the mesh cycle; without other keys the stiffness is constant."""
    cosine_N_per_m: _Waves = ()
    """Cosine amplitudes about the mean, first order first; at phase zero a loaded flank contacts at the pitch point."""
    sine_N_per_m: _Waves = ()
    """Sine amplitudes about the mean, first order first."""
    over_cycle_N_per_m: _Cycle | None = None
    """Samples at equal distances over the mesh cycle from zero, instead; they are interpolated smoothly."""

    @model_validator(mode="after")
    def _form(self) -> MeshStiffnessSection:
        if (self.mean_N_per_m is None) == (self.over_cycle_N_per_m is None):
            raise ValueError("set mean_N_per_m, with or without harmonics, or over_cycle_N_per_m")
        waves = [key for key in ("cosine_N_per_m", "sine_N_per_m") if getattr(self, key)]
        if self.over_cycle_N_per_m is not None and waves:
            raise ValueError(f"over_cycle_N_per_m cannot be combined with {', '.join(waves)}; remove one of them")
        return self


class PairSection(Section):
    """Two meshing gears.

    Gear 1 of tables and results is the smaller one, or the planet that meshes with a ring gear, whichever gear the file
    calls `pinion`.
    """

    pinion: Name
    """One gear, usually the smaller one; the planet if it meshes with a ring gear."""
    gear: Name
    """The other gear."""
    centre_distance_mm: q.LengthMm
    """Centre distance, positive also for ring gears."""
    common_face_width_mm: q.FaceWidthMm | None = None
    """Contact width of the faces, if smaller than the narrower face width, for example with chamfered ends."""
    table: bool = True
    """Whether a table of the transmission error is computed; false for a pair with specified stiffness."""
    stiffness: MeshStiffnessSection | None = None
    """Specified stiffness instead of a table."""

    @model_validator(mode="after")
    def _one_source(self) -> PairSection:
        if self.stiffness is not None and self.table and "table" in self.model_fields_set:
            raise ValueError("table = true cannot be combined with a specified stiffness; remove one of them")
        return self


class DeviationSection(Section):
    """Deviations of one gear that repeat with each revolution."""

    body: Name
    """Body of the gear."""
    gear: Name | None = None
    """Name of the gear; optional if the body has only one."""
    cumulative_pitch_um: Annotated[tuple[q.PitchUm, ...], Field(strict=False, max_length=2000)] = ()
    """Cumulative pitch deviation of each tooth (ISO 1328-1), positive into the tooth."""
    runout_um: q.RunoutUm = 0.0
    """Radial run-out, twice the eccentricity."""
    runout_angle_deg: q.AngleDeg = 0.0
    """Direction of the eccentricity at zero angle."""

    @model_validator(mode="after")
    def _something(self) -> DeviationSection:
        if not self.cumulative_pitch_um and not self.runout_um:
            raise ValueError("set cumulative_pitch_um, one number for each tooth, or runout_um")
        return self


class PinSection(Section):
    """Position error of a planet pin in its carrier."""

    body: Name
    """Planet by its number: `planet_1`."""
    radial_um: q.PlaceErrorUm = 0.0
    """Displacement away from the axis of the carrier."""
    tangential_um: q.PlaceErrorUm = 0.0
    """Displacement in the sense of +z rotation."""
