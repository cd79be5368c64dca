"""Where the power goes: friction of teeth and bearings at one operating point, efficiency, and oil temperature.

Meshes lose P mu_m H_V (`fe_ste.standards.mesh_loss`). Bearings have the frictional moment of SKF by series
(`exugear.system.bearings.rolling.friction`); needle roller bearings, which it does not describe, have M = mu P d / 2
with a constant coefficient. Radial shaft seals lose 7.69e-6 d^2 n (W, mm, rpm; ISO/TR 14179-2). Churning, windage and
auxiliary pumps are not included. The power through each mesh is that of the balance of torques with these losses
(`exugear.life.power_flow`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import scipy.optimize

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.load_cases import summarise_loads
from exugear.gearbox.parts import Mesh
from exugear.gearbox.units import MM, RPM, UM, si
from exugear.life.gear_life import RZ_OF_RA, roughness_of
from exugear.life.power_flow import power_flow
from exugear.system.bearings.duty import BearingLoadState
from exugear.system.bearings.rolling.friction import friction_series, frictional_moment
from exugear.system.bearings.rolling.life import viscosity_at
from fe_ste.standards.mesh_loss import (
    MeshOperation,
    friction_niemann,
    friction_schlenk,
    helical_loss_factor,
    loss_factor,
)
from fe_ste.transmission_error.sliding import table_friction, table_loss_factor
from fe_ste.transmission_error.table import MeshTable

NEEDLE_FRICTION = 0.0020
"""Coefficient of friction of needle roller bearings (SKF, Rolling bearings, "Estimating the frictional moment")."""
SEAL_LOSS = 7.69e-6
"""Loss of a radial shaft seal over the square of its diameter (mm) and its speed (rpm), W (ISO/TR 14179-2)."""
EXPONENTS = {"ball": 3.0, "roller": 10.0 / 3.0}
"""Exponents of the basic rating life (ISO 281)."""
USUAL_ROUGHNESS = 0.5 * UM
"""Roughness Ra of ground flanks, where the file states none, m."""
USUAL_DENSITY = 890.0
"""Density of mineral oil at 15 degrees Celsius, kg/m3."""
EXPANSION = 0.7
"""Decrease of the density, kg/(m3 K)."""
RMS_OF_RA = 1.11
"""Root mean square roughness of ground flanks over Ra (Gaussian heights: sqrt(pi / 2) = 1.25; sine: 1.11)."""
NIEMANN_WINTER = "niemann_winter"
XU_KAHRAMAN = "xu_kahraman"
"""Methods of friction in addition to that of Schlenk."""
HELICAL_FROM = 0.9
"""Overlap ratio from which contact lines carry a constant load per length rather than tooth pairs an equal load."""
HOTTEST = 250.0
"""Oil temperature (degrees Celsius) up to which the balance of heat is sought."""


@dataclass(frozen=True)
class MeshLoss:
    """Loss of all meshes of a family."""

    family: str
    count: int
    power: float
    """That enters all meshes, relative to their frame, W."""
    loss_factor: float
    from_table: bool
    """Whether the loss factor is that of the line loads of a transmission error table."""
    friction: float
    """Mean coefficient of friction by Schlenk."""
    other_friction: Mapping[str, float]
    """The same by other methods: `NIEMANN_WINTER`, and with a table `XU_KAHRAMAN`; empty without load or motion."""

    @property
    def loss(self) -> float:
        """Of all meshes, W."""
        return self.power * self.friction * self.loss_factor

    @property
    def band(self) -> tuple[float, float]:
        """Smallest and largest loss by the methods of friction, W."""
        all_methods = (self.friction, *self.other_friction.values())
        scale = self.power * self.loss_factor
        return scale * min(all_methods), scale * max(all_methods)


@dataclass(frozen=True)
class BearingLoss:
    """Loss of all bearings of a family."""

    family: str
    count: int
    load: float
    """Equivalent dynamic load, of several bearings the largest, N."""
    load_ratio: float
    """This load over the basic dynamic rating."""
    speed: float
    """Of the inner ring relative to the outer ring, rad/s."""
    series: str
    """Series whose constants are used; empty if unknown: `band` is then that of all series of the type."""
    loss: float
    """Of all bearings, W."""
    band: tuple[float, float]
    """Smallest and largest loss of all bearings, W."""


@dataclass(frozen=True)
class SealLoss:
    """Loss of a radial shaft seal."""

    name: str
    diameter: float
    """m."""
    speed: float
    """Of the shaft relative to the seal's housing, rad/s."""
    loss: float
    """W."""


@dataclass(frozen=True)
class Losses:
    """Power balance of a gearbox at one operating point."""

    speed: float
    """Of the overall input, rad/s."""
    input_power: float
    output_power: float
    """Power into all driven bodies, and out of all driving ones, W: input is output and losses."""
    oil_temperature: float
    """Degrees Celsius."""
    viscosity: float
    """Kinematic viscosity at that temperature, m2/s."""
    meshes: tuple[MeshLoss, ...]
    bearings: tuple[BearingLoss, ...]
    seals: tuple[SealLoss, ...]
    without_data: tuple[str, ...]
    """Bearings without friction: without catalogue data or with unknown loads (these need all bearings)."""
    assumed_roughness: bool
    """Whether the roughness of any gear is the usual one."""

    @property
    def total(self) -> float:
        """All losses that are included, W."""
        meshes = sum(mesh.loss for mesh in self.meshes)
        return meshes + sum(bearing.loss for bearing in self.bearings) + sum(seal.loss for seal in self.seals)

    @property
    def band(self) -> tuple[float, float]:
        """Smallest and largest sum of losses by the methods of friction, W."""
        seals = sum(seal.loss for seal in self.seals)
        bands = [mesh.band for mesh in self.meshes] + [bearing.band for bearing in self.bearings]
        return seals + sum(low for low, _ in bands), seals + sum(high for _, high in bands)

    @property
    def efficiency(self) -> float:
        """Output power over input power; zero without power."""
        return self.output_power / self.input_power if self.input_power > 0.0 else 0.0


def losses_of(
    gearbox: Gearbox, duties: tuple[BearingLoadState, ...], tables: Mapping[str, MeshTable], speed: float
) -> Losses:
    """Compute the losses under the static load.

    Parameters
    ----------
    duties : loads of the catalogue bearings under the static load
    tables : transmission error tables by gear pair, those that exist
    speed : of the overall input, rad/s

    Raises
    ------
    GearboxFileError
        Viscosity or temperature of the oil are missing, or the losses heat the oil beyond all limits.
    SelfLockingError
        The train locks itself in this direction of power.
    """
    lubricant = gearbox.case.lubricant
    if lubricant is None or lubricant.viscosity_100_mm2_per_s is None:
        raise gearbox.error(
            "lubricant: viscosity_40_mm2_per_s and viscosity_100_mm2_per_s are required for losses; add them to "
            "[lubricant]"
        )
    if lubricant.temperature_C is not None:
        return _at_temperature(gearbox, duties, tables, speed, lubricant.temperature_C)
    ambient = lubricant.ambient_C
    conductance = lubricant.conductance_W_per_K
    if ambient is None or conductance is None:
        raise gearbox.error(
            "lubricant: the temperature of the oil is required for losses; set temperature_C, or ambient_C and "
            "conductance_W_per_K"
        )

    def excess(temperature: float) -> float:
        return temperature - ambient - _at_temperature(gearbox, duties, tables, speed, temperature).total / conductance

    if excess(HOTTEST) < 0.0:
        raise gearbox.error(
            f"lubricant.conductance_W_per_K = {conductance:g}: the losses heat the oil above {HOTTEST:g} degrees "
            "Celsius; set a larger conductance (cooler), or temperature_C"
        )
    temperature = float(scipy.optimize.brentq(excess, ambient, HOTTEST, xtol=1e-6))
    return _at_temperature(gearbox, duties, tables, speed, temperature)


def _at_temperature(
    gearbox: Gearbox,
    duties: tuple[BearingLoadState, ...],
    tables: Mapping[str, MeshTable],
    speed: float,
    temperature: float,
) -> Losses:
    """Compute the losses at a temperature of the oil, degrees Celsius."""
    lubricant = gearbox.case.lubricant
    assert lubricant is not None
    assert lubricant.viscosity_100_mm2_per_s is not None
    kinematic = 1e-6 * viscosity_at(temperature, gearbox.viscosity_40, lubricant.viscosity_100_mm2_per_s)
    density = (lubricant.density_15_kg_per_m3 or USUAL_DENSITY) - EXPANSION * (temperature - 15.0)
    speeds = gearbox.train.rolling_speeds(gearbox.case.overall.input, speed)
    listed = {support.name for support in gearbox.bearings}
    known = {duty.name for duty in duties}
    meshes = _mesh_losses(gearbox, tables, speeds, kinematic * density)
    bearings = _bearing_losses(gearbox, duties, speeds, kinematic)
    found = []
    for name, seal in gearbox.case.seals.items():
        relative = abs(speeds.get(seal.body, 0.0) - speeds.get(seal.on, 0.0))
        loss = SEAL_LOSS * seal.diameter_mm**2 * relative / RPM
        found.append(SealLoss(name, si(seal, "diameter_mm"), relative, loss))
    seals = tuple(found)
    shares = {mesh.family: mesh.friction * mesh.loss_factor for mesh in meshes}
    flow = power_flow(
        gearbox.train,
        gearbox.case.static_load.torques_N_m,
        speeds,
        {mesh.name: shares[mesh.family] for mesh in gearbox.meshes},
        _drags(gearbox, duties, bearings, seals, speeds),
    )
    return Losses(
        speed=speed,
        input_power=flow.input,
        output_power=flow.output,
        oil_temperature=temperature,
        viscosity=kinematic,
        meshes=tuple(
            replace(mesh, power=sum(flow.mesh_power[own.name] for own in gearbox.meshes if own.family == mesh.family))
            for mesh in meshes
        ),
        bearings=bearings,
        seals=seals,
        without_data=(
            *gearbox.unknown_bearings,
            *dict.fromkeys(b.family for b in gearbox.bearings if b.name in listed - known),
        ),
        assumed_roughness=any(
            _roughness(gearbox, gear.name) is None
            for mesh in gearbox.meshes
            for gear in (mesh.pair.pinion, mesh.pair.gear)
        ),
    )


def _drags(
    gearbox: Gearbox,
    duties: tuple[BearingLoadState, ...],
    bearings: tuple[BearingLoss, ...],
    seals: tuple[SealLoss, ...],
    speeds: Mapping[str, float],
) -> dict[str, float]:
    """Torques of bearings and seals on both of their bodies, N m."""
    supports = {support.name: support for support in gearbox.bearings}
    single = {bearing.family: bearing.loss / bearing.count for bearing in bearings}
    losses = [
        (supports[duty.name].body, supports[duty.name].on, single[duty.family])
        for duty in duties
        if duty.name in supports
    ]
    losses += [(gearbox.case.seals[seal.name].body, gearbox.case.seals[seal.name].on, seal.loss) for seal in seals]
    drags: dict[str, float] = {}
    for body, on, loss in losses:
        relative = speeds.get(body, 0.0) - speeds.get(on, 0.0)
        if relative != 0.0:
            drags[body] = drags.get(body, 0.0) - loss / relative
            drags[on] = drags.get(on, 0.0) + loss / relative
    return drags


def _roughness(gearbox: Gearbox, gear: str) -> float | None:
    """Roughness Ra of a gear that the file states, m."""
    rating = gearbox.case.rating
    if rating is None or gear not in rating.gears:
        return None
    return roughness_of(rating.gears[gear]) / RZ_OF_RA


def _mesh_losses(
    gearbox: Gearbox, tables: Mapping[str, MeshTable], speeds: Mapping[str, float], viscosity: float
) -> tuple[MeshLoss, ...]:
    """Return the losses of the meshes under tooth forces without friction; dynamic viscosity in Pa s."""
    forces = gearbox.train.static_mesh_forces()
    families: dict[str, list[Mesh]] = {}
    for mesh in gearbox.meshes:
        families.setdefault(mesh.family, []).append(mesh)
    found = []
    for family, meshes in families.items():
        first = meshes[0]
        pair = first.pair
        relative = abs(speeds.get(first.pinion, 0.0) - speeds.get(first.frame, 0.0))
        mean = sum(abs(forces[mesh.name]) for mesh in meshes) / len(meshes)
        power = len(meshes) * mean * relative * pair.pinion.base_radius
        table = tables.get(pair.name)
        friction = 0.0
        other: dict[str, float] = {}
        if table is not None:
            factor = table_loss_factor(pair, table.static_state)
        elif pair.overlap_ratio >= HELICAL_FROM or pair.transverse_contact_ratio < 1.0:
            factor = helical_loss_factor(pair)
        else:
            factor = loss_factor(pair)
        if relative > 0.0 and mean > 0.0:
            stated = [_roughness(gearbox, gear.name) or USUAL_ROUGHNESS for gear in (pair.pinion, pair.gear)]
            roughness = 0.5 * sum(stated)
            friction = friction_schlenk(MeshOperation.of(pair, mean, relative, viscosity, roughness))
            rougher = MeshOperation.of(pair, mean, relative, viscosity, max(stated))
            # Its sum speed is that at the reference circle.
            speeds_ratio = math.tan(pair.pinion.transverse_pressure_angle) / math.tan(pair.working_pressure_angle)
            other[NIEMANN_WINTER] = friction_niemann(rougher, 2.0 * pair.pinion.reference_radius, speeds_ratio)
            if table is not None:
                other[XU_KAHRAMAN] = table_friction(
                    pair, table.static_state, relative, viscosity, RMS_OF_RA * roughness
                )
        found.append(MeshLoss(family, len(meshes), power, factor, table is not None, friction, other))
    return tuple(found)


def _bearing_losses(
    gearbox: Gearbox, duties: tuple[BearingLoadState, ...], speeds: Mapping[str, float], viscosity: float
) -> tuple[BearingLoss, ...]:
    """Compute the losses of the families of bearings; kinematic viscosity in m2/s."""
    supports = {support.name: support for support in gearbox.bearings}
    families: dict[str, list[BearingLoadState]] = {}
    for duty in duties:
        if duty.name in supports:
            families.setdefault(duty.family, []).append(duty)
    found = []
    for family, members in families.items():
        support = supports[members[0].name]
        section = support.catalogue
        assert section is not None
        relative = abs(speeds.get(support.body, 0.0) - speeds.get(support.on, 0.0))
        if section.type == "needle_roller":
            series = "needle roller"
            moment = 0.5 * NEEDLE_FRICTION * sum(map(_equivalent_load, members)) * MM * section.bore_mm
            moments = np.full(3, moment)
        else:
            series = friction_series(section)
            moments = np.zeros(3)
            for duty in members:
                load = (duty.radial_load, duty.axial_load)
                moments += frictional_moment(section, *load, relative, viscosity, duty.ratings.static)
        loss, low, high = (moments * relative).tolist()
        largest = max(map(_equivalent_load, members))
        ratio = largest / members[0].ratings.dynamic
        found.append(BearingLoss(family, len(members), largest, ratio, relative, series, loss, (low, high)))
    return tuple(found)


def _equivalent_load(duty: BearingLoadState) -> float:
    """Equivalent dynamic load, N: the one that gives the basic rating life."""
    if math.isinf(duty.basic_life):
        return 0.0
    exponent = EXPONENTS[duty.kind.rpartition("_")[2]]
    return float(duty.ratings.dynamic * duty.basic_life ** (-1.0 / exponent))


def operating_speed(gearbox: Gearbox, stated: float | None = None) -> float:
    """Speed of the overall input (rad/s) at which losses are computed: a stated one (rpm), or that of the file.

    The file's is the rated speed, or else the highest one of the first load case that turns the train.

    Raises
    ------
    GearboxFileError
        The file has neither.

    Examples
    --------
    >>> round(operating_speed(Gearbox.from_toml("cases/grc750/gearbox.toml")) / RPM, 6)
    22.1
    """
    chosen = stated or gearbox.case.operation.rated_speed_rpm
    if chosen is not None:
        return chosen * RPM
    for case in gearbox.load_cases.values():
        loads = summarise_loads(gearbox, case)
        if loads.fastest_speed > 0.0:
            return math.copysign(loads.fastest_speed, loads.end_speed)
    raise gearbox.error("operation.rated_speed_rpm: is required for losses; set it, or use --speed RPM")
