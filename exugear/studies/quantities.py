"""Outputs of studies, from modes, static equilibrium, tables, steady-state responses, runs and ratings; their table.

Of the planets of a set, the one with the largest damage is rated. A damage or a life without limit is infinite.
"""

from __future__ import annotations

import inspect
import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from exugear.gearbox.renames import STUDY_RENAMES, renamed_hint
from exugear.gearbox.units import RPM
from exugear.life.life_file import limits
from exugear.steady.mean_system.signals import SURFACE_VELOCITY, named_amplitudes
from exugear.steady.peaks import peaks
from exugear.steady.steady_file import complex_amplitudes
from exugear.studies.point_results import PointError, PointResults
from exugear.studies.sections import suggestion
from exugear.system.modes import FREE_ROTATION, Modes
from exugear.system.signals import SIGNALS
from fe_ste.tools.arrays import Floats
from fe_ste.transmission_error.contact_stress import largest_contact_stress

# Output: one number of a point or several by name, with unit and options

Values = float | Mapping[str, float]
"""One number, or several by name along the output's dimension."""
Needs = Literal["", "run", "steady", "life", "bearings"]
"""Source of an output other than modes, tables and the static state: a run, a steady-state response, a rating or the
bearings in it."""


class OutputError(ValueError):
    """Error: an unknown output, or options that it does not have."""


@dataclass(frozen=True)
class OutputKind:
    """Kind of output of a point."""

    function: Callable[..., Values]
    """Function of `PointResults` and keyword options, at module level so that workers can import it. Each option is a
    keyword-only parameter; its annotation gives its type, a default makes it optional."""
    units: str
    dimension: str = ""
    """Name of the dimension of several numbers; empty for a single number."""
    needs: Needs = ""
    """{"", "run", "steady", "life", "bearings"}: source of the output; empty for modes, tables and the static state."""

    @property
    def description(self) -> str:
        """Description in one line."""
        return (inspect.getdoc(self.function) or "").split("\n")[0]

    def check(self, name: str, options: Mapping[str, Any]) -> None:
        """Refuse unknown options, options of a wrong type, and missing ones."""
        known = {
            key: parameter
            for key, parameter in inspect.signature(self.function).parameters.items()
            if parameter.kind is inspect.Parameter.KEYWORD_ONLY
        }
        for key, value in options.items():
            if key not in known:
                hint = suggestion(key, known, f"its options are {', '.join(known) or 'none'}")
                raise OutputError(f"outputs.{name}.{key}: no such option; {hint}")
            if not _fits(value, str(known[key].annotation)):
                raise OutputError(f"outputs.{name}.{key} = {value!r}: must be {_WORDS[str(known[key].annotation)]}")
        for key, parameter in known.items():
            if parameter.default is inspect.Parameter.empty and key not in options:
                raise OutputError(f"outputs.{name}.{key}: this option is missing")


_WORDS = {
    "float": "a number",
    "int": "a whole number",
    "str": "text in quotes",
    "bool": "true or false",
    "Sequence[float]": "an array of numbers",
}
_TYPES: dict[str, tuple[type, ...]] = {"float": (int, float), "int": (int,), "str": (str,), "bool": (bool,)}


def _fits(value: object, kind: str) -> bool:
    if kind == "Sequence[float]":
        return isinstance(value, list) and bool(value) and all(_fits(entry, "float") for entry in value)
    return isinstance(value, _TYPES[kind]) and (kind == "bool" or not isinstance(value, bool))


def frequencies(results: PointResults, *, count: int = 12) -> dict[str, float]:
    """Eigenfrequencies, the lowest first, without free rotation."""
    modes = results.modes
    elastic = [n for n, name in enumerate(modes.names) if name != FREE_ROTATION][:count]
    return {str(number): float(modes.frequency[n]) for number, n in enumerate(elastic, start=1)}


def nearest_frequency(results: PointResults, *, near_Hz: float, element: str = "") -> float:
    """Eigenfrequency nearest to a frequency; with an element, of the modes with most strain energy in it."""
    return float(results.modes.frequency[_mode(results.modes, near_Hz, element)])


def nearest_damping(results: PointResults, *, near_Hz: float, element: str = "") -> float:
    """Damping ratio of that mode."""
    return float(results.modes.damping_ratio[_mode(results.modes, near_Hz, element)])


def nearest_amplification(results: PointResults, *, near_Hz: float, element: str = "") -> float:
    """TE amplification of that mode: overall TE at resonance per TE of the mesh that excites it most."""
    return float(results.modes.amplification[_mode(results.modes, near_Hz, element)].max())


def nearest_strain(results: PointResults, *, near_Hz: float, element: str) -> float:
    """Fraction of the strain energy in an element, in the mode nearest to a frequency."""
    modes = results.modes
    return float(modes.strain[_mode(modes, near_Hz, ""), _element(modes, element)])


def loudest_frequency(results: PointResults, *, from_Hz: float = 0.0, to_Hz: float = 1e6) -> float:
    """Eigenfrequency of the mode with the largest TE amplification between two frequencies."""
    modes = results.modes
    inside = (modes.frequency >= from_Hz) & (modes.frequency <= to_Hz)
    if not inside.any():
        raise PointError(f"no mode between {from_Hz:g} and {to_Hz:g} Hz")
    return float(modes.frequency[np.argmax(np.where(inside, modes.amplification.max(axis=1), -1.0))])


def _mode(modes: Modes, near: float, element: str) -> int:
    """Return the mode nearest to a frequency (Hz); with an element, of the modes with the largest fraction in it."""
    elastic = np.array([name != FREE_ROTATION for name in modes.names])
    if element:
        shares = modes.strain[:, _element(modes, element)]
        elastic &= shares >= 0.5 * shares.max(initial=0.0)
    distance = np.where(elastic, np.abs(modes.frequency - near), np.inf)
    return int(np.argmin(distance))


def _element(modes: Modes, name: str) -> int:
    if name not in modes.element_names:
        raise PointError(f"no element {name!r}; elements are {', '.join(modes.element_names)}")
    return modes.element_names.index(name)


# Outputs of the static state: mesh forces, misalignments and load sharing of planets


def mesh_forces(results: PointResults) -> dict[str, float]:
    """Force of each mesh on its line of action under the static load."""
    return dict(zip(results.assembly.mesh_names, map(float, results.static.mesh_force), strict=True))


def misalignments(results: PointResults) -> dict[str, float]:
    """Misalignment of each mesh under the static load, positive with a gap at the +z end."""
    return dict(zip(results.assembly.mesh_names, map(float, results.static.misalignment), strict=True))


def load_sharing(results: PointResults, *, meshes: str) -> float:
    """Mesh load factor: the largest force among the planets' meshes over their mean, under the static load."""
    return _sharing(planet_values(results, meshes, results.static.mesh_force), meshes)


def _sharing(forces: Floats, meshes: str) -> float:
    """Return the largest of the forces among planets over their mean; forces on the opposite flank are negative.

    Raises
    ------
    PointError
        The planets carry no load, but round-off of either sign.
    """
    mean = float(forces.mean())
    if abs(mean) < LEAST_MESH_FORCE:
        raise PointError(f"meshes {meshes!r} carry no load that the planets could share")
    return float((forces / mean).max())


def planet_values(results: PointResults, family: str, values: Floats) -> Floats:
    """Return the values of the meshes of a family, one for each planet.

    Raises
    ------
    PointError
        There is no such family.
    """
    families = [mesh.family for mesh in results.gearbox.meshes]
    chosen = [n for n, members in enumerate(families) if members == family]
    if not chosen:
        raise PointError(f"no meshes {family!r}; meshes are {', '.join(dict.fromkeys(families))}")
    return np.asarray(values[..., chosen], dtype=np.float64)


LEAST_MESH_FORCE = 1e-6
"""Mean force of the meshes of planets, N, below which they carry no load."""
SETTLING = 0.25
"""Fraction of a run at its beginning that is skipped."""
OVERALL = "overall_dte"


def _settled(results: PointResults, signal: str) -> Floats:
    """Return the values of a signal over time, without the beginning.

    Names behind that of the signal choose parts of it, as in ``coupling_torque shaft`` and ``support_force left x``.
    """
    name, *parts = signal.split(" ")
    if name not in results.run.variables or results.run[name].dims[:1] != ("time",):
        known = ", ".join(
            str(name) for name, variable in results.run.variables.items() if variable.dims[:1] == ("time",)
        )
        raise PointError(f"no signal {signal!r} over time; signals are {known}")
    found = results.run[name]
    for part in parts:
        known_parts = [str(own) for own in found[found.dims[1]].to_numpy()] if found.ndim > 1 else []
        if part not in known_parts:
            raise PointError(f"no signal {signal!r}; {nearest_names(part, known_parts)}")
        found = found[:, known_parts.index(part)]
    values = found.to_numpy()
    return np.asarray(values[int(SETTLING * len(values)) :], dtype=np.float64)


def rms(results: PointResults, *, signal: str = OVERALL) -> float:
    """Root mean square of a signal about its mean; the largest of several."""
    return float(np.max(np.std(_settled(results, signal), axis=0)))


def peak_to_peak(results: PointResults, *, signal: str = OVERALL) -> float:
    """Peak-to-peak value of a signal; the largest of several."""
    return float(np.max(np.ptp(_settled(results, signal), axis=0)))


def final_speed(results: PointResults) -> float:
    """Speed of the overall input at the end."""
    return float(results.run["input_speed"].to_numpy()[-1])


def dynamic_load_sharing(results: PointResults, *, meshes: str) -> float:
    """Largest mean force among the planets' meshes over the mean of all, in a run."""
    return _sharing(planet_values(results, meshes, _settled(results, "mesh_force")).mean(axis=0), meshes)


def order_amplitudes(
    results: PointResults, *, centre: float, spacing: float, count: int = 3, signal: str = OVERALL
) -> dict[str, float]:
    """Amplitudes of a signal at orders of the input: a centre and `count` sidebands to either side.

    The run is at constant speed and at least two periods of the spacing long.
    """
    orders = {f"{n:+d}" if n else "0": centre + n * spacing for n in range(-count, count + 1)}
    return dict(zip(orders, _order_amplitudes(results, signal, list(orders.values()), spacing), strict=True))


def run_harmonics(results: PointResults, *, mesh: str, count: int = 6, signal: str = OVERALL) -> dict[str, float]:
    """Amplitudes of a signal at the order of a mesh and its multiples, in a run of at least two input revolutions."""
    meshes = {mesh.family: mesh.name for mesh in results.gearbox.meshes}
    if mesh not in meshes:
        raise PointError(f"no meshes {mesh!r}; meshes are {', '.join(meshes)}")
    order = results.gearbox.train.mesh_frequencies(2.0 * math.pi)[meshes[mesh]]
    orders = [n * order for n in range(1, count + 1)]
    return {str(n): value for n, value in enumerate(_order_amplitudes(results, signal, orders, 1.0), start=1)}


def _order_amplitudes(results: PointResults, signal: str, orders: list[float], spacing: float) -> list[float]:
    """Return the zero-to-peak amplitudes of a signal at orders of the input that are `spacing` apart.

    A Hann window over a whole number of periods of the spacing, at least two, has its zeros at all neighbouring orders.
    """
    values = _settled(results, signal)
    time = results.run["time"].to_numpy()
    if values.ndim > 1:
        raise PointError(f"signal {signal!r} has several parts; orders require one, such as '{signal} NAME'")
    speed = np.abs(_settled(results, "input_speed"))
    rate = 1.0 / float(time[1] - time[0])
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]))]) / rate
    periods = int(angle[-1] * spacing / (2.0 * math.pi))
    if periods < 2:
        raise PointError(
            f"the run has {periods} full periods of the order {spacing:g}; 2 are required, set a longer duration"
        )
    whole = int(np.searchsorted(angle, 2.0 * math.pi * periods / spacing))
    weights = 1.0 - np.cos(2.0 * math.pi * angle[:whole] / angle[whole])
    weighed = weights * values[:whole] * (2.0 / weights.sum())
    return [float(abs(np.exp(-1j * order * angle[:whole]) @ weighed)) for order in orders]


def nearest_names(name: str, known: Sequence[str]) -> str:
    """Return the most similar of known names as a question, or else the first twelve of them."""
    return suggestion(name, known, f"there are {listed(known)}")


def listed(names: Sequence[str]) -> str:
    """Return a list of at most twelve names as text."""
    return (", ".join(names[:12]) or "none") + (f" and {len(names) - 12} more" if len(names) > 12 else "")


def _amplitudes(results: PointResults, signal: str) -> Floats:
    names = [str(name) for name in results.steady["signal"].to_numpy()]
    found = named_amplitudes(names, complex_amplitudes(results.steady), signal)
    if found is None:
        raise PointError(f"no signal {signal!r}; {nearest_names(signal, names)}")
    return found


def _line(results: PointResults, name: str) -> int:
    """Return the index of an order by its name, such as ``2 x sun_planet``."""
    names = [str(own) for own in results.steady["line"].to_numpy()]
    if name not in names:
        raise PointError(f"no line {name!r}; lines are {', '.join(names[1:8])} and so on")
    return names.index(name)


def largest_line(results: PointResults, *, line: str, signal: str = OVERALL) -> float:
    """Largest amplitude over speed of an order of a signal, such as the order ``2 x sun_planet``."""
    return float(_amplitudes(results, signal)[:, _line(results, line)].max())


def loudest_peak(results: PointResults, *, signal: str = OVERALL) -> float:
    """Amplitude of the highest order of a signal over all speeds."""
    return float(_amplitudes(results, signal)[:, 1:].max())


def loudest_speed(results: PointResults, *, signal: str = OVERALL) -> float:
    """Input speed at which an order of a signal is highest."""
    found = peaks(results.steady, signal)
    return float(abs(found[0].speed)) if found else float("nan")


def harmonics(
    results: PointResults, *, mesh: str, speed_rpm: float, count: int = 6, signal: str = OVERALL
) -> dict[str, float]:
    """Amplitudes of the harmonics of a mesh in a signal, at the speed nearest to a given one."""
    speeds = np.abs(results.steady["speed"].to_numpy())
    at = int(np.argmin(np.abs(speeds - abs(speed_rpm) * RPM)))
    values = _amplitudes(results, signal)[at]
    lines = {n: _line(results, mesh if n == 1 else f"{n} x {mesh}") for n in range(1, count + 1)}
    return {str(n): float(values[line]) for n, line in lines.items()}


# Outputs of transmission error tables and of contact over loads and misalignments

LOADS = (0.25, 0.5, 1.0, 1.5)
"""Default torques over the static torque, for outputs over loads and misalignments."""
MISALIGNMENTS_UM = (-20.0, 0.0, 20.0)
"""Default gaps at the +z end over the common face width, µm."""
POSITIONS = 16


def ste_peak_to_peak(results: PointResults, *, pair: str) -> float:
    """Peak-to-peak static transmission error of a pair at its static load."""
    return float(np.ptp(results.table(pair).static_state["ste"].to_numpy()))


def ste_harmonic(results: PointResults, *, pair: str, harmonic: int = 1) -> float:
    """Amplitude of a harmonic of the static transmission error of a pair at its static load."""
    ste = results.table(pair).static_state["ste"].to_numpy()
    return float(2.0 * np.abs(np.fft.rfft(ste)[harmonic]) / ste.size)


def mesh_stiffness(results: PointResults, *, pair: str) -> float:
    """Mean mesh stiffness of a pair over the mesh cycle at its static load."""
    return float(results.table(pair).static_state["mesh_stiffness"].mean())


def contact_pressure(results: PointResults, *, pair: str) -> float:
    """Maximum contact stress of a pair over the mesh cycle at its static load."""
    table = results.table(pair)
    return float(largest_contact_stress(results.gearbox.pairs[pair].pair, table.static_state))


def worst_ripple(
    results: PointResults,
    *,
    pair: str,
    torque_factors: Sequence[float] = LOADS,
    misalignment_um: Sequence[float] = MISALIGNMENTS_UM,
    positions: int = POSITIONS,
) -> float:
    """Largest peak-to-peak static transmission error over loads and misalignments."""
    data = results.states(pair, positions, torque_factors, misalignment_um)
    return float(np.ptp(data["ste"].to_numpy(), axis=0).max())


def mean_ripple(
    results: PointResults,
    *,
    pair: str,
    torque_factors: Sequence[float] = LOADS,
    misalignment_um: Sequence[float] = MISALIGNMENTS_UM,
    positions: int = POSITIONS,
) -> float:
    """Mean peak-to-peak static transmission error over loads and misalignments."""
    data = results.states(pair, positions, torque_factors, misalignment_um)
    return float(np.ptp(data["ste"].to_numpy(), axis=0).mean())


def worst_pressure(
    results: PointResults,
    *,
    pair: str,
    torque_factors: Sequence[float] = LOADS,
    misalignment_um: Sequence[float] = MISALIGNMENTS_UM,
    positions: int = POSITIONS,
) -> float:
    """Maximum pressure of a contact cell inside the flank over loads and misalignments."""
    data = results.states(pair, positions, torque_factors, misalignment_um)
    return float(data["max_pressure"].max())


# Outputs of ratings: safeties, damages and hours of gears and bearings, as in the command `life`

SAFETIES: Mapping[str, str] = {"life": "{}_safety", "static": "{}_static", "iso6336": "standard_{}_safety"}
"""Values of the option `of`: over the life, under the largest load, over the life with stresses to ISO 6336."""
LIVES: Mapping[str, str] = {"L10": "basic", "L10r": "reference", "L10m": "modified"}
"""Values of the option `by`."""
MINIMUM = "minimum"
"""Value of the option `by` for the worst kind of life of each bearing."""
Worst = Callable[[Iterable[float]], float]


def contact_safeties(results: PointResults, *, of: str = "life") -> dict[str, float]:
    """Safety factor S_H (pitting) by gear, flank and meshes; for planets the worst."""
    return _values_of(results, "flank", SAFETIES[of].format("contact"))


def root_safeties(results: PointResults, *, of: str = "life") -> dict[str, float]:
    """Safety factor S_F (tooth root breakage) by gear, flank and meshes; for planets the worst."""
    return _values_of(results, "flank", SAFETIES[of].format("root"))


def contact_damages(results: PointResults) -> dict[str, float]:
    """Pitting damage (Miner's sum) by gear, flank and meshes; for planets the worst."""
    return _values_of(results, "flank", "contact_damage")


def root_damages(results: PointResults) -> dict[str, float]:
    """Tooth root damage (Miner's sum) by gear, flank and meshes; for planets the worst."""
    return _values_of(results, "flank", "root_damage")


def worst_planets(results: PointResults) -> dict[str, float]:
    """Planet (number) with the largest pitting damage by gear, flank and meshes; NaN for a single body."""
    data = results.life
    numbers = [str(holder).rpartition("_")[2] for holder in data["flank_contact_holder"].to_numpy()]
    planets = [float(number) if number.isdecimal() else math.nan for number in numbers]
    return dict(zip(map(str, data["flank"].to_numpy()), planets, strict=True))


def contact_safety(results: PointResults, *, gear: str = "", of: str = "life") -> float:
    """Minimum safety factor S_H (pitting), of all gears or of one."""
    return _worst(contact_safeties(results, of=of), gear, min)


def root_safety(results: PointResults, *, gear: str = "", of: str = "life") -> float:
    """Minimum safety factor S_F (tooth root breakage), of all gears or of one."""
    return _worst(root_safeties(results, of=of), gear, min)


def contact_damage(results: PointResults, *, gear: str = "") -> float:
    """Largest pitting damage (Miner's sum), of all gears or of one."""
    return _worst(contact_damages(results), gear, max)


def root_damage(results: PointResults, *, gear: str = "") -> float:
    """Largest tooth root damage (Miner's sum), of all gears or of one."""
    return _worst(root_damages(results), gear, max)


def bearing_lives(results: PointResults, *, by: str = MINIMUM) -> dict[str, float]:
    """Bearing lives L10, L10r or L10m in hours, or the shortest of them."""
    return _bearing_values(results, "hours", by, min)


def bearing_damages(results: PointResults, *, by: str = MINIMUM) -> dict[str, float]:
    """Bearing damages (Miner's sums) by L10, L10r or L10m, or the largest of them."""
    return _bearing_values(results, "damage", by, max)


def static_safeties(results: PointResults) -> dict[str, float]:
    """Safety factor S_0 (static) of bearings under the largest load."""
    return _values_of(results, "bearing", "static_safety")


def bearing_life(results: PointResults, *, bearing: str = "", by: str = MINIMUM) -> float:
    """Shortest bearing life in hours, of all bearings or of one."""
    return _worst(bearing_lives(results, by=by), bearing, min)


def bearing_damage(results: PointResults, *, bearing: str = "", by: str = MINIMUM) -> float:
    """Largest bearing damage (Miner's sum), of all bearings or of one."""
    return _worst(bearing_damages(results, by=by), bearing, max)


def static_safety(results: PointResults, *, bearing: str = "") -> float:
    """Minimum static safety factor S_0, of all bearings or of one."""
    return _worst(static_safeties(results), bearing, min)


def life_hours(results: PointResults) -> float:
    """Hours of operation until the first Miner's sum of a gear or a bearing reaches one."""
    largest = max((damage for _, _, damage in limits(results.life)), default=math.nan)
    hours = float(results.life["hours"].sum())
    if largest > 0.0:
        return hours / largest
    if math.isnan(largest):
        return math.nan
    return math.inf


def shortfalls(results: PointResults) -> float:
    """Total number of failures and shortfalls in the command `life`: parts that fail or miss a required value."""
    return float(sum(len(json.loads(results.life.attrs[key])) for key in ("failures", "shortfalls")))


def _values_of(results: PointResults, kind: Literal["flank", "bearing"], key: str) -> dict[str, float]:
    data = results.life
    return dict(zip(map(str, data[kind].to_numpy()), map(float, data[f"{kind}_{key}"].to_numpy()), strict=True))


def _bearing_values(results: PointResults, key: str, by: str, worst: Worst) -> dict[str, float]:
    """Return values by bearing, for one kind of life or the worst of all known ones."""
    data = results.life
    names = [
        ("bearing_damage" if (kind, key) == ("basic", "damage") else f"bearing_{kind}_{key}")
        for kind in (LIVES.values() if by == MINIMUM else [LIVES[by]])
    ]
    columns = zip(*(data[name].to_numpy().tolist() for name in names), strict=True)
    known = [[value for value in column if not math.isnan(value)] for column in columns]
    found = [worst(values) if values else math.nan for values in known]
    return dict(zip(map(str, data["bearing"].to_numpy()), found, strict=True))


def _worst(values: Mapping[str, float], part: str, worst: Worst) -> float:
    """Return the worst known value of all parts or of one."""
    selected = {name: value for name, value in values.items() if part in ("", name, name.split(" ")[0])}
    known = [value for value in selected.values() if not math.isnan(value)]
    if not known:
        raise PointError(f"{part or 'no part'}: the life of this gearbox has no such result; `exugear life` states why")
    return worst(known)


# Table of all outputs for study files; a study in Python may add its own

AS_SIGNAL = "as the signal"
"""Unit of outputs with the unit of the signal in their option `signal`."""
QUANTITIES: dict[str, OutputKind] = {
    "ste_peak_to_peak": OutputKind(ste_peak_to_peak, "m"),
    "ste_harmonic": OutputKind(ste_harmonic, "m"),
    "mesh_stiffness": OutputKind(mesh_stiffness, "N/m"),
    "contact_pressure": OutputKind(contact_pressure, "Pa"),
    "worst_ripple": OutputKind(worst_ripple, "m"),
    "mean_ripple": OutputKind(mean_ripple, "m"),
    "worst_pressure": OutputKind(worst_pressure, "Pa"),
    "mesh_forces": OutputKind(mesh_forces, "N", "mesh"),
    "misalignments": OutputKind(misalignments, "rad", "mesh"),
    "load_sharing": OutputKind(load_sharing, "1"),
    "frequencies": OutputKind(frequencies, "Hz", "mode"),
    "nearest_frequency": OutputKind(nearest_frequency, "Hz"),
    "nearest_damping": OutputKind(nearest_damping, "1"),
    "nearest_amplification": OutputKind(nearest_amplification, "m/m"),
    "nearest_strain": OutputKind(nearest_strain, "1"),
    "loudest_frequency": OutputKind(loudest_frequency, "Hz"),
    "largest_line": OutputKind(largest_line, AS_SIGNAL, needs="steady"),
    "loudest_peak": OutputKind(loudest_peak, AS_SIGNAL, needs="steady"),
    "loudest_speed": OutputKind(loudest_speed, "rad/s", needs="steady"),
    "harmonics": OutputKind(harmonics, AS_SIGNAL, "harmonic", "steady"),
    "rms": OutputKind(rms, AS_SIGNAL, needs="run"),
    "peak_to_peak": OutputKind(peak_to_peak, AS_SIGNAL, needs="run"),
    "final_speed": OutputKind(final_speed, "rad/s", needs="run"),
    "dynamic_load_sharing": OutputKind(dynamic_load_sharing, "1", needs="run"),
    "run_harmonics": OutputKind(run_harmonics, AS_SIGNAL, "harmonic", "run"),
    "order_amplitudes": OutputKind(order_amplitudes, AS_SIGNAL, "sideband", "run"),
    "contact_safeties": OutputKind(contact_safeties, "1", "flank", "life"),
    "root_safeties": OutputKind(root_safeties, "1", "flank", "life"),
    "contact_damages": OutputKind(contact_damages, "1", "flank", "life"),
    "root_damages": OutputKind(root_damages, "1", "flank", "life"),
    "worst_planets": OutputKind(worst_planets, "1", "flank", "life"),
    "contact_safety": OutputKind(contact_safety, "1", needs="life"),
    "root_safety": OutputKind(root_safety, "1", needs="life"),
    "contact_damage": OutputKind(contact_damage, "1", needs="life"),
    "root_damage": OutputKind(root_damage, "1", needs="life"),
    "bearing_lives": OutputKind(bearing_lives, "h", "bearing", "bearings"),
    "bearing_damages": OutputKind(bearing_damages, "1", "bearing", "bearings"),
    "static_safeties": OutputKind(static_safeties, "1", "bearing", "bearings"),
    "bearing_life": OutputKind(bearing_life, "h", needs="bearings"),
    "bearing_damage": OutputKind(bearing_damage, "1", needs="bearings"),
    "static_safety": OutputKind(static_safety, "1", needs="bearings"),
    "life_hours": OutputKind(life_hours, "h", needs="life"),
    "shortfalls": OutputKind(shortfalls, "1", needs="life"),
}
"""Outputs by the name in a study file."""


@dataclass(frozen=True)
class Output:
    """Output with its options."""

    quantity: OutputKind
    options: Mapping[str, Any]

    @property
    def units(self) -> str:
        """Unit of its numbers; for a signal, the unit of the signal."""
        if self.quantity.units != AS_SIGNAL:
            return self.quantity.units
        named = str(self.options.get("signal", OVERALL)).split(" ")[0]
        signals = (*SIGNALS, SURFACE_VELOCITY)
        return next((signal.units for signal in signals if signal.name == named), "")

    def of(self, results: PointResults) -> Values:
        """Compute the output for a point."""
        return self.quantity.function(results, **self.options)


def outputs_of(sections: Mapping[str, Mapping[str, Any]], known: Mapping[str, OutputKind]) -> dict[str, Output]:
    """Check the sections of a study file, by their names in the dataset, and return the outputs they specify.

    Raises
    ------
    OutputError
        An unknown output or wrong options.

    Examples
    --------
    >>> outputs_of({"ringing": {"quantity": "nearest_frequncy", "near_Hz": 800.0}}, QUANTITIES)
    Traceback (most recent call last):
    ...
    exugear.studies.quantities.OutputError: outputs.ringing.quantity = 'nearest_frequncy': no such result; did you
    mean 'nearest_frequency'?
    """
    kept = {}
    for name, section in sections.items():
        options = dict(section)
        for key in options:
            if hint := renamed_hint(["outputs", name, key], STUDY_RENAMES):
                raise OutputError(f"outputs.{name}.{key}: {hint}")
        wanted = str(options.pop("quantity", ""))
        if wanted not in known:
            hint = suggestion(wanted, known, f"results are {', '.join(known)}")
            raise OutputError(f"outputs.{name}.quantity = {wanted!r}: no such result; {hint}")
        known[wanted].check(name, options)
        kept[name] = Output(known[wanted], options)
    return kept
