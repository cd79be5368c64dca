"""Order lines: what turns with a gearbox excites a fixed number of times per turn of the reference shaft.

The reference shaft is that of the overall input. Its speeds are in rad/s and count by magnitude: the line of order
``o`` lies at the frequency ``o |speed| / 2 pi``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from exugear.gearbox.gearbox import Gearbox
from fe_ste.tools.arrays import Floats

SAME_ORDER = 1e-6
"""Share by which orders of one line may differ."""


@dataclass(frozen=True)
class OrderLine:
    """A named line of constant order in a waterfall."""

    name: str
    """For legends and tables, such as ``"HS mesh"``."""
    order: float
    """Periods per turn of the reference shaft."""

    def place(self, orders: Floats) -> int | None:
        """Place of the line among orders (n,); None if it is none of them."""
        nearest = int(np.argmin(np.abs(orders - self.order)))
        if abs(orders[nearest] - self.order) <= SAME_ORDER * self.order:
            return nearest
        return None

    def frequency(self, speed: ArrayLike) -> Floats:
        """Frequency on the line, Hz, at speeds of the reference shaft in rad/s."""
        return self.order * np.abs(np.asarray(speed, dtype=np.float64)) / (2.0 * math.pi)


def harmonics(name: str, order: float, count: int) -> tuple[OrderLine, ...]:
    """Lines of a mesh and its harmonics.

    Parameters
    ----------
    name : name of the first
    order : order of the first
    count : how many, the first included

    Examples
    --------
    >>> [(line.name, line.order) for line in harmonics("planetary", 99.0, 2)]
    [('planetary', 99.0), ('2 × planetary', 198.0)]
    """
    return tuple(
        OrderLine(name if number == 1 else f"{number} × {name}", number * order) for number in range(1, count + 1)
    )


def order_lines(gearbox: Gearbox, count: int = 3) -> tuple[OrderLine, ...]:
    """Mesh orders with harmonics; meshes of one frequency (sun and ring) share a line.

    Parameters
    ----------
    count : harmonics of each mesh, the first included

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> [(line.name, round(line.order, 3)) for line in order_lines(gearbox, 1)]
    [('sun_planet', 99.0), ('intermediate', 468.571), ('high_speed', 1792.795)]
    """
    mesh_orders = gearbox.train.mesh_frequencies(2.0 * math.pi)  # at one turn per second
    lines: list[OrderLine] = []
    known_orders: list[float] = []
    for mesh in gearbox.meshes:
        order = mesh_orders[mesh.name]
        if not any(abs(order - known) < 1e-6 * known for known in known_orders):
            known_orders.append(order)
            lines.extend(harmonics(mesh.family, order, count))
    return tuple(lines)
