"""Losses at an operating point: the balance of power, each loss by hand, the temperature of the oil, bad input."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.units import RPM
from exugear.life.losses import Losses, losses_of, operating_speed
from exugear.system.bearings.duty import BearingLoadState
from exugear.system.bearings.rolling.friction import frictional_moment
from exugear.system.build import assemble
from exugear.system.operating_points import bearing_duties
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness
from fe_ste.standards.mesh_loss import helical_loss_factor

from ..cases.command import exugear

OIL = {"viscosity_100_mm2_per_s": 24.0, "temperature_C": 65.0}


@pytest.fixture(scope="module")
def oiled(grc: Gearbox) -> Gearbox:
    return grc.varied({"lubricant": {"viscosity_40_mm2_per_s": 320.0, **OIL}})


@pytest.fixture(scope="module")
def duties(oiled: Gearbox) -> tuple[BearingLoadState, ...]:
    return bearing_duties(assemble(oiled, Choice("bushing", "iso6336"), mesh_stiffness(oiled, "iso6336")))


@pytest.fixture(scope="module")
def found(oiled: Gearbox, duties: tuple[BearingLoadState, ...]) -> Losses:
    return losses_of(oiled, duties, {}, operating_speed(oiled))


def test_input_is_output_and_losses_by_element(oiled: Gearbox, found: Losses) -> None:
    assert found.input_power == pytest.approx(240e3 * 22.1 * RPM, rel=1e-12)
    parts = [part.loss for part in (*found.meshes, *found.bearings)]
    assert found.input_power == pytest.approx(found.output_power + sum(parts), rel=1e-12)
    assert found.efficiency == pytest.approx(1.0 - sum(parts) / found.input_power, rel=1e-12)
    assert 0.95 < found.efficiency < 0.98
    low, high = found.band
    assert low < found.total <= high
    for mesh in found.meshes:
        assert set(mesh.other_friction) == {"niemann_winter"}
        assert 0.4 < mesh.other_friction["niemann_winter"] / mesh.friction < 1.5


def test_each_mesh_transmits_what_the_meshes_before_it_leave(oiled: Gearbox) -> None:
    """Power enters at the carrier; relative to it, ring-planet meshes drive sun-planet meshes (Willis)."""
    found = losses_of(oiled, (), {}, operating_speed(oiled))
    power = {mesh.family: mesh.power for mesh in found.meshes}
    left = {mesh.family: 1.0 - mesh.friction * mesh.loss_factor for mesh in found.meshes}
    loss = {mesh.family: mesh.loss for mesh in found.meshes}
    planetary = left["sun_planet"] * left["ring_planet"]
    assert power["ring_planet"] == pytest.approx(found.input_power / (1.0 + 21 / 99 * planetary), rel=1e-9)
    assert power["sun_planet"] == pytest.approx(power["ring_planet"] * left["ring_planet"], rel=1e-9)
    after = found.input_power - loss["sun_planet"] - loss["ring_planet"]
    assert power["intermediate"] == pytest.approx(after, rel=1e-9)
    assert power["high_speed"] == pytest.approx(after - loss["intermediate"], rel=1e-9)


def test_losses_of_a_mesh_and_of_a_bearing_by_hand(
    oiled: Gearbox, duties: tuple[BearingLoadState, ...], found: Losses
) -> None:
    mesh = next(mesh for mesh in found.meshes if mesh.family == "high_speed")
    pair = oiled.gear_pairs["high_speed"]
    assert mesh.loss_factor == pytest.approx(helical_loss_factor(pair), rel=1e-12)
    omega = 22.1 * RPM * abs(oiled.train.ratio)
    tangent = math.tan(pair.working_pressure_angle)
    force = found.input_power / (omega * pair.pinion.base_radius)  # without friction of the stages before
    curvature = (1.0 / pair.pinion.base_radius + 1.0 / pair.gear.base_radius) / tangent
    radius = 1e3 / (curvature * math.cos(pair.pinion.base_helix_angle))
    load = 1e-3 * force / pair.face_width / (2.0 * omega * pair.pinion.base_radius * tangent * radius)
    eta = 1e6 * found.viscosity * (890.0 - 0.7 * 50.0) * 1e-3
    ra = 0.5 * sum(oiled.case.rating.gears[gear.name].roughness_Rz_um for gear in (pair.pinion, pair.gear)) / 6.0
    assert mesh.friction == pytest.approx(0.048 * load**0.2 * eta**-0.05 * ra**0.25, rel=1e-9)
    bearing = next(bearing for bearing in found.bearings if bearing.family == "hss_a")
    duty = next(duty for duty in duties if duty.name == "hss_a")
    assert bearing.speed == pytest.approx(omega, rel=1e-12)
    section = next(own for own in oiled.bearings if own.name == "hss_a").catalogue
    own = frictional_moment(section, duty.radial_load, duty.axial_load, omega, found.viscosity, duty.ratings.static)
    assert bearing.series == "22"
    assert bearing.loss == bearing.band[0] == bearing.band[1] == pytest.approx(own[0] * omega, rel=1e-12)


def test_every_bearing_of_the_gearbox_has_a_series(found: Losses) -> None:
    series = {bearing.family: bearing.series for bearing in found.bearings}
    assert series["plc_a"] == "full complement"
    assert series["lss_bc"] == "329"
    assert series["ims_bc"] == "320"
    assert series["hss_bc"] == "322"


def test_seals_lose_power_by_their_diameter_and_speed(oiled: Gearbox) -> None:
    """7.69e-6 W per square millimetre and rpm (ISO/TR 14179-2): 110 mm at 1801 rpm."""
    seals = {"output": {"body": "hss", "diameter_mm": 110.0}, "input": {"body": "carrier", "diameter_mm": 600.0}}
    sealed = losses_of(oiled.varied({"seals": seals}), (), {}, operating_speed(oiled))
    by_name = {seal.name: seal.loss for seal in sealed.seals}
    assert by_name["output"] == pytest.approx(7.69e-6 * 110.0**2 * 22.1 * abs(oiled.train.ratio), rel=1e-9)
    assert by_name["input"] == pytest.approx(7.69e-6 * 600.0**2 * 22.1, rel=1e-9)
    meshes = sum(mesh.loss for mesh in sealed.meshes)
    assert sealed.total == pytest.approx(meshes + sum(by_name.values()), rel=1e-12)
    assert sealed.input_power == pytest.approx(sealed.output_power + sealed.total, rel=1e-12)


@pytest.mark.parametrize(
    ("seal", "message"),
    [
        ({"body": "shaft"}, r"seals.lip.body = 'shaft': no such body; bodies are"),
        ({"body": "hss", "on": "lid"}, r"seals.lip.on = 'lid': no such body"),
        ({"body": "hss", "on": "hss"}, r"seals.lip.on = 'hss': is the body that the seal slides on"),
        ({"body": "hss", "diameter_mm": 0.0}, r"seals.lip.diameter_mm = 0"),
    ],
)
def test_seals_that_cannot_be_meant_are_refused(oiled: Gearbox, seal: dict, message: str) -> None:
    with pytest.raises(GearboxFileError, match=message):
        oiled.varied({"seals": {"lip": {"diameter_mm": 100.0, **seal}}})


def test_an_input_that_takes_power_is_a_warning(template: Path) -> None:
    """The rated speed has no sign: with it, a gearbox that turns in the negative sense takes power at its input."""
    text = "have opposite signs: it takes power instead of supplying it"
    assert text not in exugear("losses", template).stderr
    assert text in " ".join(exugear("losses", template, "--speed", -1500).stderr.split())


def test_friction_of_meshes_grows_with_torque_to_the_power_of_one_fifth(oiled: Gearbox, found: Losses) -> None:
    torque = {"static_load.torques_N_m": {"carrier": 120e3}}
    half = losses_of(oiled.varied(torque), (), {}, operating_speed(oiled))
    for one, whole in zip(half.meshes, found.meshes, strict=True):
        assert one.friction == pytest.approx(whole.friction / 2**0.2, rel=1e-9)


def test_the_oil_is_as_warm_as_its_losses_make_it(oiled: Gearbox, duties: tuple[BearingLoadState, ...]) -> None:
    oil = {"viscosity_40_mm2_per_s": 320.0, "viscosity_100_mm2_per_s": 24.0, "ambient_C": 20.0}
    hotter = None
    for conductance in (1000.0, 500.0, 250.0):
        warm = oiled.varied({"lubricant": {**oil, "conductance_W_per_K": conductance}})
        own = losses_of(warm, duties, {}, operating_speed(warm))
        assert own.oil_temperature - 20.0 == pytest.approx(own.total / conductance, abs=1e-5)
        assert hotter is None or own.oil_temperature > hotter
        hotter = own.oil_temperature
    cold = oiled.varied({"lubricant": {**oil, "conductance_W_per_K": 1.0}})
    with pytest.raises(GearboxFileError, match="heat the oil above 250 degrees"):
        losses_of(cold, duties, {}, operating_speed(cold))


@pytest.mark.parametrize(
    ("section", "message"),
    [
        ({"ambient_C": 20.0}, "set ambient_C and conductance_W_per_K together"),
        ({"ambient_C": 20.0, "conductance_W_per_K": 9.0, "temperature_C": 60.0}, "exclude each other"),
        ({"density_15_kg_per_m3": 0.89}, "density_15_kg_per_m3.*must lie between 500 and 2000"),
    ],
)
def test_oil_that_cannot_be_meant_is_refused(oiled: Gearbox, section: dict, message: str) -> None:
    oil = {"viscosity_40_mm2_per_s": 320.0, "viscosity_100_mm2_per_s": 24.0, **section}
    with pytest.raises(GearboxFileError, match=message):
        oiled.varied({"lubricant": oil})


def test_missing_oil_is_named(grc: Gearbox, oiled: Gearbox) -> None:
    cold = grc.varied({"lubricant": {"viscosity_40_mm2_per_s": 320.0}})
    with pytest.raises(GearboxFileError, match="viscosity_100_mm2_per_s are required for losses"):
        losses_of(cold, (), {}, 1.0)
    no_temperature = oiled.varied({"lubricant": {"viscosity_40_mm2_per_s": 320.0, "viscosity_100_mm2_per_s": 24.0}})
    with pytest.raises(GearboxFileError, match="set temperature_C, or ambient_C and conductance_W_per_K"):
        losses_of(no_temperature, (), {}, 1.0)


@pytest.fixture
def template(tmp_path: Path) -> Path:
    case = tmp_path / "my.toml"
    assert exugear("new", case, "--kind", "planetary").exit_code == 0
    return case


def test_the_command_prints_and_maps_the_losses(template: Path) -> None:
    printed = exugear("losses", template, "--map")
    assert printed.exit_code == 0, printed.stderr
    whole = exugear("losses", template, "--map", "--all")
    assert "Not included: churning" in whole.stdout and whole.stdout.startswith("Efficiency ")
    assert max(map(len, (printed.stdout + whole.stdout).splitlines())) <= 79
    summary = json.loads(exugear("losses", template, "--map", "--json").stdout)
    assert summary["input_power_W"] == pytest.approx(summary["output_power_W"] + summary["losses_W"], rel=1e-9)
    assert len(summary["map"]) == 25
    rows = [row for row in summary["map"] if row["torque_share"] == 1.0]
    losses = [row["losses_W"] for row in rows]
    assert losses == sorted(losses)
    assert summary["map"][-1]["losses_W"] == pytest.approx(summary["losses_W"], rel=1e-9)


@pytest.mark.parametrize("speed", ["0", "nan", "1e9", "inf"])
def test_impossible_speeds_are_refused(template: Path, speed: str) -> None:
    outcome = exugear("losses", template, "--speed", speed)
    assert outcome.exit_code == 2
    assert "--speed" in outcome.stderr
    assert "must be a number of rpm up to 1e+06, not 0" in outcome.stderr


def test_a_load_case_that_is_not_there_is_named(template: Path) -> None:
    outcome = exugear("losses", template, "--load-case", "storm")
    assert outcome.exit_code == 2
    assert "no load case 'storm'" in outcome.stderr
