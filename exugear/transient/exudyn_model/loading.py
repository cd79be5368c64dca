"""What acts on a gearbox from outside in an Exudyn system: torques, and the drive at prescribed speed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from exugear.system.loads import Drive, Loading
from exugear.transient.exudyn_model.library import items
from exugear.transient.exudyn_model.parts import Parts


def add_loading(parts: Parts, loading: Loading) -> None:
    """Add torques and drive; those on bodies in floating frames act with the other forces on these."""
    elsewhere = parts.assembly.floating
    for name, torque in loading.constant.items():
        if name not in elsewhere:
            parts.mbs.AddLoad(items.LoadCoordinate(markerNumber=parts.spin_marker(name), load=torque))
    for name, series in loading.varying.items():
        if name not in elsewhere:
            parts.mbs.AddLoad(
                items.LoadCoordinate(
                    markerNumber=parts.spin_marker(name),
                    load=series(0.0),
                    loadUserFunction=_load_function(series),
                )
            )
    if loading.drive is not None and loading.drive.body not in elsewhere:
        _add_drive(parts, loading.drive)


def _add_drive(parts: Parts, drive: Drive) -> None:
    """Add the spring between a body's spin and the angle that it is driven by."""
    fixed = parts.mbs.AddNode(items.NodePointGround())
    ground = parts.mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=fixed, coordinate=0))
    parts.mbs.AddObject(
        items.CoordinateSpringDamper(
            markerNumbers=[ground, parts.spin_marker(drive.body)],
            stiffness=drive.stiffness,
            damping=drive.damping,
            springForceUserFunction=_drive_function(drive),
        )
    )


def _load_function(torque: Callable[[float], float]) -> Callable[[Any, float, float], float]:
    return lambda mbs, t, load: torque(t)


def _drive_function(drive: Drive) -> Callable[..., float]:
    def force(mbs: Any, t: float, item: int, u: float, v: float, k: float, d: float, offset: float) -> float:
        return k * (u - drive.angle(t)) + d * (v - drive.speed(t))

    return force
