"""Life of a spur pair against closed forms, bins against series, and what is kept and refused."""

from __future__ import annotations

import json
import math
import os
import shutil
import subprocess
import sys
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exugear.cli.tables import bearing_findings
from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.sections.loads import RatingSection
from exugear.gearbox.templates.kinds import template
from exugear.gearbox.variant import VariantError
from exugear.life.dynamic_factors import stated_factors
from exugear.life.gear_life import flank_lives, pair_stresses, warn_beyond_tables
from exugear.life.life import SYMMETRIC, checked_loads, compute_life, needs_of_relief, rating_of, shortfalls
from exugear.life.life_file import damage_matrix, draw_life, limits, read_life, summary
from exugear.life.load_spectrum.counted import count_loads
from exugear.life.rating.lacks import missing_for_life
from exugear.life.static_balance import StaticBalance, acting_loads, static_balance
from exugear.project import Project
from exugear.system.bearings.rolling.life import basic_rating_life
from exugear.system.build import assemble
from exugear.system.kernels.meshes import FORCE
from exugear.system.statics import locked_equilibrium, rolled_coordinates
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness
from fe_ste.root_stress import MeshCycleStress
from fe_ste.standards.pitting import nominal_contact_stress
from fe_ste.standards.tooth_root import root_stress_factors

from ..cases.case_mutations import toml_text
from ..cases.command import exugear
from ..cases.gear_trains import two_stage
from ..cases.spur import SPUR_CASE
from ..cases.table import surfaces

BASE = 30e-3 * math.cos(math.radians(20.0))
STRENGTH = {
    "sigma_H_lim_MPa": 1500.0,
    "sigma_F_lim_MPa": 500.0,
    "curve": "case_hardened",
    "roughness_Rz_um": 4.8,
    "root_factor": 1.0,
}
CATALOGUE = {
    "type": "cylindrical_roller",
    "bore_mm": 40.0,
    "outer_diameter_mm": 80.0,
    "width_mm": 18.0,
    "dynamic_rating_kN": 60.0,
    "static_rating_kN": 53.0,
}


OIL = {"viscosity_40_mm2_per_s": 220.0, "viscosity_100_mm2_per_s": 19.0, "temperature_C": 70.0, "cleanliness": "normal"}


def content_of(table: str, folder: Path, **rating: Any) -> dict[str, Any]:
    """Spur case with loads of a table with commas and a rating."""
    content = tomllib.loads(SPUR_CASE)
    (folder / "loads.csv").write_text(table)
    content["bearings"]["bearing_1"] = {
        "body": "shaft_1",
        "z_mm": 0.0,
        "stiffness": {"axial_N_per_m": 1e8, "tilt_N_m_per_rad": 1e6},
        "catalogue": CATALOGUE,
        "housing_factor_applies": False,
    }
    content["loads"] = {
        "body": "shaft_1",
        "life_years": 10.0,
        "sources": {"spectrum": {"file": "loads.csv", "hours_per_year": 1000.0}},
    }
    gears = {"pinion": {**STRENGTH}, "wheel": {**STRENGTH}}
    content["rating"] = {"dynamic_factor": 1.0, "viscosity_40_mm2_per_s": 320.0, "gears": gears} | rating
    return content


TABLE = "torque_N_m,speed_rpm,hours\n100,1500,3\n200,1000,1\n"


@pytest.fixture(scope="module")
def balance(grc) -> StaticBalance:
    """The GRC under its torque at one angle."""
    return static_balance(grc.assembly(), "carrier", np.array([240e3]), 1)


@pytest.fixture(scope="module")
def first(tmp_path_factory) -> Project:
    """Folder with table and stresses of the one pair, which take some seconds, and a life."""
    project = spur_project(tmp_path_factory.mktemp("spur"), TABLE)
    project.life()
    return project


@pytest.fixture
def stresses(first) -> dict[str, MeshCycleStress]:
    return pair_stresses(first.life_tables(), first.folder)


def spur_project(folder: Path, table: str, **rating: Any) -> Project:
    gearbox = Gearbox.from_dict(content_of(table, folder, **rating), str(folder / "gearbox.toml"))
    return Project(gearbox, folder, Choice("bushing", "iso6336"))


def lives(project: Project, stresses: dict[str, MeshCycleStress]) -> dict[str, Any]:
    """Flanks by gear, computed without files."""
    gearbox = project.gearbox
    counted = checked_loads(gearbox)
    acting = acting_loads(counted)
    balance = static_balance(project.assembly(), counted.body, acting.torques, 12)
    dynamic = stated_factors(gearbox, rating_of(gearbox).dynamic_factor)
    rated = flank_lives(gearbox, rating_of(gearbox), counted.teeth, acting, balance, stresses, dynamic)
    return {f"{one.gear} {one.flank}": one for one in rated}


@pytest.mark.validation
def test_life_of_a_spur_pair_as_a_user_meets_it(first):
    """Bearing loads and L10 in closed form, gears beside the standard; a second call finds what is kept."""
    data = read_life(first.life_path)
    (bearing,) = data["bearing"].to_numpy().tolist()
    forces = np.array([100.0, 200.0]) / BASE
    hours, speeds = np.array([7500.0, 2500.0]), np.array([1500.0, 1000.0])
    revolutions = hours * speeds * 60.0
    allowed = np.array([basic_rating_life(60e3, force, "cylindrical_roller") for force in forces])
    assert bearing == "bearing_1"
    assert float(data["bearing_damage"][0]) == pytest.approx(np.sum(revolutions / 1e6 / allowed), rel=1e-3)
    assert float(data["bearing_largest_load"][0]) == pytest.approx(forces[1], rel=1e-3)
    assert float(data["bearing_static_safety"][0]) == pytest.approx(53e3 / forces[1], rel=1e-3)
    assert data["load_sharing"].to_numpy() == pytest.approx([1.0], rel=1e-6)
    cycles = data["flank_cycles"].to_numpy()
    assert cycles == pytest.approx([revolutions.sum(), revolutions.sum() * 20 / 30])
    # Finite-element root stress of this pair, whose face is stiff to its ends: within a sixth of the standard's.
    assert data["flank_root_stress"].to_numpy() == pytest.approx(data["flank_nominal_root"].to_numpy(), rel=0.17)
    assert first.life_path.with_name("life_gears.csv").read_text().startswith("flank,cycles,")
    before = first.life_path.stat().st_mtime_ns
    again = first.life()
    assert again.identical(data) and first.life_path.stat().st_mtime_ns == before
    harder = spur_project(first.folder, TABLE, dynamic_factor=1.2).life()
    assert np.all(harder["flank_contact_stress"].to_numpy() > data["flank_contact_stress"].to_numpy())


def killed_lives(first: Project, folder: Path, every: int) -> dict[str, Any]:
    """What `tests.exugear.cases.killed_lives` finds, with tables and stresses of a life that is there."""
    (folder / "gearbox.toml").write_text(toml_text(content_of(TABLE, folder)))
    for known in ("tables", "stress"):
        shutil.copytree(first.folder / known, folder / "known" / known)
    command = [sys.executable, "-m", "tests.exugear.cases.killed_lives", "life", str(folder), str(every)]
    ended = subprocess.run(command, capture_output=True, text=True, cwd=Path(__file__).parents[3], check=False)
    assert ended.returncode == 0, ended.stderr
    found: dict[str, Any] = json.loads(ended.stdout)
    return found


@pytest.mark.validation
@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
@pytest.mark.parametrize(
    ("every", "least"), [(19, 3), *(pytest.param(every, 40 // every + 1, marks=pytest.mark.long) for every in (5, 1))]
)
def test_a_life_killed_at_any_write_is_called_again_to_the_same_bits_and_leaves_no_partial_file(
    first, tmp_path, every, least
):
    found = killed_lives(first, tmp_path, every)
    assert found["kills"] >= least
    assert (found["undisturbed"], found["wrong"]) == (0, [])


def test_nominal_stresses_are_those_of_the_standard_at_the_largest_torque(tmp_path, stresses):
    found = lives(spur_project(tmp_path, TABLE), stresses)
    pair = spur_project(tmp_path, TABLE).gearbox.gear_pairs["spur"]
    force = 200.0 / pair.pinion.reference_radius
    pinion = found["pinion +"]
    assert pinion.nominal_contact == pytest.approx(nominal_contact_stress(pair, force), rel=1e-6)
    product = root_stress_factors(pair, 0).product
    assert pinion.nominal_root == pytest.approx(force / (15e-3 * 3e-3) * product, rel=1e-6)


def test_safety_is_the_factor_on_stress_at_which_the_damage_is_one(tmp_path, stresses):
    """Pitting goes with the root of torque, breakage with torque: loads scaled so have damage one."""
    found = lives(spur_project(tmp_path, TABLE), stresses)["pinion +"]
    for key, power, damage in (("contact_safety", 2.0, "contact_damage"), ("root_safety", 1.0, "root_damage")):
        factor = getattr(found, key) ** power
        scaled = f"torque_N_m,speed_rpm,hours\n{100 * factor:.9g},1500,3\n{200 * factor:.9g},1000,1\n"
        more = lives(spur_project(tmp_path, scaled), stresses)["pinion +"]
        assert getattr(more, damage) == pytest.approx(1.0, rel=1e-3)


@pytest.mark.validation
def test_load_sharing_of_planets_is_told(grc):
    counted = checked_loads(grc.gearbox)
    life = compute_life(grc.assembly(), counted, {}, stated_factors(grc.gearbox, 1.05), "")
    (line,) = (one for one in life.assumptions if one.startswith("K_gamma of sun_planet"))
    assert f"{life.load_sharing['sun_planet']:.3f}" in line
    assert not any(one.startswith("K_gamma of high_speed") for one in life.assumptions)


def test_misalignment_beyond_a_table_is_told(grc, balance):
    """Stresses of a table from -10 to 10 um over the face, under a balance that tilts gears by more."""
    gearbox = grc.gearbox
    counted = count_loads(gearbox)
    acting = acting_loads(counted)
    pair = gearbox.gear_pairs["high_speed"]
    flat = np.ones((1, 2))
    for opening, told in ((10e-6, 1), (1e-3, 0)):
        stress = MeshCycleStress(
            torque=np.ones(1),
            misalignment=np.array([-opening, opening]) / pair.face_width,
            **dict.fromkeys(("hertz", "pitch_hertz", "outside", "face_load"), flat),
            **dict.fromkeys(("root", "compression"), np.ones((1, 2, 2))),
        )
        lines = list(warn_beyond_tables(gearbox, acting, balance, {"high_speed": stress}))
        assert len(lines) == told
        assert all(line.startswith("high_speed: misalignment reaches") for line in lines)
        hub = np.concatenate([acting.points.other, acting.worst_hub])
        number = [mesh.name for mesh in gearbox.meshes].index("high_speed")
        tilts = 1e6 * pair.face_width * balance.at(balance.misalignment, acting.torques, hub)[..., number]
        signed = " and ".join(f"{end:.3g}" for end in (tilts.min(), tilts.max()) if abs(end) > 1e6 * opening)
        assert all(f"reaches {signed} µm over the face width" in line for line in lines)


def test_safeties_below_what_is_asked_for_are_named(tmp_path, stresses):
    flanks = [*lives(spur_project(tmp_path, TABLE), stresses).values()]
    least = min(min(one.contact_safety, one.contact_static) for one in flanks)
    asked = {"dynamic_factor": 1.0, "viscosity_40_mm2_per_s": 320.0}
    assert least < 1.0
    assert f"S_H = {least:.3g}, required 1" in next(shortfalls(RatingSection(**asked), flanks, [], 1.0))
    assert not list(shortfalls(RatingSection(**asked, minimum_S_H=0.999 * least), flanks, [], 1.0))
    told = list(shortfalls(RatingSection(**asked, minimum_S_H=1.001 * least), flanks, [], 1.0))
    assert len(told) == 1
    assert f"S_H = {least:.3g}" in told[0]


def test_bins_do_the_damage_of_the_series(tmp_path, stresses):
    """A swinging torque of 4000 samples in 64 bins and in as many as make each sample its own, within 1 %."""
    time = np.arange(4000) * 0.1
    torque = 150.0 + 60.0 * np.sin(0.7 * time) + 25.0 * np.sin(2.9 * time + 1.0)
    lines = "\n".join(f"{t:.1f},{one:.6f},1000" for t, one in zip(time, torque, strict=True))
    damages = []
    for bins in (64, 10_000):
        content = content_of(f"time_s,shaft_1_N_m,shaft_1_rpm\n{lines}\n", tmp_path)
        content["loads"] |= {"bins": bins}
        content["loads"]["sources"]["spectrum"]["skip_s"] = 0.0
        project = Project(Gearbox.from_dict(content, str(tmp_path / "g.toml")), tmp_path, Choice("bushing", "iso6336"))
        one = lives(project, stresses)["pinion +"]
        damages.append((one.contact_damage, one.root_damage))
    assert damages[0] == pytest.approx(damages[1], rel=0.01)


def test_reversed_torque_wears_the_other_flanks_alone(tmp_path, stresses):
    gears = {"pinion": {**STRENGTH, "mean_stress_factor": 0.7}, "wheel": {**STRENGTH, "mean_stress_factor": 0.7}}
    table = "torque_N_m,speed_rpm,hours\n200,1000,3\n-100,1000,1\n"
    found = lives(spur_project(tmp_path, table, gears=gears), stresses)
    assert set(found) == {"pinion -", "pinion +", "wheel -", "wheel +"}
    assert found["pinion +"].cycles == pytest.approx(3.0 * found["pinion -"].cycles)
    assert found["pinion +"].contact_damage > 100.0 * found["pinion -"].contact_damage


def test_an_extreme_load_counts_for_static_safety_alone(tmp_path, first, stresses):
    content = content_of(TABLE, tmp_path)
    (tmp_path / "storm.csv").write_text("torque_N_m,speed_rpm,hours\n400,1000,1\n")
    storm = {"file": "storm.csv", "kind": "extreme", "partial_factor": 1.35}
    content["loads"]["sources"]["storm"] = storm
    worse = Project(Gearbox.from_dict(content, str(tmp_path / "g.toml")), tmp_path, first.choice)
    quiet, loud = (
        compute_life(one.assembly(), checked_loads(one.gearbox), stresses, stated_factors(one.gearbox, 1.0), "")
        for one in (spur_project(tmp_path, TABLE), worse)
    )
    for calm, storm_too in zip(quiet.flanks, loud.flanks, strict=True):
        assert storm_too.root_damage == pytest.approx(calm.root_damage, rel=1e-6)
        assert calm.root_static / storm_too.root_static == pytest.approx(1.35 * 400.0 / 200.0, rel=1e-6)
    assert loud.bearings[0].static_safety == pytest.approx(53e3 / (540.0 / BASE), rel=1e-3)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda content: content.pop("rating"), "rating: this section is missing"),
        (lambda content: content["rating"]["gears"].update(sun={**STRENGTH}), "rating.gears.sun: no such gear"),
        (
            lambda content: content["loads"].update(body="nobody"),
            "does not rotate",
        ),
        (lambda content: content["loads"].update(body="shaft_2"), ": static_load.locked locks shaft_2"),
        (
            lambda content: content["rating"]["gears"]["pinion"].pop("curve"),
            "set curve, or contact_curve and bending_curve",
        ),
        (lambda content: content["rating"].update(dynamic_factor=0.5), "must lie between 1 and 10"),
        (lambda content: content["rating"].update(dynamic_factor_run="run_up"), "set dynamic_factor, or"),
        (
            lambda content: content.update(
                rating={"dynamic_factor_run": "no", "minimum_dynamic_factor": 1.0, "viscosity_40_mm2_per_s": 320.0}
            ),
            "rating.dynamic_factor_run = 'no': no such load case; load cases are run_up",
        ),
        (lambda content: content["rating"].pop("viscosity_40_mm2_per_s"), "lubricant.viscosity_40_mm2_per_s: this key"),
        (lambda content: content.update(lubricant=OIL), "viscosity_40_mm2_per_s: is set twice"),
        (
            lambda content: content["rating"]["gears"]["pinion"].update(roughness_um=4.8),
            "roughness_um = 4.8: was renamed to roughness_Rz_um; exugear migrate FILE.toml",
        ),
        (
            lambda content: content["rating"]["gears"]["pinion"].update(roughness_Ra_um=0.8),
            "one of roughness_Rz_um and roughness_Ra_um",
        ),
        (
            lambda content: content.update(lubricant=OIL | {"viscosity_100_mm2_per_s": 300.0}),
            "must be below viscosity_40_mm2_per_s",
        ),
    ],
)
def test_bad_sections_are_one_error_each_by_the_names_of_their_keys(tmp_path, change, message):
    content = content_of(TABLE, tmp_path)
    change(content)
    with pytest.raises(GearboxFileError, match=message):
        checked_loads(Gearbox.from_dict(content, str(tmp_path / "gearbox.toml")))


def test_gears_that_bend_both_ways_need_their_factor(tmp_path):
    table = "torque_N_m,speed_rpm,hours\n200,1000,3\n-100,1000,1\n"
    gearbox = spur_project(tmp_path, table).gearbox
    with pytest.raises(
        GearboxFileError, match=r"rating.gears.pinion.mean_stress_factor: this key is missing"
    ) as raised:
        checked_loads(gearbox)
    missing = [f"rating.gears.{name}.mean_stress_factor: this key is missing" for name in ("pinion", "wheel")]
    assert len(raised.value.errors) == 2
    found = missing_for_life(gearbox)
    assert found["loads"] == ()
    for verb in ("life", "check --rating"):
        assert all(reason.startswith(key) for reason, key in zip(found[verb], missing, strict=True))


def test_gears_that_bend_one_way_need_no_factor_whatever_the_sign_of_the_torque(tmp_path):
    """A generator's torque is negative at its shaft; a bin of zero torque loads no flank."""
    for table in ("-200,1000,3\n-100,1000,1\n", "-200,1000,3\n0,1000,1\n", "200,1000,3\n0,1000,1\n"):
        counted = checked_loads(spur_project(tmp_path, f"torque_N_m,speed_rpm,hours\n{table}").gearbox)
        assert counted.distribution.hours.sum() == pytest.approx(10_000.0)


@pytest.mark.parametrize(("load", "sign", "told"), [(20.0, 1.0, False), (-20.0, -1.0, False), (-20.0, 1.0, True)])
def test_a_reversed_torque_is_one_against_the_static_load(tmp_path, load, sign, told):
    content = two_stage()
    content["static_load"]["torques_N_m"] = {"input": sign * 100.0}
    duty = {"torque_N_m": [load], "speed_rpm": [600.0], "hours": [1000.0]}
    content["loads"] = {"body": "input", "life_years": 1.0, "sources": {"duty": duty}}
    content["rating"] = {"dynamic_factor": 1.0, "viscosity_40_mm2_per_s": 220.0}
    data = Project(Gearbox.from_dict(content), tmp_path, Choice("bushing")).life()
    assert (SYMMETRIC in json.loads(data.attrs["assumptions"])) == told


def test_check_says_for_each_verb_of_a_life_whether_it_is_possible_and_all_that_is_missing(tmp_path):
    case = tmp_path / "gearbox.toml"
    case.write_text(SPUR_CASE)
    said = " ".join(exugear("check", case, "--all").stdout.split())
    assert "Command loads: not available: loads: this section is missing" in said
    assert "Command life: not available: rating: this section is missing" in said
    assert "; lubricant.viscosity_40_mm2_per_s: this key is missing" in said
    assert "Command check --rating: not available: rating: this section is missing" in said
    assert json.loads(exugear("check", case, "--json").stdout)["life"]["loads"]


def test_gears_with_tip_relief_are_told_to_have_too_little_not_none(tmp_path, stresses):
    project = spur_project(tmp_path, TABLE)
    (flank, *_) = lives(project, stresses).values()
    flanks = [replace(flank, outside=0.04)]
    assert "add tip relief" in next(needs_of_relief(project.gearbox, flanks))
    relieved = project.gearbox.varied(
        {"gears.pinion.modification": {"tip_relief_um": 12.0, "tip_relief_length_mm": 3.0}}
    )
    (said,) = needs_of_relief(relieved, flanks)
    assert said.endswith("present: 12 µm of tip relief on pinion; increase its amount or length")


def test_a_lightly_loaded_gearbox_has_a_picture_and_safeties_by_torque(first, tmp_path):
    """Without damage there is nothing to draw; by Hertz S_H falls with the root of the torque, S_F with the torque."""
    safeties = []
    for torque in (2.0, 0.5):
        project = spur_project(first.folder, f"torque_N_m,speed_rpm,hours\n{torque},1500,1\n")
        data = project.life()
        assert max(damage for _, _, damage in limits(data)) < 1e-6
        _, shares = damage_matrix(data, [])
        assert shares.shape == (0, 1)
        draw_life(data, tmp_path / "life.png")
        safeties.append([float(data[f"flank_standard_{kind}_safety"][0]) for kind in ("contact", "root")])
    assert safeties[1][0] / safeties[0][0] == pytest.approx(2.0, rel=1e-9)
    assert safeties[1][1] / safeties[0][1] == pytest.approx(4.0, rel=1e-9)


def test_the_life_printed_has_the_remarks_on_bearings(first):
    """Below kappa = 0.1 ISO 281 has no a_ISO: L10m is a tenth of L10 then, and counts among what limits."""
    project = spur_project(first.folder, "torque_N_m,speed_rpm,hours\n100,2,1\n")
    content = project.gearbox.content
    rating = {key: value for key, value in content["rating"].items() if key != "viscosity_40_mm2_per_s"}
    oil = {**OIL, "temperature_C": 100.0, "cleanliness": "typical"}
    gearbox = project.gearbox.varied({"rating": rating, "lubricant": oil})
    found = summary(replace(project, gearbox=gearbox).life())
    (bearing,) = found["bearings"]
    assert bearing["viscosity_ratio"] < 0.1
    assert bearing["modified_hours"] == pytest.approx(0.1 * bearing["basic_hours"], rel=1e-3)
    assert ("bearing_1", "L10m") in {(limit["part"], limit["by"]) for limit in found["limits"]}
    (remark,) = (own for own in bearing_findings(found["remarks"]) if own.level == "warning")
    assert remark.text.startswith("bearing bearing_1: viscosity ratio")
    assert "L10m contains its minimum there, a_ISO = 0.1" in remark.text


def test_bad_input_writes_nothing(tmp_path):
    case, out = tmp_path / "gearbox.toml", tmp_path / "out"
    case.write_text(SPUR_CASE)
    result = exugear("life", case, "--out", out)
    assert (result.exit_code, out.exists()) == (2, False)
    assert "rating: this section is missing" in result.stderr


GRC = Path("cases/grc750/gearbox.toml")


@pytest.fixture(scope="module")
def grc() -> Project:
    return Project.from_toml(GRC, "nowhere", Choice("bushing", "iso6336"))


def test_planets_change_places_as_the_carrier_turns(grc):
    """At a third of a turn each planet carries what the one before it carried."""
    balance = static_balance(grc.assembly(), "carrier", np.array([240e3]), 3)
    meshes = [number for number, mesh in enumerate(grc.gearbox.meshes) if mesh.family == "sun_planet"]
    forces = balance.mesh_force.values[-1][:, meshes]
    assert np.ptp(forces[0]) > 0.01 * forces.mean()
    assert forces[1] == pytest.approx(np.roll(forces[0], -1), rel=3e-3)
    mean = forces.mean()
    train = grc.gearbox.train.static_mesh_forces({"carrier": 240e3})
    assert mean == pytest.approx(abs(train["sun_planet_1"]), rel=2e-3)
    assert 1.0 < balance.load_sharing(meshes) < 1.1


def test_rolling_goes_round_in_a_circle(grc):
    assembly = grc.assembly()
    q = rolled_coordinates(assembly, "carrier", 2.0 * math.pi)
    place = assembly.coordinates["planet_1"]
    assert q[list(place[:2])] == pytest.approx([0.0, 0.0], abs=1e-8)
    assert q[assembly.spin["hss"]] == pytest.approx(2.0 * math.pi * grc.gearbox.train.ratio)


def test_linear_laws_are_scaled_and_others_interpolated(grc, balance):
    """Between its torques the balance of a linear variant is that of another solution; rows are solved one by one."""
    with_rows = grc.assembly()
    assembly = replace(with_rows.unloaded, connectors_at_rest=None)
    full, half = (static_balance(assembly, "carrier", np.array([torque]), 1) for torque in (240e3, 120e3))
    assert full.linear
    assert full.at(full.mesh_force, np.array([120e3, -60e3]))[0] == pytest.approx(half.mesh_force.values[0], rel=1e-3)
    assert full.at(full.mesh_force, np.array([-60e3]))[0] == pytest.approx(-0.25 * full.mesh_force.values[0])
    rows = balance
    direct = static_balance(with_rows, "carrier", np.array([150e3]), 1)
    assert not rows.linear
    found = rows.at(rows.bearing_load, np.array([150e3]))[0]
    assert found[..., :3] == pytest.approx(direct.bearing_load.values[-1][..., :3], abs=3e-3 * np.abs(found).max())


def hub_assembly() -> Assembly:
    changes = {"bodies.main_shaft.enabled": True, "static_load.torques_N_m": {"main_shaft": 240e3}}
    gearbox = Gearbox.from_toml(GRC).varied(changes)
    return Project(gearbox, Path("nowhere"), Choice("bushing", "iso6336")).assembly()


@pytest.mark.validation
def test_loads_of_a_hub_are_held_by_main_bearing_and_carrier():
    """Forces in balance: what the hub pushes, main bearing and shrink disc take; and a direct solution agrees."""
    assembly, torque = hub_assembly(), np.array([240e3])
    sizes = np.array([30e3, 40e3, 20e3, 200e3, 100e3])
    balance = static_balance(assembly, "main_shaft", torque, 4, hub=sizes)
    names = [support.name for support in assembly.supports]
    main, disc = (balance.bearing_load.of(names.index(name)) for name in ("main_bearing", "shrink_disc"))
    hub = np.array([[10e3, -25e3, 15e3, 150e3, -80e3]])
    taken = sum(balance.at(one, torque, hub) - balance.at(one, torque) for one in (main, disc))
    # The shrink disc tells its load in the carrier's axes, which the torque winds up by a milliradian.
    assert np.abs(taken[0, 0, :3]) == pytest.approx(np.abs(hub[0, :3]), abs=2e-3 * 25e3)
    wrench = np.zeros(assembly.size)
    wrench[list(assembly.coordinates["main_shaft"][:5])] = hub[0]
    resting = assembly.at_rest
    direct = locked_equilibrium(resting, {"main_shaft": 240e3}, ["hss"], resting.mean_meshes, None, wrench)
    force = assembly.mesh_states(direct, np.zeros_like(direct), assembly.mean_meshes)[:, FORCE]
    found = balance.at(balance.mesh_force, torque, hub)[0, 0]
    assert found == pytest.approx(force, rel=2e-3)
    assert np.ptp(found[:3]) > 1.2 * np.ptp(
        balance.mesh_force.values[-1, 0, :3]
    )  # its moment spreads the planets' loads


def test_the_law_table_is_solved_on_some_torques(grc):
    """Between its torques the forces are those of another solution."""
    gearbox = grc.gearbox
    assembly = assemble(gearbox, Choice("bushing", "table"), surfaces(gearbox))
    balance = static_balance(assembly, "carrier", np.array([240e3]), 1)
    assert not balance.linear and len(balance.torque) == 5
    direct = static_balance(assembly, "carrier", np.array([150e3]), 1)
    found = balance.at(balance.mesh_force, np.array([150e3]))[0]
    assert found == pytest.approx(direct.at(direct.mesh_force, np.array([150e3]))[0], rel=5e-3)


def test_loads_of_a_hub_need_a_body_that_stands_in_space(grc):
    rigid = grc.chosen(variant="rigid").assembly()
    with pytest.raises(VariantError, match="carrier: rotations only in the variant rigid"):
        static_balance(rigid, "carrier", np.array([240e3]), 1, hub=np.array([1.0, 0.0, 0.0, 0.0, 0.0]))


@pytest.mark.parametrize("centre_of_mass", [26.8, 80.0])
def test_loads_of_a_hub_act_where_the_file_states_it(centre_of_mass):
    """As a constant force does there, wherever the centre of mass of the body is."""
    content = tomllib.loads(template("parallel"))
    content["bodies"]["output"]["inertia"]["discs"]["centre_of_mass_z_mm"] = centre_of_mass
    source = {"file": "duty.csv", "skip_s": 0.0, "hours_per_year": 1.0, "hub_moments": ["a_N_m", "b_N_m"]}
    content["loads"] |= {"body": "output", "hub_z_mm": 200.0, "sources": {"duty": source}}
    alone = Gearbox.from_dict(content)
    force = {"body": "output", "z_mm": 200.0, "force_N": [0.0, 100.0, 0.0]}
    loaded = Gearbox.from_dict({**content, "forces": {"hub": force}})
    plain, with_hub, with_force = (
        static_balance(assemble(own, Choice("bushing", "iso6336"), stiffness), "output", np.array([900.0]), 1, hub=hub)
        for own, hub in ((alone, None), (alone, np.array([0.0, 100.0, 0.0, 0.0, 0.0])), (loaded, None))
        for stiffness in [mesh_stiffness(own, "iso6336")]
    )
    by_hub = with_hub.bearing_load.by_hub[-1, 1]
    change = (with_force.bearing_load.values[-1] - plain.bearing_load.values[-1]) / 100.0
    assert by_hub == pytest.approx(change, abs=1e-5)
    assert np.abs(by_hub).max() > 0.5


def test_a_place_of_hub_loads_without_hub_loads_is_refused():
    content = tomllib.loads(template("parallel"))
    content["loads"]["hub_z_mm"] = 200.0
    with pytest.raises(GearboxFileError, match=r"hub_z_mm = 200: no source has hub loads; set hub_forces or"):
        Gearbox.from_dict(content)


def test_channels_of_a_hub_are_read_with_their_sense(tmp_path):
    """A force that swings with the torque: points split its bins, and their mean is that of the samples."""
    time = np.arange(400) * 0.1
    lines = [f"{t:.1f},{100 + 20 * math.sin(t):.6f},1000,{5 * math.cos(2 * t):.6f},{math.sin(3 * t):.6f}" for t in time]
    content = content_of("time_s,shaft_1_N_m,shaft_1_rpm,side_kN,tilt_kN_m\n" + "\n".join(lines) + "\n", tmp_path)
    content["loads"]["sources"]["spectrum"] |= {
        "skip_s": 0.0,
        "hub_forces": ["side_kN", "-side_kN", "side_kN"],
        "hub_moments": ["tilt_kN_m", "tilt_kN_m"],
    }
    counted = count_loads(Gearbox.from_dict(content, str(tmp_path / "gearbox.toml")))
    points, source = counted.points, counted.sources[0]
    assert source.hub[:, 0] == pytest.approx(5e3 * np.cos(2 * time), abs=1e-2)
    assert source.hub[:, 1] == pytest.approx(-source.hub[:, 0])
    assert len(points.torque) > 1.5 * len(counted.distribution.hours)
    assert points.revolutions.sum() == pytest.approx(counted.distribution.revolutions.sum())
    mean = np.average(points.other, axis=0, weights=points.revolutions)
    assert mean == pytest.approx(np.average(source.hub, axis=0, weights=source.hours * source.speed), abs=1e-6)
    by_bin = np.bincount(points.bin, points.hours)
    assert by_bin == pytest.approx(counted.distribution.hours)


def test_planet_bearings_carry_the_couple_of_their_helix(grc, balance):
    """Radially both bearings of a planet carry two tangential forces and the pair that the axial forces make."""
    assembly = grc.assembly()
    names = [support.name for support in assembly.supports]
    load = balance.bearing_load.values[-1, 0, names.index("pl_a_1")]
    half = 240e3 / 3 / 0.308 / 2.0
    assert math.hypot(load[0], load[1]) == pytest.approx(1.1 * half, rel=0.06)  # 6 to 14 % above, by planet
    counted = count_loads(grc.gearbox)
    assert counted.bearings["pl_a_1"] == pytest.approx(99.0 / 39.0)


@pytest.mark.validation
def test_stresses_of_aligned_gears_are_told_with_the_mesh_model_that_includes_misalignment(first):
    said = "of spur for aligned gears; --mesh-model table includes misalignment"
    assert said in read_life(first.life_path).attrs["assumptions"]
    tabled = first.chosen(mesh_model="table").life()
    assert "aligned gears" not in tabled.attrs["assumptions"]


@pytest.mark.validation
def test_the_verb_tells_what_limits_and_what_that_rests_on(tmp_path, first):
    case = tmp_path / "gearbox.toml"
    (tmp_path / "loads.csv").write_text(TABLE)
    for kept in ("tables", "stress"):
        shutil.copytree(first.folder / kept, tmp_path / "out" / kept)
    text = SPUR_CASE + "".join(
        f'\n[rating.gears.{gear}]\nsigma_H_lim_MPa = 1900.0\nsigma_F_lim_MPa = 500.0\ncurve = "case_hardened"\n'
        "roughness_Rz_um = 4.8\nroot_factor = 1.0\n"
        for gear in ("pinion", "wheel")
    )
    text += "\n[rating]\ndynamic_factor = 1.05\nviscosity_40_mm2_per_s = 320.0\n"
    text += '\n[loads]\nbody = "shaft_1"\nlife_years = 10.0\nsources.spectrum = '
    text += '{ file = "loads.csv", hours_per_year = 1000.0 }\n'
    case.write_text(text)
    arguments = ["life", str(case), "--variant", "rigid", "--mesh-model", "iso6336", "--out", str(tmp_path / "out")]
    result = exugear(*arguments, "--json")
    assert result.exit_code == 0, result.output
    told = json.loads(result.stdout)
    (relief,) = told["reliefs"]
    assert relief.startswith("spur: up to ") and relief.endswith("add tip relief")
    assert [one["flank"] for one in told["flanks"]] == ["pinion + spur", "wheel + spur"]
    assert told["limits"][0]["damage"] >= told["limits"][-1]["damage"]
    assert any("variant rigid has none" in line for line in told["unrated"])
    assert any(line.startswith("K_v = 1.05") for line in told["assumptions"])
    picture = Path(told["file"]).with_suffix(".png")
    assert picture.stat().st_size > 10_000
    data = read_life(Path(told["file"]))
    _, shares = damage_matrix(data, limits(data))
    assert shares.sum(axis=1) == pytest.approx(np.ones(len(shares)))
    shown = exugear(*arguments)
    assert "Parts with the largest fatigue damage" in shown.stdout
