"""Cylindrical gears and the pairs they form: what cannot run is refused here, before any mesh is built.

All other properties follow from a few inputs, in `fe_ste.geometry.gear_relations` and `fe_ste.geometry.pair_relations`.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

from fe_ste.geometry.checks import check_gear, check_gear_pair
from fe_ste.geometry.gear_relations import BasicRack, GearInputs, Material
from fe_ste.geometry.involute import PinionCutter
from fe_ste.geometry.pair_relations import UncheckedPair
from fe_ste.tools.display import ReprMixin, TitledRows, value_range

__all__ = ["BasicRack", "Gear", "GearPair", "Material", "PinionCutter"]


@dataclass(frozen=True, kw_only=True)
class Gear(GearInputs, ReprMixin):
    """One cylindrical involute gear, external or internal, spur or helical.

    Parameters
    ----------
    name : str
        Name used in messages.
    teeth : int
        Number of teeth, positive also for an internal gear.
    normal_module : float
        m.
    normal_pressure_angle : float
        rad.
    helix_angle : float
        At the reference circle, rad; positive right hand, negative left hand, zero spur.
    profile_shift : float
        Profile shift coefficient, in *normal* modules. Positive is away from the axis for both kinds:
        it thickens an external tooth, and gives an internal gear the tooth spaces of an external gear
        of the same shift.
    face_width : float
        m.
    held_diameter : float
        Diameter of the cylinder held in the FE model, m: the hub of an external gear, the outside of an
        internal one.
    internal : bool
        Whether the teeth point inwards.
    rack : BasicRack
        Basic rack in normal modules.
    tip_diameter : float, optional
        m; from the rack and the profile shift if not given.
    root_diameter : float, optional
        m; if given, it replaces the dedendum of the rack.
    tooth_thinning : float
        Reduction of the transverse tooth thickness at the reference circle, m: this gear's part of the
        backlash.
    material : Material
        Elastic constants and density.
    tip_form_diameter : float, optional
        Where a chamfer or rounding of the tip ends the flank, m; the tip diameter if not given. Contact ends there,
        while the elastic tooth reaches to the tip.
    root_form_diameter : float, optional
        Where the flank ends towards the root, m, if that is before the root fillet begins. Contact ends there.
    cutter : PinionCutter, optional
        Pinion-type cutter that generates the root fillet of an internal gear; an arc of the rack's tip radius if not
        given. The root circle follows from the cutter's tip diameter where it has one.

    Raises
    ------
    GeometryError
        If a value makes no sense, the tip or the neck of an undercut tooth is thinner than 0.2 normal modules, or
        the root fillet does not fit.

    Examples
    --------
    >>> gear = Gear(name="pinion", teeth=50, normal_module=3e-3, face_width=20e-3, held_diameter=100e-3)
    >>> round(1e3 * gear.base_radius, 6), round(1e3 * gear.tip_radius, 6)
    (70.476947, 78.0)
    """

    def __post_init__(self) -> None:
        """Refuse what cannot be made."""
        check_gear(self)

    def mirrored(self) -> Gear:
        """Return the gear with the other hand of helix."""
        return dataclasses.replace(self, helix_angle=-self.helix_angle)

    def _line(self) -> str:
        kind = "internal, " if self.internal else ""
        return (
            f" {self.name!r}: {kind}{self.teeth} teeth, normal module {1e3 * self.normal_module:g} mm, "
            f"helix {math.degrees(self.helix_angle):.4g} deg, width {1e3 * self.face_width:g} mm"
        )

    def _table(self) -> TitledRows:
        return f"{'internal' if self.internal else 'external'} gear {self.name}", {
            "teeth": str(self.teeth),
            "normal module": value_range(self.normal_module, "mm", 1e3),
            "normal pressure angle": value_range(math.degrees(self.normal_pressure_angle), "deg"),
            "helix angle": f"{math.degrees(self.helix_angle):.6g} deg ({self.hand})",
            "profile shift": value_range(self.profile_shift, "normal modules"),
            "face width": value_range(self.face_width, "mm", 1e3),
            "tip, form and root diameter": ", ".join(
                value_range(radius, "mm", 2e3) for radius in (self.tip_radius, self.form_radius, self.root_radius)
            ),
            "held diameter": value_range(self.held_diameter, "mm", 1e3),
        }


@dataclass(frozen=True, kw_only=True)
class GearPair(UncheckedPair, ReprMixin):
    """Two gears on parallel axes.

    Parameters
    ----------
    name : str
        Name used in messages.
    centre_distance : float
        Operating centre distance, m, positive also for an internal pair.
    common_face_width : float, optional
        Width over which the faces touch, m, where that is less than the narrower face; in its middle.

    Raises
    ------
    GeometryError
        If the gears do not fit each other, do not touch, or interfere.

    Notes
    -----
    Points of contact are given by ``xi``, the distance along the transverse line of action from the point where it
    touches the pinion's base circle: ``xi = r_b1 tan(alpha_1)``. A driving pinion moves the contact from `path_start`
    (tip of the gear) to `path_end` (tip of the pinion).

    Examples
    --------
    >>> wheel = {"normal_module": 3e-3, "face_width": 20e-3, "held_diameter": 100e-3}
    >>> pinion, gear = Gear(name="1", teeth=50, **wheel), Gear(name="2", teeth=50, **wheel)
    >>> pair = GearPair(name="spur", pinion=pinion, gear=gear, centre_distance=0.151)
    >>> round(pair.working_pressure_angle, 5), round(pair.transverse_contact_ratio, 3)
    (0.36683, 1.432)
    >>> pair.with_centre_distance(0.149)
    Traceback (most recent call last):
        ...
    fe_ste.geometry.checks.GeometryError: gear pair 'spur': centre_distance = 149.0000 mm is too small: ...
    """

    pinion: Gear
    """The smaller gear, always external."""
    gear: Gear
    """The larger gear, external or internal."""

    def __post_init__(self) -> None:
        """Refuse what cannot run."""
        check_gear_pair(self)

    def with_centre_distance(self, centre_distance: float) -> GearPair:
        """Return the same gears at another operating centre distance, m."""
        return dataclasses.replace(self, centre_distance=centre_distance)

    def mirrored(self) -> GearPair:
        """Return the pair with the hands of both helices swapped."""
        return dataclasses.replace(self, pinion=self.pinion.mirrored(), gear=self.gear.mirrored())

    def _line(self) -> str:
        return (
            f" {self.name!r}: {self.pinion.teeth} and {self.gear.teeth} teeth, "
            f"centre distance {1e3 * self.centre_distance:.6g} mm, contact ratio {self.total_contact_ratio:.3f}"
        )

    def _table(self) -> TitledRows:
        return f"gear pair {self.name}", {
            "pinion": f"{self.pinion.name}, {self.pinion.teeth} teeth",
            "gear": f"{self.gear.name}, {self.gear.teeth} teeth{', internal' if self.gear.internal else ''}",
            "centre distance": value_range(self.centre_distance, "mm", 1e3),
            "face width": value_range(self.face_width, "mm", 1e3),
            "working pressure angle": value_range(math.degrees(self.working_pressure_angle), "deg"),
            "transverse contact ratio": f"{self.transverse_contact_ratio:.3f}",
            "overlap ratio": f"{self.overlap_ratio:.3f}",
            "circumferential backlash": value_range(self.circumferential_backlash, "µm", 1e6),
        }
