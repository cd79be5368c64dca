"""Sound power of a gearbox with a flexible housing, over speed and order."""

from __future__ import annotations

import importlib
import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from exugear.cli.sound_tables import sound_line, sound_tables
from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.report.findings.ranking import ranking_of
from exugear.results.sound.levels import a_weighting, power_level
from exugear.results.sound.over_speed import sound_over_speed
from exugear.results.sound.radiated_power import AIR_IMPEDANCE, radiated_power
from exugear.steady.balance.response import signals, transmission_errors
from exugear.steady.crossings import contributions
from exugear.steady.findings import UPPER_ESTIMATE, response_findings
from exugear.steady.point_solver import PointSolver, harmonic_balance_model
from exugear.steady.settings import SpeedRange, SteadySettings
from exugear.steady.steady_file import load_response, stored_or_computed
from exugear.studies.quantities import QUANTITIES
from exugear.studies.study import Output, errors_of_signals
from exugear.system.loads import LoadTable
from exugear.transient.compiled.solver import CompiledSystem

from ...fe_ste.damage import damages
from ...optional_libraries import needs_meshio
from ..cases.assembled import assembled
from ..cases.box import box_content
from ..cases.case_mutations import toml_text
from ..cases.command import exugear
from ..cases.spur import SPUR_CASE
from ..cases.steady_runs import start_of

pytestmark = needs_meshio

STIFFNESS = {"spur": 3e8 * (1.0 + 0.08 * np.cos(2.0 * np.pi * np.arange(50) / 50))}
LIMIT = 8000.0 / 1.5


@pytest.fixture(scope="module")
def housed(tmp_path_factory: pytest.TempPathFactory):
    """Spur pair in an elastic plate, 125 x 50 x 12 mm."""
    folder = tmp_path_factory.mktemp("box")
    box = Gearbox.from_dict(box_content(folder), str(folder / "case.toml"))
    return assembled(box, Choice("flexible", "line_of_action"), STIFFNESS)


@pytest.fixture(scope="module")
def data(housed, tmp_path_factory: pytest.TempPathFactory):
    settings = SteadySettings(SpeedRange.from_text("600:3000:9"), harmonics=10, at_resonances=False)
    file = tmp_path_factory.mktemp("steady") / "steady-parametric.nc"
    stored_or_computed(file, housed, settings)
    return load_response(file)


def test_the_plate_radiates_from_all_of_its_surface(housed):
    found = radiated_power(housed)
    assert found is not None
    assert found.bodies == ("box",)
    assert found.area == pytest.approx(2 * (0.125 * 0.05 + 0.175 * 0.012), rel=1e-9)
    assert found.limit == pytest.approx(LIMIT)


def test_orders_and_third_octaves_add_up_to_the_total(data):
    power = data["sound_power"].to_numpy()
    frequency = np.outer(data["speed"], data["order"]) / (2.0 * np.pi)
    total = data["sound_level"].sel(weighting="Z").to_numpy()
    weighted = data["sound_level"].sel(weighting="A").to_numpy()
    assert total == pytest.approx(power_level(np.nansum(power, axis=1)), abs=1e-9)
    heard = np.nansum(power[:, 1:] * 10 ** (0.1 * a_weighting(frequency[:, 1:])), axis=1)
    assert weighted == pytest.approx(power_level(heard), abs=1e-9)
    bands = 10 ** (0.1 * data["third_octave_level"].to_numpy()) * 1e-12
    assert power_level(bands.sum(axis=1)) == pytest.approx(np.stack([total, weighted], axis=1), abs=1e-6)


def test_orders_above_two_thirds_of_the_band_are_left_out_by_name(data):
    frequency = np.outer(data["speed"], data["order"]) / (2.0 * np.pi)
    assert np.array_equal(np.isnan(data["sound_power"].to_numpy()), frequency > LIMIT)
    sound = sound_over_speed(data)
    assert sound is not None
    assert [name for name, _ in sound.orders_left_out()] == [f"{n} x spur" for n in range(6, 11)]
    texts = [finding.text for finding in response_findings(data) if finding.level == "warning"]
    assert UPPER_ESTIMATE in texts
    assert any("6 x spur at 6000 Hz" in text and "bodies.box.solid.band_Hz" in text for text in texts)


def test_power_is_that_of_the_surface_velocity(data):
    velocity = data["amplitude"].sel(signal="surface_velocity").to_numpy().astype(float)
    power = data["sound_power"].to_numpy()
    known = np.isfinite(power)
    area = json.loads(data.attrs["radiating_surface"])["outer_surface_m2"]
    assert power[known] == pytest.approx(0.5 * AIR_IMPEDANCE * area * velocity[known] ** 2, rel=1e-6)


def test_sound_power_ranks_resonances_if_it_is_asked_to(data):
    ranking = ranking_of(data, wanted="sound_power")
    assert (ranking.quantity, ranking.wanted) == ("surface_velocity", "sound_power")
    heights = [
        own.amplitudes["surface_velocity"].amplitude
        for own in ranking.resonances
        if own.amplitudes["surface_velocity"].place
    ]
    assert heights == sorted(heights, reverse=True)
    assert ranking_of(data).quantity == "mount_acceleration"


def test_the_loudest_speed_is_said_with_its_loudest_order(data):
    sound = sound_over_speed(data)
    assert sound is not None
    summary = sound.summary()
    levels = data["sound_level"].sel(weighting="A").to_numpy()
    assert summary["level_dBA"] == pytest.approx(levels.max(), abs=1e-9)
    assert summary["speed_rpm"] == pytest.approx(float(data["speed_rpm"][int(levels.argmax())]))
    first = summary["orders"][0]
    line = sound_line(summary)
    assert f"{summary['level_dBA']:.1f} dB(A), upper estimate" in line
    assert first["line"].replace(" x ", " × ") in line
    orders, bands, causes = sound_tables(summary)
    assert len(orders.rows) == 5
    assert [row["line"] for row in causes.rows] == [row["line"] for row in orders.rows]
    assert all(sum(row["meshes"].values()) == pytest.approx(1.0) for row in causes.rows)
    assert sum(10 ** (0.1 * row["level_dB"]) for row in bands.rows) == pytest.approx(10 ** (0.1 * summary["level_dB"]))
    assert json.dumps(summary)


@pytest.mark.parametrize("order", [1, 2])
def test_contributions_to_the_sound_power_add_up_to_it(housed, order):
    """The velocity of the linear response, of which all meshes and all modes are parts."""
    speed = 1500.0 * math.pi / 30.0
    solver = PointSolver(harmonic_balance_model(housed, np.array([speed]), 10), "linear")
    model = solver.model
    line = int(np.flatnonzero(model.lines.index[:, 0] == order)[0])
    found = contributions(model, speed, line, model.radiated)
    known = 2.0 * abs(signals(model, solver.response(speed))[line, -1])
    assert found.amplitude == pytest.approx(known, rel=1e-9)
    assert sum(found.meshes.values()) == pytest.approx(1.0, abs=1e-9)
    assert sum(share for _, share in found.modes) == pytest.approx(1.0, abs=0.05)


def test_the_derivative_of_the_sound_power_is_that_of_a_gearbox_with_a_stiffer_bearing(housed):
    """The excitation stays as it is: of a gearbox with a changed bearing only the averaged system is taken."""
    speed = 1500.0 * math.pi / 30.0
    model = harmonic_balance_model(housed, np.array([speed]), 10)
    radiated = model.radiated
    assert radiated is not None
    line = int(np.flatnonzero(model.lines.index[:, 0] == 1)[0])
    frequency = speed * float(model.lines.orders[line])
    interface = model.at(speed)
    loads = model.loads(interface.ports) @ transmission_errors(model, interface.ports, speed)[line].ravel()
    derivative = contributions(model, speed, line, radiated).supports
    name = max(derivative, key=lambda family: abs(derivative[family]))
    own = np.array([support.family == name for support in housed.supports])
    velocities = []
    for factor in (1.001, 0.999):
        changed = np.where(own, factor, 1.0)[:, None, None]
        arrays = housed.connectors
        arrays = arrays._replace(stiffness=arrays.stiffness * changed, damping=arrays.damping * changed)
        other = harmonic_balance_model(replace(housed, connectors=arrays), np.array([speed]), 10)
        motion = np.linalg.solve(other.system.dynamic(speed, frequency), loads)
        velocities.append(float(radiated.surface_velocity(motion[None, :], np.array([frequency]))[0]))
    slope = (velocities[0] - velocities[1]) / (0.001 * sum(velocities))
    assert abs(slope) > 0.05
    assert derivative[name] == pytest.approx(slope, rel=0.02, abs=0.02)


def stored_box(folder: Path, *options: object) -> tuple[Path, Path]:
    """Gearbox file of the box, and the file of its response from 1400 to 1600 rpm."""
    case = folder / "box.toml"
    case.write_text(toml_text(box_content(folder)), encoding="utf-8")
    asked = ("--variant", "flexible", "--speeds", "1400:1600", *options, "--json")
    return case, Path(json.loads(exugear("steady", case, *asked).stdout)["file"])


@pytest.mark.validation
def test_velocities_of_the_surface_for_other_programs_radiate_the_same_power(tmp_path):
    """Their normal parts, integrated over the faces of the VTK file as another program reads it: 2 x 2 Gauss points.

    The speed is solved again: iterations end at a thousandth of an order.
    """
    out = tmp_path / "out"
    case, file = stored_box(tmp_path, "--points", "3", "--out", out)
    asked = ("export", case, "--surface", file, "--speed", 1500, "--out", out)
    summary = json.loads(exugear(*asked, "--json").stdout)
    dataset, drawn = (Path(name) for name in summary["files"])
    mesh = importlib.import_module("meshio").read(drawn)
    with xr.open_dataset(dataset, engine="h5netcdf") as found:
        frequency, velocity = found["frequency"].to_numpy(), found["velocity"].to_numpy()
    corners = mesh.points[mesh.cells_dict["quad"]]
    sides = corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0]
    normal = np.cross(*sides)
    area = np.linalg.norm(normal, axis=1)
    places = 0.5 + np.array([-0.5, 0.5]) / math.sqrt(3.0)
    shapes = np.array([[(1 - a) * (1 - b), a * (1 - b), a * b, (1 - a) * b] for a in places for b in places])
    power = []
    for number, value in enumerate(frequency, start=1):
        parts = [mesh.point_data[f"velocity_{number}_{value:.1f}Hz_{part}"] for part in ("real", "imaginary")]
        assert np.array_equal(np.stack(parts), velocity[number - 1])
        across = [np.einsum("fcd,fd->fc", part[mesh.cells_dict["quad"]], normal / area[:, None]) for part in parts]
        square = sum(np.square(own @ shapes.T).mean(axis=1) @ area for own in across)
        power.append(0.5 * AIR_IMPEDANCE * square)
    stored = load_response(file)
    point = int(np.argmin(np.abs(stored["speed_rpm"].to_numpy() - 1500.0)))
    known = stored["sound_power"].to_numpy()[point, 1:]
    counted = np.isfinite(known)
    assert np.array(power)[counted] == pytest.approx(known[counted], rel=2e-3)
    assert importlib.import_module("pyvista").read(drawn).n_points == summary["points"]
    again = exugear(*asked)
    assert again.exit_code == 2 and "exists already" in again.stderr


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ((), "name a computed speed with --speed RPM"),
        (("--speed", 9000), "not computed; the response has"),
        (("--speed", "nan"), "not computed; the response has"),
    ],
)
def test_velocities_of_the_surface_need_a_computed_speed(tmp_path, more, said):
    case, file = stored_box(tmp_path, "--mesh-model", "iso6336", "--points", "2", "--out", tmp_path)
    outcome = exugear("export", case, "--surface", file, "--out", tmp_path, *more)
    assert outcome.exit_code == 2 and said in " ".join(outcome.stderr.split())


@pytest.mark.validation
def test_velocities_of_the_surface_need_a_whole_response_and_room(tmp_path):
    """Damaged responses are refused, and a file that is too large for the disk leaves nothing behind."""
    resource = pytest.importorskip("resource", reason="limits of a POSIX system")
    case, file = stored_box(tmp_path, "--mesh-model", "iso6336", "--points", "2", "--out", tmp_path)
    asked = ("--speed", 1400, "--out", tmp_path, "--to", tmp_path / "to")
    broken = tmp_path / "broken.nc"
    for damaged in damages(file.read_bytes(), 12):
        broken.write_bytes(damaged)
        outcome = exugear("export", case, "--surface", broken, *asked)
        assert outcome.exit_code == 2 and "broken.nc" in outcome.stderr, outcome.stderr
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, before[1]))
    try:
        outcome = exugear("export", case, "--surface", file, *asked)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert outcome.exit_code == 1 and "File too large" in outcome.stderr, outcome.stderr
    assert not list((tmp_path / "to").glob("*"))
    assert exugear("export", case, "--surface", file, *asked).exit_code == 0


def test_a_rigid_housing_has_no_sound_power(housed):
    rigid = assembled(housed.gearbox, Choice("bushing", "line_of_action"), STIFFNESS)
    assert radiated_power(rigid) is None


@pytest.mark.validation
def test_power_of_surface_velocities_in_a_run_is_that_of_the_steady_orders(housed):
    # The run starts on the steady state. Its surface velocities are integrated over the drawn faces, bilinear between
    # their corners, and averaged over whole mesh periods.
    speed = 1500.0 * math.pi / 30.0
    solver = PointSolver(harmonic_balance_model(housed, np.array([speed]), 10), "parametric")
    model, response = solver.model, solver.response(speed)
    steady = 2.0 * signals(model, response)[1:, -1].real
    area = model.radiated.area
    expected = 0.5 * AIR_IMPEDANCE * area * float(np.sum(steady**2))

    q, v = start_of(model, response)
    load = housed.gearbox.case.static_load
    period = 2.0 * math.pi / (speed * float(model.lines.orders[1]))
    steps = 400
    run = CompiledSystem(
        model.waves.assembly,
        q,
        v,
        LoadTable({**load.torques_N_m, load.locked[0]: response.torque}),
        period / steps,
    )
    surface = housed.elastic_bodies["box"].reduced.surface
    corners, moved = surface.points[surface.quads], surface.displacement[surface.quads]
    points = np.array([-1.0, 1.0]) / math.sqrt(3.0)
    powers = []
    for number in range(20):
        states = np.empty((steps, housed.size))
        rates = np.empty_like(states)
        assert run.advance(number * steps, states, rates) == steps
        own = rates[:, housed.elastic_slices["box"]]
        total = np.zeros(steps)
        for a in points:
            for b in points:
                shape = 0.25 * np.array([(1 - a) * (1 - b), (1 + a) * (1 - b), (1 + a) * (1 + b), (1 - a) * (1 + b)])
                by_a = 0.25 * np.array([-(1 - b), 1 - b, 1 + b, -(1 + b)])
                by_b = 0.25 * np.array([-(1 - a), -(1 + a), 1 + a, 1 - a])
                normal = np.cross(np.einsum("k,fkd->fd", by_a, corners), np.einsum("k,fkd->fd", by_b, corners))
                size = np.linalg.norm(normal, axis=1)
                rows = np.einsum("k,fd,fkdn->fn", shape, normal / size[:, None], moved)
                total += np.square(own @ rows.T) @ size
        powers.append(AIR_IMPEDANCE * total.mean())
    assert 10.0 * math.log10(np.mean(powers) / expected) == pytest.approx(0.0, abs=0.3)


def test_a_ranking_by_sound_power_without_a_flexible_housing_is_refused(tmp_path):
    file = tmp_path / "spur.toml"
    file.write_text(SPUR_CASE, encoding="utf-8")
    outcome = exugear("steady", file, "--mesh-model", "line_of_action", "--quantity", "sound_power")
    assert outcome.exit_code == 2
    assert "--quantity sound_power: the variant bushing has no flexible housing" in " ".join(outcome.stderr.split())


def test_no_resonance_in_sound_power_lies_at_or_above_the_limit_of_the_band(data):
    # An order that rises up to the limit has no peak there: the curve itself goes on.
    limited = data.copy()
    frequency = np.outer(np.abs(data["speed"]), data["order"]) / (2.0 * np.pi)
    limited["sound_power"] = data["sound_power"].where(xr.DataArray(frequency < 2500.0, dims=("point", "line")))
    found = [own for own in ranking_of(limited).resonances if own.amplitudes["surface_velocity"].place]
    everything = [own for own in ranking_of(data).resonances if own.amplitudes["surface_velocity"].place]
    assert [own.frequency for own in found] == [own.frequency for own in everything if own.frequency < 2500.0]
    assert len(found) < len(everything)


def test_studies_know_the_surface_velocity_of_a_flexible_housing_alone(housed):
    velocity = QUANTITIES["loudest_peak"]
    kept = {"f": Output(velocity, {"signal": "surface_velocity"})}
    assert kept["f"].units == "m/s"
    assert not [*errors_of_signals(kept, housed.gearbox, Choice("flexible"))]
    (refused,) = errors_of_signals(kept, housed.gearbox, Choice("bushing"))
    assert "outputs.f.signal = 'surface_velocity': no such signal" in refused
