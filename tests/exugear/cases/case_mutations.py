"""Gearbox files gone wrong: a seeded mutator over the keys of the case model, and over the text of the file."""

from __future__ import annotations

import copy
import datetime
import json
import math
import random
import shutil
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import numpy as np
from pydantic import BaseModel

from exugear.gearbox.sections.case import GearboxFile
from exugear.gearbox.sections.entries import Range
from exugear.system.bodies.matrix_files.files import file_contents

from .beams import beams_between
from .box import boxed, write_plate
from .spur import SPUR_CASE

GRC = Path(__file__).parents[3] / "cases" / "grc750"
JUNK: tuple[Any, ...] = (
    "20", "", " ", "yes", "ground", "räder", "a b", "x\ny", "\x00", "\x1b[31m", "[/]", "${HOME}", "../../etc/passwd",
    "<img src=x onerror=alert(1)>", "n" * 100_000, "\U0001f600",
    True, False, 0, 1, -1, 7, 20.0, 0.0, -0.0, -1.0, 1e-300, 5e-324, 1e300, -1e300, 1e9, -1e9, 1e30,
    math.nan, math.inf, -math.inf, 10**9, 2**63, -(2**63), 2**70, 10**400, 16**6000,
    [], {}, [[]], [{}], [1, 2], [1.0, 2.0, 3.0], ["a"], {"a": 1}, [0.0] * 1000, [[0.0] * 6] * 6,
    datetime.date(2024, 2, 30 - 1),
)  # fmt: skip


def bases(folder: Path) -> dict[str, dict[str, Any]]:
    """Cases to start from, whose files are written into `folder`: all verbs' inputs occur in one of them."""
    for file in GRC.iterdir():
        if file.is_file() and file.suffix not in (".toml", ".py", ".md"):
            shutil.copy(file, folder)
    write_plate(folder / "plate.vtu")
    (folder / "series.csv").write_text("time_s,shaft_1_N_m\n0.0,100.0\n1.0,120.0\n", encoding="utf-8")
    (folder / "flank.csv").write_text("radius_mm,-7.0,7.0\n29.0,1.0,0.0\n31.0,0.0,2.0\n", encoding="utf-8")
    rows = "".join(f"{speed},6,{0.01 * speed},5.0\n" for speed in (0, 1000, 2300))
    (folder / "ripple.csv").write_text(f"speed_rpm,order,amplitude_N_m,phase_deg\n{rows}", encoding="utf-8")
    grc = tomllib.loads((GRC / "gearbox.toml").read_text(encoding="utf-8"))
    return {
        "grc": grc,
        "everything": _with_errors(grc),
        "spur": tomllib.loads(SPUR_CASE),
        "modified": _modified(),
        "planetary": _planetary(grc),
        "shafts": shaped_shafts(),
        "box": _with_box(),
        "matrices": _with_matrices(folder),
    }


def _with_errors(grc: dict[str, Any]) -> dict[str, Any]:
    """All sections that a case can have."""
    case = copy.deepcopy(grc)
    case["deviations"] = {
        "planet": {"body": "planet_1", "runout_um": 20.0, "runout_angle_deg": 30.0},
        "hss": {"body": "hss", "gear": "hs_pinion", "cumulative_pitch_um": [float(n % 3) for n in range(22)]},
    }
    case["pins"] = {"first": {"body": "planet_1", "radial_um": 30.0, "tangential_um": -40.0}}
    ripple = {"body": "hss", "orders": [6, 12], "torque_N_m": [30.0, 12.0], "phase_deg": [0.0, 45.0], "pole_pairs": 2}
    growth = {"speed_exponent": 2.0, "reference_speed_rpm": 22.0}
    blades = {"body": "lss", "z_mm": 200.0, "orders": [3], "force_N": [[50.0, 0.0, 9.0]], "moment_N_m": [[4.0, 0.0]]}
    case["excitations"] = {
        "ripple": ripple | {"enabled": True, "description": "generator"},
        "blades": blades | {"direction": "fixed"},
        "unbalance": {"body": "planet_1", "z_mm": 100.0, "unbalance_g_mm": 500.0},
        "machine": {"body": "hss", "table": "ripple.csv", "pole_pairs": 2, "reaction_on": "housing"},
        "propeller": {"body": "carrier", "orders": [0.5, 5], "torque_percent": [0.02, 0.4]} | growth,
    }
    case["bodies"]["main_shaft"]["enabled"] = True
    case["bodies"]["housing"]["solid"]["seats"]["machine"] = {"same_as": "hss_bc"}
    case["ste"] = {"positions": 20, "grid": True, "torque_factors": [0.5, 1.0], "misalignment_um": [0.0, 30.0]}
    return case


def _modified() -> dict[str, Any]:
    case = tomllib.loads(SPUR_CASE)
    case["gears"]["pinion"]["modification"] = {
        "tip_relief_um": 20.0, "tip_relief_length_mm": 2.0, "root_relief_um": 5.0, "root_relief_length_mm": 1.0,
        "root_relief_shape": "parabolic", "lead_crowning_um": 5.0, "profile_crowning_um": 2.0, "helix_slope_um": -3.0,
        "twist_um": 1.0, "profile_slope_um": 1.0, "topography": "flank.csv",
    }  # fmt: skip
    case["gears"]["wheel"] |= {
        "rack": {"addendum": 0.95, "dedendum": 1.25, "tip_radius": 0.3},
        "tooth_thinning_mm": 0.1,
    }
    case["gears"]["wheel"]["material"] = {
        "youngs_modulus_GPa": 110.0,
        "poissons_ratio": 0.28,
        "density_kg_per_m3": 7200.0,
    }
    case["load_cases"]["series"] = {"torque_series": "series.csv", "torques_N_m": {"shaft_2": 140.0}}
    case["load_cases"]["driven"] = {
        "torques_N_m": {"shaft_2": 140.0}, "driven_body": "shaft_1", "end_speed_rpm": 100.0,
        "drive_stiffness_N_m_per_rad": 1e5, "start_speed_rpm": 10.0, "description": "driven",
    }  # fmt: skip
    rows = [[0.0] * 6 for _ in range(6)]
    for place, value in enumerate((2e7, 3e7, 1e8, 1e6, 1e6, 0.0)):
        rows[place][place] = value
    case["bearings"]["bearing_1"]["stiffness"] = {"matrix": rows}
    case["bearings"]["bearing_1"]["damping"] = {"radial_N_s_per_m": 100.0, "axial_N_s_per_m": 10.0}
    case["gears"]["wheel"]["held_diameter_mm"] = 64.0  # around the bearing
    case["bearings"]["bearing_2"] = {
        "body": "shaft_2", "z_mm": 0.0, "stiffness": {"axial_N_per_m": 1e8, "tilt_N_m_per_rad": 1e5},
        "catalogue": {"type": "cylindrical_roller", "bore_mm": 30.0, "outer_diameter_mm": 62.0, "width_mm": 16.0,
                      "radial_load_kN": 3.0, "radial_clearance_mm": 0.01},
    }  # fmt: skip
    return case


def _planetary(grc: dict[str, Any]) -> dict[str, Any]:
    """Planetary stage of the GRC by itself, on given stiffnesses."""
    gears = {name: copy.deepcopy(grc["gears"][name]) for name in ("sun", "planet", "ring")}
    mass = {"mass_kg": 100.0, "axial_kg_m2": 3.0, "transverse_kg_m2": 2.0, "centre_of_mass_z_mm": 0.0}
    held = {"radial_N_per_m": 1e9, "axial_N_per_m": 1e9, "tilt_N_m_per_rad": 1e7}
    return {
        "name": "planetary stage",
        "default_inertias": "given",
        "overall": {"input": "carrier", "output": "shaft", "output_gear": "sun"},
        "static_load": {"torques_N_m": {"carrier": 240e3}, "locked": ["shaft"]},
        "gears": gears,
        "pairs": {name: copy.deepcopy(grc["pairs"][name]) for name in ("sun_planet", "ring_planet")},
        "bodies": {
            "rim": {"fixed": True, "axis_position_mm": [0.0, 0.0], "gears_z_mm": {"ring": 0.0}},
            "carrier": {"axis_position_mm": [0.0, 0.0], "inertia": {"given": mass}},
            "planet": {"carrier": "carrier", "orbit_radius_mm": 308.0, "planet_angles_deg": [0.0, 120.0, 240.0],
                       "gears_z_mm": {"planet": 0.0}, "inertia": {"given": mass}},
            "shaft": {"axis_position_mm": [0.0, 0.0], "gears_z_mm": {"sun": 0.0}, "inertia": {"given": mass}},
        },
        "meshes": {
            "sun_planet": {"pair": "sun_planet", "pinion_body": "shaft", "gear_body": "planet"},
            "ring_planet": {"pair": "ring_planet", "pinion_body": "planet", "gear_body": "rim"},
        },
        "joints": {"carrier": {"body": "carrier", "z_mm": 0.0}, "shaft": {"body": "shaft", "z_mm": 0.0},
                   "pin": {"body": "planet", "on": "carrier", "z_mm": 0.0}},
        "bearings": {
            "carrier": {"body": "carrier", "on": "rim", "z_mm": 50.0, "stiffness": held},
            "shaft": {"body": "shaft", "z_mm": 50.0, "stiffness": held},
            "pin": {"body": "planet", "on": "carrier", "z_mm": 0.0, "stiffness": held},
        },
        "pins": {"one": {"body": "planet_2", "radial_um": 10.0}},
        "load_cases": {"run_up": {"torques_N_m": {"carrier": 240e3, "shaft": -38e3}}},
    }  # fmt: skip


def shaped_shafts() -> dict[str, Any]:
    """The spur pair on two flexible shafts, one with a force."""
    case = tomllib.loads(SPUR_CASE)
    for name, gear in (("shaft_1", "pinion"), ("shaft_2", "wheel")):
        case["bodies"][name] |= {
            "flexibility": "nonrotating",
            "shape": {
                "start_z_mm": -60.0,
                "torque_z_mm": 60.0,
                "sections": [
                    {"length_mm": 60.0, "outer_diameter_mm": 20.0},
                    {"length_mm": 60.0, "outer_diameter_mm": 25.0, "inner_diameter_mm": 5.0},
                ],
                "material": {"youngs_modulus_GPa": 206.0},
                "blanks": {"torque": {"mass_kg": 0.2, "axial_kg_m2": 1e-4, "transverse_kg_m2": 1e-4}},
            },
        }  # fmt: skip
        case["bodies"][name]["gears_z_mm"] = {gear: 20.0}
    for number in (1, 2):
        case["bearings"][f"bearing_{number}"]["z_mm"] = -40.0
    belt = {"force_N": [0.0, -200.0, 50.0], "moment_N_m": [1.0, 0.0]}
    case["forces"] = {"belt": {"body": "shaft_1", "z_mm": -30.0, **belt}}
    return case


def _with_box() -> dict[str, Any]:
    return boxed(4000.0, length_unit_mm=1.0, element_size_mm=5.0, elements_around=12, loss_factor=0.02)


def _with_matrices(folder: Path) -> dict[str, Any]:
    """The spur pair in a frame of beams from matrices, which are written into the folder."""
    places = np.array([[0.0, 0.0, 0.0], [0.075, 0.0, 0.0], [0.05, 0.0, -0.012]])
    for name, content in file_contents(
        beams_between(places, (1, 2, 3), 0.01).from_si("mm-t-s"), "frame", "op4"
    ).items():
        (folder / name).write_bytes(content)
    case = _with_box()
    del case["bodies"]["box"]["solid"]
    case["bodies"]["box"]["external"] = {
        "file": "frame.op4", "nodes": "frame-nodes.pch", "units": "mm-t-s", "stiffness_name": "KAAX",
        "mass_name": "MAAX", "constraint": "rbe3", "loss_factor": 0.02,
        "shift_mm": [0.0, 0.0, 0.0], "turn_deg": [0.0, 0.0, 0.0],
        "seats": {"bearing_1": {"node": 1}, "foot": {"position_mm": [50.0, 0.0, -12.0]}},
    }  # fmt: skip
    return case


def mutant(starts: dict[str, dict[str, Any]], seed: int) -> tuple[str, str]:
    """Text of one damaged file, and what it came from; the same seed gives the same."""
    rng = random.Random(seed)
    name = rng.choice(list(starts))
    content = copy.deepcopy(starts[name])
    done = []
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        change = rng.choice(_CHANGES)
        done.append(change(content, rng))
    text = toml_text(content)
    if rng.random() < 0.06:
        text = rng.choice(_TEXT_CHANGES)(text, rng)
        done.append("text")
    return text, f"seed {seed}: {name}: {'; '.join(done)}"


# -- changes of the content ---------------------------------------------------------------------------------------


def _leaves(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Paths of all values that are no tables."""
    entries = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, entry in entries:
        if not isinstance(entry, dict):
            yield (*path, key)
        yield from _leaves(entry, (*path, key))


def _tables(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Paths of all tables."""
    if isinstance(value, dict):
        yield path
        for key, entry in value.items():
            yield from _tables(entry, (*path, key))


def _at(content: Any, path: tuple[Any, ...]) -> Any:
    for part in path:
        content = content[part]
    return content


def _put(content: Any, path: tuple[Any, ...], value: Any) -> str:
    _at(content, path[:-1])[path[-1]] = value
    return f"{'.'.join(map(str, path))} = {_short(value)}"


def _short(value: Any) -> str:
    if isinstance(value, int) and value.bit_length() > 64:
        return f"int of {value.bit_length()} bits"
    return repr(value)[:60]


def _any_leaf(content: Any, rng: random.Random) -> tuple[Any, ...]:
    return rng.choice(list(_leaves(content)))


def _junk(content: Any, rng: random.Random) -> str:
    return _put(content, _any_leaf(content, rng), copy.deepcopy(rng.choice(JUNK)))


def _junk_for_table(content: Any, rng: random.Random) -> str:
    path = rng.choice([path for path in _tables(content) if path])
    return _put(content, path, copy.deepcopy(rng.choice(JUNK)))


def _scaled(content: Any, rng: random.Random) -> str:
    numbers = [path for path in _leaves(content) if type(_at(content, path)) in (int, float)]
    if not numbers:
        return "no numbers left"
    path = rng.choice(numbers)
    value = _at(content, path)
    factor = rng.choice((-1.0, 0.0, 0.5, 2.0, 1.001, 0.999, 1.1, 0.9, 1e-6, 1e-3, 0.1, 10.0, 1e3, 1e6))
    changed = value * factor if math.isfinite(value) and abs(value) < 1e200 else factor
    return _put(content, path, round(changed) if isinstance(value, int) and rng.random() < 0.7 else changed)


def _deleted(content: Any, rng: random.Random) -> str:
    path = rng.choice([*_leaves(content), *(path for path in _tables(content) if path)])
    del _at(content, path[:-1])[path[-1]]
    return f"without {'.'.join(map(str, path))}"


def _misspelt(content: Any, rng: random.Random) -> str:
    path = rng.choice([path for path in _leaves(content) if isinstance(path[-1], str)])
    table = _at(content, path[:-1])
    name = rng.choice((path[-1][:-1] + "x", path[-1].upper(), f" {path[-1]}", "", "a.b", "x\ny", "k" * 100_000, "_"))
    table[name] = table.pop(path[-1]) if rng.random() < 0.7 else table[path[-1]]
    return f"key {name[:20]!r} for {'.'.join(map(str, path))}"


def _names(content: Any) -> list[str]:
    found = {key for path in _tables(content) for key in path if isinstance(key, str)}
    return sorted({*found, "ground", "planet_1", "nobody"})


def _swapped_name(content: Any, rng: random.Random) -> str:
    texts = [path for path in _leaves(content) if isinstance(_at(content, path), str)]
    if not texts:
        return "no names left"
    return _put(content, rng.choice(texts), rng.choice(_names(content)))


def _renamed_entry(content: Any, rng: random.Random) -> str:
    path = rng.choice([path for path in _tables(content) if len(path) > 1] or [("name",)])
    table = _at(content, path[:-1])
    name = rng.choice(_names(content))
    entry = copy.deepcopy(table[path[-1]])
    if rng.random() < 0.5:
        del table[path[-1]]
    table[name] = entry
    return f"{'.'.join(map(str, path))} as {name}"


def _changed_array(content: Any, rng: random.Random) -> str:
    arrays = [path for path in _leaves(content) if isinstance(_at(content, path), list) and _at(content, path)]
    if not arrays:
        return "no arrays left"
    path = rng.choice(arrays)
    values = _at(content, path)
    changed = rng.choice(
        (
            [*values, values[-1]], values[:-1], values[::-1], [*values, *values], values * 2000, values[:1], [values],
            [*values[:-1], rng.choice(JUNK)],
        )
    )  # fmt: skip
    return _put(content, path, copy.deepcopy(changed))


def _other_planets(content: Any, rng: random.Random) -> str:
    sets = [path for path in _leaves(content) if path[-1] == "planet_angles_deg"]
    if not sets:
        return "no planets"
    count = rng.choice((1, 2, 3, 4, 5, 6, 12, 41))
    angles = [360.0 * n / count for n in range(count)]
    return _put(content, rng.choice(sets), rng.choice((angles, [0.0] * count, angles + angles)))


def _other_state(content: Any, rng: random.Random) -> str:
    """What decides on the train: who is held, fixed, enabled, driven, loaded."""
    bodies = list(content["bodies"]) if isinstance(content.get("bodies"), dict) else []
    body = rng.choice([*bodies, "nobody"])
    static = content.get("static_load")
    if isinstance(static, dict) and rng.random() < 0.5:
        key, value = rng.choice(
            (("locked", [body]), ("locked", []), ("locked", bodies), ("torques_N_m", {}), ("torques_N_m", {body: 1.0}),
             ("torques_N_m", {body: -1e4, "shaft_1": 10.0}))
        )  # fmt: skip
        return _put(static, (key,), value)
    if isinstance(content.get("overall"), dict) and rng.random() < 0.4:
        return _put(content["overall"], (rng.choice(("input", "output")),), body)
    if isinstance(content.get("bodies", {}).get(body) if bodies else None, dict):
        key = rng.choice(("fixed", "spin_only", "enabled", "flexibility"))
        value = rng.choice(("none", "elastic", "nonrotating", "ffrf")) if key == "flexibility" else rng.random() < 0.7
        if key == "fixed" and value:
            content["bodies"][body].pop("inertia", None)
        return f"{body}: {_put(content['bodies'][body], (key,), value)}"
    return "nothing"


def _model_tables(value: Any, kind: Any, path: tuple[Any, ...]) -> Iterator[tuple[tuple[Any, ...], type[BaseModel]]]:
    """Path and model of each table of the content that has one."""
    kind = _bare(kind)
    if get_origin(kind) in (Union, UnionType):
        for one in get_args(kind):
            yield from _model_tables(value, one, path)
    elif isinstance(value, dict) and isinstance(kind, type) and issubclass(kind, BaseModel):
        yield path, kind
        for name, field in kind.model_fields.items():
            yield from _model_tables(value.get(name), field.annotation, (*path, name))
    elif isinstance(value, dict) and get_origin(kind) is dict:
        for name, entry in value.items():
            yield from _model_tables(entry, get_args(kind)[1], (*path, name))
    elif isinstance(value, list) and get_origin(kind) is tuple:
        for number, entry in enumerate(value):
            yield from _model_tables(entry, get_args(kind)[0], (*path, number))


def _bare(kind: Any) -> Any:
    while get_origin(kind) is Annotated:
        kind = get_args(kind)[0]
    return kind


def _known_key(content: Any, rng: random.Random) -> str:
    """Set a key that the model knows, there or not, to a value that its range allows, or to one of its ends."""
    path, model = rng.choice(list(_model_tables(content, GearboxFile, ())))
    name = rng.choice(list(model.model_fields))
    field = model.model_fields[name]
    return _put(content, (*path, name), _valid(field.annotation, tuple(field.metadata), content, rng))


def _valid(kind: Any, metadata: tuple[Any, ...], content: Any, rng: random.Random) -> Any:
    """Value of a type, as far as its own type and range tell."""
    if get_origin(kind) is Annotated:
        kind, *more = get_args(kind)
        return _valid(kind, (*metadata, *more), content, rng)
    origin, arguments = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType):
        return _valid(rng.choice([one for one in arguments if one is not type(None)]), (), content, rng)
    if origin is Literal:
        return rng.choice(arguments)
    if origin is dict:
        names = [rng.choice(_names(content)) for _ in range(rng.randrange(3))]
        return {name: _valid(arguments[1], (), content, rng) for name in names}
    if origin is tuple:
        kinds = [arguments[0]] * rng.randrange(5) if arguments[-1] is Ellipsis else list(arguments)
        return [_valid(one, (), content, rng) for one in kinds]
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        return {
            name: _valid(field.annotation, tuple(field.metadata), content, rng)
            for name, field in kind.model_fields.items()
            if field.is_required() or rng.random() < 0.3
        }
    if kind is bool:
        return rng.random() < 0.5
    if kind is str:
        return rng.choice(_names(content))
    limits = next((one for one in metadata if isinstance(one, Range)), Range(-1e3, 1e3))
    return _number(limits, whole=kind is int, rng=rng)


def _number(limits: Range, whole: bool, rng: random.Random) -> float:
    ends = [limits.least, limits.most, *(limits.usual or ())]
    if rng.random() < 0.3:
        value = rng.choice(ends) * rng.choice((1.0, 1.0, 1.0001, 0.9999))
    else:
        largest = max(abs(limits.least), abs(limits.most))
        smallest = limits.least if limits.least > 0.0 else 1e-9 * largest
        value = math.exp(rng.uniform(math.log(smallest), math.log(largest))) * (-1.0 if limits.least < 0.0 else 1.0)
        value *= rng.choice((1.0, -1.0)) if limits.least < 0.0 else 1.0
    return round(value) if whole else value


_CHANGES: tuple[Callable[[Any, random.Random], str], ...] = (
    _junk, _junk, _junk_for_table, _scaled, _scaled, _scaled, _deleted, _misspelt, _swapped_name, _swapped_name,
    _renamed_entry, _changed_array, _other_planets, _other_state, _other_state, _known_key, _known_key, _known_key,
)  # fmt: skip


# -- changes of the text --------------------------------------------------------------------------------------------


_TEXT_CHANGES: tuple[Callable[[str, random.Random], str], ...] = (
    lambda text, rng: text[: rng.randrange(len(text))],
    lambda text, rng: "\ufeff" + text,
    lambda text, rng: text.replace("=", "= \x00", 1),
    lambda text, rng: text + "\nname = 'again'\n",
    lambda text, rng: "deep = " + "[" * 5000 + "]" * 5000 + "\n" + text,
    lambda text, rng: "deep = " + "{a=" * 5000 + "1" + "}" * 5000 + "\n" + text,
    lambda text, rng: "digits = " + "9" * 5000 + "\n" + text,
    lambda text, rng: f"[{'a.' * 3000}b]\n" + text,
    lambda text, rng: "".join(c for c in text if rng.random() > 1e-3),
    lambda text, rng: text.replace("\n", "\r", 3),
)


# -- writing --------------------------------------------------------------------------------------------------------


def toml_text(content: dict[str, Any]) -> str:
    """Text of a TOML file; a line for each key at the top, tables inline."""
    return "".join(f"{_quoted(key)} = {_toml(value)}\n" for key, value in content.items())


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _toml(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_quoted(key)} = {_toml(entry)}" for key, entry in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(_toml(entry) for entry in value) + "]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value) if value.bit_length() < 10_000 else hex(value)
    if isinstance(value, float):
        return repr(value)
    return value.isoformat() if isinstance(value, datetime.date) else _quoted(value)
