"""Tables of commands fit 79 columns with whole numbers and headings, whatever the gearbox; help fits 40 lines."""

from __future__ import annotations

import io
import json
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import typer
import xarray as xr
from rich.console import Console

from exugear.cli import rating_tables, resonances, tables
from exugear.cli.app import app
from exugear.cli.tasks import bearings, check, life, loads, modes, report, ste
from exugear.cli.tasks import study as study_task
from exugear.gearbox.gearbox import Gearbox
from exugear.life.rating.sheet import FINITE_ELEMENTS, FlankSheet, RatingSheet
from exugear.report.findings.ranking import PeakAmplitude, Ranking, Resonance
from exugear.report.writer import Report
from tests.exugear.cases.command import exugear

CASE = Path(__file__).parents[3] / "cases" / "grc750" / "gearbox.toml"
COLUMNS = 79
LINES = 40
NAMES = [f"{stem}{n}".ljust(24, "x") for n, stem in enumerate(9 * ["intermediate_stage_"], start=1)]
"""Nine names of 24 characters."""
LONG = NAMES[0]
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

    print_table = tables.print_table

    def spy(table: tables.Table) -> None:
        found.rows.append([{column.heading: column.cell(row) for column in table.columns} for row in table.rows])
        print_table(table)

    monkeypatch.setattr(tables, "print_table", spy)
    yield found


def show(*shown: tables.Table, whole: bool = True, verdict: str = "Verdict") -> None:
    """Print tables as a command does."""
    tables.Outcome(verdict, {}, shown).show(as_json=False, whole=whole)


def test_check(printed: Printed) -> None:
    large = 3 * [-123456.789]
    force = {"force": LONG, "body": NAMES[1], "z_mm": -1234.56, "force_N": large, "moment_N_m": large}
    pairs = [
        {
            "pair": name,
            "teeth": [123, 1234],
            "centre_distance_mm": 12345.678,
            "pressure_angle_deg": 25.1234,
            "transverse_contact_ratio": 1.543,
            "overlap_ratio": 10.691,
            "torque_gear_1_N_m": -1234567.8,
            "sigma_H0_MPa": 1234.0,
            "margin_to_form_diameter": [0.123, None],
            "tip_thickness_in_modules": [0.57, 0.75],
            "held_diameter_mm": [120.0, 1180.0],
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
    summary = {"name": LONG, "ratio": -0.00123456, "pairs": pairs, "tooth_thickness": thicknesses, "forces": [force]}
    show(*check.check_tables(LONG, {**summary, "load_cases": cases, "bearings": supports}))
    printed.check(5)
    known = {"variants": {"flexible": " ".join(NAMES)}, "steady": {}, "life": {"life": []}}
    tables.Outcome("", {}, remarks=check.availability(known)).show(as_json=False, whole=True)
    assert max(map(len, printed.lines)) <= COLUMNS


def test_check_rating(printed: Printed) -> None:
    values = {name: 123456.789 for block in rating_tables._BLOCKS.values() for name in block}
    flanks = tuple(
        FlankSheet(gear, LONG, sign, 0, values, dict.fromkeys(FINITE_ELEMENTS, 1234.5), {}, ())
        for gear in NAMES[:3]
        for sign in "+-"
    )
    sheet = RatingSheet("ISO 6336:2006", " ".join(NAMES), flanks, (), (), ())
    show(*rating_tables.rating_outcome(sheet, "gearbox.toml", LONG).tables)
    printed.check(2)


def test_ste(printed: Printed) -> None:
    summaries = [
        {
            "pair": name,
            "torque_gear_1_N_m": -1234567.8,
            "ste_mean_um": 123.45,
            "ste_peak_to_peak_um": 12.345,
            "mesh_stiffness_mean_N_per_m": 12345.6e6,
            "contact_stress_MPa": 12345.0,
            "superelement_contact_stress_MPa": 12345.0,
            "sigma_H0_MPa": 1234.0,
            "K_Hbeta_aligned": 12.34,
            "sigma_H_aligned_MPa": 12345.0,
            "ste_peak_to_peak_error_um": 12.345,
            "ste_harmonics_um": [123.456] * 4,
            "superelement_mean_um": 123.45,
            "superelement_peak_to_peak_um": 12.345,
            "difference_of_means_percent": -12.3,
            "states": 1200,
            "not_converged": 12,
        }
        for name in NAMES
    ]
    show(
        tables.Table("Static transmission error", summaries, ste.TABLES, ste.LEGEND, ste.DETAILS),
        tables.Table("Reference", summaries, ste.REFERENCES, ste.REFERENCE_LEGEND),
    )
    printed.check(2)


def test_bearings(printed: Printed) -> None:
    duty: dict[str, Any] = {
        "radial_load_kN": 12345.6789,
        "axial_load_kN": -12345.6789,
        "radial_stiffness_N_per_m": 12.34e9,
        "axial_stiffness_N_per_m": 1e9,
        "tilt_stiffness_N_m_per_rad": 1e9,
        "misalignment_mrad": 12.3456,
        "most_loaded_element_kN": 1234.5678,
        "contact_pressure_MPa": 12345.0,
        "dynamic_rating_kN": 12345.678,
        "static_rating_kN": 12345.678,
        "ratings_estimated": True,
        "ratings_of_makers": ["A", "B"],
        "L10_Mrev": 1.2345e11,
        "L10r_Mrev": 1.2345e-11,
    }
    mesh = {
        "force_kN": -12345.6789,
        "misalignment_mrad": -12.3456,
        "opening_um": -1234.5,
        "load_centroid_mm": -123.4,
        "K_Hbeta": 12.34,
        "sigma_H_misaligned_MPa": 12345.0,
    }
    duties = [{**duty, "bearing": name} for name in NAMES]
    meshes = [{**mesh, "mesh": name} for name in NAMES]
    show(*bearings.bearing_tables({"variant": "bushing", "bearings": duties, "meshes": meshes}))
    printed.check(2)


def test_steady(printed: Printed) -> None:
    loudness = {
        "error": PeakAmplitude(123.456e-6, "", 1234),
        "force": PeakAmplitude(12345.6, NAMES[1], 2345),
        "acceleration": PeakAmplitude(1234.5, NAMES[1], 3456),
    }
    lines = [f"12 x {name} - 3 x {NAMES[0]} + 2 x {NAMES[1]}" for name in NAMES]
    found = tuple(Resonance(line, 123.456, -1234.5678, 12345.678, loudness) for line in lines)
    ranking = Ranking(found, (0.1, 1234.5), False, "shafts and housing", quantity="force")
    gearbox = Gearbox.from_toml(CASE)
    for whole in (False, True):
        show(resonances.resonance_table(gearbox, ranking, "bushing"), whole=whole)
    printed.check(2)
    assert "3456" in "\n".join(printed.lines)
    assert "about -z" in "\n".join(printed.lines)


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
    summary = {"variant": "bushing", "mesh_model": "line_of_action", "inertias": LONG, "modes": rows}
    for whole in (False, True):
        show(modes.mode_table(summary, whole))
    printed.check(2)


def test_modes_that_participate_by_round_off_are_in_the_order_of_frequencies() -> None:
    shares = {1: (0.0, 1e-20), 2: (100.0, 1e-31), 3: (200.0, 1.0), 4: (300.0, 1e-17)}
    rows = [
        {"mode": mode, "frequency_Hz": frequency, "te_participation": share, "name": ""}
        for mode, (frequency, share) in shares.items()
    ]
    summary = {"variant": "bushing", "mesh_model": "line_of_action", "inertias": "discs", "modes": rows}
    assert [row["mode"] for row in modes.mode_table(summary, whole=False).rows] == [3, 2, 4, 1]


def test_life(printed: Printed) -> None:
    flanks = [f"{NAMES[0]} + {name}" for name in NAMES]
    flank = dict.fromkeys(("outside", "face_load", "contact_safety", "root_safety"), 123.456)
    flank |= dict.fromkeys(("standard_contact_safety", "standard_root_safety"), 123.456)
    flank |= dict.fromkeys(("contact_static", "root_static"), 123.456)
    flank |= dict.fromkeys(("contact_stress", "nominal_contact", "root_stress", "nominal_root", "compression"), -1234e6)
    flank |= dict.fromkeys(("contact_damage", "root_damage"), 1.234e-131)
    bearing: dict[str, Any] = dict.fromkeys(("largest_load", "equivalent"), 12345678.9)
    bearing |= dict.fromkeys(("basic_hours", "reference_hours"), 1.234e12) | {"modified_hours": "infinite"}
    bearing |= {"viscosity_ratio": 1.23, "pressure": 12345e6, "static_safety": 1234.56}
    summary = {
        "flanks": [{**flank, "flank": label, "contact_holder": LONG, "root_holder": LONG} for label in flanks],
        "bearings": [{**bearing, "bearing": name} for name in NAMES],
        "limits": [{"part": name, "by": "L10r", "damage": 2.0} for name in NAMES],
        **dict.fromkeys(("failures", "assumptions", "unrated", "reliefs"), ()),
        "remarks": {LONG: ["load below the usual minimum load"]},
    }
    show(*life.life_tables(summary))
    assert "inf." in "\n".join(printed.lines)
    assert ">1e9" in "\n".join(printed.lines)
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
    slopes = {f"{m:.4g}": 123.4567 for m in np.linspace(3.0, 12.0, 12)}
    summary = {"body": LONG, "life_years": 20.0, "hours": 175320.0, "revolutions": 1.234e12, "sources": [source]}
    summary |= {"equivalent_torque_kN_m": slopes, "equivalent_range_1_Hz_kN_m": slopes}
    hub = {"moment_y_kN_m": slopes}
    show(*loads.load_tables({**summary, "hub_equivalent_range_1_Hz": hub, "parts": parts}, 1234))
    printed.check(4)


def test_report(printed: Printed, tmp_path: Any) -> None:
    step = f"comparison with Exudyn, flexible, {', '.join(NAMES)}"
    (tmp_path / "times.jsonl").write_text(json.dumps({"step": step, "seconds": 123456.7, "memory": 1.234e11}) + "\n")
    written = Report(tmp_path.relative_to(tmp_path), (), (), (), (), Gearbox.from_toml(CASE))
    report._outcome(tmp_path, written, None).show(as_json=False, whole=True)
    printed.check(1)


def test_study(printed: Printed, monkeypatch: pytest.MonkeyPatch) -> None:
    dataset = xr.Dataset(
        {name: ("evaluation", np.full(1300, -1.2345e-123)) for name in NAMES}
        | {"on_front": ("evaluation", np.ones(1300, dtype=int))}
    )
    study: Any = SimpleNamespace(file=SimpleNamespace(parameters=NAMES[2:]), tolerances=None)
    monkeypatch.setattr(study_task, "_judged", lambda _: NAMES[:2])
    show(
        tables.Table("Sensitivity", [(NAMES[1], LONG, -1.23456)], study_task.SLOPES),
        study_task._front(study, dataset),
    )
    printed.check(2)


def test_points_of_a_study(printed: Printed) -> None:
    values = np.full(12, -1.2345e-123)
    data = xr.Dataset(dict.fromkeys((*NAMES, "seconds"), ("seat", values)), {"seat": ("seat", np.arange(12.0))})
    table = study_task.point_table(data, ["seat"], ["seat"], NAMES)
    show(table, whole=False)
    assert len(printed.rows[0]) == tables.SHOWN_ROWS and len(printed.rows[0][0]) == study_task.SHOWN_COLUMNS
    assert printed.lines[-1] == "2 more points, 4 more columns: --all"
    show(table)
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
    show(tables.Table("Title", rows, [tables.Column(key, key, is_text=key == "c") for key in rows[0]]))
    printed.check(1)
    assert tables.wrapped(LONG, 12) == ["intermediate", "_stage_1xxxx"]


def test_a_column_converts_units_and_names_unknown_and_infinite_values(printed: Printed) -> None:
    columns = (
        tables.Column("part", "part"),
        tables.Column("load\nkN", "load_N", ".2f", 1e-3),
        tables.Column("life\nh", lambda row: row["turns"] / 60.0, ".4g", missing="none"),
    )
    rows = [
        {"part": "a", "load_N": 12345.6, "turns": float("inf")},
        {"part": "b", "load_N": None, "turns": float("nan")},
    ]
    show(tables.Table("Title", rows, columns))
    assert printed.rows == [
        [{"part": "a", "load\nkN": "12.35", "life\nh": "inf."}, {"part": "b", "load\nkN": "-", "life\nh": "none"}]
    ]


@pytest.mark.parametrize("form", [".4g", "g", ".0f", tables.significant])
def test_round_off_is_printed_as_zero(form: Any) -> None:
    """A load of 4e-12 kN, a transmission error of -7e-13 um: no digit of them has a meaning."""
    for value in (4e-12, -7e-13, -0.0):
        assert float(tables.Column("load", "load", form).cell({"load": value})) == 0.0
        assert not tables.Column("load", "load", form).cell({"load": value}).startswith("-")
    assert tables.Column("load\nkN", "load", ".4g", 1e-3).cell({"load": 4e-9}) == "0"
    assert tables.Column("gap", "gap", ".0f").cell({"gap": -0.2}) == "0"
    assert tables.Column("gap", "gap", ".2g").cell({"gap": 2.5e-8}) == "2.5e-08"
