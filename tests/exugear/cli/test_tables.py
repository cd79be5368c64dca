"""Tables of commands fit 79 columns with whole numbers and headings, whatever the gearbox; help fits 40 lines."""

from __future__ import annotations

import io
import json
import re
from collections.abc import Iterator, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import typer
import xarray as xr
from rich.console import Console

from exugear.cli import rating_tables, tables
from exugear.cli.app import app
from exugear.cli.commands import bearings, life, loads, modes, report, ste, steady
from exugear.cli.commands import study as study_command
from exugear.cli.file_commands import check
from exugear.gearbox.sections.case import DampingSection
from exugear.gearbox.variant import Variant
from exugear.life.rating.sheet import FINITE_ELEMENTS, FlankSheet, RatingSheet
from exugear.report.findings.ranking import PeakAmplitude, Ranking, Resonance
from exugear.report.writer import Report
from exugear.system.bearings.duty import Ratings
from tests.exugear.cases.command import exugear

COLUMNS = 79
LINES = 40
NAMES = [f"{stem}{n}".ljust(24, "x") for n, stem in enumerate(9 * ["intermediate_stage_"], start=1)]
"""Nine names of 24 characters."""
LONG = NAMES[0]
MODULES = (check, rating_tables, bearings, life, loads, modes, report, ste, steady, study_command)
WHOLE = re.compile(r"^\d[\d.]*$")


class Printed:
    """What was printed: tables by their rows, and the text of all."""

    def __init__(self) -> None:
        self.rows: list[Sequence[Any]] = []
        self.stream = io.StringIO()

    @property
    def lines(self) -> list[str]:
        """All lines."""
        return self.stream.getvalue().splitlines()

    def check(self, count: int) -> None:
        """Fail where a line is too long, or a heading or a number is not whole."""
        text = self.stream.getvalue()
        assert len(self.rows) == count
        assert max(map(len, self.lines)) <= COLUMNS, max(self.lines, key=len)
        assert "…" not in text
        words = re.split(r"\s{2,}|\n|(?<=\d)\*| \(", text)
        for rows in self.rows:
            for heading in rows[0]:
                for line in heading.strip().split("\n"):
                    assert line.strip() in text
            for number in (value for row in rows for value in row.values() if WHOLE.match(value)):
                assert any(number in word for word in words), number


@pytest.fixture
def printed(monkeypatch: pytest.MonkeyPatch) -> Iterator[Printed]:
    """Collect what tables print on a console of 80 columns."""
    found = Printed()
    console = Console(width=80, file=found.stream)
    monkeypatch.setattr(tables, "results", console)
    monkeypatch.setattr("exugear.cli.console.results", console)

    def spy(title: str, rows: Sequence[Any], *more: Any, **named: Any) -> None:
        found.rows.append(rows)
        tables.print_table(title, rows, *more, **named)

    for module in MODULES:
        monkeypatch.setattr(module, "print_table", spy)
    yield found


def test_check(printed: Printed) -> None:
    force = SimpleNamespace(name=LONG, body=NAMES[1], position=(0.0, 0.0, -1.23456), wrench=6 * [-123456.789])
    case = SimpleNamespace(overall=SimpleNamespace(input=LONG))
    gearbox: Any = SimpleNamespace(name=LONG, train=SimpleNamespace(ratio=-0.00123456), forces=[force], case=case)
    pairs = [
        {
            "pair": name,
            "teeth": [123, 1234],
            "centre_distance_mm": 12345.678,
            "pressure_angle_deg": 25.1234,
            "transverse_contact_ratio": 1.543,
            "overlap_ratio": 10.691,
            "torque_gear_1_N_m": -1234567.8,
            "pitch_point_pressure_MPa": 1234.0,
            "margin_to_form_diameter": [0.123, None],
            "tip_thickness_in_modules": [0.57, 0.75],
            "backlash_um": [1012.0, 1134.0, 1245.0],
        }
        for name in NAMES
    ]
    thicknesses = [
        {
            "gear": name,
            "normal_tooth_thickness_mm": [12.345, 23.456],
            "span_teeth": 12,
            "base_tangent_length_mm": [1234.567, 1234.678],
            "span_doubt": None,
        }
        for name in NAMES
    ]
    cases = [
        {
            "load_case": name,
            "net_torque_N_m": -12345678.9,
            "driven": True,
            "end_speed_rpm": -1234.5,
            "highest_mesh_frequency_Hz": 12345.6,
            "band_Hz": 6400.0,
            "fastest_rim_m_per_s": 123.4,
            "loaded_flanks": dict.fromkeys(NAMES, "+"),
            "reversed_flanks": NAMES[:2],
        }
        for name in NAMES[:2]
    ]
    supports = [
        {
            "bearing": name,
            "radial_load_kN": 12345.678,
            "reaction_kN": 2345.678,
            "axial_load_kN": -12345.6,
            "radial_stiffness_N_per_m": 12.345e9,
            "estimated": {"contact_angle_deg": {"radial_stiffness_N_per_m": [10.123e9, 14.321e9]}},
        }
        for name in NAMES
    ]
    check._print_check(gearbox, pairs, thicknesses, cases, supports)
    printed.check(6)
    check._print_availability({"flexible": " ".join(NAMES)}, {}, {"life": []})
    assert max(map(len, printed.lines)) <= COLUMNS


def test_check_rating(printed: Printed) -> None:
    values = {name: 123456.789 for block in rating_tables._BLOCKS.values() for name in block}
    flanks = tuple(
        FlankSheet(gear, LONG, sign, 0, values, dict.fromkeys(FINITE_ELEMENTS, 1234.5), {}, ())
        for gear in NAMES[:3]
        for sign in "+-"
    )
    rating_tables.print_rating(RatingSheet("ISO 6336:2006", " ".join(NAMES), flanks, (), (), ()))
    printed.check(1)


def test_ste(printed: Printed) -> None:
    summaries = [
        {
            "pair": name,
            "torque_gear_1_N_m": -1234567.8,
            "ste_mean_um": 123.45,
            "ste_peak_to_peak_um": 12.345,
            "mesh_stiffness_mean_N_per_m": 12345.6e6,
            "max_pressure_MPa": 12345.0,
            "contact_stress_MPa": 12345.0,
            "superelement_contact_stress_MPa": 12345.0,
            "pitch_point_pressure_MPa": 1234.0,
            "superelement_mean_um": 123.45,
            "superelement_peak_to_peak_um": 12.345,
            "difference_of_means_percent": -12.3,
            "states": 1200,
            "not_converged": 12,
        }
        for name in NAMES
    ]
    ste.print_table("Static transmission error", [*map(ste._ste_row, summaries)], legend=ste.TABLE_LEGEND)
    ste.print_table("Reference", [*map(ste._reference_row, summaries)], legend=ste.REFERENCE_LEGEND)
    printed.check(2)


def test_bearings(printed: Printed) -> None:
    duties: list[Any] = [
        SimpleNamespace(
            name=name,
            radial_load=12345678.9,
            axial_load=-12345678.9,
            radial_stiffness=12.34e9,
            stiffness=1e9 * np.eye(6),
            misalignment=12.3456e-3,
            element_load=1234567.8,
            pressure=12345e6,
            ratings=Ratings(12345678.0, 12345678.0, True, ("A", "B")),
            basic_life=1.2345e11,
            reference_life=1.2345e-11,
        )
        for name in NAMES
    ]
    meshes: list[Any] = [
        SimpleNamespace(
            name=name,
            force=-12345678.9,
            misalignment=-12.3456e-3,
            opening=-1234.5e-6,
            load_centroid=-123.4e-3,
            face_load_factor=12.34,
            pressure=12345e6,
        )
        for name in NAMES
    ]
    bearings._print_bearings(duties, meshes, Variant.bushing)
    printed.check(3)


def test_steady(printed: Printed) -> None:
    loudness = {
        "error": PeakAmplitude(123.456e-6, "", 1234),
        "force": PeakAmplitude(12345.6, NAMES[1], 2345),
        "acceleration": PeakAmplitude(1234.5, NAMES[1], 3456),
    }
    lines = [f"12 x {name} - 3 x {NAMES[0]} + 2 x {NAMES[1]}" for name in NAMES]
    resonances = tuple(Resonance(line, 123.456, -1234.5678, 12345.678, loudness) for line in lines)
    ranking = Ranking(resonances, (0.1, 300.0), True, "shafts and housing")
    steady.print_table("Resonances", [*map(steady._row, resonances)], ("bearing",), steady._legend(ranking))
    printed.check(1)
    assert "(3456)" in "\n".join(printed.lines)


def test_modes(printed: Printed) -> None:
    name = f"{NAMES[0]} torsion 61 %, {NAMES[1]} radial 16 %; strain energy: {NAMES[2]} itself 62 %"
    rows = [
        {
            "mode": 1234,
            "frequency_Hz": 12345.67,
            "damping_ratio": 0.12345,
            "te_participation": 1.0,
            "amplification": 1234.5,
            "name": name,
        },
        {
            "mode": 1,
            "frequency_Hz": 0.0,
            "damping_ratio": 0.0,
            "te_participation": 0.0,
            "amplification": 0.0,
            "name": "rigid-body rotation",
        },
    ]
    assembly = SimpleNamespace(variant="bushing", mesh_model="line_of_action", inertias=LONG, housing_factor=0.5)
    assembly.gearbox = SimpleNamespace(case=SimpleNamespace(damping=DampingSection()))
    found: Any = SimpleNamespace(assembly=assembly)
    modes._print_modes(found, rows)
    printed.check(1)


def test_life(printed: Printed) -> None:
    flanks = [f"{NAMES[0]} + {name}" for name in NAMES]
    keys = [
        *("contact_stress", "nominal_contact", "outside", "face_load", "contact_damage", "contact_safety"),
        *("standard_contact_safety", "root_stress", "nominal_root", "compression", "root_damage", "root_safety"),
        *("standard_root_safety", "contact_static", "root_static"),
    ]
    variables: dict[str, Any] = {f"flank_{key}": ("flank", np.full(9, 123.456)) for key in keys}
    for key in ("contact_stress", "nominal_contact", "root_stress", "nominal_root", "compression"):
        variables[f"flank_{key}"] = ("flank", np.full(9, -1234e6))
    for key in ("contact_damage", "root_damage"):
        variables[f"flank_{key}"] = ("flank", np.full(9, 1.234e-131))
    for key in ("contact_holder", "root_holder"):
        variables[f"flank_{key}"] = ("flank", np.array(NAMES, dtype=object))
    for key in ("largest_load", "equivalent"):
        variables[f"bearing_{key}"] = ("bearing", np.full(9, 12345678.9))
    for key in ("basic_hours", "reference_hours", "modified_hours"):
        variables[f"bearing_{key}"] = ("bearing", np.full(9, 1.234e12))
    for key, value in {"viscosity_ratio": 1.23, "pressure": 12345e6, "static_safety": 1234.56}.items():
        variables[f"bearing_{key}"] = ("bearing", np.full(9, value))
    variables |= {"bearing_damage": ("bearing", np.full(9, 2.0)), "bearing_reference_damage": ("bearing", np.ones(9))}
    lists = dict.fromkeys(("failures", "assumptions", "unrated", "reliefs"), json.dumps([]))
    data = xr.Dataset(variables, {"flank": flanks, "bearing": NAMES}, lists | {"life_years": 20.0})
    life._print_result(data)
    printed.check(4)


def test_loads(printed: Printed) -> None:
    source = {
        "source": LONG,
        "kind": "fatigue",
        "skipped_s": 1234.5,
        "files": 1234,
        "hours": 147136.0,
        "mean_torque_kN_m": -1234.5,
        "least_torque_kN_m": -12345.6,
        "largest_torque_kN_m": 12345.6,
        "mean_speed_rpm": -1234.5,
    }
    parts = [{"part": f"{LONG}, flank +", "loaded_by": name, "cycles": 1.234e12, "force_kN": 1234.5} for name in NAMES]
    slopes = dict.fromkeys(np.linspace(3.0, 12.0, 12).tolist(), 123456.7)
    counted: Any = SimpleNamespace(
        body=LONG,
        equivalents=lambda: slopes,
        equivalent_ranges={"torque": slopes, "moment_around_the_y_axis": slopes},
        distribution=SimpleNamespace(hours=np.ones(1234), revolutions=1e9 * np.ones(1234)),
        part_rows=lambda: parts,
    )
    loads.print_table("Load sources", [loads._source_row(source)], ("kind",))
    loads.print_table("Equivalent", loads._equivalent_rows(counted), legend=loads._equivalent_legend(counted))
    loads.print_table("Hub", [loads._hub_row(*item) for item in counted.equivalent_ranges.items()])
    loads.print_table("Parts", loads._part_rows(counted), ("mesh",))
    printed.check(4)


def test_report(printed: Printed, tmp_path: Any) -> None:
    step = f"comparison with Exudyn, flexible, {', '.join(NAMES)}"
    (tmp_path / "times.jsonl").write_text(json.dumps({"step": step, "seconds": 123456.7, "memory": 1.234e11}) + "\n")
    report._print_report(tmp_path, Report(tmp_path.relative_to(tmp_path), (), (), (), ()), None, False)
    printed.check(1)


def test_study(printed: Printed, monkeypatch: pytest.MonkeyPatch) -> None:
    rows = [{"parameter": LONG, "result": NAMES[1], "change per\nstep %": "-123.456"}]
    study_command.print_table("Sensitivity", rows, ("result",))
    dataset = xr.Dataset(
        {name: ("evaluation", np.full(1300, -1.2345e-123)) for name in NAMES}
        | {"on_front": ("evaluation", np.ones(1300, dtype=int))}
    )
    study: Any = SimpleNamespace(file=SimpleNamespace(parameters=NAMES[2:]), tolerances=None)
    monkeypatch.setattr(study_command, "_judged", lambda _: NAMES[:2])
    study_command._print_front(study, dataset)
    printed.check(2)


@pytest.mark.parametrize("command", sorted(typer.main.get_command(app).commands))  # type: ignore[attr-defined]
def test_the_help_of_a_command_fits_a_screen(command: str) -> None:
    lines = exugear(command, "--help", COLUMNS="80").stdout.splitlines()
    assert len(lines) <= LINES
    assert max(map(len, lines)) <= 80
    assert "…" not in "".join(lines)


def test_the_list_of_commands_is_not_cut() -> None:
    assert "..." not in exugear("--help", COLUMNS="80").stdout.split("Commands:")[1]


def test_names_are_wrapped_and_numbers_are_not(printed: Printed) -> None:
    rows = [{"a": LONG, "b\nmm": "1234.5", "c": f"{LONG} and more of {LONG}"}]
    tables.print_table("Title", rows, ("c",))
    printed.rows.append(rows)
    printed.check(1)
    assert tables.wrapped(LONG, 12) == ["intermediate", "_stage_1xxxx"]
