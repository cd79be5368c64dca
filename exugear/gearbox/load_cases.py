"""Effect of a load case on the kinematic gear train: net torque, speeds, and loaded flanks of the meshes.

Gears and couplings are treated as rigid and all axes as fixed. The speed of the overall input, plus a few others in a
train of several degrees of freedom, then determines all speeds. Torques are referred to the input by their power, and
inertias by their kinetic energy, including the orbital motion of planets. The computation takes negligible time
compared with a run and reveals torques of the wrong sign beforehand.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import LoadCase
from exugear.gearbox.reading import GearboxFileError, error_line, shortened
from exugear.gearbox.train import UNLOADED
from exugear.gearbox.units import RPM
from exugear.gearbox.variant import Variant
from fe_ste.standards.mesh_loss import loss_factor
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import ReprMixin, TitledRows, torque_text, value_range

# Torques of a load case over time, from a CSV file in the folder of the gearbox file


def torque_series(gearbox: Gearbox, case: LoadCase) -> dict[str, tuple[Floats, Floats]]:
    """Read times (s) and torques (N m) by body from the CSV file of the load case.

    The header is ``time_s`` and one ``<body>_N_m`` per loaded body. Torques are interpolated linearly between rows.

    Returns
    -------
    mapping of body name to (times, torques), each (rows,); empty without a file.

    Raises
    ------
    GearboxFileError
        The file cannot be read, has unknown columns or text instead of numbers, or its times do not increase.
    """
    if case.torque_series is None:
        return {}

    def file_error(text: str) -> GearboxFileError:
        return GearboxFileError(error_line(str(case.torque_series), text))

    try:
        with case.torque_series.open(newline="", encoding="utf-8-sig") as file:
            lines = [line for line in csv.reader(file) if line]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise file_error(f"cannot be read as CSV ({error})") from None
    if len(lines) < 3 or lines[0][0].strip() != "time_s":
        raise file_error("expected a header time_s,BODY_N_m,... and at least two lines of numbers")
    try:
        table = np.array([[float(cell) for cell in line] for line in lines[1:]])
    except ValueError as error:
        raise file_error(f"{error}; every line needs {len(lines[0])} numbers") from None
    if table.ndim != 2 or table.shape[1] != len(lines[0]) or not np.all(np.isfinite(table)):
        raise file_error(f"every line needs {len(lines[0])} finite numbers")
    if not np.all(np.diff(table[:, 0]) > 0.0):
        raise file_error("time_s must increase from line to line")
    series = {}
    for column, name in enumerate(lines[0][1:], start=1):
        body = name.strip().removesuffix("_N_m")
        if body not in gearbox.spinning or not name.strip().endswith("_N_m"):
            known = ", ".join(f"{known}_N_m" for known in gearbox.spinning)
            raise file_error(f"column {shortened(name.strip())} is not the torque of a body; columns are {known}")
        series[body] = (table[:, 0], table[:, column])
    return series


Series = Mapping[str, tuple[Floats, Floats]]
BURSTING_RIM_SPEED = 300.0
"""Circumferential speed that no steel gear survives, m/s: density times its square is 0.7 GPa, the yield strength of
gear steels. The fastest turbo gears run at two thirds of it.
"""
LEAST_SHARE = 0.25
"""Fraction of the static load below which displacements of linear bearings are over 25 % off the nonlinear rows."""
OTHER_LOAD = 0.3
"""Relative difference from the static load above which a mesh is reported as loaded differently from its table."""
BEYOND_BAND = 1.05
"""Ratio of mesh frequency to band above which a warning is given; the band of a run has a soft edge."""
BAND_STEP = 100.0
"""Step to which a proposed band is rounded up, Hz."""
SHOWN_MESHES = 3
"""Maximum number of meshes above the band that a message lists."""
COVERED = 1e-6
"""Relative excess of speeds over those of a table that is put down to round-off."""
INSTANTS = 2001
"""Number of evaluated instants for a torque that changes with time, in addition to those of its own rows."""


@dataclass(frozen=True)
class LoadSummary(ReprMixin, line=" {name!r}: net torque {net_torque:g} N m, {start_speed:g} to {end_speed:g} rad/s"):
    """Summary of a load case on the kinematic gear train."""

    name: str
    inertia: float
    """Inertia of the whole train at the overall input, kg m2."""
    net_torque: float
    """Sum of all torques referred to the overall input, at the start and without that of a drive, N m."""
    driven: bool
    """Whether a machine prescribes the speed and supplies the remaining torque."""
    start_speed: float
    end_speed: float
    fastest_speed: float
    """Of the overall input, rad/s; the last without sign."""
    rim_speeds: Mapping[str, float]
    """By body name, tip speed of the largest gear of each body with gears at `fastest_speed`, m/s."""
    mesh_frequencies: Mapping[str, float]
    """By mesh name, highest mesh frequency, Hz."""
    mesh_forces: Mapping[str, float]
    """By mesh name, F_bt at the start, N; its sign indicates the loaded flank of gear 1, as in
    `Train.static_mesh_forces`.
    """
    flanks: Mapping[str, str]
    """By mesh family, loaded flanks during the load case: ``+``, ``-``, ``+-`` for both, ``0`` for none."""
    reversed_flanks: tuple[str, ...]
    """Mesh families with a loaded flank other than that of the static load, for which their tables are computed."""
    least_shares: Mapping[str, float]
    """By mesh family, minimum mesh force during the load case divided by that of the static load; negative if it
    reverses.
    """
    greatest_shares: Mapping[str, float]
    """By mesh family, maximum mesh force during the load case divided by that of the static load."""

    def _table(self) -> TitledRows:
        speeds = (self.start_speed, self.end_speed, self.fastest_speed)
        return f"load case {self.name}, rigid kinematics", {
            "inertia at the input": value_range(self.inertia, "kg m2"),
            "net torque at the input": value_range(self.net_torque, "N m"),
            "driven": "yes" if self.driven else "no",
            "start, end and fastest speed of the input": ", ".join(value_range(speed, "rad/s") for speed in speeds),
            "flanks": ", ".join(f"{family} {flank}" for family, flank in self.flanks.items()),
            "on another flank than by the static load": ", ".join(self.reversed_flanks) or "none",
        }

    @property
    def fastest_rim(self) -> tuple[str, float]:
        """Body with the highest tip speed, and this speed, m/s; an empty name and zero for a rotor without gears."""
        return max(self.rim_speeds.items(), key=lambda pair: pair[1], default=("", 0.0))


def summarise_loads(
    gearbox: Gearbox,
    case: LoadCase,
    inertias: str | None = None,
    duration: float | None = None,
    series: Series | None = None,
) -> LoadSummary:
    """Summarise the effect of a load case on the kinematic gear train.

    Parameters
    ----------
    inertias : inertia set; default: that of the file
    duration : simulated time, s; default: that of the load case
    series : mapping, optional
        Result of `torque_series`, if the file has already been read.

    Raises
    ------
    GearboxFileError
        The torque series cannot be used, or the speed of the input does not determine the speeds of the train.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> loads = summarise_loads(gearbox, gearbox.load_cases["reference"])
    >>> round(loads.net_torque), round(loads.end_speed, 1)
    (-4472, -22.5)
    >>> loads.flanks["high_speed"], loads.reversed_flanks
    ('-', ())
    """
    series = torque_series(gearbox, case) if series is None else series
    total = case.duration if duration is None else duration
    names = gearbox.spinning
    reference = gearbox.case.overall.input
    rolling = gearbox.train.rolling_speeds(reference, 1.0)
    unit = np.array([rolling[name] for name in names])
    axial = _axial_inertias(gearbox, inertias)
    times = np.array([0.0, total])
    if series:  # resolve the torques, including the rows of their file
        rows = np.concatenate([own for own, _ in series.values()])
        inside = rows[(rows > 0.0) & (rows < total)]
        times = np.unique(np.concatenate([np.linspace(0.0, total, INSTANTS), inside]))
    torques = np.zeros((len(times), len(names)))
    for name, torque in case.torques.items():
        torques[:, names.index(name)] += torque
    for name, (lines, values) in series.items():
        torques[:, names.index(name)] += np.interp(times, lines, values)
    rates, added = _rates(gearbox, case, axial, torques)
    start = gearbox.start_speeds(case)
    # Torques are linear between the instants, so the trapezoidal rule is exact.
    gained = np.cumsum(0.5 * (rates[1:] + rates[:-1]) * np.diff(times)[:, None], axis=0)
    gained = np.concatenate([np.zeros((1, rates.shape[1])), gained])
    spins = np.asarray(np.array([start[name] for name in names]) + gained)
    speeds = spins[:, names.index(reference)]
    # Mesh forces F_bt (times, meshes) for balanced torques; of minimum norm if meshes share.
    balanced = torques + added - rates * axial
    solved = np.linalg.lstsq(gearbox.train.spin_rows.T, balanced.T, rcond=1e-12)[0]
    forces: Floats = np.asarray(solved[: len(gearbox.meshes)].T)
    fastest = dict(zip(names, np.abs(spins).max(axis=0).tolist(), strict=True))
    of_body = dict(zip(names, spins.T, strict=True))
    standing = np.zeros(len(spins))  # speed of bodies without rotation
    flanks, reversed_flanks = _flanks(gearbox, forces)
    net = float(torques[0] @ unit)
    return LoadSummary(
        name=case.name,
        inertia=float(axial @ unit**2),
        # Round-off of the torques counts as zero.
        net_torque=net if abs(net) > UNLOADED * float(np.abs(torques[0] * unit).max(initial=0.0)) else 0.0,
        driven=case.driven_body is not None,
        start_speed=case.start_speed,
        end_speed=float(speeds[-1]),
        fastest_speed=fastest[reference],
        rim_speeds={name: fastest[name] * radius for name, radius in rim_radii(gearbox).items()},
        mesh_frequencies={
            mesh.name: float(np.abs(of_body.get(mesh.pinion, standing) - of_body.get(mesh.frame, standing)).max())
            * mesh.pair.pinion.teeth
            / (2.0 * math.pi)
            for mesh in gearbox.meshes
        },
        mesh_forces={mesh.name: float(force) for mesh, force in zip(gearbox.meshes, forces[0], strict=True)},
        flanks=flanks,
        reversed_flanks=reversed_flanks,
        least_shares=_shares(gearbox, forces, min),
        greatest_shares=_shares(gearbox, forces, max),
    )


def load_warnings(loads: LoadSummary) -> tuple[str, ...]:
    """Return warnings that indicate a wrong sign of a torque; empty if none."""
    doubts = []
    if loads.reversed_flanks:
        doubts.append(
            f"check torque signs: {', '.join(loads.reversed_flanks)} loaded on the opposite flank of the static load, "
            "at which tables, stiffness and phases are computed"
        )
    body, rim = loads.fastest_rim
    if rim > BURSTING_RIM_SPEED:
        doubts.append(
            f"overspeed: the tip speed on {body} reaches {rim:.4g} m/s, and steel gears burst at about "
            f"{BURSTING_RIM_SPEED:g} m/s, where a run stops; check torque signs and duration"
        )
    return tuple(doubts)


def missing_torque_warning(gearbox: Gearbox, case: LoadCase) -> str:
    """Return a warning if an end of a train with several degrees of freedom carries no torque; empty otherwise.

    A train with n degrees of freedom has n + 1 ends: those that `static_load` loads or locks. An end without torque
    accelerates freely, and takes the power of the others.
    """
    if gearbox.train.degrees_of_freedom < 2:
        return ""
    acting = {*case.torques, *torque_series(gearbox, case), case.driven_body}
    ends = dict.fromkeys((*gearbox.case.static_load.torques_N_m, *gearbox.locked))
    free = [body for body in ends if body not in acting]
    if not free:
        return ""
    return (
        f"no torque on {', '.join(free)}: the gear train has {gearbox.train.degrees_of_freedom} degrees of freedom, so "
        "nothing resists there and it speeds up freely; add the torque to torques_N_m, or state it as 0"
    )


def bearing_range_warning(gearbox: Gearbox, loads: LoadSummary, variant: str) -> str:
    """Return a warning if linear bearings leave the load range around their linearisation point; empty otherwise.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> loads = summarise_loads(gearbox, gearbox.load_cases["reference"])
    >>> bearing_range_warning(gearbox, loads, "bushing")
    ''
    """
    led = [
        bearing
        for bearing in gearbox.bearings
        if bearing.catalogue is not None and bearing.catalogue.radial_load_kN is None and bearing.model == "linear"
    ]
    light = {family: share for family, share in loads.least_shares.items() if share < LEAST_SHARE}
    if not led or not light or not Variant.of(variant).has_bearings:
        return ""
    turned = [family for family, share in light.items() if share < 0.0]
    least = min(light.values())
    how = f"reverses the load of {', '.join(turned)}"
    if not turned:
        # The least of shares that are not negative may be a negative zero.
        how = f"loads {', '.join(light)} with {100.0 * abs(least):.2g} % of it"
    return (
        f'bearings are linearised at the static load, but the load case {loads.name} {how}; set model = "iso16281" on '
        "the bearings for displacements and loads there"
    )


def friction_warning(gearbox: Gearbox, loads: LoadSummary) -> str:
    """Return a warning if torques that are to accelerate the gear train do not overcome the friction of its teeth.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml").varied({"damping": {"tooth_friction": 0.05}})
    >>> friction_warning(gearbox, summarise_loads(gearbox, gearbox.load_cases["reference"]))
    'the net torque at the input, 4472 N m, is below the friction of the teeth, about 4742 N m: the gearbox ...
    """
    coefficient = gearbox.case.damping.tooth_friction
    if coefficient == 0.0 or loads.driven:
        return ""
    turns = gearbox.train.rolling_speeds(gearbox.case.overall.input, 1.0)
    friction = 0.0
    for mesh in gearbox.meshes:
        pinion_speed = abs(turns[mesh.pinion] - turns.get(mesh.frame, 0.0))
        power = abs(loads.mesh_forces[mesh.name]) * mesh.pair.pinion.base_radius * pinion_speed
        friction += coefficient * loss_factor(mesh.pair) * power
    if abs(loads.net_torque) >= friction:
        return ""
    return (
        f"the net torque at the input, {abs(loads.net_torque):.4g} N m, is below the friction of the teeth, about "
        f"{friction:.4g} N m: the gearbox slows down or stands still; increase a torque, or remove tooth_friction"
    )


def other_load_warning(gearbox: Gearbox, loads: LoadSummary, uses_single_load: bool = True) -> str:
    """Return a warning that names meshes with another load than the static one of their STE tables; empty if none.

    A stated stiffness is the same under all loads.

    Parameters
    ----------
    uses_single_load : whether the mesh model evaluates tables at the static load only

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> half = gearbox.varied({"load_cases.reference.torques_N_m": {"carrier": 120e3, "hss": -1500.0}})
    >>> other_load_warning(half, summarise_loads(half, half.load_cases["reference"]))
    'other load: sun_planet 50 %, ring_planet 50 %, intermediate 50 %, high_speed 50 % of the static load ...
    """
    entries = []
    stated = {mesh.family for mesh in gearbox.meshes if mesh.pair.name in gearbox.stated_stiffness}
    for family, least in loads.least_shares.items():
        greatest = loads.greatest_shares[family]
        if family not in stated and (least < 1.0 - OTHER_LOAD or greatest > 1.0 + OTHER_LOAD):
            shares = dict.fromkeys(str(round(100.0 * share)) for share in (least, greatest))
            entries.append(f"{family} {' to '.join(shares)} %")
    if not entries or not uses_single_load:
        return ""
    loaded_at_start = _torques_at_start(gearbox, gearbox.load_cases[loads.name])
    advice = "add --at-load-case to the command run, or use" if loaded_at_start else "use"
    return (
        f"other load: {', '.join(entries)} of the static load ({static_load_in_words(gearbox)}), at which transmission "
        f"error and stiffness are computed; {advice} --mesh-model table, which covers a range of loads"
    )


def band_warning(loads: LoadSummary, band: float) -> str:
    """Return a warning about mesh frequencies above the stored band, with a sufficient band (Hz); empty if none.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> loads = summarise_loads(gearbox, gearbox.load_cases["reference"])
    >>> band_warning(loads, 6400.0)
    ''
    >>> band_warning(loads, 5000.0)
    'beyond the stored band: the run stores frequencies up to 5000 Hz, and mesh frequencies reach ...
    """
    beyond = {name: found for name, found in loads.mesh_frequencies.items() if found > BEYOND_BAND * band}
    if not beyond:
        return ""
    named = ", ".join(f"{name} {frequency:.0f} Hz" for name, frequency in list(beyond.items())[:SHOWN_MESHES])
    wanted = math.ceil(max(beyond.values()) / BAND_STEP) * BAND_STEP
    return (
        f"beyond the stored band: the run stores frequencies up to {band:g} Hz, and mesh frequencies reach {named}; "
        f"use exugear run --band {wanted:g}"
    )


def table_speed_warning(gearbox: Gearbox, loads: LoadSummary) -> str:
    """Return a text on an excitation whose table does not cover the speeds of a load case; empty if all do."""
    passed = (loads.start_speed, loads.end_speed)
    slowest = min(map(abs, passed)) if passed[0] * passed[1] > 0.0 else 0.0
    beyond = speeds_beyond_tables(gearbox, slowest, loads.fastest_speed)
    return f"load_cases.{loads.name}: {beyond}" if beyond else ""


def drive_warning(gearbox: Gearbox, case: LoadCase, duration: float | None) -> str:
    """Return a warning that a drive goes on beyond its end speed in a longer run; empty if it does not.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> drive_warning(gearbox, gearbox.load_cases["speed_driven"], 10.0)
    'hss is driven on at the same rate after 5 s: to 3600 rpm at 10 s, beyond end_speed_rpm = 1800; ...
    """
    if duration is None or duration <= case.duration or case.end_speed is None or not drive_rate(gearbox, case):
        return ""
    reached = driven_start_speed(gearbox, case) + drive_rate(gearbox, case) * duration
    return (
        f"{case.driven_body} is driven on at the same rate after {case.duration:g} s: to {reached / RPM:.5g} rpm at "
        f"{duration:g} s, beyond end_speed_rpm = {case.end_speed / RPM:g}; for a slower run-up set duration_s of the "
        "load case instead of --duration"
    )


def load_case_warnings(
    gearbox: Gearbox,
    case: LoadCase,
    band: float,
    variant: str,
    inertias: str | None = None,
    duration: float | None = None,
    *,
    uses_single_load: bool = True,
) -> tuple[str, ...]:
    """Return all warnings about a run of a load case: torques, bearings, tables, stored band, friction.

    Parameters
    ----------
    band : highest stored frequency, Hz
    variant, inertias, duration : of the run; the last two default to those of the file
    uses_single_load : whether the mesh model evaluates tables at the static load only

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> load_case_warnings(gearbox, gearbox.load_cases["reference"], 6400.0, "bushing")
    ()
    """
    loads = summarise_loads(gearbox, case, inertias, duration)
    found = (
        *load_warnings(loads),
        missing_torque_warning(gearbox, case),
        bearing_range_warning(gearbox, loads, variant),
        other_load_warning(gearbox, loads, uses_single_load),
        band_warning(loads, band),
        friction_warning(gearbox, loads),
        table_speed_warning(gearbox, loads),
        drive_warning(gearbox, case, duration),
    )
    return tuple(filter(None, found))


def load_in_words(case: LoadCase) -> str:
    """Return the torques of a load case and the driven body as text.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> load_in_words(gearbox.load_cases["speed_driven"])
    'carrier 240 kN m, hss driven'
    """
    parts = [f"{body} {torque_text(torque)}" for body, torque in case.torques.items()]
    if case.torque_series is not None:
        parts.append(f"torques of {case.torque_series.name}")
    if case.driven_body is not None:
        parts.append(f"{case.driven_body} driven")
    return ", ".join(parts) or "no torque"


def static_load_in_words(gearbox: Gearbox) -> str:
    """Return the torques of the static load as text.

    Examples
    --------
    >>> static_load_in_words(Gearbox.from_toml("cases/grc750/gearbox.toml"))
    'carrier 240 kN m'
    """
    torques = gearbox.case.static_load.torques_N_m
    return ", ".join(f"{body} {torque_text(torque)}" for body, torque in torques.items()) or "no torque"


def gearbox_at_load(gearbox: Gearbox, case: LoadCase) -> Gearbox:
    """Return the gearbox with the initial torques of a load case as its static load; locked bodies are unchanged.

    Raises
    ------
    GearboxFileError
        The load case has no torque except on bodies that react the static load, or its torques cannot be reacted.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> gearbox_at_load(gearbox, gearbox.load_cases["rated"]).case.static_load.torques_N_m
    {'carrier': 240000.0}
    """
    torques = _torques_at_start(gearbox, case)
    if not torques:
        raise gearbox.error(
            f"load_cases.{case.name}.torques_N_m: at the start, no torque acts except on bodies that hold the static "
            f"load ({', '.join(gearbox.case.static_load.locked)}), so nothing is loaded; choose another load case"
        )
    return gearbox.varied({"static_load.torques_N_m": torques})


def _torques_at_start(gearbox: Gearbox, case: LoadCase) -> dict[str, float]:
    """Torques of a load case at its start, N m, on bodies that do not hold the static load."""
    first = {body: float(values[0]) for body, (_, values) in torque_series(gearbox, case).items()}
    locked = gearbox.case.static_load.locked
    return {body: torque for body, torque in {**case.torques, **first}.items() if torque and body not in locked}


def rim_radii(gearbox: Gearbox) -> dict[str, float]:
    """Radius (m) of the largest gear on each rotating body with gears; for an internal gear the radius at its teeth."""
    return {
        body.name: max(gearbox.gears[gear].tip_radius for gear in body.wheels)
        for body in gearbox.bodies()
        if body.wheels and not body.fixed
    }


def _axial_inertias(gearbox: Gearbox, inertias: str | None) -> Floats:
    """Moment of inertia of each rotation, kg m2; the orbital motion of planets is included in the carrier."""
    bodies = {body.name: body for body in gearbox.bodies(inertias)}
    axial = {name: bodies[name].axial for name in gearbox.spinning}
    for body in bodies.values():
        if body.carrier is not None and body.carrier in axial:
            axial[body.carrier] += body.mass * math.dist(body.axis, bodies[body.carrier].axis) ** 2
    return np.array([axial[name] for name in gearbox.spinning])


def inertia_at_input(gearbox: Gearbox, inertias: str | None = None) -> float:
    """Moment of inertia of the kinematic gear train at the overall input, by its kinetic energy, kg m2."""
    unit = gearbox.train.rolling_speeds(gearbox.case.overall.input, 1.0)
    speeds = np.array([unit[name] for name in gearbox.spinning])
    return float(_axial_inertias(gearbox, inertias) @ speeds**2)


def _rates(gearbox: Gearbox, case: LoadCase, axial: Floats, torques: Floats) -> tuple[Floats, Floats]:
    """Angular accelerations (rad/s2) of the kinematic gear train and added machine torques (N m), both (times, bodies).

    The equations of motion are formulated in the kinematic modes. A machine prescribes the acceleration of its body;
    its torque is one additional unknown.
    """
    modes = gearbox.train.kinematic_modes
    matrix = modes.T @ (axial[:, None] * modes)
    loads = modes.T @ torques.T
    added = np.zeros_like(torques)
    if case.driven_body is None:
        return (modes @ np.linalg.solve(matrix, loads)).T, added
    driven = gearbox.spinning.index(case.driven_body)
    row = modes[driven]
    # Scaling the machine torque makes the row as large as the inertias.
    scale = float(np.abs(matrix).max())
    bordered = np.block([[matrix, -scale * row[:, None]], [scale * row[None, :], np.zeros((1, 1))]])
    rate = np.full((1, loads.shape[1]), scale * drive_rate(gearbox, case))
    solved = np.linalg.solve(bordered, np.concatenate([loads, rate]))
    added[:, driven] = scale * solved[-1]
    return (modes @ solved[:-1]).T, added


def drive_rate(gearbox: Gearbox, case: LoadCase) -> float:
    """Angular acceleration (rad/s2) of the driven body from its speed at the start to its end speed."""
    end = case.end_speed if case.end_speed is not None else 0.0
    return (end - driven_start_speed(gearbox, case)) / case.duration


def driven_start_speed(gearbox: Gearbox, case: LoadCase) -> float:
    """Speed of the driven body at the start, rad/s; the load case specifies it at the overall input."""
    return gearbox.start_speeds(case)[str(case.driven_body)]


def _flanks(gearbox: Gearbox, forces: Floats) -> tuple[dict[str, str], tuple[str, ...]]:
    """Find the loaded flanks by mesh family, and the families whose loaded flank differs from the static load."""
    static = gearbox.train.static_mesh_forces()
    least = UNLOADED * float(np.abs(forces).max(initial=0.0))
    flanks: dict[str, str] = {}
    turned = []
    for m, mesh in enumerate(gearbox.meshes):
        mesh_forces = forces[:, m]
        loaded = ("+" if np.any(mesh_forces > least) else "") + ("-" if np.any(mesh_forces < -least) else "")
        flanks[mesh.family] = "".join(sign for sign in "+-" if sign in flanks.get(mesh.family, "") + loaded)
        if np.any(mesh_forces * np.sign(static[mesh.name]) < -least):
            turned.append(mesh.family)
    return {family: signs or "0" for family, signs in flanks.items()}, tuple(dict.fromkeys(turned))


def _shares(gearbox: Gearbox, forces: Floats, extreme: Callable[..., float]) -> dict[str, float]:
    """Extreme mesh force (times, meshes) of each family divided by that of the static load.

    Families without static load are omitted.
    """
    static = gearbox.train.static_mesh_forces()
    largest = max(map(abs, static.values()), default=0.0)
    shares: dict[str, float] = {}
    for m, mesh in enumerate(gearbox.meshes):
        if abs(static[mesh.name]) > UNLOADED * largest:
            share = extreme((forces[:, m] / static[mesh.name]).tolist())
            shares[mesh.family] = extreme(share, shares.get(mesh.family, share))
    return shares


def speeds_beyond_tables(gearbox: Gearbox, lowest: float, highest: float) -> str:
    """Return an error text for input speeds (rad/s, no sign) outside the table of an excitation; empty for others."""
    speeds = gearbox.train.rolling_speeds(gearbox.case.overall.input, 1.0)
    for load in gearbox.varying_loads:
        if not load.curve or load.body not in speeds or speeds[load.body] == 0.0:
            continue
        wanted = [abs(speeds[load.body]) * speed / RPM for speed in (lowest, highest)]
        covered = [load.curve[0][0] / RPM, load.curve[-1][0] / RPM]
        if wanted[0] < covered[0] * (1.0 - COVERED) or wanted[1] > covered[1] * (1.0 + COVERED):
            return (
                f"excitations.{load.excitation}.table: covers {covered[0]:.6g} to {covered[1]:.6g} rpm of {load.body}, "
                f"which turns at {wanted[0]:.6g} to {wanted[1]:.6g} rpm; add rows, or limit the speeds"
            )
    return ""


# Operating speed range, which decides which resonances count

OF_RATED = (0.5, 1.25)
"""Default operating range as a fraction of the rated speed, if the file specifies no range."""


def operating_range(gearbox: Gearbox) -> tuple[float, float] | None:
    """Operating range of the overall input: minimum and maximum speed, rad/s, without sign.

    None if the file specifies neither a range nor a rated speed; all speeds then count.

    Examples
    --------
    >>> [round(speed / RPM, 3) for speed in operating_range(Gearbox.from_toml("cases/grc750/gearbox.toml"))]
    [11.05, 27.625]
    """
    operation = gearbox.case.operation
    if operation.speed_range_rpm is not None:
        low, high = operation.speed_range_rpm
        return low * RPM, high * RPM
    if operation.rated_speed_rpm is None:
        return None
    return OF_RATED[0] * operation.rated_speed_rpm * RPM, OF_RATED[1] * operation.rated_speed_rpm * RPM
