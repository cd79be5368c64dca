"""Exudyn's textbook way, mesh forces as loads with user functions: the same run as by one element for all meshes."""

from __future__ import annotations

import importlib.util
import json
import os
import signal
from pathlib import Path
from typing import get_args, get_type_hints

import numpy as np
import pytest

from exugear.cli.commands import models
from exugear.gearbox.choice import Choice
from exugear.project import Project
from exugear.results.run_file import load_run
from exugear.transient.exudyn_model import system
from exugear.transient.runup import simulate

from ..cases.command import exugear
from ..cases.table import surfaces

GRC = Path(__file__).parents[3] / "cases" / "grc750"
SIGNALS = ("input_speed", "overall_dte", "mesh_dte", "mesh_force", "support_force", "elastic_energy", "work_of_loads")
ROUND_OFF = 1e-9
"""Both routes take the same RK4 steps with the same forces, added up in another order over hundreds of steps."""
SEVEN_DIGITS = 2e-7
"""Two neighbours among the numbers of single precision, as which signals of meshes and supports are stored."""


def run(case, out, *options):
    return exugear("run", case, "--mesh-model", "iso6336", "--out", out, *options)


def assert_same_run(first, second):
    for name in SIGNALS:
        values, others = first[name].to_numpy(), second[name].to_numpy()
        scale = np.abs(values).max()
        assert scale > 0.0, name
        tolerance = SEVEN_DIGITS if values.dtype == np.float32 else ROUND_OFF
        assert np.abs(others - values).max() < tolerance * scale, name


def test_the_routes_offered_are_those_of_the_library():
    assert get_args(get_type_hints(models.run)["mesh_route"]) == get_args(system.MeshRoute)


@pytest.mark.validation
def test_both_routes_give_the_same_run_and_each_file_says_which_it_was(case, tmp_path):
    runs = {}
    for route in get_args(system.MeshRoute):
        options = ("--variant", "bushing", "--solver", "exudyn", "--mesh-route", route, "--duration", 0.02, "--json")
        outcome = run(case, tmp_path / route, *options)
        assert outcome.exit_code == 0, outcome.stderr
        summary = json.loads(outcome.stdout)
        assert summary["solver"].endswith("meshes as loads") == (route == "loads")
        runs[route] = load_run(summary["file"], SIGNALS)
        assert runs[route].attrs["mesh_route"] == route
    assert_same_run(*runs.values())


@pytest.mark.validation
@pytest.mark.parametrize("law", ["tangential", pytest.param("table", marks=pytest.mark.long)])
def test_both_routes_give_the_same_run_of_a_whole_gearbox(grc, stiffness, tmp_path, law):
    """By the law whose force is not along its deflection, and by that which knows how gears stand."""
    data = surfaces(grc) if law == "table" else stiffness
    choice, options = Choice("bushing", law), {"duration": 0.002, "solver": "exudyn"}
    runs = [
        simulate(grc, choice, data, tmp_path / route, mesh_route=route, **options) for route in ("element", "loads")
    ]
    assert_same_run(*(load_run(run.path, SIGNALS) for run in runs))


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--variant", "bushing"], "exist in Exudyn only, not in the solver compiled; add --solver exudyn"),
        (["--variant", "rigid", "--solver", "exudyn"], "the variant rigid has rotations only"),
        (
            ["--variant", "rigid", "--mesh-model", "kinematic", "--solver", "exudyn"],
            "the variant rigid has rotations only",
        ),
        (["--variant", "bushing", "--solver", "exudyn", "--mesh-route", "springs"], "'element', 'loads'"),
    ],
)
def test_loads_where_none_can_act_are_refused_before_anything_is_written(case, tmp_path, options, said):
    outcome = run(case, tmp_path / "out", "--mesh-route", "loads", *options)
    assert outcome.exit_code == 2
    assert outcome.stdout == ""
    assert said in " ".join(outcome.stderr.split())
    assert not (tmp_path / "out").exists()


def test_elastic_bodies_are_refused(tmp_path):
    options = ("--variant", "flexible", "--solver", "exudyn", "--mesh-route", "loads")
    outcome = run(GRC / "gearbox.toml", tmp_path / "out", *options)
    assert outcome.exit_code == 2
    assert "the variant flexible has flexible bodies; use --variant bushing" in " ".join(outcome.stderr.split())
    assert not (tmp_path / "out").exists()


@pytest.mark.usefixtures("terminal_signals")
def test_a_stopped_run_does_not_go_on_by_the_other_route(case, tmp_path):
    project = Project.from_toml(case, tmp_path, Choice("bushing", "iso6336"))
    stopped = project.run(duration=2.0, progress=lambda at: os.kill(os.getpid(), signal.SIGINT))
    assert not stopped.complete
    options = ("--variant", "bushing", "--duration", 2.0, "--solver", "exudyn", "--mesh-route", "loads", "--resume")
    outcome = run(case, tmp_path, *options)
    assert outcome.exit_code == 1
    assert ": was run with mesh_route = element, not loads; run it again without --resume" in " ".join(
        outcome.stderr.split()
    )


@pytest.mark.validation
def test_the_example_of_the_grc_finds_round_off_only(tmp_path):
    spec = importlib.util.spec_from_file_location("grc750_textbook_loads", GRC / "textbook_loads.py")
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    differences = example.main(tmp_path, duration=0.002)
    assert set(differences) == set(example.SIGNALS)
    assert max(differences.values()) < SEVEN_DIGITS
