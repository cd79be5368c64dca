"""Figures of lives: safeties, damages and hours of gears and bearings, as the verb `life` tells them.

Of several planets the one that is worn most is rated. A damage without end is infinite, and so is a life that nothing
ends.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping

from exugear.studies.figures.point_results import PointError, PointResults

SAFETIES: Mapping[str, str] = {"life": "{}_safety", "static": "{}_static", "iso6336": "standard_{}_safety"}
"""Words of the option `of`: over the life, under the largest load, over the life by stresses of the standard."""
LIVES: Mapping[str, str] = {"L10": "basic", "L10r": "reference", "L10m": "modified"}
"""Words of the option `by`."""
LEAST = "least"
"""Word of the option `by`: whichever is worst for a bearing."""
Worst = Callable[[Iterable[float]], float]


def contact_safeties(results: PointResults, *, of: str = "life") -> dict[str, float]:
    """Safety S_H against pitting by gear, flank and meshes, the worst of planets."""
    return _of_flanks(results, SAFETIES[of].format("contact"))


def root_safeties(results: PointResults, *, of: str = "life") -> dict[str, float]:
    """Safety S_F against breakage of teeth by gear, flank and meshes, the worst of planets."""
    return _of_flanks(results, SAFETIES[of].format("root"))


def contact_damages(results: PointResults) -> dict[str, float]:
    """Miner's sum of pitting by gear, flank and meshes, the worst of planets."""
    return _of_flanks(results, "contact_damage")


def root_damages(results: PointResults) -> dict[str, float]:
    """Miner's sum of breakage of teeth by gear, flank and meshes, the worst of planets."""
    return _of_flanks(results, "root_damage")


def worst_planets(results: PointResults) -> dict[str, float]:
    """Which planet's flanks are worn most, by gear, flank and meshes: its number; none where there is but one body."""
    data = results.life
    holders = zip(data["flank"].to_numpy().tolist(), data["flank_contact_holder"].to_numpy().tolist(), strict=True)
    return {str(label): _number_of(str(holder)) for label, holder in holders}


def contact_safety(results: PointResults, *, gear: str = "", of: str = "life") -> float:
    """Least safety S_H against pitting, of all gears or of one."""
    return _worst(contact_safeties(results, of=of), gear, min)


def root_safety(results: PointResults, *, gear: str = "", of: str = "life") -> float:
    """Least safety S_F against breakage of teeth, of all gears or of one."""
    return _worst(root_safeties(results, of=of), gear, min)


def contact_damage(results: PointResults, *, gear: str = "") -> float:
    """Largest Miner's sum of pitting, of all gears or of one."""
    return _worst(contact_damages(results), gear, max)


def root_damage(results: PointResults, *, gear: str = "") -> float:
    """Largest Miner's sum of breakage of teeth, of all gears or of one."""
    return _worst(root_damages(results), gear, max)


def bearing_lives(results: PointResults, *, by: str = LEAST) -> dict[str, float]:
    """Hours until bearings fail by L10, L10r or L10m, or by whichever is least."""
    return _of_bearings(results, "hours", by, min)


def bearing_damages(results: PointResults, *, by: str = LEAST) -> dict[str, float]:
    """Miner's sum of bearings by L10, L10r or L10m, or by whichever is worst."""
    return _of_bearings(results, "damage", by, max)


def static_safeties(results: PointResults) -> dict[str, float]:
    """Safety S_0 of bearings under the largest load."""
    data = results.life
    return dict(
        zip(map(str, data["bearing"].to_numpy()), map(float, data["bearing_static_safety"].to_numpy()), strict=True)
    )


def bearing_life(results: PointResults, *, bearing: str = "", by: str = LEAST) -> float:
    """Least hours until a bearing fails, of all or of one."""
    return _worst(bearing_lives(results, by=by), bearing, min)


def bearing_damage(results: PointResults, *, bearing: str = "", by: str = LEAST) -> float:
    """Largest Miner's sum of bearings, of all or of one."""
    return _worst(bearing_damages(results, by=by), bearing, max)


def static_safety(results: PointResults, *, bearing: str = "") -> float:
    """Least static safety S_0 of bearings, of all or of one."""
    return _worst(static_safeties(results), bearing, min)


def life_hours(results: PointResults) -> float:
    """Hours of operation until the first Miner's sum of a gear or a bearing is one."""
    from exugear.life.life_file import limits

    largest = max((damage for _, _, damage in limits(results.life)), default=math.nan)
    hours = float(results.life["hours"].sum())
    if largest > 0.0:
        return hours / largest
    if math.isnan(largest):
        return math.nan
    return math.inf


def shortfalls(results: PointResults) -> float:
    """How many sentences the verb `life` ends with: parts that fail, or fall short of what is asked for."""
    return float(sum(len(json.loads(results.life.attrs[key])) for key in ("failures", "shortfalls")))


def _of_flanks(results: PointResults, key: str) -> dict[str, float]:
    data = results.life
    return dict(zip(map(str, data["flank"].to_numpy()), map(float, data[f"flank_{key}"].to_numpy()), strict=True))


def _of_bearings(results: PointResults, key: str, by: str, worst: Worst) -> dict[str, float]:
    """Figures by bearing, of one kind of life or the worst of all that are known."""
    data = results.life
    names = [_name_of(kind, key) for kind in (LIVES.values() if by == LEAST else [LIVES[by]])]
    columns = zip(*(data[name].to_numpy().tolist() for name in names), strict=True)
    known = [[value for value in column if not math.isnan(value)] for column in columns]
    found = [worst(values) if values else math.nan for values in known]
    return dict(zip(map(str, data["bearing"].to_numpy()), found, strict=True))


def _name_of(kind: str, key: str) -> str:
    if (kind, key) == ("basic", "damage"):
        return "bearing_damage"
    return f"bearing_{kind}_{key}"


def _worst(values: Mapping[str, float], part: str, worst: Worst) -> float:
    """Least or largest of those that are known, of all parts or of one."""
    own = {name: value for name, value in values.items() if part in ("", name, name.split(" ")[0])}
    known = [value for value in own.values() if not math.isnan(value)]
    if not known:
        raise PointError(f"{part or 'no part'}: the life of this gearbox has no such figure; `exugear life` says why")
    return worst(known)


def _number_of(holder: str) -> float:
    number = holder.rpartition("_")[2]
    if number.isdecimal():
        return float(number)
    return math.nan
