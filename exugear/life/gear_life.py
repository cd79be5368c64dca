"""Life of gears to ISO 6336 with stresses from finite element contact: Miner's sums and safety factors by flank.

Load sharing, misalignment and the load distribution along face and profile are included in the stresses. K_gamma is
included in the forces of the static balance, for each planet and angle; only K_v is a separate factor, so no influence
counts twice. Contact stress is from line loads inside the path of contact, root stress from gauges on the closed ring.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.sections.loads import RatingSection, StrengthSection
from exugear.gearbox.units import MPA, UM, si
from exugear.gearbox.versions import LIFE
from exugear.life.dynamic_factors import DynamicFactor
from exugear.life.load_spectrum.counted import FLANKS, ToothExposure
from exugear.life.static_balance import ActingLoads, StaticBalance
from exugear.system.tooth_mesh.tables import TableRequest
from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.standards.iso6336 import Hardening, outside_scope
from fe_ste.standards.pitting import (
    CASE_HARDENED_BENDING,
    CASE_HARDENED_CONTACT,
    THROUGH_HARDENED_BENDING,
    THROUGH_HARDENED_CONTACT,
    UNMODIFIED,
    LifeCurve,
    damages,
    lubricant_factor,
    nominal_contact_stress,
    reduced_radius,
    roughness_factor,
    safety_factor,
    single_contact_factors,
    tangential_force,
    velocity_factor,
)
from fe_ste.standards.tooth_root import (
    notch_factor,
    root_face_load_factor,
    root_stress_factors,
    size_factor,
    surface_factor,
)
from fe_ste.tools.arrays import Floats
from fe_ste.tools.stores import Layout, Store

if TYPE_CHECKING:
    from fe_ste.root_stress import MeshCycleStress, RootGauges

RZ_OF_RA = 6.0
"""Rz over Ra (ISO 6336-2)."""
PLAIN_TEST_GEAR = 2.0
"""Y_ST: stress correction factor of the reference test gears for sigma_F_lim (ISO 6336-3)."""


@dataclass(frozen=True)
class FlankLife:
    """Stresses, damages and safeties of a gear's flank and root in one family of meshes; for planets the worst."""

    gear: str
    family: str
    flank: str
    """Flank ``+`` faces the sense of +z rotation."""
    contact_holder: str
    root_holder: str
    """Body with the largest damage, for several equal ones: the planet."""
    cycles: float
    """Load cycles in the life."""
    contact_stress: float
    root_stress: float
    """Maximum stress of the life including K_v, Pa."""
    compression: float
    """Minimum principal stress of the root (compression), Pa."""
    contact_worn: float
    root_worn: float
    """Maximum stress of the fatigue loads, without extreme loads, Pa."""
    contact_limit: float
    root_limit: float
    """Stress at the first cycles of the S-N curve, Pa: above it, the damage is infinite; NaN without strength."""
    reach: float
    """Largest torque including K_v, over the largest torque of the pair's table."""
    contact_damage: float
    root_damage: float
    """Miner's sums; NaN without strength."""
    contact_safety: float
    root_safety: float
    """Factors on stress at which the damages are one; NaN without strength."""
    contact_static: float
    root_static: float
    """Safety factors under the largest load, extreme loads with partial factors included; NaN without strength."""
    nominal_contact: float
    nominal_root: float
    """sigma_H0 of ISO 6336-2 and sigma_F0 of ISO 6336-3 at the largest load, for comparison."""
    standard_contact_safety: float
    standard_root_safety: float
    """S_H and S_F over the life with stresses of ISO 6336-2 and -3, K_gamma and K_v of each load, K_Hbeta of finite
    elements, K_Fbeta from K_Hbeta, and K_Halpha = K_Falpha = 1; NaN without strength."""
    outside: float
    """Largest fraction of the load outside the path of contact, which tip relief would remove."""
    face_load: float
    """Maximum over mean line load along the face width at the largest load."""
    contact_by_bin: Floats
    root_by_bin: Floats
    """(bins,) parts of the damages by torque bin; NaN without strength."""


def check_strengths(
    gearbox: Gearbox, rating: RatingSection, teeth: Sequence[ToothExposure], reversed_too: bool
) -> None:
    """Refuse strengths of unknown gears, and alternating bending without Y_M; all errors are raised together."""
    errors: list[str] = []
    for name, strength in rating.gears.items():
        flanks = {tooth.flank for tooth in teeth if tooth.gear == name}
        if not flanks:
            known = ", ".join(sorted({tooth.gear for tooth in teeth}))
            errors += gearbox.error(f"rating.gears.{name}: no gear of that name in a mesh; gears are {known}").errors
        elif (len(flanks) > 1 or reversed_too) and strength.mean_stress_factor is None:
            errors += gearbox.error(
                f"rating.gears.{name}.mean_stress_factor: this key is missing; teeth of {name} are loaded on both "
                "flanks (alternating bending)"
            ).errors
    if rating.f_ZCa is not None and not any(
        mesh.pair.overlap_ratio > 0.0 and is_modified(gearbox, mesh.pair) for mesh in gearbox.meshes
    ):
        errors += gearbox.error(
            f"rating.f_ZCa = {rating.f_ZCa:g}: no helical gear has a modification; add [gears.NAME.modification], or "
            f"remove the key (f_ZCa = {UNMODIFIED:g})"
        ).errors
    if errors:
        raise GearboxFileError(*errors)


def is_modified(gearbox: Gearbox, pair: GearPair) -> bool:
    """Return whether the file removes material from the flanks of a gear of the pair."""
    for gear in (pair.pinion, pair.gear):
        section = gearbox.case.gears[gear.name].modification
        if section is not None and section.removes_material:
            return True
    return False


def auxiliary_factor(gearbox: Gearbox, rating: RatingSection, pair: GearPair) -> float:
    """Return f_ZCa of ISO 6336-2:2019: the value of the file for modified flanks, otherwise 1.2."""
    return rating.f_ZCa if rating.f_ZCa is not None and is_modified(gearbox, pair) else UNMODIFIED


def warn_beyond_tables(
    gearbox: Gearbox, acting: ActingLoads, balance: StaticBalance, stresses: Mapping[str, MeshCycleStress]
) -> Iterator[str]:
    """Warn of pairs whose misalignment exceeds the range of their tables, where the stresses at its end are used."""
    hub = np.concatenate([acting.points.other, acting.worst_hub])
    tilts = balance.at(balance.misalignment, acting.torques, hub)
    for name, stress in stresses.items():
        if len(stress.misalignment) < 2:
            continue
        meshes = [number for number, mesh in enumerate(gearbox.meshes) if mesh.pair.name == name]
        width = gearbox.gear_pairs[name].face_width
        low, high = stress.misalignment[[0, -1]]
        least = float(tilts[..., meshes].min())
        most = float(tilts[..., meshes].max())
        reached = [extreme for extreme in (least, most) if not low <= extreme <= high]
        if reached:
            told = " and ".join(f"{1e6 * extreme * width:.3g}" for extreme in reached)
            yield (
                f"{name}: misalignment reaches {told} µm over the face width, the table covers {1e6 * low * width:.3g}"
                f" to {1e6 * high * width:.3g}; stresses beyond are those at the end of the table; widen "
                "misalignment_um of [ste]"
            )


def flank_lives(
    gearbox: Gearbox,
    rating: RatingSection,
    teeth: Sequence[ToothExposure],
    acting: ActingLoads,
    balance: StaticBalance,
    stresses: Mapping[str, MeshCycleStress],
    dynamic: Mapping[str, DynamicFactor],
) -> tuple[FlankLife, ...]:
    """Rate all gears of pairs with known stresses, by pair name, with K_v by mesh family."""
    pairs = {mesh.family: mesh.pair for mesh in gearbox.meshes}
    lives: dict[tuple[str, str, str], list[FlankLife]] = {}
    for tooth in teeth:
        pair = pairs[tooth.family]
        if pair.name not in stresses:
            continue
        for sense in (1, -1):
            if np.any(acting.torques * sense > 0.0):
                case = _RatedTooth(
                    gearbox, rating, tooth, pair, balance, stresses[pair.name], dynamic[tooth.family], sense
                )
                rated = case.life(acting)
                lives.setdefault((rated.gear, rated.family, rated.flank), []).append(rated)
    return tuple(worst_of(planets) for planets in lives.values())


LEAST_COUNTS = ("compression", "contact_limit", "root_limit")
"""Values of a flank for which the minimum is the worst, in addition to safeties."""


def worst_of(lives: Sequence[FlankLife]) -> FlankLife:
    """Return the worst of each value over the flanks of equal planets."""
    contact = max(lives, key=lambda life: (np.nan_to_num(life.contact_damage, posinf=np.inf), life.contact_stress))
    root = max(lives, key=lambda life: (np.nan_to_num(life.root_damage, posinf=np.inf), life.root_stress))
    worst: dict[str, Any] = {}
    for name in (field.name for field in fields(FlankLife) if field.type == "float"):
        values = np.array([getattr(life, name) for life in lives])
        least = name.endswith(("_safety", "_static")) or name in LEAST_COUNTS
        worst[name] = float(values.min() if least else values.max())
    return replace(
        lives[0],
        **worst,
        contact_holder=contact.contact_holder if len(lives) > 1 else "",
        root_holder=root.root_holder if len(lives) > 1 else "",
        contact_by_bin=contact.contact_by_bin,
        root_by_bin=root.root_by_bin,
    )


@dataclass(frozen=True)
class _RatedTooth:
    """One tooth in one family of meshes under torques of one sign."""

    gearbox: Gearbox
    rating: RatingSection
    tooth: ToothExposure
    pair: GearPair
    balance: StaticBalance
    stress: MeshCycleStress
    dynamic: DynamicFactor
    sense: int

    def life(self, acting: ActingLoads) -> FlankLife:
        tooth = self.tooth
        stress = self.stress
        points = acting.points
        worn = np.sign(points.torque) == self.sense
        speed = points.speed[worn]
        hertz, root, _ = self._stresses(points.torque[worn], points.other[worn], self.dynamic.at(speed))
        # A tooth meets each carrier angle and each mesh equally often: cycles are shared evenly among them.
        share = tooth.cycles / (len(tooth.meshes) * len(self.balance.angle))
        cycles = np.broadcast_to((points.revolutions[worn] * share)[:, None, None], hertz.shape)
        worst_torque, worst_hub = acting.worst(self.sense)
        highest = self.dynamic.largest(acting.slowest, acting.fastest)
        worst = self._stresses(worst_torque, worst_hub, np.full(len(worst_torque), highest))
        torque, tilt = self._loads(worst_torque, worst_hub)
        top = int(np.abs(worst_torque).argmax())
        force = tangential_force(self.pair.pinion, float(torque[top].mean()) / self.pair.pinion.base_radius)
        rated = self._rated(hertz, root, cycles, speed, float(worst[0].max()), float(worst[1].max()))
        in_scope = not outside_scope(self.pair)
        by_standard = (math.nan, math.nan)
        if in_scope:
            by_standard = self._standard_safeties(points.torque[worn], points.other[worn], speed, cycles)
        by_point = np.zeros((2, len(points.torque)))
        by_point[:, worn] = rated.pop("by_point")
        return FlankLife(
            contact_by_bin=acting.sum_by_bin(by_point[0]),
            root_by_bin=acting.sum_by_bin(by_point[1]),
            gear=tooth.gear,
            family=tooth.family,
            flank=FLANKS[self.sense * tooth.flank],
            cycles=float(points.revolutions[worn].sum()) * tooth.cycles,
            contact_holder=tooth.holder,
            root_holder=tooth.holder,
            contact_stress=float(worst[0].max()),
            root_stress=float(worst[1].max()),
            contact_worn=float(hertz.max(initial=0.0)),
            root_worn=float(root.max(initial=0.0)),
            reach=highest * float(torque.max()) / float(stress.torque[-1]),
            compression=float(worst[2].min()),
            nominal_contact=nominal_contact_stress(self.pair, force) if in_scope else math.nan,
            nominal_root=self._nominal_root(force) if in_scope else math.nan,
            standard_contact_safety=by_standard[0],
            standard_root_safety=by_standard[1],
            outside=float(stress.at(stress.outside, 0.0, torque, tilt).max()),
            face_load=float(stress.at(stress.face_load, 0.0, torque[top], tilt[top]).max()),
            **rated,
        )

    def _loads(self, torques: Floats, hub: Floats) -> tuple[Floats, Floats]:
        """Return torque on gear 1 (N m) and misalignment (rad) of each mesh, (loads, angles, meshes)."""
        passed = list(self.tooth.meshes)
        force = np.abs(self.balance.at(self.balance.mesh_force, torques, hub)[..., passed])
        tilt = self.balance.at(self.balance.misalignment, torques, hub)[..., passed]
        return force * self.pair.pinion.base_radius, tilt

    def _stresses(self, torques: Floats, hub: Floats, dynamic: Floats) -> tuple[Floats, Floats, Floats]:
        """Return contact stress, root stress and root compression of each mesh, (loads, angles, meshes), Pa."""
        torque, tilt = self._loads(torques, hub)
        torque = torque * dynamic[:, None, None]
        stress = self.stress
        member = self.tooth.member
        return (
            stress.at(stress.hertz, 0.5, torque, tilt),
            stress.at(stress.root, 1.0, torque, tilt)[..., member],
            stress.at(stress.compression, 1.0, torque, tilt)[..., member],
        )

    def _nominal_root(self, force: float) -> float:
        area = self.pair.face_width * self.pair.pinion.normal_module
        return force / area * root_stress_factors(self.pair, self.tooth.member, edition=self.rating.edition).product

    def _rated(
        self, hertz: Floats, root: Floats, cycles: Floats, speed: Floats, worst_hertz: float, worst_root: float
    ) -> dict[str, Any]:
        strength = self.rating.gears.get(self.tooth.gear)
        keys = (
            *("contact_damage", "root_damage", "contact_safety", "root_safety", "contact_static", "root_static"),
            *("contact_limit", "root_limit"),
        )
        if strength is None:
            return {**dict.fromkeys(keys, math.nan), "by_point": np.nan}
        contact, bending = life_curves(strength)
        allowed = self._contact_strength(strength, speed)[:, None, None]
        endured = root_strength(strength, self.pair, self.tooth.member)
        static = si(strength, "sigma_H_lim_MPa") * contact.factors[0]
        by_contact = damages(contact, hertz / allowed, 1.0, cycles).sum(axis=(1, 2))
        by_root = damages(bending, root, endured, cycles).sum(axis=(1, 2))
        values = (
            float(by_contact.sum()),
            float(by_root.sum()),
            safety_factor(contact, hertz / allowed, 1.0, cycles),
            safety_factor(bending, root, endured, cycles),
            static / worst_hertz,
            endured * bending.factors[0] / worst_root,
            float(allowed.min(initial=math.inf)) * contact.factors[0],
            endured * bending.factors[0],
        )
        return {**dict(zip(keys, values, strict=True)), "by_point": np.stack([by_contact, by_root])}

    def _standard_safeties(self, torques: Floats, hub: Floats, speed: Floats, cycles: Floats) -> tuple[float, float]:
        """Return S_H and S_F with the nominal stresses of the standard and K_Hbeta from finite elements."""
        strength = self.rating.gears.get(self.tooth.gear)
        if strength is None:
            return math.nan, math.nan
        torque, tilt = self._loads(torques, hub)
        torque = torque * self.dynamic.at(speed)[:, None, None]
        face = self.stress.at(self.stress.face_load, 0.0, torque, tilt)
        force = tangential_force(self.pair.pinion, 1.0) * torque / self.pair.pinion.base_radius
        contact, bending = life_curves(strength)
        allowed = self._contact_strength(strength, speed)[:, None, None]
        auxiliary = 1.0
        if self.rating.edition == "ISO 6336:2019":
            auxiliary = auxiliary_factor(self.gearbox, self.rating, self.pair)
        single = single_contact_factors(self.pair, auxiliary)[self.tooth.member]
        hertz = single * nominal_contact_stress(self.pair, 1.0) * np.sqrt(force * face)
        flank = safety_factor(contact, hertz / allowed, 1.0, cycles)
        root = self._nominal_root(1.0) * force * root_face_load_factor(face, self.pair)
        return flank, safety_factor(bending, root, root_strength(strength, self.pair, self.tooth.member), cycles)

    def _contact_strength(self, strength: StrengthSection, speed: Floats) -> Floats:
        """Return the contact strength (Pa) for a life factor of one, at each speed (rad/s) of the loaded body."""
        other = (self.pair.gear, self.pair.pinion)[self.tooth.member].name
        mate = self.rating.gears.get(other, strength)
        softer = MPA * min(strength.sigma_H_lim_MPa, mate.sigma_H_lim_MPa)
        roughness = 0.5 * (roughness_of(strength) + roughness_of(mate))
        still = lubricant_factor(softer, self.gearbox.viscosity_40)
        still *= roughness_factor(softer, roughness, reduced_radius(self.pair))
        gear = (self.pair.pinion, self.pair.gear)[self.tooth.member]
        velocity = speed * self.tooth.cycles / len(self.tooth.meshes) * gear.reference_radius
        moving = np.array([velocity_factor(softer, float(value)) for value in velocity])
        return si(strength, "sigma_H_lim_MPa") * still * moving


def roughness_of(strength: StrengthSection) -> float:
    """Return Rz of a gear's flanks, m."""
    return UM * (strength.roughness_Rz_um or RZ_OF_RA * (strength.roughness_Ra_um or 0.0))


def hardening_of(strength: StrengthSection) -> Hardening:
    """Return the material group for constants; case-hardened (smallest running-in) if none is given."""
    return strength.curve or "case_hardened"


def root_factors(strength: StrengthSection, pair: GearPair, member: int) -> tuple[float, float, float]:
    """Return Y_delta_rel_T, Y_R_rel_T and Y_X of a gear; or the product stated in the file, in place of the first."""
    if strength.root_roughness_Rz_um is None:
        return strength.root_factor or 1.0, 1.0, 1.0
    hardening = hardening_of(strength)
    notch = root_stress_factors(pair, member).notch
    return (
        notch_factor(notch, hardening),
        surface_factor(si(strength, "root_roughness_Rz_um")),
        size_factor(pair.pinion.normal_module, hardening),
    )


def root_strength(strength: StrengthSection, pair: GearPair, member: int) -> float:
    """Return the root strength (Pa) of a gear for a life factor of one."""
    both_ways = strength.mean_stress_factor or 1.0
    factors = math.prod(root_factors(strength, pair, member))
    return si(strength, "sigma_F_lim_MPa") * PLAIN_TEST_GEAR * factors * both_ways


def life_curves(strength: StrengthSection) -> tuple[LifeCurve, LifeCurve]:
    """Return the S-N curves of contact and of bending of a gear."""
    if strength.contact_curve is None or strength.bending_curve is None:
        if strength.curve == "through_hardened":
            return THROUGH_HARDENED_CONTACT, THROUGH_HARDENED_BENDING
        return CASE_HARDENED_CONTACT, CASE_HARDENED_BENDING
    contact, bending = (
        LifeCurve(tuple(point[0] for point in curve), tuple(point[1] for point in curve))
        for curve in (strength.contact_curve, strength.bending_curve)
    )
    return contact, bending


# Stresses of gear pairs from their tables, computed once and stored next to them

_FIELDS = {
    "hertz": (("torque", "misalignment"), "Pa", "largest Hertzian stress inside the path of contact"),
    "pitch_hertz": (("torque", "misalignment"), "Pa", "largest Hertzian stress near the pitch point"),
    "outside": (("torque", "misalignment"), "1", "largest fraction of the load outside the path of contact"),
    "face_load": (("torque", "misalignment"), "1", "maximum over mean line load along the face width"),
    "root": (("torque", "misalignment", "gear"), "Pa", "largest principal stress at the roots of gear 1 and 2"),
    "compression": (("torque", "misalignment", "gear"), "Pa", "smallest principal stress there"),
}
_LAYOUT = Layout(
    "pair stress",
    LIFE,
    {name: dims for name, (dims, _, _) in _FIELDS.items()} | {"torque": ("torque",), "misalignment": ("misalignment",)},
    ("pair", "input_hash"),
)


def pair_stresses(
    requests: Iterable[TableRequest],
    folder: Path,
    begin: Callable[[str], None] | None = None,
    keep: bool = True,
) -> dict[str, MeshCycleStress]:
    """Return the stresses of all pairs with tables; stresses that are missing or belong to another table are computed.

    Parameters
    ----------
    folder : for the files ``stress/<pair>.nc``
    begin : called with the name of each pair before it is computed
    keep : whether to store computed stresses
    """
    import xarray as xr

    from fe_ste.root_stress import MeshCycleStress, mesh_cycle_stress, root_gauges  # finite elements, not for checks

    known: dict[tuple[Gear, int], RootGauges] = {}

    def gauges(gear: Gear, side: int) -> RootGauges:
        if (gear, side) not in known:
            known[gear, side] = root_gauges(gear, side)
        return known[gear, side]

    stresses = {}
    for request in requests:
        if request.stored is None:
            continue
        pair = request.wanted.pair
        digest = hashlib.sha256(f"{LIFE} {request.stored.input_hash}".encode()).hexdigest()
        store = Store(folder / "stress" / f"{request.name}.nc", digest)
        dataset = store.read_dataset(_LAYOUT)
        if dataset is not None:
            kept = MeshCycleStress(**{name: dataset[name].to_numpy() for name in ("torque", "misalignment", *_FIELDS)})
        else:
            if begin is not None:
                begin(request.name)
            both = gauges(pair.pinion, 1), gauges(pair.gear, -1 if pair.gear.internal else 1)
            kept = mesh_cycle_stress(pair, request.stored.dataset, both)
            if keep:
                variables = {
                    name: (dims, np.asarray(getattr(kept, name)), {"units": units, "long_name": words})
                    for name, (dims, units, words) in _FIELDS.items()
                }
                coordinates = {
                    "torque": (("torque",), kept.torque, {"units": "N m"}),
                    "misalignment": (("misalignment",), kept.misalignment, {"units": "rad"}),
                }
                store.write_dataset(xr.Dataset(variables, coordinates, {"pair": request.name, "method_version": LIFE}))
        stresses[request.name] = kept
    return stresses
