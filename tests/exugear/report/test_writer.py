"""The report of a results folder: one page that needs nothing else, of results that belong to the case."""

from __future__ import annotations

import html
import json
import pickle
import re
import shutil
import tomllib
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import xarray as xr

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.report.findings.context import ReportError
from exugear.report.findings.parameter_variations import begin_variations
from exugear.report.writer import write_report
from exugear.results.folder import bodies_folder, keep_case, modes_path, note_time, read_stored_gearbox, times_spent
from exugear.system.modes import eigenmodes
from exugear.system.signals import energy_residual
from exugear.system.system import input_hash
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness

from ..cases.assembled import assembled, modes_with_bodies, simulated, spur_with_tables
from ..cases.spur import SPUR_CASE

pytestmark = pytest.mark.usefixtures("coarse_tables")

LAW = "line_of_action"


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Table, run-ups and modes of both variants."""
    folder = tmp_path_factory.mktemp("results")
    gearbox, stiffness = spur_with_tables(folder, LAW)
    for variant in ("rigid", "bushing"):
        simulated(gearbox, Choice(variant, load_case="run_up"), stiffness, folder)
        modes_with_bodies(gearbox, Choice(variant, LAW), stiffness).save(
            modes_path(folder, Choice(variant, LAW, "disc"))
        )
    note_time(folder, "a step of the test", 1.5)
    return folder


@pytest.fixture(scope="module")
def gearbox(results) -> Gearbox:
    return read_stored_gearbox(results)


@pytest.mark.validation
def test_the_page_stands_alone_and_names_its_assumptions(results):
    report = write_report(results, target=1000.0)
    page = report.path.read_text(encoding="utf-8")
    assert report.path == results / "report.html"
    # Links lead to places in the page; nothing is loaded from anywhere, and the policy forbids it.
    assert all(
        source.startswith(("#", "data:image/png;")) for source in re.findall(r'(?:src|href)="([^"]{0,30})', page)
    )
    assert "default-src 'none'" in page
    for words in (
        "Resonances",
        "Run-up run_up, mesh stiffness over the mesh cycle, inertia set disc, housing stiffness factor 0.5",
        "no peak of 3 dB prominence on the same order within the resolution",
        "a step of the test",
        "Hann window",
        "overlap 75 %, 0 dB = 1 µm",
        input_hash_of(results, "rigid"),
        "exudyn",
        "three 0.",
    ):
        assert words in page, words
    assert 'role="alert"' not in page
    assert report.left_out == ()


@pytest.mark.validation
def test_cards_and_checks_on_the_page_are_the_sentences_of_the_command_line(results):
    report = write_report(results, target=1000.0)
    page = html.unescape(report.path.read_text(encoding="utf-8"))
    kinds = ("Highest resonance: ", "Run-up run_up: Highest", "Run-up run_up: Effect")
    facts = [line for line in report.statements if line.startswith(kinds)]
    assert len(facts) == 3
    for line in facts[1:]:
        assert line.split(". ", 1)[1] in page
    sentence = facts[0].split(". ")[1]
    assert sentence in page and len(sentence.split()) <= 25
    checks = [line for line in report.statements if line.startswith(("Passed: ", "Warning: "))]
    assert len(checks) >= 4
    for line in checks:
        assert line.split(": ", 1)[1].removesuffix(".") in page


@pytest.mark.validation
def test_an_executor_beside_changes_nothing_on_the_page(results, monkeypatch):
    """What another process works out comes back as it would be here, and can go from one process to another."""
    alone = write_report(results, target=1000.0).path.read_bytes()
    monkeypatch.setattr("exugear.report.writer.WORTH_A_PROCESS", 0)
    carried: list[object] = []

    def begun(*arguments):
        future = begin_variations(*arguments)
        carried.append(future)
        return future

    monkeypatch.setattr("exugear.report.writer.begin_variations", begun)
    with ThreadPoolExecutor(1) as executor:
        beside = write_report(results, target=1000.0, executor=executor).path.read_bytes()
    assert beside == alone
    models = pickle.loads(pickle.dumps(carried[0].result()))
    assert [choice.variant for choice in models] == ["bushing"]
    assert all(not isinstance(figures, str) for figures in models[Choice("bushing", LAW, "disc")].values())


@pytest.mark.validation
def test_flexible_runs_alone_are_reported_with_the_reductions_that_are_kept(results, tmp_path, monkeypatch):
    shutil.copytree(results / "tables", tmp_path / "tables")
    shaft = """
[bodies.shaft_1.shape]
start_z_mm = -20.0
sections = [{ length_mm = 80.0, outer_diameter_mm = 25.0 }]
"""
    content = tomllib.loads(SPUR_CASE + shaft)
    content["bodies"]["shaft_1"]["flexibility"] = "nonrotating"
    content["bearings"]["bearing_1"]["z_mm"] = 40.0
    content["elasticity"] = {"band_Hz": 12e3, "limit_Hz": 30e3}
    gearbox = Gearbox.from_dict(content, str(tmp_path / "spur.toml"))
    keep_case(gearbox, tmp_path)
    kept = bodies_folder(tmp_path)
    stiffness = mesh_stiffness(gearbox, LAW, tmp_path)
    modes = modes_with_bodies(gearbox, Choice("flexible", LAW), stiffness, folder=kept)
    modes.save(modes_path(tmp_path, Choice("flexible", LAW, "disc")))
    simulated(gearbox, Choice("flexible", load_case="run_up"), stiffness, tmp_path, duration=0.2)
    reduction = "exugear.system.bodies.of_gearbox.reduce_shaft"
    monkeypatch.setattr(reduction, lambda model: pytest.fail("reduced again"))
    before = set(kept.iterdir())
    report = write_report(tmp_path, target=1000.0)
    assert report.left_out == ()
    assert set(kept.iterdir()) == before
    page = report.path.read_text(encoding="utf-8")
    assert "Flexible in the variant flexible: shaft_1" in page
    assert "ith flexible bodies" in page
    assert any("shaft_1 itself" in name for name in modes.names)


def input_hash_of(results, variant):
    with xr.open_dataset(results / variant / "run_up-line_of_action-disc" / "run.nc", engine="h5netcdf") as data:
        return data.attrs["input_hash"]


@pytest.mark.validation
def test_resonances_of_the_runs_are_eigenfrequencies(results, gearbox):
    report = write_report(results, target=1000.0)
    stiffness = mesh_stiffness(gearbox, LAW, results)
    rigid = eigenmodes(gearbox, Choice("rigid", LAW), stiffness).frequency[1]
    page = report.path.read_text(encoding="utf-8")
    # The one mode of the rigid variant shows in its run-up and is matched: the panel of a resonance has its frequency.
    found = re.search(r'id="data">(.*?)</script>', page, re.DOTALL)
    assert found
    (group,) = json.loads(found[1])["groups"]
    facts = [dict(map(tuple, own["facts"]))["Mode"] for own in group["variants"]["rigid"]["resonances"]]
    assert any(f" at {rigid:.1f} Hz" in mode for mode in facts)


@pytest.mark.validation
def test_no_mode_near_is_said_in_words(results):
    statements = " ".join(write_report(results, target=9000.0).statements)
    assert "no mode within 5 % of 9000 Hz" in statements
    assert "near 9000 Hz" not in statements


def test_results_of_another_case_are_left_out_by_name(results, gearbox, tmp_path):
    stale = gearbox.varied({"bearings.bearing_1.stiffness.radial_N_per_m": 3e7})
    keep_case(stale, results)
    try:
        report = write_report(results, target=1000.0)
    finally:
        keep_case(gearbox, results)
    # Hashes are of the whole case: both variants' runs and modes belong to another one; the table does not.
    assert sum("another input" in line for line in report.left_out) == 4
    assert "Static transmission error" in report.path.read_text(encoding="utf-8")


def test_a_folder_with_nothing_of_its_case_is_refused(gearbox, tmp_path):
    with pytest.raises(GearboxFileError, match="no results"):
        write_report(tmp_path)
    keep_case(gearbox, tmp_path)
    with pytest.raises(ReportError, match="no such file"):
        write_report(tmp_path)


def test_a_damaged_case_is_one_message(tmp_path):
    (tmp_path / "case.json").write_text('{"source": ', encoding="utf-8")
    with pytest.raises(GearboxFileError, match=r"case\.json: cannot be used"):
        read_stored_gearbox(tmp_path)


def test_times_keep_the_last_of_each_step_and_survive_a_cut_line(tmp_path):
    note_time(tmp_path, "tables", 90.0)
    note_time(tmp_path, "run", 2.0)
    note_time(tmp_path, "tables", 0.1)
    with (tmp_path / "times.jsonl").open("a", encoding="utf-8") as file:
        file.write(json.dumps({"step": "cut"})[:-3])
    assert [(spent.step, spent.seconds) for spent in times_spent(tmp_path)] == [("run", 2.0), ("tables", 0.1)]


def test_the_energy_of_the_runs_is_accounted_for(results):
    for variant in ("rigid", "bushing"):
        path = results / variant / "run_up-line_of_action-disc" / "run.nc"
        with xr.open_dataset(path, engine="h5netcdf") as data:
            assert abs(energy_residual(data)) < 1e-3  # what the power balance asks for


def test_the_hash_tells_load_cases_variants_and_tables_apart(gearbox):

    stiffness = {"spur": np.array([3.0e8, 3.1e8])}
    hashes = {
        input_hash(
            assembled(gearbox, Choice(variant), stiffness if soft else {"spur": np.array([3.0e8, 3.2e8])}), load_case
        )
        for variant in ("rigid", "bushing")
        for soft in (True, False)
        for load_case in (None, "run_up")
    }
    assert len(hashes) == 8
