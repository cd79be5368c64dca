"""Loads of a steady-state response on what stands still, over frequency, as CSV and as Nastran load cards.

With them a structural department computes sound or stress by its own model of the housing. Conventions:

- F(t) = Re(F exp(i omega t)): complex amplitudes are zero-to-peak, with the phase at angle zero of the overall input.
- A positive force or moment acts on the housing, along or about the axes of the gearbox.
- Moments are about the seat: the position of a bearing, the middle of a gear on its axis, the place of an excitation.
- Static loads are not included.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.units import RPM
from exugear.system.bodies.matrix_files.interface import UNIT_SYSTEMS, UnitSystemName
from exugear.system.bodies.matrix_files.punch import nastran_decimal
from fe_ste.tools.arrays import Complexes, Floats

if TYPE_CHECKING:
    import xarray as xr

OF_BEARINGS = ("support_force", "support_moment")
ON_BODIES = (("gear_force", "gear_moment"), ("reaction_force", "reaction_moment"))
"""Signals of force and moment: of bearings on their moving bodies, of gears and excitations on the fixed body."""
AXES = ("x", "y", "z")
DIRECTIONS = (*AXES, *(f"r{axis}" for axis in AXES))
"""Forces along the axes, then moments about them: components 1 to 6 of a node in Nastran."""
SAME_FREQUENCY = 1e-9
"""Relative difference below which two orders have one frequency; their amplitudes are added."""
FIRST_SET = 1000
"""Set of DLOAD and FREQ in Nastran; sets of single loads and tables follow."""
COLUMNS = ("speed_rpm", "order", "frequency_Hz", "seat", "node", "direction", "unit", "real", "imaginary")
"""Headings of the CSV file."""


@dataclass(frozen=True, eq=False)
class InterfaceLoads:
    """Forces and moments at one speed on what stands still."""

    speed: float
    """Of the overall input, rad/s."""
    seats: tuple[str, ...]
    """(s,) names of the bearings, gears and excitations."""
    nodes: tuple[int, ...]
    """(s,) node numbers."""
    order: Floats
    frequency: Floats
    """(l,) periods per revolution of the overall input, and Hz, ascending."""
    load: Complexes
    """(l, s, 6) amplitudes of the force along x, y, z (N), then of the moment about them (N m)."""


def loaded_seats(gearbox: Gearbox, data: xr.Dataset) -> tuple[str, ...]:
    """Bearings on what stands still, then gears of fixed bodies and excitations that a response has the loads of."""
    return (*(bearing.name for bearing in gearbox.standing_bearings), *(name for name, _ in _on_bodies(data)))


def _on_bodies(data: xr.Dataset) -> Iterator[tuple[str, tuple[str, str]]]:
    """Yield gears and excitations with their signals of force and moment."""
    names = [str(name) for name in data["signal"].to_numpy()]
    for signals in ON_BODIES:
        prefix = f"{signals[0]} "
        found = (name.removeprefix(prefix).rsplit(" ", 1)[0] for name in names if name.startswith(prefix))
        yield from ((name, signals) for name in dict.fromkeys(found))


def interface_loads(
    gearbox: Gearbox, data: xr.Dataset, points: Sequence[int], numbers: Mapping[str, int]
) -> Iterator[InterfaceLoads]:
    """Yield the loads at some points of a steady-state response.

    Parameters
    ----------
    data : as `exugear.steady.steady_file.load_response` gives it
    points : indices of the speeds
    numbers : node number by seat, for those of `loaded_seats`

    Raises
    ------
    ValueError
        The response has no forces of these bearings: it belongs to another gearbox or variant.
    """
    names = [str(name) for name in data["signal"].to_numpy()]
    bearings = len(gearbox.standing_bearings)
    signals_of = [*((own.name, OF_BEARINGS) for own in gearbox.standing_bearings), *_on_bodies(data)]
    seats = tuple(seat for seat, _ in signals_of)
    columns = []
    for seat, signals in signals_of:
        wanted = [f"{signal} {seat} {axis}" for signal in signals for axis in AXES]
        if not set(wanted) <= set(names):
            raise ValueError(f"no loads of the bearing {seat}; compute the response of this gearbox again")
        columns += [names.index(name) for name in wanted]
    orders = data["order"].to_numpy()
    amplitude = data["amplitude"].to_numpy()[..., columns].astype(np.float64)
    phase = data["phase"].to_numpy()[..., columns].astype(np.float64)
    # Signals of bearings are loads on the moving bodies; those of negative orders turn the other way.
    sense = np.repeat(np.where(np.arange(len(seats)) < bearings, -1.0, 1.0), len(DIRECTIONS))
    load = sense * amplitude * np.exp(1j * np.where(orders < 0.0, -1.0, 1.0)[:, None] * phase)
    group, members = _equal_orders(np.abs(orders))
    vibrating = group > 0.0  # the response is about the static state: the line of order zero is its change
    group, members = group[vibrating], [rows for rows, kept in zip(members, vibrating, strict=True) if kept]
    for point in points:
        summed = np.array([load[point, rows].sum(axis=0) for rows in members])
        speed = float(data["speed"].to_numpy()[point])
        yield InterfaceLoads(
            speed=speed,
            seats=seats,
            nodes=tuple(numbers[seat] for seat in seats),
            order=group,
            frequency=group * abs(speed) / (2.0 * np.pi),
            load=summed.reshape(len(group), len(seats), len(DIRECTIONS)),
        )


def _equal_orders(orders: Floats) -> tuple[Floats, list[list[int]]]:
    """Distinct orders, ascending, and the indices of each."""
    found: list[float] = []
    members: list[list[int]] = []
    for line in np.argsort(orders, kind="stable"):
        if found and orders[line] - found[-1] <= SAME_FREQUENCY * max(found[-1], 1.0):
            members[-1].append(int(line))
        else:
            found.append(float(orders[line]))
            members.append([int(line)])
    return np.array(found), members


def loads_csv(loads: Sequence[InterfaceLoads]) -> bytes:
    """Content of a CSV file with a row for each speed, order, seat and direction; see `COLUMNS`."""
    text = io.StringIO()
    text.write(",".join(COLUMNS) + "\n")
    units = ["N"] * 3 + ["N m"] * 3
    for own in loads:
        for line, (order, frequency) in enumerate(zip(own.order, own.frequency, strict=True)):
            for seat, (name, node) in enumerate(zip(own.seats, own.nodes, strict=True)):
                for direction, unit, value in zip(DIRECTIONS, units, own.load[line, seat], strict=True):
                    start = f"{own.speed / RPM:.9g},{order:.9g},{frequency:.9g},{name},{node},{direction},{unit}"
                    text.write(f"{start},{value.real:.9g},{value.imag:.9g}\n")
    return text.getvalue().encode()


def nastran_loads(loads: InterfaceLoads, units: UnitSystemName = "SI") -> bytes:
    """Content of a bulk data file with the loads of one speed.

    RLOAD1 has the real and imaginary part of each load over frequency (TABLED1) in N or N m, DAREA node, component and
    the factor to the units of the model, DLOAD the sum, FREQ the frequencies.

    Parameters
    ----------
    units : unit system of the model; frequencies are in Hz in all of them but mm-kg-ms, where they are in kHz
    """
    length, mass, time = UNIT_SYSTEMS[units]
    force = mass * length / time**2
    factors = [nastran_decimal(1.0 / own) for own in [force] * 3 + [force * length] * 3]
    frequency = [nastran_decimal(float(value) * time) for value in loads.frequency]
    lines = [
        f"$ Loads on the housing at {loads.speed / RPM:.6g} rpm of the overall input, zero-to-peak; model in {units}",
        "$ Tables in N and N m; F(t) = Re(F exp(i omega t)); axes of the gearbox",
        f"$ Case control: DLOAD = {FIRST_SET}, FREQUENCY = {FIRST_SET}",
        *_wide_card("FREQ", [str(FIRST_SET), *frequency]),
    ]
    sets = []
    number = FIRST_SET
    for seat, node in enumerate(loads.nodes):
        for axis, direction in enumerate(DIRECTIONS):
            values = loads.load[:, seat, axis]
            if not np.any(values):
                continue
            number += 2
            sets.append(number)
            lines.append(f"$ {loads.seats[seat]} {direction}")
            lines += _wide_card("DAREA", [str(number), str(node), str(axis + 1), factors[axis]])
            lines += _wide_card("RLOAD1", [str(number), str(number), "", "", str(number), str(number + 1)])
            for table, part in ((number, values.real), (number + 1, values.imag)):
                cells = [cell for x, y in zip(frequency, part, strict=True) for cell in (x, nastran_decimal(float(y)))]
                lines += _wide_card("TABLED1", [str(table), *[""] * 7, *cells, "ENDT"])
    combined = [cell for own in sets for cell in ("1.0", str(own))]
    lines += _wide_card("DLOAD", [str(FIRST_SET), "1.0", *combined])
    return ("\n".join(lines) + "\n").encode()


def _wide_card(name: str, cells: Sequence[str]) -> Iterator[str]:
    """Lines of a card in fields of 16 columns; two of them are one line of eight fields."""
    count = 8 * -(-len(cells) // 8)
    padded = [*cells, *[""] * (count - len(cells))]
    for start in range(0, count, 4):
        prefix = f"{name}*" if start == 0 else "*"
        yield f"{prefix:<8}{''.join(f'{cell:>16}' for cell in padded[start : start + 4])}".rstrip()
