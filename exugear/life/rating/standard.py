"""Rating of one flank of a gear to ISO 6336, method B: factors, stresses, permissible stresses and safeties.

Load sharing and misalignment are those of the static balance of the shafts. Misalignment and deviations that remain
after running-in affect the distribution over face and teeth. Under a spectrum, factors are computed for each load and
safeties by Miner's rule; the listed load is the one with the largest damage to the flank.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from exugear.gearbox.sections.loads import StrengthSection
from exugear.gearbox.units import MPA, si
from exugear.life.gear_life import hardening_of, life_curves, root_factors, root_strength, roughness_of
from fe_ste.geometry.gears import GearPair
from fe_ste.standards.iso1328 import tolerance
from fe_ste.standards.iso6336 import (
    Edition,
    FlankDeviations,
    Hardening,
    dynamic_factor,
    face_load_factor,
    helix_running_in,
    mesh_stiffness,
    pitch_running_in,
    reduced_mass,
    resonance_speed,
    transverse_load_factors,
)
from fe_ste.standards.pitting import (
    UNMODIFIED,
    contact_ratio_factor,
    damages,
    elasticity_factor,
    helix_factor,
    lubricant_factor,
    nominal_contact_stress,
    reduced_radius,
    roughness_factor,
    safety_factor,
    single_contact_factors,
    velocity_factor,
    zone_factor,
)
from fe_ste.standards.tooth_root import root_face_load_factor, root_stress_factors
from fe_ste.tools.arrays import Floats

FINE_CLASS = 5
"""Coarsest flank tolerance class whose tip relief counts in K_v."""


@dataclass(frozen=True, eq=False)
class MeshLoads:
    """Loads of a family of meshes for each load of a spectrum."""

    torque: Floats
    """(n,) of the loaded body, N m: label of the loads."""
    force: Floats
    """(n,) F_t at the reference circle, mean of the meshes over the angles of the carrier, N."""
    sharing: Floats
    """(n,) K_gamma: largest over mean force."""
    opening: Floats
    """(n,) largest misalignment of the meshes as a gap over the face width, m."""
    speed: Floats
    """(n,) of gear 1 relative to the frame of its mating gears' axes, rad/s."""
    turns: Floats
    """(n,) load cycles of the flank."""


@dataclass(frozen=True, eq=False)
class FlankRules:
    """Data for the rating of one gear of a pair."""

    pair: GearPair
    member: int
    """{0, 1}"""
    strengths: tuple[StrengthSection | None, StrengthSection | None]
    """Of gear 1 and gear 2."""
    application_factor: float
    stated_dynamic_factor: float
    """K_A, and K_v if the standard's is not available."""
    viscosity: float
    """At 40 °C, mm2/s."""
    meshes: tuple[int, int]
    """Simultaneous meshes of gear 1 and of gear 2, for the relative mass."""
    free_bore: bool
    """Whether the gear's bore is free, as for a planet."""
    ring_held: bool = True
    """Whether the housing holds an internal gear 2."""
    edition: Edition = "ISO 6336:2019"
    f_ZCa: float = UNMODIFIED
    """Auxiliary factor of helical gears, edition of 2019."""

    @property
    def auxiliary_factor(self) -> float:
        """Auxiliary factor in Z_B and Z_D: f_ZCa, or 1 in the edition of 2006."""
        return 1.0 if self.edition == "ISO 6336:2006" else self.f_ZCa

    @property
    def strength(self) -> StrengthSection | None:
        """Strength of the gear itself."""
        return self.strengths[self.member]

    @property
    def classes(self) -> tuple[int, int] | None:
        """Tolerance classes of both gears; None if either is missing."""
        found = [strength.tolerance_class for strength in self.strengths if strength is not None]
        if len(found) < 2 or None in found:
            return None
        return (found[0] or 0, found[1] or 0)

    def deviations(self) -> FlankDeviations | None:
        """Return the tolerances of the classes: the larger of both gears, f_ma combined; None without classes."""
        classes = self.classes
        if classes is None:
            return None
        found: dict[str, list[float]] = {}
        for gear, one in zip((self.pair.pinion, self.pair.gear), classes, strict=True):
            size = {
                "reference_diameter": 2.0 * gear.reference_radius,
                "normal_module": gear.normal_module,
                "face_width": gear.face_width,
            }
            pitch = tolerance("single_pitch", one, **size) * math.cos(gear.transverse_pressure_angle)
            found.setdefault("pitch", []).append(pitch)
            found.setdefault("form", []).append(tolerance("profile_form", one, **size))
            found.setdefault("helix", []).append(tolerance("helix_slope", one, **size))
        return FlankDeviations(max(found["pitch"]), max(found["form"]), math.hypot(*found["helix"]))

    def lacking(self) -> dict[str, str]:
        """Return the reasons why factors are not rated, by factor."""
        lines = {}
        if self.classes is None:
            lines["K_v"] = "not rated: set tolerance_class of both gears; K_v of [rating] is used"
        if self.classes is None:
            lines["K_Halpha"] = "not rated: set tolerance_class of both gears; 1 is used"
            lines["K_Hbeta"] = "deflections only: set tolerance_class of both gears to include deviations"
        return lines


def rate(rules: FlankRules, loads: MeshLoads) -> dict[str, float]:
    """Return factors, stresses and safeties of a flank and its root, by standard symbol.

    Returns
    -------
    stresses in Pa, F_t in N, v in m/s; unrated values are NaN. ``torque`` is the torque of the gear from all its
    meshes of the family, without factors; ``load_torque`` is the torque of the loaded body.
    """
    factors = [_load_factors(rules, loads, place) for place in range(len(loads.force))]
    stresses = [_stresses(rules, factor) for factor in factors]
    contact = np.array([stress["sigma_H"] for stress in stresses])
    root = np.array([stress["sigma_F"] for stress in stresses])
    allowed = np.array([_contact_influences(rules, factor["v"]) for factor in factors])
    found = {"S_H": math.nan, "S_F": math.nan, "sigma_HG": math.nan, "sigma_FG": math.nan}
    decides = int((contact * loads.turns**0.05).argmax())
    strength = rules.strength
    if strength is not None:
        curve, bending = life_curves(strength)
        endured = si(strength, "sigma_H_lim_MPa") * allowed.prod(axis=1)
        broken = root_strength(strength, rules.pair, rules.member)
        by_load = damages(curve, contact / endured, 1.0, loads.turns)
        if 0.0 < by_load.sum() < math.inf:
            decides = int(by_load.argmax())
        found["S_H"] = safety_factor(curve, contact / endured, 1.0, loads.turns)
        found["S_F"] = safety_factor(bending, root, broken, loads.turns)
        found["sigma_HG"], found["sigma_FG"] = found["S_H"] * contact[decides], found["S_F"] * root[decides]
        found["Z_NT"], found["Y_NT"] = found["sigma_HG"] / endured[decides], found["sigma_FG"] / broken
        relative = root_factors(strength, rules.pair, rules.member)
        found["Y_rel"] = math.prod(relative)
        if strength.root_factor is None:
            found |= dict(zip(ROOT_STRENGTH, relative, strict=True))
        found["Y_M"] = strength.mean_stress_factor or 1.0
        found |= {"sigma_Hlim": si(strength, "sigma_H_lim_MPa"), "sigma_Flim": si(strength, "sigma_F_lim_MPa")}
    found |= dict(zip(("Z_L", "Z_v", "Z_R"), allowed[decides].tolist(), strict=True))
    gear = (rules.pair.pinion, rules.pair.gear)[rules.member]
    place = {
        "torque": factors[decides]["F_t"] * gear.reference_radius * rules.meshes[rules.member],
        "load_torque": float(loads.torque[decides]),
        "N_L": float(loads.turns.sum()),
    }
    return {**place, **factors[decides], **stresses[decides], **found}


ROOT_STRENGTH = ("Y_deltarelT", "Y_RrelT", "Y_X")
"""Relative root strength factors; omitted if the file states their product, which is ``Y_rel``."""


def _load_factors(rules: FlankRules, loads: MeshLoads, place: int) -> dict[str, float]:
    """Return F_t, v and the K factors of one load."""
    pair = rules.pair
    force = float(loads.force[place])
    sharing = float(loads.sharing[place])
    velocity = float(loads.speed[place]) * pair.pinion.reference_radius
    width = pair.face_width
    deviations = rules.deviations()
    stiffness = mesh_stiffness(pair, tangential_force=force, application_factor=rules.application_factor * sharing)
    line_load = force * rules.application_factor * sharing / width
    left = _run_in(rules, deviations, velocity)
    dynamic = rules.stated_dynamic_factor
    mass = reduced_mass(pair, rules.meshes, rules.ring_held)
    resonance = resonance_speed(pair, stiffness.mesh_stiffness, mass)
    ratio = abs(float(loads.speed[place])) / resonance
    if left is not None:
        relief = _running_in_relief(rules) if max(rules.classes or (FINE_CLASS + 1,)) <= FINE_CLASS else None
        dynamic = dynamic_factor(ratio, pair.total_contact_ratio, stiffness.single_stiffness, line_load, left, relief)
    opening = float(loads.opening[place]) + (deviations.helix if deviations else 0.0)
    taken = _mean(rules, lambda kind, limit: helix_running_in(opening, kind, limit, velocity))
    face = face_load_factor(
        line_load * dynamic, stiffness.mesh_stiffness_for_load_distribution, max(opening - taken, 0.0)
    )
    across = math.nan, math.nan
    if deviations is not None and left is not None:
        pitch = max(deviations.base_pitch, deviations.profile_form)
        remaining = pitch - (deviations.base_pitch - left.base_pitch)
        across = transverse_load_factors(
            pair, line_load * dynamic * face, stiffness.mesh_stiffness, remaining, contact_ratio_factor(pair)
        )
    return {
        "F_t": force,
        "v": velocity,
        "K_A": rules.application_factor,
        "K_gamma": sharing,
        "K_v": dynamic,
        "F_betax": opening,
        "K_Hbeta": face,
        "K_Halpha": across[0],
        "K_Fbeta": float(root_face_load_factor(np.array(face), pair)),
        "K_Falpha": across[1],
        "c'": stiffness.single_stiffness,
        "c_gammaalpha": stiffness.mesh_stiffness,
        "m_red": mass,
        "n_E1": resonance,
        "N": ratio,
    }


def _running_in_relief(rules: FlankRules) -> float:
    """Return C_ay from running-in of the tips, m; designed tip relief is neglected (ISO 6336-1:2006, 6.5.4)."""
    limits = [strength.sigma_H_lim_MPa for strength in rules.strengths if strength is not None]
    return 1e-6 * sum(((limit / 97.0 - 18.45) ** 2 / 18.0 + 1.5) / len(limits) for limit in limits)


def _run_in(rules: FlankRules, deviations: FlankDeviations | None, velocity: float) -> FlankDeviations | None:
    """Return the deviations that remain after running-in."""
    if deviations is None:
        return None

    def left(deviation: float) -> float:
        return deviation - _mean(rules, lambda kind, limit: pitch_running_in(deviation, kind, limit, velocity))

    return FlankDeviations(left(deviations.base_pitch), left(deviations.profile_form))


def _mean(rules: FlankRules, taken: Callable[[Hardening, float], float]) -> float:
    """Return the mean running-in allowance of both gears; zero without their strength."""
    known = [strength for strength in rules.strengths if strength is not None]
    values = [taken(hardening_of(strength), si(strength, "sigma_H_lim_MPa")) for strength in known]
    return sum(values) / len(values) if values else 0.0


def _stresses(rules: FlankRules, of: dict[str, float]) -> dict[str, float]:
    """Return nominal and acting stresses of one load with its Z and Y factors; NaN K_Halpha and K_Falpha count as 1."""
    pair = rules.pair
    member = rules.member
    strength = rules.strength
    tolerance_class = strength.tolerance_class if strength else None
    root = root_stress_factors(pair, member, tolerance_class, rules.free_bore, rules.edition)
    single = single_contact_factors(pair, rules.auxiliary_factor)[member]
    of_2019 = {}
    if rules.edition == "ISO 6336:2019" and pair.overlap_ratio > 0.0:
        of_2019 = {"f_ZCa": rules.f_ZCa, "f_eps": root.load_distribution}
        if (pair.pinion, pair.gear)[member].internal:
            of_2019["f_ZCa"] = 1.0
    common = of["K_A"] * of["K_gamma"] * of["K_v"]
    nominal = nominal_contact_stress(pair, of["F_t"])
    nominal_root = of["F_t"] / (pair.face_width * pair.pinion.normal_module) * root.product
    across, across_root = (1.0 if math.isnan(of[name]) else of[name] for name in ("K_Halpha", "K_Falpha"))
    return {
        "Z_H": zone_factor(pair),
        "Z_E": elasticity_factor(pair),
        "Z_eps": contact_ratio_factor(pair),
        "Z_beta": helix_factor(pair.pinion),
        "Z_BD": single,
        **of_2019,
        "Z_W": 1.0,
        "Z_X": 1.0,
        "Y_F": root.form,
        "Y_S": root.stress_correction,
        "Y_beta": root.helix,
        "Y_B": root.rim,
        "Y_DT": root.deep_tooth,
        "sigma_H0": nominal,
        "sigma_H": single * nominal * math.sqrt(common * of["K_Hbeta"] * across),
        "sigma_F0": nominal_root,
        "sigma_F": nominal_root * common * of["K_Fbeta"] * across_root,
    }


def _contact_influences(rules: FlankRules, velocity: float) -> tuple[float, float, float]:
    """Return Z_L, Z_v and Z_R of the softer gear at a pitch line velocity; NaN without strengths."""
    known = [strength for strength in rules.strengths if strength is not None]
    if not known:
        return math.nan, math.nan, math.nan
    softer = MPA * min(strength.sigma_H_lim_MPa for strength in known)
    roughness = sum(roughness_of(strength) for strength in known) / len(known)
    return (
        lubricant_factor(softer, rules.viscosity),
        velocity_factor(softer, velocity),
        roughness_factor(softer, roughness, reduced_radius(rules.pair)),
    )
