"""Where components stand: positions and directions in the axes of the gearbox file, z along the shafts."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from exugear.exchange.rexs.faults import Faults, RexsError
from exugear.exchange.rexs.to_case.notes import tidy
from exugear.exchange.rexs.tree import Component, Model
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import Displayed

PARALLEL = 1e-6
"""Largest sine of the angle between axes that count as parallel."""
LONGEST_CHAIN = 100
"""Most components placed by each other in a row."""
TURNING = ("shaft", "cylindrical_gear", "ring_gear", "side_plate")
"""Types whose u axis is an axis that something turns about."""


class Places(Displayed):
    """Positions (mm) and senses of components.

    REXS places a component in the frame (u, v, w) of another, most often of the gear unit. Here x, y, z are the
    gear unit's v, w, u where the shafts lie along its u, and turned so that z lies along them elsewhere.

    Raises
    ------
    RexsError
        Axes that are not parallel, vectors that are not three numbers: all at once.
    """

    def __init__(self, model: Model) -> None:
        self._model = model
        self._moved: dict[int, tuple[float, float]] = {}
        self._frames: dict[int, tuple[Floats, Floats]] = {}
        _refuse_lost_vectors(model)
        faults = Faults()
        directions: dict[Component, Floats] = {}
        for part in model.of_type(*TURNING):
            with faults.gathered():
                directions[part] = self._frame(part, 0)[1][:, 0]
        faults.tell()
        self._axes = _axes(list(directions.values()), self._outermost(list(directions)))
        skew = [part for part, direction in directions.items() if abs(direction @ self._axes[2]) < 1.0 - PARALLEL]
        if skew:
            names = ", ".join(str(part) for part in skew[:3])
            raise RexsError(f"the axis of {names} is not parallel to the others; only parallel axes can be imported")

    def _line(self) -> str:
        return f" along {np.round(self._axes[2], 3).tolist()}"

    def position(self, part: Component) -> tuple[float, float, float]:
        """Origin of a component, mm: the left end of a shaft or plate, the middle of all else.

        Raises
        ------
        RexsError
            It has no position.
        """
        if not part.given("support_vector"):
            raise RexsError(f"{part}: support_vector is missing, so that it has no place")
        x, y, z = (self._axes @ self._frame(part, 0)[0]).tolist()
        by = self._moved.get(part.number, (0.0, 0.0))
        x = x + by[0]
        y = y + by[1]
        return tidy(round(x, 9)), tidy(round(y, 9)), tidy(round(z, 9))

    def move(self, parts: Iterable[Component], by: tuple[float, float]) -> None:
        """Let components stand elsewhere by x and y, mm: where other statements of the file count more."""
        for part in parts:
            self._moved[part.number] = by

    def sense(self, part: Component) -> int:
        """Sense of a component's u axis: 1 along +z, -1 against it."""
        if self._frame(part, 0)[1][:, 0] @ self._axes[2] > 0.0:
            return 1
        return -1

    def axes(self, part: Component) -> Floats:
        """Axes u, v, w of a component as the rows of a (3, 3) array, in the axes of the gearbox file."""
        return np.asarray((self._axes @ self._frame(part, 0)[1]).T)

    def turned(self, vector: Floats) -> Floats:
        """Return a vector of the gear unit's axes in those of the gearbox file."""
        return np.asarray(self._axes @ vector)

    def _outermost(self, parts: list[Component]) -> Floats:
        """Axes u, v, w of the gear unit as columns; of the first part in a file without one."""
        first = [*self._model.of_type("gear_unit"), *parts][:1]
        if first:
            return self._frame(first[0], 0)[1]
        return np.eye(3)

    def _frame(self, part: Component, depth: int) -> tuple[Floats, Floats]:
        """Origin (3) and axes u, v, w as columns (3, 3), in the outermost frame."""
        if part.number in self._frames:
            return self._frames[part.number]
        if depth > LONGEST_CHAIN:
            raise RexsError(f"{part}: is placed by a chain of components that does not end")
        origin = np.array(part.vector("support_vector") or (0.0, 0.0, 0.0))
        axes = _own_axes(part)
        reference = part.whole("reference_component_for_position")
        if reference is not None and reference != part.number:
            if reference not in self._model.components:
                raise RexsError(f"{part}: is placed by component {reference}, which is not there")
            base, turned = self._frame(self._model.components[reference], depth + 1)
            origin = base + turned @ origin
            axes = turned @ axes
        self._frames[part.number] = origin, axes
        return origin, axes


def _refuse_lost_vectors(model: Model) -> None:
    """Refuse a file whose vectors are no vectors: some programs lost them all in writing JSON."""
    keys = ("support_vector", "u_axis_vector", "w_axis_vector")
    lost = [part for part in model.components.values() if any(part.has_lost_vector(key) for key in keys)]
    if lost:
        more = f" and {len(lost) - 3} more" if len(lost) > 3 else ""
        raise RexsError(
            f"positions are not three numbers for {', '.join(str(part) for part in lost[:3])}{more}: the program that "
            "wrote the file lost its arrays; export it anew"
        )


def _own_axes(part: Component) -> Floats:
    """Axes u, v, w as columns, from u and w."""
    u = np.array(part.vector("u_axis_vector") or (1.0, 0.0, 0.0))
    w = np.array(part.vector("w_axis_vector") or (0.0, 0.0, 1.0))
    lengths = np.linalg.norm(u), np.linalg.norm(w)
    if min(lengths) < 1e-9 or abs(u @ w) > 1e-6 * lengths[0] * lengths[1]:
        raise RexsError(f"{part}: u_axis_vector and w_axis_vector are not at right angles")
    u = u / lengths[0]
    w = w / lengths[1]
    return np.column_stack([u, np.cross(w, u), w])


def _axes(directions: list[Floats], unit: Floats) -> Floats:
    """Axes x, y, z of the gearbox file as rows: v, w, u of the gear unit, or z along the first shaft and y near w."""
    along = unit[:, 0]
    up = unit[:, 2]
    if directions and abs(directions[0] @ along) < 1.0 - PARALLEL:
        along = directions[0]
    across = up - (up @ along) * along
    if np.linalg.norm(across) < 1e-3:
        least = int(np.argmin(np.abs(along)))
        across = np.eye(3)[least] - along[least] * along
    across = across / np.linalg.norm(across)
    rows = np.array([np.cross(across, along), across, along])
    return np.where(np.abs(rows) < 1e-15, 0.0, rows)
