"""Power flow with friction: closed forms of planetary trains, circulating power, self-locking, balance of energy."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.units import RPM
from exugear.life.losses import Losses, losses_of
from exugear.life.power_flow import SelfLockingError, power_flow

from ..cases.command import exugear

GEAR = """
[gears.{name}]
teeth = {teeth}
normal_module_mm = {module}
profile_shift = 0.0
face_width_mm = 30.0
held_diameter_mm = {held}
tooth_thinning_mm = 0.03
{more}"""
BODY = """
[bodies.{name}]
axis_position_mm = [0.0, 0.0]
{gears}
{inertia}"""
INERTIA = "inertia.d = { mass_kg = 5.0, axial_kg_m2 = 0.02, transverse_kg_m2 = 0.02, centre_of_mass_z_mm = 0.0 }"
LIGHT = INERTIA.replace("0.02", "0.002")
LUBRICANT = """
[lubricant]
viscosity_40_mm2_per_s = 220.0
viscosity_100_mm2_per_s = 19.0
temperature_C = 70.0
"""
HEAD = """
name = "train"
default_inertias = "d"
overall = {{ input = "{input}", output = "{output}", output_gear = "{gear}" }}
static_load = {{ torques_N_m = {{ {input} = {torque} }}, locked = ["{output}"] }}
operation = {{ rated_speed_rpm = 1000.0 }}
load_cases = {{ run = {{ torques_N_m = {{ {input} = {torque} }}, duration_s = 0.01 }} }}
"""


def gear(name: str, teeth: int, module: float, more: str = "") -> str:
    held = (1.3 if "internal" in more else 0.4) * teeth * module
    return GEAR.format(name=name, teeth=teeth, module=module, held=held, more=more)


def text_of_stepped_planets(a: int, b: int, c: int, d: int, torque: float = 10.0) -> str:
    """Arm E in, sun A held, stepped planets B and C, sun D out: ratio 1 - e with e = a c / (b d)."""
    distance, one = a + b, 2.0
    other = 2.0 * distance / (c + d)
    text = HEAD.format(input="E", output="D", gear="D", torque=torque)
    text += gear("A", a, one) + gear("B", b, one) + gear("C", c, other) + gear("D", d, other)
    first, second = sorted("AB", key=lambda name: {"A": a, "B": b}[name])
    third, fourth = sorted("CD", key=lambda name: {"C": c, "D": d}[name])
    text += f'[pairs]\nAB = {{ pinion = "{first}", gear = "{second}", centre_distance_mm = {distance} }}\n'
    text += f'CD = {{ pinion = "{third}", gear = "{fourth}", centre_distance_mm = {distance} }}\n'
    text += BODY.format(name="held", gears="gears_z_mm = { A = -20.0 }", inertia="fixed = true")
    text += BODY.format(name="D", gears="gears_z_mm = { D = 20.0 }", inertia=INERTIA)
    text += BODY.format(name="E", gears="", inertia=INERTIA)
    text += f"""
[bodies.P]
carrier = "E"
orbit_radius_mm = {distance}
planet_angles_deg = [0.0, 180.0]
gears_z_mm = {{ B = -20.0, C = 20.0 }}
{LIGHT}
"""
    on = {"A": "held", "B": "P", "C": "P", "D": "D"}
    text += f'[meshes]\nAB = {{ pair = "AB", pinion_body = "{on[first]}", gear_body = "{on[second]}" }}\n'
    text += f'CD = {{ pair = "CD", pinion_body = "{on[third]}", gear_body = "{on[fourth]}" }}\n'
    text += '[joints]\njd = { body = "D", z_mm = 0.0 }\nje = { body = "E", z_mm = 0.0 }\n'
    text += 'jp = { body = "P", on = "E", z_mm = 0.0 }\n' + LUBRICANT
    return text


def stepped_planets(*teeth: int, torque: float = 10.0) -> Gearbox:
    return Gearbox.from_dict(tomllib.loads(text_of_stepped_planets(*teeth, torque=torque)))


def losses_at(gearbox: Gearbox, rpm: float) -> Losses:
    return losses_of(gearbox, (), {}, rpm * RPM)


def basic_efficiency(found: Losses) -> float:
    """Efficiency with the arm held: what both meshes in series leave."""
    product = 1.0
    for mesh in found.meshes:
        product *= 1.0 - mesh.friction * mesh.loss_factor
    return product


@pytest.mark.parametrize(
    ("teeth", "efficiency"),
    [
        ((40, 36, 40, 44), 0.398),
        ((40, 44, 44, 36), None),
        ((44, 40, 40, 40), None),
        ((36, 40, 44, 40), None),
        ((40, 44, 40, 36), None),
        ((30, 40, 40, 60), None),
    ],
)
def test_efficiency_where_power_circulates_is_that_of_torques_with_friction(
    teeth: tuple[int, int, int, int], efficiency: float | None
) -> None:
    """Arm in, T_A = -T_D e eta_0^w (Mueller, Epicyclic Drive Trains): eta = (1 - e eta_0^w) / (1 - e), inverted.

    T_E + T_A + T_D = 0, so T_D = T_E / (e eta_0^w - 1). Relative to the arm, D rotates with -e times its speed: for
    e > 1 the power there flows from D to A, w = -1, and for e < 1 from A to D, w = 1.
    """
    a, b, c, d = teeth
    e = a * c / (b * d)
    found = losses_at(stepped_planets(*teeth), 1000.0)
    eta = basic_efficiency(found)
    with_friction = e / eta if e > 1.0 else e * eta
    assert found.efficiency == pytest.approx((1.0 - e) / (1.0 - with_friction), rel=1e-9)
    assert found.input_power - found.output_power == pytest.approx(found.total, rel=1e-9)
    if efficiency:
        assert found.efficiency == pytest.approx(efficiency, abs=1e-3)


def test_a_train_that_cannot_be_driven_backwards_says_so() -> None:
    """Driven from the sun, e eta_0 < 1 < e: the torque on the arm has the wrong sign (same source)."""
    gearbox = stepped_planets(40, 36, 40, 44)
    with pytest.raises(SelfLockingError, match="drive it from the other side"):
        losses_at(gearbox, -1000.0)
    with pytest.raises(SelfLockingError):
        losses_at(stepped_planets(40, 36, 40, 44, torque=-10.0), 1000.0)
    forwards = losses_at(stepped_planets(40, 36, 40, 44, torque=-10.0), -1000.0)
    assert forwards.efficiency == pytest.approx(0.398, abs=1e-3)


def test_driven_backwards_a_train_of_small_circulating_power_still_runs() -> None:
    """As above with the power from D to E: eta = (1 - e eta_0^-w) / (1 - e)."""
    found = losses_at(stepped_planets(30, 40, 40, 60), -1000.0)
    e = 30 * 40 / (40 * 60)
    eta = basic_efficiency(found)
    assert found.efficiency == pytest.approx((1.0 - e / eta) / (1.0 - e), rel=1e-9)


def test_losses_beyond_the_load_leave_no_output(grc: Gearbox) -> None:
    """Bearings and seals that take more than the load supplies: each loaded body is driven."""
    speeds = grc.train.rolling_speeds(grc.case.overall.input, 2.0)
    none = {mesh.name: 0.0 for mesh in grc.meshes}
    drag = {"hss": -2.0 * 240e3 / speeds["hss"]}
    flow = power_flow(grc.train, {"carrier": 120e3}, speeds, none, drag)
    assert flow.input == pytest.approx(480e3, rel=1e-9)
    assert flow.output == 0.0


def test_a_held_gear_may_be_the_smaller_one(tmp_path: Path) -> None:
    """Sun held, ring in, carrier out: both meshes transmit z_sun / (z_sun + z_ring) of the power (Willis)."""
    text = HEAD.format(input="r", output="c", gear="ring", torque=300.0)
    text += gear("sun", 20, 3.0) + gear("planet", 30, 3.0)
    text += gear("ring", 80, 3.0, "internal = true\nfitted_tip = true\n")
    text += '[pairs]\nsp = { pinion = "sun", gear = "planet", centre_distance_mm = 75.0 }\n'
    text += 'rp = { pinion = "planet", gear = "ring", centre_distance_mm = 75.0 }\n'
    text += BODY.format(name="s", gears="gears_z_mm = { sun = 0.0 }", inertia="fixed = true")
    text += BODY.format(name="r", gears="gears_z_mm = { ring = 0.0 }", inertia=INERTIA)
    text += BODY.format(name="c", gears="", inertia=INERTIA)
    text += f"""
[bodies.p]
carrier = "c"
orbit_radius_mm = 75.0
planet_angles_deg = [0.0, 90.0, 180.0, 270.0]
gears_z_mm = {{ planet = 0.0 }}
{LIGHT}
[meshes]
sp = {{ pair = "sp", pinion_body = "s", gear_body = "p" }}
rp = {{ pair = "rp", pinion_body = "p", gear_body = "r" }}
[joints]
jr = {{ body = "r", z_mm = 0.0 }}
jc = {{ body = "c", z_mm = 0.0 }}
jp = {{ body = "p", on = "c", z_mm = 0.0 }}
"""
    text += LUBRICANT
    found = losses_at(Gearbox.from_dict(tomllib.loads(text)), 1000.0)
    power = {mesh.family: mesh.power for mesh in found.meshes}
    assert power["rp"] == pytest.approx(300.0 * 1000.0 * RPM * 20 / 100, rel=1e-9)
    assert found.efficiency == pytest.approx(1.0 - 0.2 * (1.0 - basic_efficiency(found)), rel=1e-9)
    (tmp_path / "held.toml").write_text(text, encoding="utf-8")
    assert exugear("losses", tmp_path / "held.toml").exit_code == 0


def test_the_command_says_that_a_train_locks_itself(tmp_path: Path) -> None:
    case = tmp_path / "arm.toml"
    case.write_text(text_of_stepped_planets(40, 36, 40, 44), encoding="utf-8")
    outcome = exugear("losses", case, "--speed=-1000")
    assert outcome.exit_code == 1
    assert "E 10 N m at -1000 rpm: the train locks itself" in outcome.stderr
