"""Resonances on the console: the highest one in a line, and the table of a ranking."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

from exugear.cli.tables import HARD_SPACE, Column, Table, detail, significant
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.load_cases import static_load_in_words
from exugear.gearbox.units import RPM
from exugear.report.findings.ranking import UNIT_KEYS, Ranking
from exugear.report.findings.words import QUANTITIES, Labels

if TYPE_CHECKING:
    import xarray as xr

ORDER = Column("order", "line", lambda line: line.replace(" x ", " × "))
LEAST_SOURCE = 0.01
"""Least share of the amplitude of an order with which a source is listed."""
SPEED = Column("speed\nrpm", lambda own: abs(own["speed_rpm"]), partial(significant, digits=3))
FREQUENCY = Column("freq.\nHz", "frequency_Hz", partial(significant, digits=3))


def highest_resonance(gearbox: Gearbox, ranking: Ranking) -> str:
    """Return the first resonance of a ranking in one line."""
    if not ranking.resonances:
        return f"No resonance, {_speeds(ranking)}"
    first = ranking.resonances[0].summary()
    quantity = ranking.quantity
    label = QUANTITIES[quantity]
    at = f"{first[f'{quantity}_at']}, " if f"{quantity}_at" in first else ""
    order = _order(gearbox).cell(first).replace(" × ", f"{HARD_SPACE}×{HARD_SPACE}")
    return (
        f"Highest peak: {label.column} ±{_amplitude(quantity, first)} {label.unit}, {at}{SPEED.cell(first)} rpm, "
        f"{FREQUENCY.cell(first)} Hz, {order}"
    )


def _order(gearbox: Gearbox) -> Column:
    """Column of orders with the excitations of the file that have them."""
    words = Labels(gearbox)
    return Column("order", lambda own: ORDER.cell(own) + words.causes(own["order"]))


def source_table(gearbox: Gearbox, data: xr.Dataset) -> Table | None:
    """Return the shares of meshes and excitations in the orders at resonances.

    None for a file without excitations, and for mesh models with contact loss, whose response is no sum of shares.
    """
    peaks = json.loads(data.attrs["contributions"])
    if not gearbox.varying_loads or not peaks:
        return None
    rows = []
    for peak in peaks:
        name = str(data["line"][peak["line"]].item())
        shares = sorted(peak["meshes"].items(), key=lambda own: -abs(own[1]))
        listed = [f"{source} {100.0 * share:.0f} %" for source, share in shares if abs(share) >= LEAST_SOURCE]
        rows.append({"line": name, "speed_rpm": peak["speed"] / RPM, "from": ", ".join(listed) or "-"})
    legend = "Shares along the sum, opposed ones negative; method linear."
    columns = [ORDER, SPEED, Column("from", "from", is_text=True)]
    return Table("Sources of the transmission error at resonances", rows, columns, legend, noun="resonances")


def _speeds(ranking: Ranking) -> str:
    low, high = (significant(speed / RPM, 3) for speed in ranking.speeds)
    return f"{low} to {high} rpm"


def resonance_table(gearbox: Gearbox, ranking: Ranking, model: str) -> Table:
    """Return the table of the ranking of a model: the quantity that decides first, with its range over the damping."""
    resonances = [resonance.summary() for resonance in ranking.resonances]
    first, body = ranking.quantity, gearbox.case.overall.input
    where = "all speeds" if ranking.whole else "operating range"
    title = f"Resonances, {_speeds(ranking)} ({where}), at {static_load_in_words(gearbox)}"
    turning = "-z" if any(own.speed < 0.0 for own in ranking.resonances) else "+z"
    legend = f"{model}; {body} turns about {turning}. Zero-to-peak"
    if any("lowest_damping" in key for own in resonances for key in own):
        band = gearbox.case.damping.modal_band_percent
        damping = f"{band[0]:g} to {band[1]:g} % of critical" if band else "half to twice the"
        legend += f"; {damping} damping in parentheses"
    legend += ". TE: overall transmission error"
    names = [first, *(own for own in QUANTITIES if own != first and resonances and f"{own}_place" in resonances[0])]
    if "force" in names:
        owner = {"shafts": "shaft", "housing": "housing"}.get(ranking.accelerates, ranking.accelerates)
        legend += f"; force: dynamic bearing force; accel.: {owner} at the bearing"
    if "surface_velocity" in names[:3]:
        legend += "; surface: normal velocity of the housing, rms over its outer surface"
    columns = [_order(gearbox), SPEED, FREQUENCY, Column(_heading(first), partial(_amplitude_and_range, first))]
    if first not in ("error", "surface_velocity"):
        columns.append(Column("at", f"{first}_at", is_text=True))
    columns += [Column(_heading(name), partial(_amplitude, name)) for name in names[1:3]]
    columns += [detail(_heading(name), partial(_amplitude, name)) for name in names[3:]]
    columns += [detail(f"{_heading(name)} range", partial(_range, name)) for name in names[1:]]
    columns += [detail(f"{QUANTITIES[name].short}\nrank", partial(_rank, name)) for name in names]
    title = title.replace(" N m", f"{HARD_SPACE}N{HARD_SPACE}m")
    return Table(title, resonances, columns, f"{legend}.", noun="resonances")


def _heading(quantity: str) -> str:
    return f"{QUANTITIES[quantity].short}\n{QUANTITIES[quantity].unit}"


def _amplitude(quantity: str, resonance: Mapping[str, Any]) -> str:
    return significant(QUANTITIES[quantity].factor * resonance[f"{quantity}_{UNIT_KEYS[quantity]}"], 3)


def _range(quantity: str, resonance: Mapping[str, Any]) -> str | None:
    """Amplitudes of a resonance with the highest and with the lowest damping; None where they were not solved."""
    ends = [resonance.get(f"{quantity}_{end}_damping_{UNIT_KEYS[quantity]}") for end in ("highest", "lowest")]
    if None in ends:
        return None
    return "–".join(significant(QUANTITIES[quantity].factor * end, 2) for end in ends if end is not None)


def _amplitude_and_range(quantity: str, resonance: Mapping[str, Any]) -> str:
    limits = _range(quantity, resonance)
    return _amplitude(quantity, resonance) + (f" ({limits})" if limits else "")


def _rank(quantity: str, resonance: Mapping[str, Any]) -> str | None:
    """Rank of a resonance in one quantity, and its best and worst rank over the damping if they differ."""
    place = resonance[f"{quantity}_place"]
    places = resonance.get(f"{quantity}_places_over_damping")
    if place is None or places is None or places[0] == places[1]:
        return None if place is None else str(place)
    return f"{place} ({places[0]}–{places[1]})"
