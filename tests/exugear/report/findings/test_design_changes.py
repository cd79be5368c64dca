"""Design changes: geometry that keeps the centre distance, effects on a peak and on the range, refusals, reuse."""

from __future__ import annotations

import json
import math
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.templates.kinds import template
from exugear.gearbox.units import RPM
from exugear.project import Project
from exugear.report import design_study
from exugear.report.design_study import relief_tolerance
from exugear.report.findings.context import OTHER_INPUT
from exugear.report.findings.design_changes import (
    LEAST_DB,
    ChangeResult,
    DesignStudy,
    Effect,
    effects_of,
    multiples_of,
    objection_to,
    ordered,
    peaks_of,
    price_of,
    read_design_study,
)
from exugear.report.findings.margins import margins_in_words, margins_of, shortfalls_of
from exugear.report.findings.proposals import DesignChange, helix_change, propose_changes
from exugear.report.findings.ranking import ranking_of
from exugear.report.findings.words import rounded_text
from exugear.results.folder import DESIGN_CHANGES_FILE, read_stored_gearbox
from exugear.steady.settings import SpeedRange, SteadySettings
from exugear.system.tooth_mesh import tables
from fe_ste.tools.files import FileError

from ...cases.spur import COARSE_INPUT, SPUR_CASE


@pytest.mark.parametrize(
    ("pair", "degrees"), [("intermediate", 17.4), ("high_speed", 16.4), ("sun_planet", 8.2), ("ring_planet", 8.2)]
)
def test_another_helix_angle_keeps_centre_distance_and_backlash(grc: Gearbox, pair: str, degrees: float) -> None:
    """All gears of the planetary stage turn together; transverse sections keep their module."""
    changed = grc.varied(helix_change(grc, pair, math.radians(degrees)))
    assert abs(changed.gear_pairs[pair].pinion.helix_angle) == pytest.approx(math.radians(degrees), rel=1e-12)
    for name, before in grc.gear_pairs.items():
        after = changed.gear_pairs[name]
        assert after.centre_distance == before.centre_distance
        assert after.circumferential_backlash == pytest.approx(before.circumferential_backlash, rel=1e-3)
        assert after.pinion.reference_radius == pytest.approx(before.pinion.reference_radius, rel=1e-12)


def proposals(gearbox: Gearbox, families: list[str], multiple: int = 1) -> dict[str, DesignChange]:
    multiples = dict.fromkeys(families, multiple)
    found = propose_changes(gearbox, multiples, {"intermediate": 30e-6}, ["hss_bc", "ims_a"])
    return {change.name: change for change in found}


def test_the_overlap_ratio_goes_to_the_whole_numbers_around_it_within_limits(grc: Gearbox) -> None:
    """It is 1.59: a whole number by the helix angle, and by the face width only with more than 20 % of change."""
    found = proposals(grc, ["intermediate"])
    for target in (1, 2):
        change = found[f"intermediate-helix-angle-{target}"]
        changed = grc.varied(change.keys)
        assert changed.gear_pairs["intermediate"].overlap_ratio == pytest.approx(target, rel=5e-3)
        assert f"overlap ratio {target}" in change.words
        refused = found[f"intermediate-face-width-{target}"]
        assert not refused.keys and "more than 20 %" in refused.reason
    assert found["intermediate-tip-relief-15"].keys["gears.im_gear.modification.tip_relief_um"] == 15.0
    assert found["intermediate-crowning-30"].keys == {"gears.im_pinion.modification.lead_crowning_um": 30.0}
    angle = grc.case.bearings["hss_bc"].catalogue.contact_angle_deg
    for other in (angle - 5.0, angle + 5.0):
        assert found[f"hss_bc-contact-angle-{other:g}"].keys == {"bearings.hss_bc.catalogue.contact_angle_deg": other}
    assert found["hss_bc-preload-20"].group == "bearing"
    assert not found["ims_a-none"].keys and "cylindrical roller bearing without" in found["ims_a-none"].reason
    assert found["housing-0.15"].group == found["housing-0.6"].group == "assumption"
    for change in found.values():
        grc.varied(change.keys)


def test_relief_and_crowning_are_reduced_where_gears_have_them_down_to_none(grc: Gearbox) -> None:
    """Deflections of 30 µm give steps of 15 and 30 µm; with 20 µm, the second step would repeat the first."""
    keys = {
        f"gears.{gear}.modification.tip_relief_um": value for gear, value in (("im_pinion", 40.0), ("im_gear", 8.0))
    }
    keys |= {f"gears.{gear}.modification.tip_relief_length_mm": 3.0 for gear in ("im_pinion", "im_gear")}
    relieved = grc.varied(keys | {"gears.im_pinion.modification.lead_crowning_um": 12.0})
    less = {name: change.keys for name, change in proposals(relieved, ["intermediate"]).items() if "-less-" in name}
    assert list(less) == [
        *(f"intermediate-less-tip-relief-{amount}" for amount in (15, 30)),
        "intermediate-less-crowning-15",
    ]
    assert [
        less["intermediate-less-tip-relief-15"][f"gears.{gear}.modification.tip_relief_um"]
        for gear in ("im_pinion", "im_gear")
    ] == [25.0, 0.0]
    assert less["intermediate-less-crowning-15"] == {"gears.im_pinion.modification.lead_crowning_um": 0.0}
    assert not [name for name in proposals(grc, ["intermediate"]) if "-less-" in name]


@pytest.mark.parametrize("mesh", ["sun_planet", "ring_planet"])
def test_other_phases_of_planets_keep_centre_distances_backlash_and_assembly(grc: Gearbox, mesh: str) -> None:
    """With 21, 39 and 99 teeth the three planets mesh in phase; a tooth more or fewer puts them out of phase."""
    found = {name: change for name, change in proposals(grc, [mesh]).items() if name.endswith("-teeth")}
    counts = [[change.keys[f"gears.{gear}.teeth"] for gear in ("sun", "planet", "ring")] for change in found.values()]
    assert counts == [[22, 38, 98], [20, 40, 100]]
    for change in found.values():
        assert "out of phase" in change.words
        changed = grc.varied(change.keys)
        for name, before in grc.gear_pairs.items():
            after = changed.gear_pairs[name]
            assert after.centre_distance == before.centre_distance
            assert after.circumferential_backlash == pytest.approx(before.circumferential_backlash, rel=1e-6)
        assert "speed ratio" in price_of(grc, changed)
        # Back again, the change is to planets in phase.
        back = [one for one in proposals(changed, [mesh]).values() if one.name.endswith("39-teeth")]
        assert len(back) == 1 and "in phase" in back[0].words


def test_planet_phases_are_proposed_only_where_they_change_the_sum_of_forces(grc: Gearbox) -> None:
    """At the third multiple of the mesh frequency three planets are in phase with any number of teeth."""
    assert not [name for name in proposals(grc, ["sun_planet"], 3) if name.endswith("-teeth")]
    assert not [name for name in proposals(grc, ["intermediate"]) if name.endswith("-teeth")]
    stated = grc.varied({"meshes.sun_planet.phase": 0.0})
    assert not [name for name in proposals(stated, ["sun_planet"]) if name.endswith("-teeth")]


@pytest.mark.validation
def test_planets_out_of_phase_move_forces_from_torsion_to_the_bearings(tmp_path: Path, monkeypatch) -> None:
    """The overall transmission error vanishes, whose sum the phases cancel, and the carrier's bearings vibrate.

    Parker (Journal of Sound and Vibration 236, 2000, 561-573): planets in phase excite rotation alone; multiples of the
    mesh frequency that are out of phase by a third excite translation alone.
    """
    monkeypatch.setattr(tables, "TableInput", COARSE_INPUT)
    settings = SteadySettings(SpeedRange(2300.0 * RPM, 2500.0 * RPM, 5))
    monkeypatch.setattr(design_study, "settings_of_study", lambda gearbox: settings)
    content = tomllib.loads(template("planetary"))
    content["ste"] = {"positions": 16}
    content["operation"] = {"speed_range_rpm": [2300.0, 2500.0]}
    gearbox = Gearbox.from_dict(content)
    project = Project(gearbox, tmp_path, Choice("bushing"))
    data = project.steady(settings)
    assert ranking_of(data, wanted="transmission_error").resonances[0].line == "4 x sun_planet"
    proposed = propose_changes(gearbox, {"sun_planet": 4, "ring_planet": 4}, {}, [])
    changes = [change for change in proposed if change.name == "planet-37-teeth"]
    monkeypatch.setattr(design_study, "propose_changes", lambda *given: changes)
    study = project.design_changes(quantity="transmission_error")
    assert study is not None
    (result,) = study.results
    assert not result.refusal
    assert result.effects["error"].this_peak == LEAST_DB
    assert result.effects["force"].this_peak > -20.0


def test_spur_gears_have_no_overlap_to_round_up() -> None:
    spur = Gearbox.from_dict(tomllib.loads(SPUR_CASE))
    found = propose_changes(spur, {"spur": 1}, {"spur": 10e-6}, ["bearing_1"])
    names = {change.name for change in found}
    assert not {name for name in names if "face" in name or "helix" in name}
    assert {"bearing_1-stiffer", "bearing_1-softer", "spur-tip-relief-10"} <= names


def response(heights: list[list[float]]) -> xr.Dataset:
    """Overall transmission errors by speed and order, in m; the mean is order 0."""
    amplitude = np.array(heights)[:, :, None]
    return xr.Dataset(
        {
            "amplitude": (("point", "line", "signal"), np.pad(amplitude, ((0, 0), (1, 0), (0, 0)))),
            "phase": (("point", "line", "signal"), np.zeros((3, 3, 1))),
            "speed": (("point",), np.array([8.0, 10.0, 12.0])),
            "order": (("line",), np.array([0.0, 20.0, 40.0])),
            "index": (("line", "base"), np.array([[0], [1], [2]])),
        },
        {"signal": ["overall_dte"], "base": ["spur"]},
        {"mounts": "[]"},
    )


def peaks(data: xr.Dataset, fastest: float) -> dict[str, tuple[float, float]]:
    """Peaks of the mesh frequency at 10 rad/s, and in the range from 8 rad/s."""
    return peaks_of(data, {"spur": 1}, {"spur"}, 20.0 * 10.0 / (2.0 * math.pi), (8.0, fastest))


def test_a_peak_that_only_moves_is_lower_here_but_not_in_the_range() -> None:
    before = peaks(response([[1e-6, 0.0], [8e-6, 0.0], [1e-6, 0.0]]), 12.0)
    after = peaks(response([[1e-6, 0.0], [2e-6, 0.0], [9e-6, 0.0]]), 12.0)
    effect = effects_of(before, after)["error"]
    assert effect.this_peak == pytest.approx(20.0 * math.log10(2.0 / 8.0), abs=1e-3)
    assert effect.highest == pytest.approx(20.0 * math.log10(9.0 / 8.0), abs=1e-3)
    outside = peaks(response([[1e-6, 0.0], [8e-6, 0.0], [99e-6, 0.0]]), 11.0)
    assert outside["error"][1] == pytest.approx(8e-6, rel=1e-6)


def test_a_peak_of_an_excitation_is_found_by_its_order_of_the_shaft_alone() -> None:
    """Order 12 of a shaft beside a sideband of the mesh at the same frequency; without the excitation there is none."""
    data = response([[1e-6, 3e-6], [8e-6, 2e-6], [1e-6, 1e-6]])
    index = (("line", "base"), np.array([[0, 0], [0, 12], [1, -8]]))
    data = data.drop_vars(["base", "index"]).assign(index=index, order=("line", [0.0, 12.0, 12.0]))
    data = data.assign_coords(base=["spur", "rotation of shaft_1"])
    multiples = multiples_of(data, 12.0, {"spur"})
    assert multiples == {"rotation of shaft_1": 12}
    found = peaks_of(data, multiples, {"spur"}, 12.0 * 10.0 / (2.0 * math.pi), (8.0, 12.0))
    assert found["error"] == pytest.approx((8e-6, 8e-6))
    without = peaks_of(data.isel(base=[0]), multiples, {"spur"}, 12.0 * 10.0 / (2.0 * math.pi), (8.0, 12.0))
    assert without["error"][0] == 0.0


def test_couplings_are_changed_and_excitations_left_out_where_they_matter() -> None:
    content = tomllib.loads(SPUR_CASE)
    content["bodies"]["rotor"] = {"spin_only": True, "inertia": {"disc": {"axial_kg_m2": 0.02}}}
    content["couplings"] = {"clutch": {"bodies": ["rotor", "shaft_1"], "stiffness_N_m_per_rad": 5e4}}
    content["excitations"] = {"ripple": {"body": "rotor", "orders": [12], "torque_N_m": [5.0]}}
    gearbox = Gearbox.from_dict(content)
    found = {change.name: change for change in propose_changes(gearbox, {}, {}, [], ["clutch"], ["ripple"])}
    assert found["clutch-stiffer"].keys == {"couplings.clutch.stiffness_N_m_per_rad": 1.3 * 5e4}
    assert found["clutch-softer"].group == "coupling"
    assert found["ripple-none"].words == "without the excitation ripple"
    assert found["ripple-none"].group == "assumption"
    assert gearbox.varied(found["ripple-none"].keys).varying_loads == ()


def test_changes_are_sorted_with_assumptions_and_refusals_behind() -> None:
    change = DesignChange("a", "a", "gear", {})
    worse = ChangeResult(change, {"error": Effect(3.0, 3.0)}, "")
    better = ChangeResult(change, {"error": Effect(-1.0, -3.0)}, "")
    assumed = ChangeResult(replace(change, group="assumption"), {"error": Effect(-20.0, -20.0)}, "")
    refused = ChangeResult(change, {}, refusal="does not fit")
    assert ordered([refused, assumed, worse, better], "error") == [better, worse, assumed, refused]


def test_a_change_that_raises_another_quantity_or_lowers_nothing_is_not_recommended() -> None:
    """Tip relief where planets mesh out of phase: -10.9 dB of transmission error, +12.4 dB of bearing force."""
    labels = {"error": "transmission error", "force": "bearing force", "acceleration": "acceleration"}
    effects = {"error": Effect(-10.9, -10.9), "force": Effect(-10.9, 12.4), "acceleration": Effect(-10.9, 6.0)}
    assert objection_to(effects, "error", labels) == "raises bearing force by 12.4 dB and acceleration by 6.0 dB"
    assert objection_to(effects, "force", labels) == "does not lower bearing force in the range"
    good = {"error": Effect(0.4, 0.9), "force": Effect(-3.0, -2.0)}
    assert objection_to(good, "force", labels) == ""
    moved = {"force": Effect(-9.0, -0.05)}  # the peak is lower, but another one remains as high
    assert objection_to(moved, "force", labels) == "does not lower bearing force in the range"
    change = DesignChange("a", "a", "assumption", {})
    assert not ChangeResult(change, good).recommended  # an assumption is no design change


def test_margins_are_the_smallest_of_all_parts_next_to_their_requirements() -> None:
    def life(contact: float, hours: float, outside: float) -> xr.Dataset:
        values = {"contact_safety": [contact, 1.9], "contact_static": [2.5, math.nan], "root_safety": [1.45, 1.5]}
        values["outside"] = [outside, 0.0]
        flanks = {f"flank_{name}": ("flank", value) for name, value in (values | {"root_static": [3.0, 3.0]}).items()}
        lives = {f"bearing_{name}_hours": ("bearing", [hours, 9e4]) for name in ("basic", "reference")}
        lives |= {"bearing_modified_hours": ("bearing", [math.nan, math.inf]), "hours": ("bin", [3000.0, 5000.0])}
        lives |= {"bearing_static_safety": ("bearing", [4.0, 2.0])}
        names = {"flank": ["pinion left", "wheel left"], "bearing": ["a", "b"]}
        attributes = {"failures": "[]", "shortfalls": json.dumps(["a: L10 = 7,000 h, required 8,000 h"])}
        return xr.Dataset(flanks | lives, names, attributes)

    rating = Gearbox.from_dict(tomllib.loads(template("parallel"))).case.rating
    before, after = (margins_of(life(*values), rating) for values in ((0.971, 12000.0, 0.005), (0.891, 7000.0, 0.02)))
    assert (before["S_H"].value, before["S_H"].part) == (0.971, "pinion left")
    assert (after["shortest bearing life"].value, after["shortest bearing life"].required) == (7000.0, 8000.0)
    required = rating.minimum_S_H
    assert margins_in_words(before, after) == (
        f"S_H 0.971 to 0.891 ({required:g} required); shortest bearing life 12,000 to 7,000 h (8,000 required)"
        "; load on tip edges 0.5 to 2 % (1 at most)"
    )
    assert [name for name, margin in before.items() if margin.fails] == ["S_H"] * (required > 0.971)
    assert after["load on tip edges"].fails and not before["load on tip edges"].fails
    assert shortfalls_of(life(0.891, 7000.0, 0.02)) == ["a: L10 = 7,000 h, required 8,000 h"]


@pytest.mark.parametrize("load", ["half", "0%", "-50%", "1000%", "nan%", "50"])
def test_an_unknown_load_is_one_message_with_the_known_ones(grc: Gearbox, load: str) -> None:
    with pytest.raises(GearboxFileError, match="specify a load case .*rated.* or a percentage of the static load"):
        design_study.at_load(grc, load)


def test_the_diagram_of_changes_has_both_effects_of_those_that_can_be_made() -> None:
    known = {"error": Effect(-6.0, -2.0), "force": Effect(1.0, None)}
    results = tuple(
        ChangeResult(DesignChange(name, f"{name} it", "gear", {}), effects, refusal=refusal)
        for name, effects, refusal in (("widen", known, ""), ("turn", {}, "does not fit"), ("soften", {}, ""))
    )
    panel = DesignStudy({}, "", "spur", 184.0, 2.4, {}, results).plot()
    assert [label.get_text() for label in panel.get_yticklabels()] == ["widen it", "soften it"]
    drawn = np.array([bar.get_width() for bar in panel.patches]).reshape(2, 2, 2)  # quantity, range or peak, change
    expected = [[[known[name].highest, None], [known[name].this_peak, None]] for name in ("error", "force")]
    np.testing.assert_array_equal(drawn, np.array(expected, dtype=np.float64))
    assert panel.get_xlabel() == "Change of the amplitude / dB"


def test_the_price_names_axial_force_and_nominal_stress(grc: Gearbox) -> None:
    found = proposals(grc, ["intermediate"])
    changed = grc.varied(found["intermediate-helix-angle-2"].keys)
    assert "axial force of intermediate" in price_of(grc, changed)
    assert "nominal contact stress of intermediate at the pitch point" in price_of(grc, changed)
    assert "nominal" not in price_of(grc, changed, nominal=False)
    assert price_of(grc, grc) == ""


@pytest.mark.validation
def test_the_tolerance_of_tip_relief_is_that_of_files_with_the_limits(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(tables, "TableInput", COARSE_INPUT)
    gearbox = Gearbox.from_dict(tomllib.loads(SPUR_CASE))
    keys = [f"gears.{gear}.modification.tip_relief" for gear in ("pinion", "wheel")]

    def relieved(amount: float) -> dict[str, float]:
        return {f"{key}_um": amount for key in keys} | {f"{key}_length_mm": 5.0 for key in keys}

    swings = []
    for amount in (5.0, 3.0, 7.0):
        file = Project(gearbox.varied(relieved(amount)), tmp_path / f"file-{amount:g}", Choice("bushing"))
        file.stiffness()
        swings.append(rounded_text(1e6 * np.ptp(file.tables_at_work()["spur"].static_state["ste"].to_numpy())))
    assert len(set(swings)) == 3
    project = Project(gearbox, tmp_path / "study", Choice("bushing"))
    change = DesignChange("spur-tip-relief-5", "spur: tip relief 5 µm more", "modification", relieved(5.0))
    assert relief_tolerance(project, change) == (
        "static transmission error of spur {} µm peak-to-peak; with 2 µm less tip relief {} µm, with 2 µm more {} µm"
    ).format(*swings)
    crowned = replace(change, keys={"gears.pinion.modification.lead_crowning_um": 10.0})
    assert relief_tolerance(project, crowned) == ""


@pytest.mark.validation
def test_a_study_computes_each_change_once_and_names_what_cannot_be_made(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(tables, "TableInput", COARSE_INPUT)
    changes = [
        DesignChange("crowned", "crowned", "modification", {"gears.pinion.modification.lead_crowning_um": 10.0}),
        DesignChange("housing", "softer housing", "assumption", {"housing.factor": 0.25}),
        DesignChange("wide", "too far apart", "gear", {"pairs.spur.centre_distance_mm": 90.0}),
    ]
    monkeypatch.setattr(design_study, "propose_changes", lambda *given: changes)
    content = tomllib.loads(SPUR_CASE)
    content["operation"] = {"speed_range_rpm": [300.0, 1500.0]}
    project = Project(Gearbox.from_dict(content), tmp_path, Choice("bushing"))
    told: list[str] = []
    study = project.design_changes(lambda done, total, words: told.append(f"{done}/{total} {words}"))
    assert study is not None
    assert told == ["0/3 crowned", "1/3 softer housing", "2/3 too far apart"]
    names = [result.change.name for result in study.results]
    assert names == ["crowned", "housing", "wide"]
    assert all(math.isfinite(effect.this_peak) for effect in study.results[0].effects.values())
    assert study.results[2].refusal and not study.results[2].effects
    stored = json.loads((tmp_path / DESIGN_CHANGES_FILE).read_text(encoding="utf-8"))
    assert [result["change"]["name"] for result in stored["results"]] == names
    # Repeated, everything is read: no file of a response or table is written again.
    files = sorted((tmp_path / design_study.FOLDER).rglob("*.nc"))
    before = [path.stat().st_mtime_ns for path in files]
    again = project.design_changes()
    assert [result.effects for result in again.results] == [result.effects for result in study.results]
    assert [path.stat().st_mtime_ns for path in files] == before
    # A copy of a table that a full disk ends leaves no file that counts as there.
    copied = tmp_path / design_study.FOLDER / "housing" / "tables" / "spur.nc"
    copied.unlink()
    with monkeypatch.context() as full, pytest.raises(OSError, match="full"):
        full.setattr("os.replace", lambda *names: (_ for _ in ()).throw(OSError(28, "disk full")))
        project.design_changes()
    assert not copied.exists()
    assert [result.effects for result in project.design_changes().results] == [r.effects for r in study.results]
    # Followed on the changed file, from its own tables on, the advice has the effect that it was listed with.
    changed = read_stored_gearbox(tmp_path / design_study.FOLDER / "crowned")
    followed = Project(changed, tmp_path / "followed", Choice("bushing"))
    data = project.replaced(project.gearbox, tmp_path / design_study.FOLDER / "unchanged").steady(
        design_study.settings_of_study(project.gearbox)
    )
    ranking = ranking_of(data)
    families = {mesh.family for mesh in project.gearbox.meshes}
    multiples = multiples_of(data, ranking.resonances[0].order, families)
    both = [
        peaks_of(own, multiples, families, study.frequency, ranking.speeds)
        for own in (data, followed.steady(design_study.settings_of_study(followed.gearbox)))
    ]
    for name, effect in effects_of(*both).items():
        assert effect.highest == pytest.approx(study.results[0].effects[name].highest, abs=1e-6)
        assert effect.this_peak == pytest.approx(study.results[0].effects[name].this_peak, abs=1e-6)
    # The page lists what the file has, and nothing of another gearbox.
    path = tmp_path / DESIGN_CHANGES_FILE
    assert read_design_study(path) == study
    project.steady(design_study.settings_of_study(project.gearbox))
    page = project.report()
    text = page.path.read_text(encoding="utf-8")
    assert "too far apart" in text and 'id="design-changes"' in text and not page.left_out
    assert 'id="contact"' in text
    reduction = next(line for line in page.statements if line.startswith("Reduction"))
    assert ("crowned" in reduction) == study.results[0].recommended
    path.write_text(json.dumps(stored | {"input_hash": "0"}), encoding="utf-8")
    page = project.report()
    assert page.left_out == (f"{DESIGN_CHANGES_FILE}: {OTHER_INPUT}",)
    assert 'id="design-changes"' not in page.path.read_text(encoding="utf-8")


def damaged_studies() -> dict[str, str]:
    """Contents of files that are no studies."""
    result = {"change": {"name": "a", "words": "a", "group": "gear", "keys": {}}, "effects": {}, "price": ""}
    result["objection"] = ""
    study = {
        "model": {"variant": "bushing", "mesh_model": "table", "inertias": "discs"},
        "input_hash": "0",
        "line": "spur",
        "frequency": 1.0,
        "speed": 1.0,
        "amplitudes": {},
        "results": [result | {"refusal": ""}],
    }
    first = study["results"][0]
    changed = {
        "not JSON": "{",
        "a list": "[]",
        "deep": "[" * 100_000,
        "no results": json.dumps({key: value for key, value in study.items() if key != "results"}),
        "a text as results": json.dumps(study | {"results": "none"}),
        "another quantity": json.dumps(study | {"quantity": "noise"}),
        "another key": json.dumps(study | {"more": 1}),
        "a text as frequency": json.dumps(study | {"frequency": "high"}),
        "NaN": json.dumps(study | {"speed": math.nan}),
        "another group": json.dumps(study | {"results": [first | {"change": first["change"] | {"group": "?"}}]}),
        "an effect of text": json.dumps(study | {"results": [first | {"effects": {"error": {"here": "much"}}}]}),
    }
    assert DesignStudy(**json.loads(json.dumps(study)))
    return changed


@pytest.mark.parametrize("damage", damaged_studies())
def test_a_damaged_study_is_one_message(tmp_path: Path, damage: str) -> None:
    path = tmp_path / DESIGN_CHANGES_FILE
    path.write_text(damaged_studies()[damage], encoding="utf-8")
    with pytest.raises(FileError, match="cannot be read as design changes") as caught:
        read_design_study(path)
    assert "--levers" in str(caught.value) and len(str(caught.value)) < 500


def test_a_rating_that_cannot_be_computed_is_said_instead_of_no_shortfall(grc: Gearbox) -> None:
    rated = design_study.Rated({}, ["a: L10 = 1 h, required 2 h"])
    assert design_study._requirements(grc, rated) == ["a: L10 = 1 h, required 2 h"]
    assert design_study._requirements(grc, None) == [f"no requirement is checked: {design_study.NOT_RATED}"]
    assert design_study._requirements(Gearbox.from_dict(tomllib.loads(SPUR_CASE)), None) == []
