"""Findings on a stored steady-state response: where it is missing, unstable or outside the range of its models."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from exugear.gearbox.units import RPM
from exugear.gearbox.variant import Variant
from exugear.results.findings import Finding, check_finding
from exugear.results.sound.over_speed import sound_over_speed
from exugear.steady.mean_system.signals import SIGNALS, round_off
from exugear.steady.peaks import (
    STRAINED,
    bearing_swings,
    dynamic_load_ratios,
    pulls,
    tensile_fractions,
    varying_carriers,
)
from exugear.system.tooth_mesh.laws.registry import LAWS
from exugear.system.tooth_mesh.tables import Shuttling
from fe_ste.tools.arrays import Floats

if TYPE_CHECKING:
    import xarray as xr

MAX_ENERGY_ERROR = 1e-4
"""Permissible relative difference between dissipated power and power of the meshes."""
NOTICED_CHANGE = 1e-2
"""Relative change of the highest peaks with more harmonics above which a warning is given."""
NOTICED_VARIATION = 1e-3
"""Relative variation of stiffness with the carrier angle above which a warning is given."""
NOTICED_NEIGHBOURS = 0.05
"""Relative change of a mesh order by orders that are left out beside it above which a warning is given."""
NOTICED_SHUTTLING = 0.3
"""Ratio of shuttling moment to transmission error excitation above which a warning is given."""
FIRST_RANKS = 20
"""Highest peaks of which a warning is given if one may be higher between the speeds, instead of a note."""
QUANTITY_NAMES = {
    "error": "transmission error",
    "force": "bearing force",
    "acceleration": "acceleration at bearings",
    "mount_acceleration": "acceleration at mounts",
    "surface_velocity": "surface velocity",
}
SHOWN_BEARINGS = 4
SHOWN_ORDERS = 3
SHOWN_SPEEDS = 6
UPPER_ESTIMATE = (
    "sound power is an upper estimate (equivalent radiated power), too high at low frequency, for the GRC by 12 to "
    "14 dB at 63 Hz; housing modes shifted by 5 % change a single order by 8 to 10 dB"
)
"""How far sound power can be trusted."""


def response_findings(data: xr.Dataset) -> tuple[Finding, ...]:
    """Check a response, as `exugear.steady.steady_file.load_response` reads it."""
    return (
        *_balance(data),
        *_speeds(data),
        *_between_speeds(data),
        *_models(data),
        *_passing(data),
        *_excitation(data),
        *_sound(data),
    )


@dataclass(frozen=True)
class SpeedCaveats:
    """What weakens the amplitudes at single speeds of a response."""

    speed: Floats
    """(n,) absolute input speed, rad/s."""
    load_ratios: Mapping[str, Floats]
    """Dynamic over static load by bearing, (n,)."""
    tensile: Mapping[str, Floats]
    """Fraction of time with tensile force by mesh, (n,); empty if the mesh model loses contact."""

    def at(self, speed: float) -> tuple[str, ...]:
        """Return the caveats on the amplitudes at a speed (rad/s), the nearest that was computed."""
        point = int(np.argmin(np.abs(self.speed - abs(speed))))
        ratios = {name: float(ratio[point]) for name, ratio in self.load_ratios.items()}
        name = max(ratios, key=lambda bearing: ratios[bearing], default="")
        found = []
        if name and ratios[name] >= STRAINED:
            text = f"dynamic load of {name} {_percent(ratios[name])} of its static load: outside the linear range, "
            found.append(f"{text}too high")
        for mesh, fraction in self.tensile.items():
            if fraction[point] > 0.0:
                text = f"tensile force of {mesh} for {_percent(float(fraction[point]))} of the time: invalid, "
                found.append(f"{text}because contact loss is neglected")
        return tuple(found)


def _percent(ratio: float) -> str:
    """Return a ratio in percent; a static load that is next to nothing gives no meaningful number.

    Examples
    --------
    >>> _percent(0.0234), _percent(1.2), _percent(1777.0)
    ('2.3 %', '120 %', 'over 1000 %')
    """
    if ratio > 10.0:
        return "over 1000 %"
    return f"{100.0 * ratio:.0f} %" if ratio > 0.1 else f"{100.0 * ratio:.2g} %"


def speed_caveats(data: xr.Dataset) -> SpeedCaveats:
    """Return the caveats at each speed of a response."""
    tensile = {} if LAWS[str(data.attrs["mesh_model"])].loses_contact else tensile_fractions(data)
    return SpeedCaveats(np.abs(data["speed"].to_numpy()), dynamic_load_ratios(data), tensile)


def is_excited(data: xr.Dataset) -> bool:
    """Whether anything vibrates: the overall transmission error or, as under an unbalance, bearing forces alone."""
    return _varies(data, "error") or _varies(data, "force")


def _varies(data: xr.Dataset, quantity: str) -> bool:
    """Return whether a quantity has orders above round-off."""
    signal, _ = SIGNALS[quantity]
    places = [n for n, name in enumerate(data["signal"].to_numpy()) if str(name).split(" ", maxsplit=1)[0] == signal]
    amplitude = data["amplitude"].to_numpy()[:, :, places]
    static = float(amplitude[:, 0].max(initial=0.0))
    return bool((amplitude[:, 1:] > round_off(quantity, static)).any())


def _load_sharing(data: xr.Dataset) -> dict[str, float]:
    """K_gamma of families whose planets are loaded unequally."""
    found: dict[str, float] = json.loads(str(data.attrs.get("load_sharing", "{}")))
    return found


def _rpm(speed: float) -> str:
    """Return a speed (rad/s) in three digits, without exponent."""
    return f"{float(f'{abs(speed) / RPM:.3g}'):g} rpm"


def _counted(speeds: Sequence[object]) -> str:
    """Return a number of speeds, with its noun."""
    return f"{len(speeds)} speed{'s' * (len(speeds) != 1)}"


def _balance(data: xr.Dataset) -> Iterator[Finding]:
    """Energy and stability of the steady state."""
    error = float(np.nanmax(np.abs(data["energy_error"])))
    text = f"energy balance closed to {100.0 * error:.1g} % (power supplied by the meshes = power dissipated)"
    yield check_finding(error < MAX_ENERGY_ERROR, text, error)
    growth = float(data.attrs["growth_rate"])
    if growth <= 0.0:
        yield Finding(
            "passed", f"the steady state is stable: disturbances decay at {-growth:.2g} 1/s or faster", growth
        )
        return
    at = data["speed"].to_numpy()[data["growth"].to_numpy() == growth]
    where = f" (at {_rpm(at[0])})" if at.size else ""
    text = f"the steady state is unstable: disturbances grow at up to {growth:.3g} 1/s{where}"
    yield Finding("warning" if bool(data["growth"].notnull().any()) else "error", text, growth)


def _speeds(data: xr.Dataset) -> Iterator[Finding]:
    """Speeds without a state, and speeds with a remark."""
    if ended := str(data.attrs["branch_ended"]):
        yield Finding("error", f"continuation incomplete: {ended}")
    if missing := json.loads(data.attrs["not_converged"]):
        first = f"{_rpm(missing[0]['speed'])}: {missing[0]['reason']}"
        text = f"no steady state found at {_counted(missing)} (blank in the diagrams), first {first}"
        yield Finding("warning", text, len(missing))
    speed = np.abs(data["speed"].to_numpy())
    if (at := speed[data["loads_at_mean_angles"].to_numpy() == 1]).size:
        where = f"up to {_rpm(at.max())}"
        if at.size < np.count_nonzero(speed <= at.max()):
            more = f" and {at.size - SHOWN_SPEEDS} more" if at.size > SHOWN_SPEEDS else ""
            where = f"at {', '.join(_rpm(one) for one in at[:SHOWN_SPEEDS])}{more}"
        text = f"meshes and excitations follow the mean speed alone {where}: vibration would turn gears by over a "
        text += (
            "tenth of a mesh cycle, so sidebands are missing there; add the inertia of the connected machines, raise "
        )
        text += "the lowest speed, or use exugear run"
        operation = json.loads(str(data.attrs["operating_range"]))
        inside = operation is None or bool(((at >= operation[0]) & (at <= operation[1])).any())
        yield Finding("warning" if inside else "note", text, at.size)
    remarks = [(speed, str(text)) for speed, text in zip(data["speed"].values, data["remark"].values, strict=True)]
    if said := [(speed, text) for speed, text in remarks if text]:
        first = f"{_rpm(said[0][0])}: {said[0][1]}"
        yield Finding("warning", f"{_counted(said)} with warnings, first {first}", len(said))


def _between_speeds(data: xr.Dataset) -> Iterator[Finding]:
    """Peaks of lower rank that are higher between the computed speeds."""
    if higher := json.loads(str(data.attrs.get("higher_between", "[]"))):
        parts = [
            f"{QUANTITY_NAMES[own['quantity']]} from rank {own['rank']} on, by up to {_percent(own['excess'])}"
            for own in higher
        ]
        text = "peaks of lower rank may be higher between the computed speeds than listed (upper estimates: "
        text += f"{'; '.join(parts)}); compute them with a narrower range of --speeds"
        first = min(own["rank"] for own in higher)
        yield Finding("warning" if first <= FIRST_RANKS else "note", text, max(own["excess"] for own in higher))


def _models(data: xr.Dataset) -> Iterator[Finding]:
    """Range of the models of meshes, bearings and planets."""
    model = str(data.attrs["mesh_model"])
    for pull in () if LAWS[model].loses_contact else pulls(data):
        text = f"{pull.name}: tensile mesh force at {pull.count} of {data.sizes['point']} speeds, at most "
        text += f"{_percent(pull.share)} of the time at {_rpm(pull.speed)}; amplitudes there are invalid, because "
        text += f"the model {model} neglects contact loss; use --mesh-model table --method nonlinear"
        yield Finding("warning", text, pull.share)
    turned = any(str(name).startswith("rotation of ") for name in data["base"].values)
    waves = any(str(name).endswith(" cosine") for name in data["mesh_wave"].values)
    at_their_mean = turned and waves and not _load_sharing(data)
    if LAWS[model].loses_contact and at_their_mean and Variant.of(str(data.attrs["variant"])).has_bearings:
        text = "planets count at their mean under excitations: what unequal load sharing adds as they pass is left out "
        text += "(2 % of the orders of the GRC off resonances); leave the excitations out (--without NAME) to see its "
        text += "size, or use exugear run"
        yield Finding("warning", text)
    if sharing := _load_sharing(data):
        values = ", ".join(f"{value:.3f} of {family}" for family, value in sharing.items())
        text = f"unequally loaded planets: K_gamma = {values} (largest over mean force of the planets' meshes)"
        yield Finding("note", text, max(sharing.values()))
    apart = float(np.max(np.nan_to_num(data["contact_loss_fraction"].to_numpy()), initial=0.0))
    if apart > 0.0:
        text = f"contact loss for up to {_percent(apart)} of the time (included in the mesh model)"
        yield Finding("passed", text, apart)
    if names := str(data.attrs["bearings_in_time"]):
        yield Finding("note", f"nonlinear bearings (rolling elements evaluated in time): {names}")
    elif "16281" in data.attrs["bearing_laws"]:
        text = "nonlinear bearings are linearised at the static load; --method nonlinear evaluates the nonlinear model"
        if _load_sharing(data):
            text = (
                "nonlinear bearings are linearised at the static load, those of planets at their mean although these "
            )
            text += "share the load unequally (up to a quarter of a mesh order in the GRC); use --method nonlinear"
        yield Finding("warning" if _load_sharing(data) else "note", text)
    if swings := bearing_swings(data):
        loads = [f"{own.name} {_percent(own.share)} at {_rpm(own.speed)}" for own in swings[:SHOWN_BEARINGS]]
        more = f"; and {len(swings) - SHOWN_BEARINGS} more" if len(swings) > SHOWN_BEARINGS else ""
        text = f"dynamic load of bearings over {100.0 * STRAINED:.0f} % of their static load or preload "
        text += f"({'; '.join(loads)}{more}): "
        text += 'outside the linear range, peaks there are too high; set model = "iso16281"'
        if varying_carriers(data):  # runs alone evaluate rolling elements of planets that are not alike
            text += " and use exugear run"
        elif data.attrs["method"] != "nonlinear":
            text += " and use --method nonlinear"
        yield Finding("warning", text, swings[0].share)
    variation = float(data.attrs["stiffness_variation"])
    if variation > NOTICED_VARIATION:
        text = f"stiffness varies by {100.0 * variation:.2g} % over a carrier revolution (unequal planet loads); the "
        text += "mean is used, and responses near lightly damped planet modes are off by a few thousandths"
        yield Finding("warning", text, variation)


def _passing(data: xr.Dataset) -> Iterator[Finding]:
    """Orders beside others by stiffness that varies with the angle of a carrier."""
    carriers = varying_carriers(data)
    if not carriers:
        return
    left_out = float(data.attrs["neighbours_left_out"])
    passing = data["index"].to_numpy()[:, np.isin(data["base"].to_numpy(), carriers)]
    count = int(np.count_nonzero(passing.any(axis=1)))
    several = len(carriers) > 1
    named = " and ".join(carriers)
    angles = "angles" if several else "angle"
    text = f"stiffness varies with the {angles} of {named}: {count} orders of passing planets and beside mesh orders "
    text += "are included; at the speeds where they were chosen, those left out change a mesh order by at most "
    text += f"{100.0 * left_out:.1g} % of its amplitude, or of a tenth of the highest order"
    yield Finding("warning" if left_out > NOTICED_NEIGHBOURS else "note", text, left_out)
    over_angle = data["mode_over_angle"].to_numpy()
    if over_angle.size:
        spread = over_angle[:, 1] - over_angle[:, 0]
        most = int(np.argmax(spread))
        frequency = float(np.nanmean(data["mode_frequency"].to_numpy()[:, most]))
        low, high = (100.0 * np.round(over_angle[most] - 1.0, 6)).tolist()
        turning = "one of them" if several else "it"
        text = f"natural frequencies are those with {named} at zero {angles}; as {turning} turns, they vary from "
        text += f"{low:.2g} to {high:+.2g} % at most (mode at {frequency:.0f} Hz)"
        yield Finding("note", text, float(spread[most]))


def _excitation(data: xr.Dataset) -> Iterator[Finding]:
    """Excitation by the meshes, and its truncation."""
    if not _varies(data, "error"):
        # Displaced pins and unbalances still load bearings, at orders of their shafts.
        others = bool(_load_sharing(data)) or is_excited(data)
        model = str(data.attrs["mesh_model"])
        remedy = ""
        if data.sizes["mesh_wave"]:
            text = f"no excitation{' by the meshes' if others else ''}: the mesh model {model} has constant stiffness "
            text += "over the mesh cycle, and "
            remedy = "; use --mesh-model line_of_action"
            if LAWS[model].moves_load or LAWS[model].loses_contact:
                remedy = "; remove the constant stiffness of the pairs, so that their tables are computed"
        else:
            text = "the train has no meshes: "
        text += "the overall transmission error does not vary" if others else "all amplitudes are zero"
        turned = any(str(name).startswith("rotation of ") for name in data["base"].values)
        if turned and not Variant.of(str(data.attrs["variant"])).has_bearings:
            text += "; in this variant ideal joints take the forces of excitations and unbalances"
        yield Finding("warning" if remedy else "note", f"{text}{remedy}")
        return
    harmonics = int(data.attrs["harmonics"])
    change = float(data.attrs["change_with_more"])
    if math.isfinite(change):
        combined = bool((np.count_nonzero(data["index"].to_numpy(), axis=1) > 1).any())
        more = ", and 1.5 times as many combinations of meshes," if combined else ""
        text = f"{harmonics} mesh harmonics ({math.ceil(1.5 * harmonics)}{more} would change the ten highest peaks by "
        text += f"at most {_percent(change)})"
        yield Finding("warning" if change > NOTICED_CHANGE else "note", text, change)
    else:
        yield Finding("note", f"{harmonics} mesh harmonics; harmonics that a solution requires are added")
    if shared := str(data.attrs["shared_lines"]):
        yield Finding("note", f"coinciding orders, each named after one of them: {shared}")


def _sound(data: xr.Dataset) -> Iterator[Finding]:
    """Limits of the sound power of an elastic housing."""
    sound = sound_over_speed(data)
    if sound is None or not is_excited(data):
        return
    yield Finding("warning", UPPER_ESTIMATE)
    if left_out := sound.orders_left_out():
        limit = float(sound.surface["limit_Hz"])
        # Orders of a single mesh come before combinations.
        named = sorted(left_out, key=lambda own: " + " in own[0] or " - " in own[0])[:SHOWN_ORDERS]
        lowest = [f"{name} at {frequency:.0f} Hz" for name, frequency in named]
        more = f" and {len(left_out) - SHOWN_ORDERS} more" if len(left_out) > SHOWN_ORDERS else ""
        keys = ", ".join(f"bodies.{name}.solid.band_Hz" for name in sound.surface["bodies"])
        text = f"sound power without orders above {limit:.4g} Hz, two thirds of the band of the housing; at "
        text += f"{_rpm(float(sound.speed.max()))} these are {', '.join(lowest)}{more}; set {keys} to 1.5 times the "
        text += "highest frequency that counts"
        yield Finding("warning", text, limit)


def shuttling_findings(shuttling: tuple[Shuttling, ...], mesh_model: str) -> tuple[Finding, ...]:
    """Return a warning if a mesh model neglects shuttling that excites notably, largest first."""
    if not shuttling or shuttling[0].over_error <= NOTICED_SHUTTLING:
        return ()
    text = f"{shuttling[0].description}. The shuttling moment, {shuttling[0].over_error:.2g} times the excitation by "
    text += f"the transmission error, is neglected by the mesh model {mesh_model}; resonances with tilting gears may "
    text += "be many times higher; use --mesh-model line_of_action"
    return (Finding("warning", text, shuttling[0].over_error),)
