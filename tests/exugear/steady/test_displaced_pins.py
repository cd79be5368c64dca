"""Displaced planet pins in the steady-state response: load sharing, orders of the carrier, sidebands of mesh orders."""

from __future__ import annotations

import json
import tomllib
from dataclasses import replace

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.templates.kinds import template
from exugear.steady.balance.load_sharing import mean_planet_forces
from exugear.steady.balance.response import dissipated_and_given, signals
from exugear.steady.findings import response_findings
from exugear.steady.mean_system.mesh_waves import wave_name
from exugear.steady.mean_system.signals import PLANET_AXES, support_waves
from exugear.steady.settings import SpeedRange, SteadySettings
from exugear.steady.steady_file import to_dataset
from exugear.steady.steady_response import response_of
from exugear.system.build import assemble
from exugear.system.statics import static_state

from ...optional_libraries import needs_meshio
from ..cases import gear_trains
from ..cases.assembled import assembled
from ..cases.ring import ring_content, write_rim
from ..cases.steady_runs import apart, column_of, drive_of, rolling, solver_of, whole_run
from ..cases.table import surface_of

LATE = {"late": {"body": "planet_1", "tangential_um": 20.0, "radial_um": 8.0}}
PLANE = PLANET_AXES[:2]
ROLLING = ("pl_a", "pl_b", "lss_a", "lss_bc", "ims_a", "ims_bc", "hss_a", "hss_bc")
CYCLE = 2.0 * np.pi * np.arange(50) / 50
SHAPE = 1.0 + 0.08 * np.cos(CYCLE) + 0.03 * np.sin(2 * CYCLE)


def train(content, pins=LATE, variant="bushing", shape=SHAPE):
    gearbox = Gearbox.from_dict(content | {"pins": pins})
    return assemble(gearbox, Choice(variant), dict.fromkeys(gearbox.pairs, 4e8 * shape))


def forces_of_planets(model, response, rolled):
    """Forces of each family's meshes at all planets, (samples, planets) by the numbers of the meshes, N."""
    names = [own.name for own in model.signal_names]
    lines = signals(model, response)
    speed = response.interface.speed
    angles = np.outer(np.copysign(1.0, speed) * rolled, model.lines.bases)
    found = {}
    for meshes, planets in model.waves.groups:
        if planets is None:
            continue
        waves = [wave for wave in (model.waves.waves[n] for n in model.waves.force_waves) if wave.first == meshes[0]]
        columns = [names.index(f"mesh_force {wave.name}") for wave in waves]
        shapes = planets.values(planets.ratio * rolled, len(waves))
        found[meshes] = np.einsum("snw,sw->sn", shapes, model.lines.values(lines[:, columns], angles))
    return found


def mean_forces(model, response):
    """Mean forces (planets,) of each family's meshes, N."""
    lines = 2.0 * signals(model, response)
    lines[0] *= 0.5
    return mean_planet_forces(model, lines, response.interface.speed)


def bearings_of_planets(model, response, rolled):
    """Forces of the planets' bearings along radius and tangent (samples, planets, 2), by family, N."""
    names = [own.name for own in model.signal_names]
    frame = model.system.frame
    lines = signals(model, response)
    # Signals are those about the static state.
    q, v, _ = frame.state(0.0, response.interface.speed, model.system.static_at(response.interface.speed))
    turn, labels = support_waves(frame.assembly, frame.sets)
    first = names.index(f"support_force {labels[0]}")
    lines[0, first : first + len(labels)] -= turn @ frame.assembly.bearing_loads(q, v)[:, :3].ravel()
    angles = np.outer(np.copysign(1.0, response.interface.speed) * rolled, model.lines.bases)
    found = {}
    for planets in model.system.frame.sets:
        own = [support for support in model.waves.assembly.supports if support.body in planets.names]
        for family in dict.fromkeys(support.family for support in own):
            waves = [wave_name(number, planets.waves) for number in range(planets.waves)]
            columns = [
                [names.index(f"support_force {family} {wave} {axis}") for axis in PLANET_AXES[:2]] for wave in waves
            ]
            values = model.lines.values(lines[:, np.array(columns)], angles)
            forces = np.einsum("snw,swa->sna", planets.values(planets.ratio * rolled), values)
            found[family] = planets, [support.name for support in own if support.family == family], forces
    return found


def largest_difference(solver, speed, duration, step, last, assembly):
    """Largest root mean square differences of the forces of planets' meshes and bearings between run and response.

    Means are part of them; over the mean force of all planets of the family.
    """
    model = solver.model
    response = solver.response(speed)
    torque = drive_of(model, response)
    time, found, states, observer = whole_run(model, response, duration, step, torque, assembly)
    late = time > duration - last
    mean, rolled = rolling(model, response, time[late], states[late, model.system.pinned])
    response = solver.response(mean)
    apart_by = []
    for meshes, known in forces_of_planets(model, response, rolled).items():
        names = [assembly.elements[mesh].mesh.name for mesh in meshes]
        own = found[late][:, [column_of(observer, f"mesh_force {name}") for name in names]]
        apart_by.append(np.sqrt(np.mean((own - known) ** 2, axis=0)).max() / abs(own.mean()))
    layout = observer.layout
    first = layout["support_force"].start
    for planets, names, known in bearings_of_planets(model, response, rolled).values():
        columns = np.array([[first + place_of(layout, name, axis) for axis in "xy"] for name in names])
        x, y = np.moveaxis(found[late][:, columns], -1, 0)
        turned = (x + 1j * y) * np.exp(-1j * (planets.ratio * rolled[:, None] + planets.angles))
        change = turned - known[..., 0] - 1j * known[..., 1]
        apart_by.append(np.sqrt(np.mean(np.abs(change) ** 2, axis=0)).max() / abs(turned.mean()))
    return max(apart_by)


@pytest.mark.parametrize("planets", [3, 4])
def test_planets_of_a_stiff_sun_have_the_load_of_the_displacement_times_the_stiffness(planets):
    """In the variant rigid both meshes of a planet are springs in series between sun and ring, 2e8 N/m together.

    The carrier turns until the sum of all loads is as before.
    """
    pins = {"late": {"body": "planet_1", "tangential_um": 20.0}}
    assembly = train(gear_trains.planetary("ring", planets), pins, "rigid", np.ones(1))
    solver = solver_of(assembly, (50.0, 150.0), "parametric")
    found = mean_forces(solver.model, solver.response(90.0))["sun_planet"]
    angles = {element.mesh.name: element.mesh.pair.working_pressure_angle for element in assembly.elements}
    way = 20e-6 * (np.cos(angles["sun_planet_1"]) + np.cos(angles["planet_ring_1"]))
    alone = np.zeros(planets)
    alone[0] = -2e8 * way
    np.testing.assert_allclose(found - found.mean(), alone - alone.mean(), rtol=1e-4)


def test_three_planets_of_a_floating_sun_share_the_load_equally():
    """The sun is held by 2e-4 of a planet's stiffness. With bearings like all others loads differ by half of the mean.

    What is left of the difference falls with the stiffness that holds the sun.
    """
    shares = []
    for radial in (2e4, 2e5, 2e8):
        content = gear_trains.planetary("ring")
        for side in ("left", "right"):
            content["bearings"][f"sun_{side}"]["stiffness"] = gear_trains.HELD | {"radial_N_per_m": radial}
        solver = solver_of(train(content), (50.0, 150.0), "linear")
        loads = mean_forces(solver.model, solver.response(60.0))["sun_planet"]
        shares.append(np.ptp(loads) / loads.mean())
    assert shares[0] < 2e-3
    assert shares[1] == pytest.approx(10.0 * shares[0], rel=0.1)
    assert shares[2] > 0.4


@pytest.mark.parametrize("planets", [3, 4])
def test_load_sharing_is_that_of_the_static_state(planets):
    """At a hundredth of the lowest natural frequency, stiffness constant over the cycle."""
    assembly = train(gear_trains.planetary("ring", planets), shape=np.ones(1))
    solver = solver_of(assembly, (0.5, 2.0), "parametric")
    found = mean_forces(solver.model, solver.response(1.0))
    q = static_state(assembly).q
    static = dict(zip(assembly.mesh_names, assembly.mesh_states(q, np.zeros_like(q))[:, 4].tolist(), strict=True))
    for family in ("sun_planet", "planet_ring"):
        expected = np.array([static[f"{family}_{n + 1}"] for n in range(planets)])
        np.testing.assert_allclose(found[family], expected, rtol=1e-4)
        assert expected.max() / expected.mean() > 1.1


def test_a_stored_response_states_the_load_sharing_of_displaced_pins():
    assembly = train(gear_trains.planetary("ring"))
    data = to_dataset(response_of(assembly, SteadySettings(SpeedRange(20.0, 40.0, 3))))
    solver = solver_of(assembly, (20.0, 40.0), "parametric")
    loads = mean_forces(solver.model, solver.response(20.0))["sun_planet"]
    sharing = json.loads(data.attrs["load_sharing"])
    assert sharing["sun_planet"] == pytest.approx(loads.max() / loads.mean(), rel=1e-3)
    (said,) = [finding.text for finding in response_findings(data) if "K_gamma" in finding.text]
    assert f"{sharing['planet_ring']:.3f} of planet_ring" in said
    without = to_dataset(
        response_of(train(gear_trains.planetary("ring"), {}), SteadySettings(SpeedRange(20.0, 40.0, 3)))
    )
    assert json.loads(without.attrs["load_sharing"]) == {}


TRAINS = {
    "ring held": (gear_trains.planetary("ring"), "planet_1", 90.0),
    "ring held, backwards": (gear_trains.planetary("ring"), "planet_1", -90.0),
    "sun held": (gear_trains.planetary("sun"), "planet_1", 90.0),
    "four planets": (gear_trains.planetary("ring", 4), "planet_1", 90.0),
    "stepped planets": (gear_trains.stepped_planets(), "planet_2", 90.0),
    "meshing planets": (gear_trains.meshing_planets(), "short_1", 90.0),
    "two planetary stages": (gear_trains.wind(), "planet_1_1", 3.0),
}


@pytest.mark.validation
@pytest.mark.parametrize("method", ["parametric", "nonlinear"])
@pytest.mark.parametrize("kind", TRAINS)
def test_gear_trains_of_every_kind_stay_on_their_steady_state_with_a_displaced_pin(kind, method):
    """Constant speed, RK4 at 1/60 kHz, the last half of 1.6 s: all lines of the overall error, each planet's forces.

    The displacement is larger than the deflection of a mesh, which leaves products of both. Where the input turns
    slowly, the run is long enough for two revolutions of the carrier, whose lines lie close together.
    """
    content, planet, speed = TRAINS[kind]
    assembly = train(content, {"late": LATE["late"] | {"body": planet}})
    solver = solver_of(assembly, tuple(sorted((0.5 * speed, 2.0 * speed))), method)
    assert any(name.endswith("carrier") or "carrier_1" in name for name in solver.model.base_names)
    duration, last = (1.6, 0.8) if speed > 10.0 else (5.0, 4.2)
    assert apart(solver, speed, duration, 1.0 / 60e3, last, assembly)[0] < 2e-3
    assert largest_difference(solver, speed, 1.6, 1.0 / 60e3, 0.8, assembly) < 1e-3


@pytest.mark.validation
@pytest.mark.parametrize(("planets", "variation"), [(3, 1.0), (4, 1.0), (3, 20.0)])
def test_tables_stay_on_their_steady_state_with_a_displaced_pin(planets, variation):
    """The same with tables in all meshes, also where mesh forces vary by a fifth of the mean."""
    gearbox = Gearbox.from_dict(gear_trains.planetary("ring", planets) | {"pins": LATE})
    tables = {name: surface_of(gearbox, name, variation=variation, stiffness=4e8) for name in gearbox.pairs}
    assembly = assemble(gearbox, Choice("bushing", mesh_model="table"), tables)
    solver = solver_of(assembly, (45.0, 180.0), "nonlinear", None)
    assert apart(solver, 90.0, 1.6, 1.0 / 60e3, 0.8, assembly)[0] < 5e-4
    assert largest_difference(solver, 90.0, 1.6, 1.0 / 60e3, 0.8, assembly) < 1e-3


@pytest.mark.validation
def test_pins_displaced_alike_are_part_of_the_static_state_alone():
    """They shift the meshes of sun and ring against each other: the first order is half as large again as without."""
    pins = {f"pin_{n}": {"body": f"planet_{n}", "tangential_um": 20.0, "radial_um": 5.0} for n in (1, 2, 3)}
    assembly = train(gear_trains.planetary("ring"), pins)
    solver = solver_of(assembly, (50.0, 150.0), "parametric")
    assert len(solver.model.base_names) == 1
    assert apart(solver, 90.0, 0.8, 1.0 / 60e3, 0.4, assembly)[0] < 1e-3


def test_pins_that_are_hardly_displaced_change_nothing_else():
    """A millionth of a micrometre: orders in common are equal to round-off."""
    found = []
    for pins in ({}, {"late": {"body": "planet_1", "tangential_um": 1e-6}}):
        solver = solver_of(train(gear_trains.planetary("ring"), pins), (50.0, 150.0), "parametric")
        overall = signals(solver.model, solver.response(70.0))[:, 0]
        orders = np.round(solver.model.lines.orders, 9)
        found.append(dict(zip(orders.tolist(), overall.tolist(), strict=True)))
    without, displaced = found
    assert set(without) < set(displaced)
    size = max(map(abs, without.values()))
    assert max(abs(displaced[order] - value) for order, value in without.items()) < 1e-7 * size


@pytest.mark.validation
def test_the_power_of_displaced_pins_is_what_the_dampers_dissipate(grc, stiffness):
    """Bearings of the planets are unequal, too."""
    assembly = assemble(grc.varied({"pins": LATE}), Choice("bushing"), stiffness)
    for level in ("linear", "parametric", "nonlinear"):
        solver = solver_of(assembly, (1.0, 22.5), level)
        assert solver.model.loaded_bearings
        taken, given = dissipated_and_given(solver.model, solver.response(10.0))
        assert taken == pytest.approx(given, rel=1e-5)


@pytest.mark.parametrize("method", ["linear", "parametric", "nonlinear"])
def test_planets_that_share_the_load_very_unequally_are_in_balance(method):
    """Template of a planetary stage, one pin displaced by 20 um, near standstill and at speed.

    Forces of bearings that followed from the solution before did not settle near standstill.
    """
    gearbox = Gearbox.from_dict(tomllib.loads(template("planetary")) | {"pins": LATE})
    assembly = assemble(gearbox, Choice("bushing"), dict.fromkeys(gearbox.pairs, 4e8 * SHAPE))
    solver = solver_of(assembly, (0.5, 314.0), method, 5)
    for speed in (0.8, 100.0):
        taken, given = dissipated_and_given(solver.model, solver.response(speed))
        assert taken == pytest.approx(given, rel=1e-5)


def test_displaced_pins_of_constant_stiffness_are_not_said_to_leave_all_amplitudes_at_zero():
    """A pin displaced along the tangent loads bearings at the order of the carrier; the overall error stays."""
    pins = {"late": {"body": "planet_1", "tangential_um": 20.0}}
    assembly = train(gear_trains.planetary("ring"), pins, shape=np.ones(1))
    data = to_dataset(response_of(assembly, SteadySettings(SpeedRange(20.0, 40.0, 3), at_resonances=False)))
    (said,) = [own.text for own in response_findings(data) if own.text.startswith("no excitation")]
    assert "the overall transmission error does not vary" in said


def test_a_response_warns_of_rolling_elements_that_are_loaded_unequally(grc, stiffness):
    said = {}
    for name, pins in (("without", {}), ("late", LATE)):
        gearbox = grc.varied({"bearings.pl_a.model": "iso16281", "bearings.pl_b.model": "iso16281", "pins": pins})
        settings = SteadySettings(SpeedRange(9.0, 10.0, 2), at_resonances=False)
        data = to_dataset(response_of(assemble(gearbox, Choice("bushing"), stiffness), settings))
        (said[name],) = [finding for finding in response_findings(data) if "linearised" in finding.text]
    assert said["without"].level == "note"
    assert said["late"].level == "warning"
    assert "share the load unequally" in said["late"].text


CARRIER = ("plc_a", "plc_b", "lss_a")


def lines_of_run(solver, speed, assembly, names):
    """Lines (n, signals) of a run of 3 s that starts on the response at a speed, and those of the response."""
    model = solver.model
    response = solver.response(speed)
    torque = drive_of(model, response)
    time, found, states, observer = whole_run(model, response, 3.0, 1.0 / 120e3, torque, assembly)
    late = time > 1.0
    mean, rolled = rolling(model, response, time[late], states[late, model.system.pinned])
    phases = np.outer(rolled, model.lines.orders)
    columns = np.hstack([np.cos(phases), -np.sin(phases[:, 1:])])
    layout = observer.layout
    own = found[late][:, [layout["support_force"].start + place_of(layout, *name.split()[1:]) for name in names]]
    fit = np.linalg.lstsq(columns, own, rcond=None)[0]
    count = phases.shape[1]
    known = signals(model, solver.response(mean))
    at = [[signal.name for signal in model.signal_names].index(name) for name in names]
    return fit[1:count] + 1j * fit[count:], 2.0 * known[1:, at]


def place_of(layout, support, axis):
    """Place of a force among those of all supports."""
    signal = next(own for own in layout.signals if own.name == "support_force")
    supports, axes = (layout.names[dimension] for dimension in signal.dimensions[1:])
    return supports.index(support) * len(axes) + axes.index(axis)


@pytest.mark.validation
@pytest.mark.parametrize("method", ["parametric", "nonlinear"])
def test_a_displaced_pin_of_the_gearbox_brings_the_order_of_the_carrier_and_sidebands(grc, stiffness, method):
    """Constant speed of 10 rad/s, RK4 at 1/120 kHz, the last 2 of 3 s; one pin displaced by 20 um along the tangent.

    Amplitudes of the forces of bearings of carrier and sun shaft: the order of the carrier, all mesh orders together,
    and all of their sidebands. Bearings of the planets are stiffer where their load is larger, by up to 0.7 % of the
    mean: without that, sidebands of the third mesh order are an eighth of those of the run. Twice the carrier's order,
    a product of two displacements, is 1e-3 of the carrier's, and is left out.
    """
    pins = {"late": {"body": "planet_1", "tangential_um": 20.0}}
    assembly = assemble(grc.varied({"pins": pins}), Choice("bushing"), stiffness)
    solver = solver_of(assembly, (1.0, 22.5), method)
    names = [f"support_force {support} {axis}" for support in CARRIER for axis in "xy"]
    run, known = map(np.abs, lines_of_run(solver, 10.0, assembly, names))
    index = solver.model.lines.index[1:]
    slow = (index == [0, 0, 0, 1]).all(axis=1)
    assert slow.sum() == 1
    np.testing.assert_allclose(known[slow], run[slow], rtol=3e-4)
    of_meshes = index[:, :3].any(axis=1)
    beside = (index[:, 3] != 0) & of_meshes
    most = 0.012 if method == "parametric" else 4e-3
    assert np.linalg.norm(known[beside] - run[beside]) < most * np.linalg.norm(run[beside])
    assert np.linalg.norm(run[beside]) > 0.1 * np.linalg.norm(run[of_meshes])
    others = of_meshes & ~beside
    assert np.linalg.norm(known[others] - run[others]) < 5e-3 * np.linalg.norm(run[others])
    assert largest_difference(solver, 10.0, 3.0, 1.0 / 120e3, 2.0, assembly) < 5e-4


@pytest.mark.validation
@pytest.mark.long
def test_a_displaced_pin_on_rolling_elements_brings_the_sidebands_of_a_run(grc, stiffness):
    """As before, with ISO/TS 16281 in all bearings, at 12 rad/s, where the first mesh order meets modes of planets.

    Elements of each planet's bearings stand alike in the run, as they do in the response.
    """
    rows = {f"bearings.{family}.model": "iso16281" for family in ROLLING}
    pins = {"late": {"body": "planet_1", "tangential_um": 20.0}}
    assembly = assemble(grc.varied(rows | {"pins": pins}), Choice("bushing"), stiffness)
    solver = solver_of(assembly, (1.0, 22.5), "nonlinear")
    alike = solver.model.waves.assembly.connectors.rolling
    assembly = replace(assembly, connectors=assembly.connectors._replace(rolling=alike))
    names = [f"support_force {support} {axis}" for support in CARRIER for axis in "xy"]
    run, known = map(np.abs, lines_of_run(solver, 12.0, assembly, names))
    index = solver.model.lines.index[1:]
    beside = (index[:, 3] != 0) & index[:, :3].any(axis=1)
    assert np.linalg.norm(known[beside] - run[beside]) < 0.01 * np.linalg.norm(run[beside])
    assert largest_difference(solver, 12.0, 3.0, 1.0 / 120e3, 2.0, assembly) < 1e-3


@needs_meshio
@pytest.mark.validation
@pytest.mark.parametrize("method", ["parametric", "nonlinear"])
def test_a_displaced_pin_under_a_flexible_ring_gear_stays_on_its_steady_state(grc, stiffness, tmp_path, method):
    """The ring is up to 10 mm thinner at two opposite places; RK4 at 1/200 kHz, the last 1.0 of 1.6 s."""
    content = ring_content(grc, tmp_path)
    write_rim(tmp_path / "rim.vtu", oval=0.01)
    gearbox = Gearbox.from_dict(content, str(tmp_path / "stage.toml")).varied({"pins": LATE})
    assembly = assembled(gearbox, Choice("flexible"), stiffness)
    solver = solver_of(assembly, (7.0, 9.0), method, 9)
    assert apart(solver, 8.0, 1.6, 5e-6, 1.0, assembly)[0] < 2e-3
    assert largest_difference(solver, 8.0, 1.6, 5e-6, 1.0, assembly) < 5e-4
