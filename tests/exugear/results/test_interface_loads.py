"""Loads of a steady-state response on the housing: balance, sign, phase, and the cards that Nastran reads."""

from __future__ import annotations

import csv
import io
import json
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

from exugear.cli.app import app
from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.units import RPM
from exugear.project import Project
from exugear.results.interface_loads import COLUMNS, interface_loads, loaded_seats, loads_csv, nastran_loads
from exugear.steady.settings import SpeedRange, SteadySettings
from exugear.steady.steady_file import steady_response, to_dataset, with_names
from exugear.steady.steady_response import response_of
from exugear.system.bodies.of_gearbox import node_numbers
from exugear.system.build import assemble
from exugear.system.statics import static_state

from ..cases.assembled import assembled
from ..cases.box import box_content
from ..cases.command import exugear
from ..cases.spur import SPUR_CASE

STIFFNESS = {"spur": 2e8 * (1.0 + 0.1 * np.cos(2.0 * np.pi * np.arange(16) / 16 + 0.4))}
NUMBERS = {"bearing_1": 11, "bearing_2": 12}


@pytest.fixture(scope="module")
def spur() -> Gearbox:
    return Gearbox.from_dict(tomllib.loads(SPUR_CASE), "case.toml")


@pytest.fixture(scope="module")
def response(spur: Gearbox) -> xr.Dataset:
    settings = SteadySettings(SpeedRange.from_text("600:1200:3"), at_resonances=False)
    return steady_response(spur, Choice("bushing"), STIFFNESS, settings=settings)


def test_the_forces_are_those_of_the_mesh_less_the_inertia_of_the_shaft(spur: Gearbox, response: xr.Dataset) -> None:
    """Sign and size by another way: Newton's law for the shaft of 1 kg, with the mesh along its static direction."""
    assembly = assemble(spur, Choice("bushing"), STIFFNESS)
    at_rest = assembly.bearing_loads(static_state(assembly).q, np.zeros(assembly.size))[0, :3]
    along_mesh = at_rest / (
        100.0 / (0.030 * np.cos(np.radians(20.0)))
    )  # over the force on the line of action, r_b = 28.2 mm
    assert np.linalg.norm(along_mesh) == pytest.approx(1.0, rel=1e-6)
    (loads,) = interface_loads(spur, response, [2], NUMBERS)
    assert (loads.seats, loads.nodes) == (("bearing_1", "bearing_2"), (11, 12))

    def signal(name: str) -> np.ndarray:
        own = response.isel(point=2, line=slice(1, None)).sel(signal=name)
        return own["amplitude"].to_numpy() * np.exp(1j * own["phase"].to_numpy().astype(float))

    mesh = signal("mesh_force spur")
    for axis, name in enumerate("xyz"):
        wanted = along_mesh[axis] * mesh - 1.0 * signal(f"seat_acceleration bearing_1 {name}")
        assert np.abs(loads.load[:, 0, axis] - wanted).max() < 1e-5 * np.abs(mesh).max()


def test_forces_over_time_are_those_of_the_signals_with_the_other_sign(spur: Gearbox, response: xr.Dataset) -> None:
    (loads,) = interface_loads(spur, response, [2], NUMBERS)
    assert loads.speed == pytest.approx(1200.0 * RPM)
    signal = response.isel(point=2, line=slice(1, None)).sel(signal="support_force bearing_2 y")
    angle = np.linspace(0.0, 2.0 * np.pi, 37)
    order = signal["order"].to_numpy()[:, None]
    amplitude, phase = (signal[name].to_numpy().astype(float)[:, None] for name in ("amplitude", "phase"))
    wanted = -(amplitude * np.cos(order * angle + phase)).sum(axis=0)
    time = angle / loads.speed
    found = (loads.load[:, 1, 1, None] * np.exp(2j * np.pi * loads.frequency[:, None] * time)).real.sum(axis=0)
    assert found == pytest.approx(wanted, rel=1e-6, abs=1e-6 * np.abs(wanted).max())
    assert np.ptp(found) > 1.0  # the mesh stiffness excites them


def test_orders_of_one_frequency_are_added_and_negative_ones_turned(spur: Gearbox, response: xr.Dataset) -> None:
    three = response.isel(line=[1, 1, 1, 2]).copy(deep=True)
    three["order"] = ("line", np.array([20.0, 20.0, -20.0, 40.0]))
    three["amplitude"][:] = 1.0
    three["phase"][:] = 0.0
    three["phase"][:, 1:3] = 0.5
    (loads,) = interface_loads(spur, three, [0], NUMBERS)
    assert loads.order.tolist() == [20.0, 40.0]
    assert loads.load[0, 0, 0] == pytest.approx(-(1.0 + np.exp(0.5j) + np.exp(-0.5j)), abs=1e-6)


def test_a_response_of_another_gearbox_is_refused(spur: Gearbox, response: xr.Dataset) -> None:
    other = response.sel(signal=[name for name in response["signal"].to_numpy() if "bearing_2 z" not in name])
    with pytest.raises(ValueError, match="no loads of the bearing bearing_2; compute the response of this gearbox"):
        list(interface_loads(spur, other, [0], NUMBERS))


def test_bearings_between_moving_bodies_load_no_housing(grc: Gearbox) -> None:
    names = {bearing.name for bearing in grc.standing_bearings}
    assert {"hss_a", "hss_bc", "plc_a"} <= names
    assert not any(name.startswith("pl_") for name in names)


def test_the_table_has_a_row_for_each_number(spur: Gearbox, response: xr.Dataset) -> None:
    loads = list(interface_loads(spur, response, [0, 1, 2], NUMBERS))
    rows = list(csv.DictReader(io.StringIO(loads_csv(loads).decode())))
    assert tuple(rows[0]) == COLUMNS
    assert len(rows) == 3 * len(loads[0].order) * 2 * 6
    row = rows[-4]
    assert (row["seat"], row["node"], row["direction"], row["unit"]) == ("bearing_2", "12", "z", "N")
    assert float(row["frequency_Hz"]) == pytest.approx(float(row["order"]) * float(row["speed_rpm"]) / 60.0)
    assert float(row["real"]) == pytest.approx(loads[-1].load[-1, 1, 2].real, rel=1e-8)


STATOR = {"body": "shaft_1", "orders": [6], "z_mm": 20.0, "force_N": [[30.0, 0.0, 4.0]], "torque_N_m": [5.0]}


@pytest.mark.parametrize("seat", ["stator", None])
def test_the_reaction_of_a_stator_acts_at_its_seat_on_a_flexible_housing(tmp_path: Path, seat: str | None) -> None:
    """Opposite to the load on the rotor, about its seat, else about the main seat of the housing."""
    case = box_content(tmp_path)
    case["excitations"] = {"stator": {**STATOR, "reaction_on": "box", "phase_deg": [40.0]}}
    place = np.array([-0.0125, 0.0, -0.012])
    if seat is not None:
        own = {"diameter_mm": 60.0, "inner_diameter_mm": 0.0, "position_mm": (1e3 * place).tolist()}
        case["bodies"]["box"]["solid"]["seats"][seat] = own
    gearbox = Gearbox.from_dict(case, str(tmp_path / "case.toml"))
    assembly = assembled(gearbox, Choice("flexible"), {"spur": 3e8})
    body = assembly.elastic_bodies["box"]
    node = node_numbers(gearbox, "box")["stator"]
    assert body.reduced.seats[node - 1].name == (seat or body.main_seat)
    lever = np.array([0.0, 0.0, 0.02]) - body.reduced.seats[node - 1].position
    settings = SteadySettings(SpeedRange.from_text("600:1200:3"), "linear", at_resonances=False)
    data = with_names(to_dataset(response_of(assembly, settings)))
    (loads,) = interface_loads(gearbox, data, [1], dict.fromkeys(loaded_seats(gearbox, data), node))
    assert loads.seats[-1] == "stator"
    line = int(np.argmin(np.abs(loads.order - 6.0)))
    force = -np.array([30.0, 0.0, 4.0])
    wanted = np.concatenate([force, [0.0, 0.0, -5.0] + np.cross(lever, force)]) * np.exp(1j * np.radians(40.0))
    # The angle of the shaft under its static torque adds to the phase.
    np.testing.assert_allclose(loads.load[line, -1], wanted, rtol=0.0, atol=2e-2)
    np.testing.assert_allclose(np.abs(loads.load[line, -1]), np.abs(wanted), rtol=1e-5, atol=1e-6)
    assert np.abs(np.delete(loads.load[:, -1], line, axis=0)).max() < 1e-9


def wide_cards(text: str) -> list[list[str]]:
    """Cards in fields of 16 columns; each has whole lines of eight fields."""
    cards: list[list[str]] = []
    lines: list[int] = []
    for line in text.splitlines():
        if line.startswith("$"):
            continue
        assert len(line) <= 72, line
        cells = [line[start : start + 16].strip() for start in range(8, 72, 16)]
        if line.startswith("*"):
            cards[-1] += cells
            lines[-1] += 1
        else:
            cards.append([line[:8].strip().rstrip("*"), *cells])
            lines.append(1)
    assert all(count % 2 == 0 for count in lines)
    return cards


def test_nastran_cards_hold_the_forces_over_frequency(spur: Gearbox, response: xr.Dataset) -> None:
    (loads,) = interface_loads(spur, response, [1], NUMBERS)
    cards = wide_cards(nastran_loads(loads).decode())
    tables: dict[str, np.ndarray] = {}
    places: dict[str, tuple[int, int]] = {}
    sources: dict[str, tuple[str, str]] = {}
    for name, *cells in cards:
        if name == "TABLED1":
            end = cells.index("ENDT")
            tables[cells[0]] = np.array([float(cell) for cell in cells[8:end]]).reshape(-1, 2)
        elif name == "DAREA":
            places[cells[0]] = (int(cells[1]), int(cells[2]))
            assert float(cells[3]) == 1.0
        elif name == "RLOAD1":
            assert cells[0] == cells[1]
            sources[cells[0]] = (cells[4], cells[5])
        elif name == "FREQ":
            frequency = np.array([float(cell) for cell in cells[1:] if cell])
        else:
            assert name == "DLOAD"
            combined = [cell for cell in cells[2:] if cell]
    assert frequency == pytest.approx(loads.frequency, rel=1e-9)
    assert combined[1::2] == list(sources)
    assert set(combined[::2]) == {"1.0"}
    for load, (real, imaginary) in sources.items():
        node, direction = places[load]
        wanted = loads.load[:, loads.nodes.index(node), direction - 1]
        assert np.array_equal(tables[real][:, 0], frequency)
        assert tables[real][:, 1] == pytest.approx(wanted.real, rel=1e-9, abs=1e-12)
        assert tables[imaginary][:, 1] == pytest.approx(wanted.imag, rel=1e-9, abs=1e-12)
    moving = {(node, axis) for s, node in enumerate(loads.nodes) for axis in range(6) if loads.load[:, s, axis].any()}
    assert {(node, direction - 1) for node, direction in places.values()} == moving


def test_cards_convert_to_the_units_of_the_model(spur: Gearbox, response: xr.Dataset) -> None:
    """A force of 1 N is 1e-3 kN = kg mm/ms2, a moment of 1 N m is 1 N m there and 1000 N mm in mm, t, s."""
    (loads,) = interface_loads(spur, response, [1], NUMBERS)
    loads = replace(loads, load=np.ones_like(loads.load))  # the spur pair has no moments
    factors = {}
    for units in ("SI", "mm-t-s", "mm-kg-ms"):
        cards = wide_cards(nastran_loads(loads, units).decode())
        factors[units] = {int(cells[2]): float(cells[3]) for name, *cells in cards if name == "DAREA"}
        highest = max(float(cell) for name, *cells in cards if name == "FREQ" for cell in cells[1:] if cell)
        assert highest == pytest.approx(loads.frequency[-1] * (1e-3 if units == "mm-kg-ms" else 1.0))
    assert factors["SI"] == pytest.approx(dict.fromkeys(factors["SI"], 1.0))
    assert set(factors["SI"]) == {1, 2, 3, 4, 5, 6}
    assert factors["mm-t-s"] == pytest.approx({axis: 1.0 if axis < 4 else 1e3 for axis in factors["SI"]})
    assert factors["mm-kg-ms"] == pytest.approx({axis: 1e-3 if axis < 4 else 1.0 for axis in factors["SI"]})


def test_the_command_writes_table_and_cards_and_refuses_other_speeds(tmp_path: Path) -> None:
    case = tmp_path / "case.toml"
    content = SPUR_CASE.replace("[pairs]\nspur = {", "[pairs]\nspur = { stiffness = { mean_N_per_m = 2e8, "
                                "cosine_N_per_m = [2e7] },")  # fmt: skip
    case.write_text(content, encoding="utf-8")
    project = Project.from_toml(case, tmp_path / "results", Choice("bushing"))
    settings = SteadySettings(SpeedRange.from_text("600:1200:3"), at_resonances=False)
    project.steady(settings)
    stored = project.steady_path(settings)
    told = json.loads(exugear("export", case, "--loads", stored, "--speed", "900", "--to", tmp_path, "--json").stdout)
    assert told["speeds_rpm"] == pytest.approx([900.0])
    assert [Path(file).name for file in told["files"]] == [f"{stored.stem}-loads.csv", f"{stored.stem}-loads.bdf"]
    assert told["seats"] == [{"seat": "bearing_1", "node": 1}, {"seat": "bearing_2", "node": 2}]
    assert all(Path(file).is_file() for file in told["files"])

    def refused(*arguments: object) -> Any:
        outcome = CliRunner().invoke(app, ["export", str(case), *map(str, arguments)])
        assert outcome.exit_code == 2
        return " ".join(outcome.stderr.split())

    assert "exists already" in refused("--loads", stored, "--to", tmp_path)
    assert "--speed 700: not computed; the response has 3 speeds, the nearest is 600 rpm" in refused(
        "--loads", stored, "--speed", "700"
    )
    assert "no such file; specify a file that exugear steady has written" in refused("--loads", tmp_path / "none.nc")
