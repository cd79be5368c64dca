"""Torques and speeds of a REXS file, at rest and by load case, on the bodies of the gearbox file."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from exugear.rexs.faults import RexsError
from exugear.rexs.to_case.bodies import Bodies, Body
from exugear.rexs.to_case.notes import Block, Entry, Notes, assumed, derived, read, tidy
from exugear.rexs.to_case.places import Places
from exugear.rexs.tree import Attribute, Component, LoadCase, Model

FORCES = ("force_u_direction", "force_v_direction", "force_w_direction")
UNKNOWN_TORQUE = 100.0
"""Torque where the file gives none, N m."""
LEAST_SHARE = 0.1
"""Speed at the start of a run-up over that at its end."""


@dataclass(frozen=True)
class Loads:
    """Torques (N m) and speeds (rpm) on bodies, positive about +z.

    Attributes
    ----------
    name : str
        Of the load case.
    description : str
    torques, speeds : mapping of body name to float
    """

    name: str
    description: str
    torques: Mapping[str, float]
    speeds: Mapping[str, float]


@dataclass(frozen=True)
class Ends:
    """Bodies at which the gearbox is driven and loaded, and why these."""

    input: str
    output: str
    reason: str


def loads_of(model: Model, places: Places, bodies: Bodies, notes: Notes) -> list[Loads]:
    """Gather the loads of each load case, or of the file itself if it has none."""
    forced = [part for part in model.of_type("external_load") if _has_forces(part)]
    forced += [
        model.components[number]
        for case in model.load_cases
        for number, changes in case.changes.items()
        if number in model.components and _has_forces(Component(number, "", "", changes))
    ]
    for part in dict.fromkeys(forced):
        notes.ignored.append(f"{part}: point forces, which a gearbox file cannot hold")
    return [_loads(model, places, bodies, case) for case in model.load_cases or (None,)]


def _has_forces(part: Component) -> bool:
    return any(part.quantity(key, "N") for key in FORCES)


def _loads(model: Model, places: Places, bodies: Bodies, case: LoadCase | None) -> Loads:
    changes = case.changes if case else {}
    speeds: dict[str, float] = {}
    for shaft in _changed(model.of_type("shaft"), changes):
        body, speed = bodies.of_any(shaft), shaft.quantity("rotational_speed", "1 / min")
        if body is not None and speed is not None and not body.fixed:
            speeds.setdefault(body.name, tidy(places.sense(shaft) * speed))
    torques: dict[str, float] = {}
    for load in _changed(model.of_type("external_load"), changes):
        body, torque = _owner(model, bodies, load), _torque(model, places, load, speeds, bodies)
        if body is not None and torque and load.flag("transmits_torque") is not False:
            torques[body.name] = torques.get(body.name, 0.0) + torque
    share = None
    for unit in _changed(model.of_type("gear_unit"), changes):
        share = unit.quantity("operating_time_fraction", "%")
    name = f"load_case_{case.number}" if case else "nominal"
    return Loads(name, "" if share is None else f"{share:g} % of the operating time", torques, speeds)


def _changed(parts: Sequence[Component], changes: Mapping[int, Mapping[str, Attribute]]) -> list[Component]:
    return [part.with_attributes(changes[part.number]) if part.number in changes else part for part in parts]


def _shaft(model: Model, load: Component) -> Component | None:
    owners = [
        one for kind in ("assembly", "ordered_assembly") for one in model.related(kind, "part", load.number, "assembly")
    ]
    return next((one for one in owners if one.type in ("shaft", "side_plate", "planet_carrier")), None)


def _owner(model: Model, bodies: Bodies, load: Component) -> Body | None:
    shaft = _shaft(model, load)
    body = bodies.of_any(shaft) if shaft else None
    return None if body is None or body.fixed or body.carrier else body


def _torque(model: Model, places: Places, load: Component, speeds: Mapping[str, float], bodies: Bodies) -> float | None:
    """Torque of a load about +z, N m; from its power and the speed of its body where the file gives no torque."""
    shaft, body = _shaft(model, load), _owner(model, bodies, load)
    if shaft is None or body is None:
        return None
    torque = load.quantity("torque_around_u_axis", "N m")
    if torque is not None:
        return tidy(places.sense(shaft) * torque)
    power, speed = load.quantity("power", "kW"), speeds.get(body.name)
    if power and speed:
        return tidy(1e3 * power / (speed * math.pi / 30.0))
    return None


def ends_of(model: Model, bodies: Bodies, loads: Sequence[Loads], links: Mapping[str, int]) -> Ends:
    """Tell input and output of the gearbox.

    Parameters
    ----------
    links : mapping of body name to int
        Number of meshes of each body that turns.

    Raises
    ------
    RexsError
        The file does not tell them.
    """
    turning = [body for body in bodies.members if not body.fixed and not body.carrier]
    links = {body.name: links[body.name] for body in turning if body.name in links}
    if len(links) < 2:
        raise RexsError(
            f"only {', '.join(links) or 'nothing'} can turn in mesh, all else is joined with the casing: "
            "a gearbox has an input and an output; open one of the connections with the casing"
        )
    defined = {b.name for b in turning for part in b.parts if part.flag("defines_speed") is True}
    loaded = [
        body.name
        for part in model.of_type("external_load")
        if part.flag("transmits_torque") is not False and (body := _owner(model, bodies, part)) is not None
    ]
    given = [name for one in loads for name in one.torques]
    candidates = [name for name in given if name in defined] or given or [n for n in loaded if n in defined] or loaded
    candidates = candidates or [name for name in links if name in defined] or list(links)
    first = candidates[0]
    others = [name for name in dict.fromkeys(loaded) if name != first]
    why = "bodies with an external_load; the input has the torque or defines the speed"
    if not others:
        others = [name for name, count in links.items() if count == 1 and name != first]
        why = "the file loads one body only; the output is the other end of the train"
    if not others:
        raise RexsError("no external_load tells which shafts are driven and loaded: add one on each of them")
    return Ends(first, others[-1], why)


def static_load(loads: Sequence[Loads], ends: Ends) -> Entry:
    """Torque of the static state: the largest of all load cases at the input."""
    torques = [one.torques[ends.input] for one in loads if one.torques.get(ends.input)]
    if not torques:
        return assumed({ends.input: UNKNOWN_TORQUE}, "the file gives no torque: SET IT")
    source = "torque_around_u_axis, or power over speed" + ("; the largest of the load cases" if len(loads) > 1 else "")
    return read({ends.input: max(torques, key=abs)}, source)


def load_case_blocks(loads: Sequence[Loads], ends: Ends, static: float, ratio: float) -> dict[str, Block]:
    """Tables of the load cases: each at its speed with balanced torques, and a run-up to the fastest.

    Parameters
    ----------
    static : float
        Torque of the static state at the input, N m.
    ratio : float
        Speed of the output over that of the input.
    """
    blocks = {}
    fastest = 0.0
    for one in loads:
        torque = one.torques.get(ends.input) or static
        speed = _input_speed(one, ends, ratio)
        fastest = max(fastest, speed, key=abs)
        entries = {"description": Entry(one.description)} if one.description else {}
        entries["torques_N_m"] = _balanced(ends, torque, ratio)
        if speed:
            entries["start_speed_rpm"] = read(tidy(speed), f"rotational_speed, at {ends.input}")
        entries["duration_s"] = assumed(1.0, "")
        blocks[one.name] = Block("", entries)
    if fastest:
        blocks["run_up"] = _run_up(ends, static, ratio, fastest)
    return blocks


def _balanced(ends: Ends, torque: float, ratio: float) -> Entry:
    return derived({ends.input: torque, ends.output: _rounded(-torque / ratio)}, "the output holds the balance")


def _run_up(ends: Ends, torque: float, ratio: float, speed: float) -> Block:
    return Block(
        "",
        {
            "description": Entry("the input is driven up to its speed, the output loaded"),
            "torques_N_m": derived({ends.output: _rounded(-torque / ratio)}, "as in the static state"),
            "driven_body": Entry(ends.input),
            "start_speed_rpm": assumed(tidy(LEAST_SHARE * speed), ""),
            "end_speed_rpm": derived(tidy(speed), "the fastest of the file"),
            "drive_stiffness_N_m_per_rad": assumed(
                tidy(max(100.0 * abs(torque), 10.0)), "the torque of the static state twists it by 0.01 rad"
            ),
            "duration_s": assumed(5.0, ""),
        },
    )


def _input_speed(loads: Loads, ends: Ends, ratio: float) -> float:
    if ends.input in loads.speeds:
        return loads.speeds[ends.input]
    return loads.speeds.get(ends.output, 0.0) / ratio


def _rounded(torque: float) -> float:
    return float(f"{torque:.8g}") + 0.0
