"""Forces of a steady-state response on what stands still, over frequency, as CSV and as Nastran load cards.

With them a structural department computes sound or stress by its own model of the housing. Conventions:

- F(t) = Re(F exp(i omega t)): complex amplitudes are zero-to-peak, with the phase at angle zero of the overall input.
- A positive force acts on the housing, along the axes of the gearbox.
- Static forces are not included.
- Moments are not included; bearings that resist tilting also transmit moments.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import Bearing
from exugear.gearbox.sections.entries import GROUND
from exugear.gearbox.units import RPM
from exugear.system.bodies.matrix_files.punch import nastran_decimal
from fe_ste.tools.arrays import Complexes, Floats

if TYPE_CHECKING:
    import xarray as xr

SIGNAL = "support_force"
AXES = ("x", "y", "z")
SAME_FREQUENCY = 1e-9
"""Relative difference below which two orders have one frequency; their amplitudes are added."""
FIRST_SET = 1000
"""Set of DLOAD and FREQ in Nastran; sets of single loads and tables follow."""
COLUMNS = ("speed_rpm", "order", "frequency_Hz", "seat", "node", "direction", "real_N", "imaginary_N")
"""Headings of the CSV file."""


@dataclass(frozen=True, eq=False)
class InterfaceLoads:
    """Forces at one speed on what stands still."""

    speed: float
    """Of the overall input, rad/s."""
    seats: tuple[str, ...]
    """(s,) names of the bearings."""
    nodes: tuple[int, ...]
    """(s,) node numbers."""
    order: Floats
    frequency: Floats
    """(l,) periods per revolution of the overall input, and Hz, ascending."""
    force: Complexes
    """(l, s, 3) amplitudes, N."""


def standing_supports(gearbox: Gearbox) -> tuple[Bearing, ...]:
    """Bearings between a moving body and one that stands still, such as the housing or the ground.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> [bearing.name for bearing in standing_supports(gearbox)][:3]
    ['plc_a', 'plc_b', 'lss_a']
    """
    standing = {GROUND, *(body.name for body in gearbox.bodies() if body.fixed)}
    return tuple(bearing for bearing in gearbox.bearings if bearing.on in standing and bearing.body not in standing)


def interface_loads(
    gearbox: Gearbox, data: xr.Dataset, points: Sequence[int], numbers: Mapping[str, int]
) -> Iterator[InterfaceLoads]:
    """Yield the loads at some points of a steady-state response.

    Parameters
    ----------
    data : as `exugear.steady.steady_file.load_response` gives it
    points : indices of the speeds
    numbers : node number by bearing

    Raises
    ------
    ValueError
        The response has no forces of these bearings: it belongs to another gearbox or variant.
    """
    names = [str(name) for name in data["signal"].to_numpy()]
    supports = standing_supports(gearbox)
    columns = []
    for bearing in supports:
        wanted = [f"{SIGNAL} {bearing.name} {axis}" for axis in AXES]
        if not set(wanted) <= set(names):
            raise ValueError(f"no forces of the bearing {bearing.name}; compute the response of this gearbox again")
        columns += [names.index(name) for name in wanted]
    orders = data["order"].to_numpy()
    amplitude = data["amplitude"].to_numpy()[..., columns].astype(np.float64)
    phase = data["phase"].to_numpy()[..., columns].astype(np.float64)
    # The signals are forces on the moving bodies; those of negative orders turn the other way.
    force = -amplitude * np.exp(1j * np.where(orders < 0.0, -1.0, 1.0)[:, None] * phase)
    group, members = _equal_orders(np.abs(orders))
    vibrating = group > 0.0  # the response is about the static state: the line of order zero is its change
    group, members = group[vibrating], [rows for rows, kept in zip(members, vibrating, strict=True) if kept]
    for point in points:
        summed = np.array([force[point, rows].sum(axis=0) for rows in members])
        speed = float(data["speed"].to_numpy()[point])
        yield InterfaceLoads(
            speed=speed,
            seats=tuple(bearing.name for bearing in supports),
            nodes=tuple(numbers[bearing.name] for bearing in supports),
            order=group,
            frequency=group * abs(speed) / (2.0 * np.pi),
            force=summed.reshape(len(group), len(supports), 3),
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
    for own in loads:
        for line, (order, frequency) in enumerate(zip(own.order, own.frequency, strict=True)):
            for seat, (name, node) in enumerate(zip(own.seats, own.nodes, strict=True)):
                for axis, value in zip(AXES, own.force[line, seat], strict=True):
                    start = f"{own.speed / RPM:.9g},{order:.9g},{frequency:.9g},{name},{node},{axis}"
                    text.write(f"{start},{value.real:.9g},{value.imag:.9g}\n")
    return text.getvalue().encode()


def nastran_loads(loads: InterfaceLoads) -> bytes:
    """Content of a bulk data file with the loads of one speed.

    RLOAD1 has the real and imaginary part of each force over frequency (TABLED1), DAREA node and direction, DLOAD the
    sum, FREQ the frequencies.
    """
    frequency = [nastran_decimal(float(value)) for value in loads.frequency]
    lines = [
        f"$ Forces on the housing at {loads.speed / RPM:.6g} rpm of the overall input, N, zero-to-peak",
        "$ F(t) = Re(F exp(i omega t)); axes of the gearbox; no moments",
        f"$ Case control: DLOAD = {FIRST_SET}, FREQUENCY = {FIRST_SET}",
        *_wide_card("FREQ", [str(FIRST_SET), *frequency]),
    ]
    sets = []
    number = FIRST_SET
    for seat, node in enumerate(loads.nodes):
        for axis in range(3):
            values = loads.force[:, seat, axis]
            if not np.any(values):
                continue
            number += 2
            sets.append(number)
            lines.append(f"$ {loads.seats[seat]} {AXES[axis]}")
            lines += _wide_card("DAREA", [str(number), str(node), str(axis + 1), "1.0"])
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
