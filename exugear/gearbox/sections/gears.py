"""Sections on gears: geometry, material, modification, pairs, errors of wheels and of planets' pins."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from exugear.gearbox.sections import entries as q
from exugear.gearbox.sections.entries import FileName, Name, Section


class RackSection(Section):
    """Basic rack of one gear, as factors of the normal module (ISO 53)."""

    addendum: q.RackHeight = 1.0
    """Height of the gear's tooth above the reference line, in normal modules."""
    dedendum: q.RackHeight = 1.25
    """Depth of the gear's tooth below the reference line, in normal modules."""
    tip_radius: q.RackRadius = 0.38
    """Radius at the tip of the tool's tooth, in normal modules: it makes the root fillet."""


class CutterSection(Section):
    """Pinion-type cutter that generates the root fillet of a ring; without it this is an arc of the rack's radius.

    Its normal module, pressure angle and helix angle are those of the ring. Give its tip by one of two keys, or by
    neither: it then reaches the root circle of the ring, which `root_diameter_mm` or the rack says.
    """

    teeth: q.Teeth
    """Number of its teeth (z_0)."""
    tip_radius: q.RackRadius
    """Radius that rounds the tips of its teeth in the transverse section, in normal modules (rho_a0*)."""
    profile_shift: q.ProfileShift = 0.0
    """Its profile shift (x_0) in normal modules; it falls as the cutter is ground again."""
    addendum: q.RackHeight | None = None
    """Height of its teeth above its reference line (h_a0*) in normal modules."""
    tip_diameter_mm: q.LengthMm | None = None
    """Its tip diameter (d_a0) instead."""

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
    """Roll length from the tip over which it is removed; or the next key."""
    tip_relief_start_roll_deg: q.RollAngleDeg | None = None
    """Roll angle at which the tip relief begins."""
    tip_relief_shape: Literal["linear", "parabolic"] = "linear"
    """How it grows towards the tip."""
    root_relief_um: q.RemovedUm = 0.0
    """Material removed at the root."""
    root_relief_length_mm: q.RollLengthMm | None = None
    """Roll length from the root form circle over which it is removed; or the next key."""
    root_relief_start_roll_deg: q.RollAngleDeg | None = None
    """Roll angle at which the root relief begins."""
    root_relief_shape: Literal["linear", "parabolic"] = "linear"
    """How it grows towards the root."""
    profile_crowning_um: q.RemovedUm = 0.0
    """Material removed at tip and root by a parabola over the roll length."""
    lead_crowning_um: q.RemovedUm = 0.0
    """Material removed at both ends by a parabola over the face."""
    profile_slope_um: q.SlopeUm = 0.0
    """Material removed at the tip by a straight line over the roll length; negative: at the root."""
    helix_slope_um: q.SlopeUm = 0.0
    """Material removed at the +z end by a straight line over the face; negative: at the -z end."""
    twist_um: q.SlopeUm = 0.0
    """Helix slope at the tip less that at the root."""
    topography: FileName | None = None
    """CSV file of material removed over radius and face, beside the gearbox file."""

    @property
    def removes_material(self) -> bool:
        """Whether any of the amounts differs from zero."""
        amounts = (value for key, value in self if key.endswith("_um"))
        return self.topography is not None or any(amounts)

    @model_validator(mode="after")
    def _starts(self) -> ModificationSection:
        for kind in ("tip", "root"):
            given = (getattr(self, f"{kind}_relief_length_mm"), getattr(self, f"{kind}_relief_start_roll_deg"))
            wanted = 1 if getattr(self, f"{kind}_relief_um") > 0.0 else 0
            if sum(value is not None for value in given) != wanted:
                raise ValueError(
                    f"a {kind} relief requires {kind}_relief_um and one of {kind}_relief_length_mm and {kind}"
                    "_relief_start_roll_deg"
                )
        return self


class ToothThicknessSection(Section):
    """Allowances of the tooth thickness on the reference circle, normal section, negative (DIN 3967: A_sne, A_sni).

    Teeth are computed with their mean: it thins them by its amount over the cosine of the helix angle in the transverse
    section. The ends give the least and the greatest backlash that `exugear check` tells.
    """

    upper_allowance_um: q.AllowanceUm
    """Upper allowance, nearer to zero: of the thickest tooth."""
    lower_allowance_um: q.AllowanceUm | None = None
    """Lower allowance, of the thinnest tooth; or the next key."""
    tolerance_um: q.AllowanceRangeUm | None = None
    """Tolerance, the upper less the lower allowance (DIN 3967: T_sn), instead of the lower one."""

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
    """One toothed wheel; helix angle signed, right hand positive."""

    teeth: q.Teeth
    """Number of teeth, positive for rings, too."""
    normal_module_mm: q.ModuleMm
    """Normal module."""
    normal_pressure_angle_deg: q.PressureAngleDeg = 20.0
    """Normal pressure angle."""
    helix_angle_deg: q.HelixAngleDeg = 0.0
    """Helix angle at the reference circle; right hand positive, a ring as the planet that it meshes with."""
    profile_shift: q.ProfileShift = 0.0
    """Profile shift in normal modules; positive for a larger gear, of a ring as well."""
    profile_shift_from_centre_distance: bool = False
    """Whether the profile shift is the one that leaves no backlash at the centre distance, beside that of the mate."""
    face_width_mm: q.FaceWidthMm
    """Width of the teeth."""
    held_diameter_mm: q.LengthMm
    """Where the finite-element model is held: bore of a gear, outside of a ring's rim."""
    internal: bool = False
    """Whether it is a ring with teeth inside."""
    tooth_thinning_mm: q.ThinningMm = 0.0
    """Tooth thickness taken off on the reference circle, for backlash."""
    tooth_thickness: ToothThicknessSection | None = None
    """Allowances of the tooth thickness instead."""
    tip_diameter_mm: q.LengthMm | None = None
    """Tip diameter; from rack and profile shift by default."""
    fitted_tip: bool = False
    """Whether the tip is shortened as far as mates ask for: the rack's clearance, and room above their fillets."""
    root_diameter_mm: q.LengthMm | None = None
    """Root diameter; from rack and profile shift by default."""
    tip_form_diameter_mm: q.LengthMm | None = None
    """Where a chamfer or rounding ends the flank at the tip (d_Fa); the tip diameter by default. Contact ends there."""
    tip_chamfer_mm: q.ChamferMm = 0.0
    """Height of a chamfer at the tip, instead of the form diameter there."""
    root_form_diameter_mm: q.LengthMm | None = None
    """Where the flank ends at the root (d_Ff), if before its fillet begins, as after grinding. Contact ends there."""
    rack: RackSection = RackSection()
    """Basic rack, ISO 53 A by default."""
    cutter: CutterSection | None = None
    """Cutter of a ring, which makes its root fillet."""
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
    """Mesh stiffness that the file states, for textbook models: no table is computed of its pair.

    It is that of the whole face on the transverse line of action, force over deflection: constant, as a Fourier
    series over the mesh cycle, or as values over it.
    """

    mean_N_per_m: q.MeshStiffness | None = None
    """Mean over the mesh cycle; alone it is constant."""
    cosine_N_per_m: _Waves = ()
    """Cosine waves about the mean, first order first; at zero a loaded flank stands in the pitch point."""
    sine_N_per_m: _Waves = ()
    """Sine waves about the mean likewise."""
    over_cycle_N_per_m: _Cycle | None = None
    """Values at equal distances over the mesh cycle from zero on instead, joined by a smooth curve."""

    @model_validator(mode="after")
    def _form(self) -> MeshStiffnessSection:
        if (self.mean_N_per_m is None) == (self.over_cycle_N_per_m is None):
            raise ValueError("set mean_N_per_m, with or without harmonics, or over_cycle_N_per_m")
        waves = [key for key in ("cosine_N_per_m", "sine_N_per_m") if getattr(self, key)]
        if self.over_cycle_N_per_m is not None and waves:
            raise ValueError(f"over_cycle_N_per_m cannot be combined with {', '.join(waves)}; remove one of them")
        return self


class PairSection(Section):
    """Two gears that mesh.

    Gear 1 of tables and results is the smaller one, the planet against a ring, whichever the file calls `pinion`.
    """

    pinion: Name
    """One gear, the smaller one by custom; the planet against a ring."""
    gear: Name
    """The other gear."""
    centre_distance_mm: q.LengthMm
    """Distance of the axes, positive for rings, too."""
    common_face_width_mm: q.FaceWidthMm | None = None
    """Width over which the faces touch, where that is less than the narrower face, as with chamfered ends."""
    table: bool = True
    """Whether it gets a table of the transmission error; false where its stiffness is stated."""
    stiffness: MeshStiffnessSection | None = None
    """Stiffness that the file states, in place of a table."""

    @model_validator(mode="after")
    def _one_source(self) -> PairSection:
        if self.stiffness is not None and self.table and "table" in self.model_fields_set:
            raise ValueError("table = true cannot be combined with a specified stiffness; remove one of them")
        return self


class DeviationSection(Section):
    """Errors of one wheel that return with each of its revolutions."""

    body: Name
    """Body that the wheel is on."""
    gear: Name | None = None
    """Wheel; may be left out where the body has one."""
    cumulative_pitch_um: Annotated[tuple[q.PitchUm, ...], Field(strict=False, max_length=2000)] = ()
    """Cumulative pitch deviation of each tooth (ISO 1328-1), positive into the tooth."""
    runout_um: q.RunoutUm = 0.0
    """Radial run-out, twice the eccentricity."""
    runout_angle_deg: q.AngleDeg = 0.0
    """Where the eccentricity points at zero angle."""

    @model_validator(mode="after")
    def _something(self) -> DeviationSection:
        if not self.cumulative_pitch_um and not self.runout_um:
            raise ValueError("set cumulative_pitch_um, one number for each tooth, or runout_um")
        return self


class PinSection(Section):
    """Position error of a planet's pin in its carrier."""

    body: Name
    """The planet, by its number: `planet_1`."""
    radial_um: q.PlaceErrorUm = 0.0
    """Displacement away from the carrier's axis."""
    tangential_um: q.PlaceErrorUm = 0.0
    """Displacement in the sense of +z rotation."""
