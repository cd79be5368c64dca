"""The nominal load of a gearbox as a spectrum of one load: that of the static load, at rated speed."""

from __future__ import annotations

import hashlib
import math

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import RPM
from exugear.gearbox.sections.loads import RatingSection
from exugear.life.counting.duration import LoadPoints, load_duration
from exugear.life.load_spectrum.counted import CountedLoads
from exugear.life.load_spectrum.exposure import bearing_turns, tooth_exposures
from exugear.life.load_spectrum.sources import HOURS_PER_YEAR, LoadSource

HUB_LOADS = 5
"""Forces and moments of a hub beside the torque: none here."""
LONGEST = 1e10
"""Load cycles at the last point of the standards' S-N curves: what a load without stated hours is rated for."""


def nominal_loads(gearbox: Gearbox, rating: RatingSection, factor: float = 1.0) -> CountedLoads:
    """Spectrum of the static load alone.

    Parameters
    ----------
    rating : its `nominal_hours`; without them the teeth that are loaded least often are loaded `LONGEST` times
    factor : on the torque

    Raises
    ------
    CaseError
        No rated speed, or a static load on several bodies.
    """
    overall = gearbox.case.overall
    torques = gearbox.case.static_load.torques_N_m
    rated = gearbox.case.operation.rated_speed_rpm
    if rated is None:
        raise gearbox.fault(
            "operation.rated_speed_rpm: this key is missing; without [loads] gears are rated at the speed of "
            f"{overall.input}"
        )
    if len(torques) != 1:
        raise gearbox.fault(
            f"static_load.torques_N_m: {', '.join(torques) or 'nothing'} has a torque; without [loads] gears are rated "
            "under a load on one body, give [loads]"
        )
    body, torque = next(iter(torques.items()))
    speed = abs(gearbox.train.rolling_speeds(overall.input, rated * RPM).get(body, 0.0))
    if speed == 0.0 or torque == 0.0:
        raise gearbox.fault(f"static_load.torques_N_m.{body} = {torque:g}: {body} has no power at rated speed")
    teeth = tooth_exposures(gearbox, body)
    least = min((one.cycles for one in teeth if one.cycles > 0.0), default=1.0)
    torque *= factor
    hours = rating.nominal_hours or LONGEST / least * 2.0 * math.pi / speed / 3600.0
    duration = load_duration(np.array([torque]), np.array([speed]), np.array([hours]), 1)
    forces = gearbox.train.static_mesh_forces({body: 1.0})
    families: dict[str, float] = {}
    for mesh in gearbox.meshes:
        families[mesh.family] = max(families.get(mesh.family, 0.0), abs(forces[mesh.name]))
    return CountedLoads(
        body=body,
        life_years=hours / HOURS_PER_YEAR,
        sources=(_source(torque, speed, hours),),
        distribution=duration,
        points=LoadPoints(
            duration.torque, np.zeros((1, HUB_LOADS)), duration.hours, duration.revolutions, np.zeros(1, int)
        ),
        equivalent_ranges={},
        teeth=teeth,
        bearings=bearing_turns(gearbox, body),
        mesh_forces=families,
        bin_value="mean",
    )


def _source(torque: float, speed: float, hours: float) -> LoadSource:
    one = np.array([torque])
    return LoadSource(
        name="nominal",
        kind="fatigue",
        case="static load at rated speed",
        file="",
        files=0,
        count=1,
        digest=hashlib.sha256(f"{torque!r} {speed!r} {hours!r}".encode()).hexdigest(),
        torque=one,
        speed=np.array([speed]),
        hours=np.array([hours]),
        hub=np.zeros((1, 0)),
        series=False,
        skipped=0.0,
        duration=0.0,
        factors=(1.0, 1.0),
        least=torque,
        largest=torque,
        slowest=speed,
        fastest=speed,
        equivalent_ranges={},
    )
