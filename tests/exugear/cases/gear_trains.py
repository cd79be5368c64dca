"""Gear trains of every kind, each as small as it can be: what a gearbox file of the kind says, with stated stiffness.

Wheels have no profile shift and stand at the standard distance, all alike but for tooth numbers; each body sits on one
bearing that holds all directions but the spin. So torques and speeds follow from tooth numbers alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

MODULE_MM = 3.0
STIFFNESS = {"mean_N_per_m": 4e8, "cosine_N_per_m": [4e7, 8e6]}
"""Of every mesh: 10 % of the first and 2 % of the second order about the mean."""
TORQUE = 100.0
SPEED_RPM = 600.0
DURATION_S = 0.05
HELD = {"radial_N_per_m": 2e8, "axial_N_per_m": 1e8, "tilt_N_m_per_rad": 1e6}


class Train:
    """A gearbox file that grows part by part."""

    def __init__(self, name: str, *, face_mm: float = 30.0, helix_deg: float = 0.0) -> None:
        self.face_mm, self.helix_deg = face_mm, helix_deg
        self.content: dict[str, Any] = {
            "name": name,
            "default_inertias": "discs",
            "gears": {},
            "pairs": {},
            "bodies": {},
            "meshes": {},
            "joints": {},
            "bearings": {},
            "load_cases": {},
            "ste": {"positions": 8},
        }

    def gear(
        self, name: str, teeth: int, hand: int = 0, *, internal: bool = False, face_mm: float | None = None
    ) -> Train:
        """Wheel of a hand (+1 right, -1 left, 0 spur); a ring's teeth are short, for a planet's roots."""
        module = MODULE_MM / self._cos(hand)
        gear: dict[str, Any] = {
            "teeth": teeth,
            "normal_module_mm": MODULE_MM,
            "helix_angle_deg": hand * self.helix_deg,
            "face_width_mm": face_mm or self.face_mm,
            "held_diameter_mm": module * teeth + 12 * MODULE_MM if internal else 0.6 * module * teeth,
            "tooth_thinning_mm": 0.03,
        }
        if internal:
            gear |= {"internal": True, "rack": {"addendum": 0.8}}
        self.content["gears"][name] = gear
        return self

    def _cos(self, hand: int) -> float:
        return math.cos(math.radians(hand * self.helix_deg))

    def distance_mm(self, first: str, second: str) -> float:
        """Standard centre distance of two wheels."""
        one, other = self.content["gears"][first], self.content["gears"][second]
        teeth = other["teeth"] + one["teeth"] * (-1 if other.get("internal") else 1)
        return MODULE_MM * teeth / (2.0 * math.cos(math.radians(one["helix_angle_deg"])))

    def body(
        self,
        name: str,
        wheels: Mapping[str, float] | None = None,
        at: Sequence[float] | None = (0.0, 0.0),
        *,
        mass: float = 2.0,
        axial: float = 2e-3,
        held: bool = True,
        **keys: Any,
    ) -> Train:
        """Turning body on its joint and bearing, a planet on its carrier's."""
        z = 0.5 * (min(wheels.values()) + max(wheels.values())) if wheels else 0.0
        inertia = {"mass_kg": mass, "axial_kg_m2": axial, "transverse_kg_m2": axial, "centre_of_mass_z_mm": z}
        place = {} if at is None else {"axis_position_mm": list(at)}
        body = {**place, "inertia": {"discs": inertia}, **keys}
        if wheels:
            body["gears_z_mm"] = dict(wheels)
        self.content["bodies"][name] = body
        if held:
            on = {"on": keys["carrier"]} if "carrier" in keys else {}
            self.content["joints"][name] = {"body": name, "z_mm": z, **on}
            self.content["bearings"][name] = {"body": name, "z_mm": z, "stiffness": dict(HELD), **on}
        return self

    def elastic(self, name: str) -> Train:
        """Let a body be a shaft on two bearings beside its wheels, elastic in the variant flexible."""
        body = self.content["bodies"][name]
        places = body.get("gears_z_mm", {"": 0.0}).values()
        start, end = min(places) - 60.0, max(places) + 60.0
        section = {"length_mm": end - start, "outer_diameter_mm": 30.0}
        shape = {"start_z_mm": start, "sections": [section], "torque_z_mm": start + 20.0}
        body |= {"flexibility": "elastic", "shape": shape}
        del self.content["bearings"][name]
        for side, z in (("left", start + 10.0), ("right", end - 10.0)):
            self.content["bearings"][f"{name}_{side}"] = {"body": name, "z_mm": z, "stiffness": dict(HELD)}
        return self

    def housing(self, wheels: Mapping[str, float]) -> Train:
        """What stands still and has gears."""
        self.content["bodies"]["housing"] = {
            "fixed": True,
            "axis_position_mm": [0.0, 0.0],
            "gears_z_mm": dict(wheels),
        }
        return self

    def planets(
        self,
        name: str,
        wheels: Mapping[str, float],
        radius_mm: float,
        count: int,
        *,
        carrier: str = "carrier",
        start_deg: float = 0.0,
    ) -> Train:
        """Equal planets, evenly around their carrier."""
        angles = [start_deg + 360.0 * n / count for n in range(count)]
        keys = {"carrier": carrier, "orbit_radius_mm": radius_mm, "planet_angles_deg": angles}
        return self.body(name, wheels, None, mass=0.8, axial=5e-4, **keys)

    def mesh(self, pinion: tuple[str, str], gear: tuple[str, str], name: str = "", distance_mm: float = 0.0) -> Train:
        """Mesh of (wheel, body) with (wheel, body), at the standard distance unless another is given."""
        name = name or f"{pinion[0]}_{gear[0]}"
        distance = distance_mm or self.distance_mm(pinion[0], gear[0])
        self.content["pairs"].setdefault(
            name,
            {"pinion": pinion[0], "gear": gear[0], "centre_distance_mm": distance, "stiffness": dict(STIFFNESS)},
        )
        self.content["meshes"][name] = {"pair": name, "pinion_body": pinion[1], "gear_body": gear[1]}
        return self

    def loaded(
        self,
        torques: Mapping[str, float],
        locked: Sequence[str],
        ends: tuple[str, str],
        output_gear: str | None,
        **case: Any,
    ) -> dict[str, Any]:
        """Finish the file: torques in balance, bodies held in the static state, ends of the train."""
        overall = {"input": ends[0], "output": ends[1]}
        if output_gear is not None:
            overall["output_gear"] = output_gear
        static = {name: torque for name, torque in torques.items() if name not in locked}
        steady = {"torques_N_m": dict(torques), "start_speed_rpm": SPEED_RPM, "duration_s": DURATION_S, **case}
        self.content |= {
            "overall": overall,
            "static_load": {"torques_N_m": static, "locked": list(locked)},
            "load_cases": {"steady": steady},
        }
        return {key: value for key, value in self.content.items() if value != {}} | {
            key: self.content[key] for key in ("gears", "pairs", "meshes")
        }


def pair(*, helix_deg: float = 15.0, face_mm: float = 30.0, swapped: bool = False) -> dict[str, Any]:
    """Two wheels; `swapped`: the larger one is called the pinion."""
    train = Train("pair", helix_deg=helix_deg, face_mm=face_mm).gear("small", 24, 1).gear("large", 36, -1)
    train.body("input", {"small": 0.0}).body("output", {"large": 0.0}, (train.distance_mm("small", "large"), 0.0))
    train.elastic("input")
    ends = (("small", "input"), ("large", "output"))
    train.mesh(*(ends[::-1] if swapped else ends), name="helical")
    return train.loaded({"input": TORQUE, "output": TORQUE * 36 / 24}, ["output"], ("input", "output"), "large")


def internal_pair() -> dict[str, Any]:
    """A pinion inside a ring that turns with it."""
    train = Train("internal pair").gear("pinion", 24).gear("ring", 72, internal=True)
    train.body("input", {"pinion": 0.0}).body("output", {"ring": 0.0}, (-train.distance_mm("pinion", "ring"), 0.0))
    train.elastic("input").mesh(("pinion", "input"), ("ring", "output"))
    return train.loaded({"input": TORQUE, "output": -TORQUE * 72 / 24}, ["output"], ("input", "output"), "ring")


def two_stage(teeth: tuple[int, int, int, int] = (21, 42, 24, 60)) -> dict[str, Any]:
    """Two helical stages on bearings from a catalogue."""
    p1, w1, p2, w2 = teeth
    train = Train("two stages", helix_deg=12.0)
    train.gear("p1", p1, 1).gear("w1", w1, -1).gear("p2", p2, -1).gear("w2", w2, 1)
    first = train.distance_mm("p1", "w1")
    second = first + train.distance_mm("p2", "w2")
    train.body("input", {"p1": 0.0}).body("middle", {"w1": 0.0, "p2": 60.0}, (first, 0.0))
    train.body("output", {"w2": 60.0}, (second, 0.0))
    train.mesh(("p1", "input"), ("w1", "middle")).mesh(("p2", "middle"), ("w2", "output"))
    train.elastic("input")
    ball = {"type": "deep_groove_ball", "designation": "6207", "bore_mm": 35, "outer_diameter_mm": 72, "width_mm": 17}
    train.content["bearings"] = {
        f"{body}_{side}": {"body": body, "z_mm": z, "catalogue": ball}
        for body in ("input", "middle", "output")
        for side, z in (("left", -50.0), ("right", 50.0 if body == "input" else 110.0))
    }
    torques = {"input": TORQUE, "output": -TORQUE * w1 / p1 * w2 / p2}
    return train.loaded(torques, ["output"], ("input", "output"), "w2")


def planetary(held: str, planets: int = 3) -> dict[str, Any]:
    """Sun, planets and ring, one of the three central members held."""
    train = Train(f"planetary, {held} held").gear("sun", 24).gear("planet", 24).gear("ring", 72, internal=True)
    train.planets("planet", {"planet": 0.0}, train.distance_mm("sun", "planet"), planets)
    for name in ("sun", "ring"):
        if held == name:
            train.housing({name: 0.0})
        else:
            train.body(name, {name: 0.0})
    if held == "carrier":
        train.content["bodies"]["carrier"] = {"fixed": True, "axis_position_mm": [0.0, 0.0]}
    else:
        train.body("carrier", mass=5.0, axial=2e-2)
    train.elastic("ring" if held == "sun" else "sun")
    place = {name: "housing" if held == name else name for name in ("sun", "ring")}
    train.mesh(("sun", place["sun"]), ("planet", "planet")).mesh(("planet", "planet"), ("ring", place["ring"]))
    # Sun, ring and carrier share torques as 1 : R : -(1 + R), R = 72 / 24.
    torques = {"sun": TORQUE, "ring": 3.0 * TORQUE, "carrier": -4.0 * TORQUE}
    del torques[held]
    begin, end = {"ring": ("sun", "carrier"), "sun": ("ring", "carrier"), "carrier": ("sun", "ring")}[held]
    return train.loaded(torques, [end], (begin, end), "ring" if held == "carrier" else "planet")


def unevenly_spaced() -> dict[str, Any]:
    """Three planets of which one stands 7.5 degrees beside its place: a multiple of 360 / (24 + 72) degrees."""
    content = planetary("ring")
    content["bodies"]["planet"]["planet_angles_deg"] = [0.0, 120.0, 247.5]
    return content


def differential() -> dict[str, Any]:
    """Sun and ring both drive the carrier, each at its own speed."""
    train = Train("differential").gear("sun", 24).gear("planet", 24).gear("ring", 72, internal=True)
    train.planets("planet", {"planet": 0.0}, train.distance_mm("sun", "planet"), 3)
    train.body("sun", {"sun": 0.0}).body("ring", {"ring": 0.0}).body("carrier", mass=5.0, axial=2e-2)
    train.elastic("sun")
    train.mesh(("sun", "sun"), ("planet", "planet")).mesh(("planet", "planet"), ("ring", "ring"))
    torques = {"sun": TORQUE, "ring": 3.0 * TORQUE, "carrier": -4.0 * TORQUE}
    return train.loaded(
        torques, ["ring", "carrier"], ("sun", "carrier"), "planet", start_speeds_rpm={"ring": -0.5 * SPEED_RPM}
    )


def idler() -> dict[str, Any]:
    """A wheel between two others, for direction or distance."""
    train = Train("idler").gear("first", 24).gear("idler", 30).gear("last", 36)
    x = train.distance_mm("first", "idler")
    train.body("input", {"first": 0.0}).body("between", {"idler": 0.0}, (x, 0.0))
    train.body("output", {"last": 0.0}, (x, train.distance_mm("idler", "last")))
    train.elastic("input").mesh(("first", "input"), ("idler", "between")).mesh(("idler", "between"), ("last", "output"))
    return train.loaded({"input": TORQUE, "output": -TORQUE * 36 / 24}, ["output"], ("input", "output"), "last")


def power_split() -> dict[str, Any]:
    """A pinion drives two countershafts, which drive one bull wheel."""
    train = Train("power split").gear("pinion", 24).gear("wheel", 48).gear("small", 24).gear("bull", 96)
    first, second = train.distance_mm("pinion", "wheel"), train.distance_mm("small", "bull")
    # Input and bull wheel on one axis would need equal distances; the bull wheel stands below, symmetric to both.
    x = 0.9 * first
    y = math.sqrt(first**2 - x**2)
    below = y - math.sqrt(second**2 - x**2)
    train.body("input", {"pinion": 0.0}).body("output", {"bull": 50.0}, (0.0, below))
    train.elastic("input")
    for side, sign in (("left", -1.0), ("right", 1.0)):
        train.body(side, {"wheel": 0.0, "small": 50.0}, (sign * x, y))
        train.mesh(("pinion", "input"), ("wheel", side), f"in_{side}").mesh(
            ("small", side), ("bull", "output"), f"out_{side}"
        )
    return train.loaded({"input": TORQUE, "output": -TORQUE * 2.0 * 4.0}, ["output"], ("input", "output"), "bull")


def stepped_planets() -> dict[str, Any]:
    """Planets with two wheels: the large one on the sun, the small one in the ring that is held."""
    train = Train("stepped planets").gear("sun", 24).gear("large", 42).gear("small", 24).gear("ring", 90, internal=True)
    train.planets("planet", {"large": 0.0, "small": 50.0}, train.distance_mm("sun", "large"), 3)
    train.housing({"ring": 50.0}).body("sun", {"sun": 0.0}).body("carrier", mass=5.0, axial=2e-2)
    train.elastic("sun").mesh(("sun", "sun"), ("large", "planet")).mesh(("small", "planet"), ("ring", "housing"))
    ratio = 1.0 + 42 * 90 / (24 * 24)
    return train.loaded({"sun": TORQUE, "carrier": -ratio * TORQUE}, ["carrier"], ("sun", "carrier"), "large")


def meshing_planets() -> dict[str, Any]:
    """Ravigneaux set: the small sun drives short planets, these long ones, these the ring; one sun is held."""
    train = Train("meshing planets").gear("small_sun", 24).gear("short", 18).gear("long", 21, face_mm=75.0)
    train.gear("large_sun", 30).gear("ring", 72, internal=True)
    inner, outer = train.distance_mm("small_sun", "short"), train.distance_mm("long", "ring")
    between = train.distance_mm("short", "long")
    turn = math.degrees(math.acos((inner**2 + outer**2 - between**2) / (2.0 * inner * outer)))
    train.planets("short", {"short": -20.0}, inner, 3).planets("long", {"long": 0.0}, outer, 3, start_deg=turn)
    train.housing({"large_sun": 20.0}).body("small_sun", {"small_sun": -20.0}).body("ring", {"ring": 20.0})
    train.body("carrier", mass=5.0, axial=2e-2)
    train.elastic("small_sun").mesh(("small_sun", "small_sun"), ("short", "short")).mesh(
        ("short", "short"), ("long", "long")
    )
    train.mesh(("long", "long"), ("large_sun", "housing")).mesh(("long", "long"), ("ring", "ring"))
    ratio = (1.0 / 3.0 + 24 / 30) / (1.0 + 24 / 30)  # of the ring's speed to the small sun's
    torques = {"small_sun": TORQUE, "ring": -TORQUE / ratio}
    return train.loaded(torques, ["ring"], ("small_sun", "ring"), "ring")


def wind() -> dict[str, Any]:
    """Two planetary stages and a parallel one, as in wind turbines of some megawatts."""
    train = Train("wind", helix_deg=8.0)
    for stage, hand in (("1", 1), ("2", -1)):
        train.gear(f"sun_{stage}", 24, hand).gear(f"planet_{stage}", 24, -hand)
        train.gear(f"ring_{stage}", 72, -hand, internal=True)
    train.gear("wheel", 60, 1).gear("pinion", 24, -1)
    train.housing({"ring_1": 0.0, "ring_2": 150.0})
    train.body("carrier_1", mass=5.0, axial=2e-2).body("middle", {"sun_1": 0.0}, mass=5.0, axial=2e-2)
    train.body("low", {"sun_2": 150.0, "wheel": 250.0})
    train.body("high", {"pinion": 250.0}, (0.0, train.distance_mm("pinion", "wheel")))
    for stage, carrier, z in (("1", "carrier_1", 0.0), ("2", "middle", 150.0)):
        sun, planet, ring = (f"{name}_{stage}" for name in ("sun", "planet", "ring"))
        train.planets(planet, {planet: z}, train.distance_mm(sun, planet), 3, carrier=carrier)
        train.mesh((sun, {"1": "middle", "2": "low"}[stage]), (planet, planet))
        train.mesh((planet, planet), (ring, "housing"))
    train.elastic("high").mesh(("pinion", "high"), ("wheel", "low"))
    torques = {"carrier_1": 40.0 * TORQUE, "high": TORQUE}
    return train.loaded(torques, ["high"], ("carrier_1", "high"), "pinion", start_speed_rpm=SPEED_RPM / 40.0)


def rotor() -> dict[str, Any]:
    """Two discs on one coupling: a rotor without gears."""
    train = Train("rotor").body("motor").body("fan", axial=8e-3).elastic("motor")
    train.content["couplings"] = {"shaft": {"bodies": ["motor", "fan"], "stiffness_N_m_per_rad": 1e4}}
    return train.loaded({"motor": TORQUE, "fan": -TORQUE}, ["fan"], ("motor", "fan"), None)


def reversed_torque(content: dict[str, Any]) -> dict[str, Any]:
    """The same train with all torques the other way round: it is driven from its output."""
    for load in (content["static_load"], *content["load_cases"].values()):
        load["torques_N_m"] = {name: -torque for name, torque in load["torques_N_m"].items()}
    return content


KINDS: dict[str, Callable[[], dict[str, Any]]] = {
    "single pair": pair,
    "larger wheel as pinion": lambda: pair(swapped=True),
    "reversed torque": lambda: reversed_torque(pair()),
    "wide face": lambda: pair(helix_deg=25.0, face_mm=100.0),
    "internal pair": internal_pair,
    "two stages": two_stage,
    "idler": idler,
    "power split": power_split,
    "planetary, ring held": lambda: planetary("ring"),
    "planetary, sun held": lambda: planetary("sun"),
    "planetary, carrier held": lambda: planetary("carrier"),
    "planetary, reversed torque": lambda: reversed_torque(planetary("ring")),
    "one planet": lambda: planetary("ring", 1),
    "two planets": lambda: planetary("ring", 2),
    "planets, unevenly spaced": unevenly_spaced,
    "differential": differential,
    "stepped planets": stepped_planets,
    "meshing planets": meshing_planets,
    "wind turbine": wind,
    "rotor without gears": rotor,
}
"""All of them by their name."""
