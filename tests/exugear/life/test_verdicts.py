"""What a life comes to: the worst planet, damage without end, loads beyond tables, safeties and lives asked for."""

from __future__ import annotations

import copy
import json
import math
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.sections.loads import StrengthSection
from exugear.life.bearing_life import BearingLife, bearing_lives
from exugear.life.dynamic_factors import DynamicFactor, stated_factors
from exugear.life.gear_life import FlankLife, flank_lives, roughness_of, worst_of
from exugear.life.life import LARGEST_REACH, check_reach, checked_loads, failures, rating_of, shortfalls
from exugear.life.life_file import INFINITE, damage_matrix, draw_life, limits, read_life, summary
from exugear.life.static_balance import acting_loads, static_balance
from exugear.project import Project
from exugear.report.writer import write_report
from exugear.system.bearings.rolling.life import (
    fatigue_limit,
    life_factor,
    viscosity_at,
    viscosity_ratio,
)
from fe_ste.root_stress import MeshCycleStress

from ..cases.case_mutations import toml_text
from ..cases.command import exugear
from ..cases.gear_trains import pair
from ..cases.spur import SPUR_CASE
from .test_life import OIL, TABLE, content_of, hub_assembly

pytestmark = pytest.mark.usefixtures("coarse_tables")

GRC = Path("cases/grc750/gearbox.toml")
TYPE = "cylindrical_roller"


def hertzian(torque: float) -> MeshCycleStress:
    """Stresses of a pair that go with the root of torque, and with torque: 1200 and 200 MPa at this one."""
    flat = np.ones((1, 1))
    return MeshCycleStress(
        torque=np.array([torque]),
        misalignment=np.zeros(1),
        hertz=1200e6 * flat,
        pitch_hertz=1200e6 * flat,
        outside=0.0 * flat,
        face_load=1.2 * flat,
        root=200e6 * np.ones((1, 1, 2)),
        compression=-200e6 * np.ones((1, 1, 2)),
    )


@cache
def planets_with(pin_of: int = 0) -> dict[str, FlankLife]:
    """Flanks of the GRC, with the pin of a planet 60 um out of its place, or none."""
    pins = {"pin": {"body": f"planet_{pin_of}", "tangential_um": 60.0}} if pin_of else {}
    content = {**Gearbox.from_toml(GRC).content, "pins": pins}
    gearbox = Gearbox.from_dict(content, str(GRC))
    project = Project(gearbox, Path("nowhere"), Choice("bushing", "iso6336"))
    counted = checked_loads(gearbox)
    acting = acting_loads(counted)
    balance = static_balance(project.assembly(), counted.body, acting.torques, 12)
    stresses = {name: hertzian(pair.static_torque) for name, pair in gearbox.pairs.items()}
    rating = rating_of(gearbox)
    dynamic = stated_factors(gearbox, 1.05)
    lives = flank_lives(gearbox, rating, counted.teeth, acting, balance, stresses, dynamic)
    return {f"{one.gear} {one.family}": one for one in lives}


@pytest.mark.validation
def test_the_worst_of_all_planets_is_rated_and_told():
    """A pin 60 um out of place lowers the planets' safety whichever planet it belongs to, and by the same."""
    right = planets_with()["planet sun_planet"]
    by_planet = {number: planets_with(number)["planet sun_planet"] for number in (1, 2, 3)}
    safeties = [one.contact_safety for one in by_planet.values()]
    assert safeties == pytest.approx([safeties[0]] * 3, rel=3e-3)
    assert max(safeties) < 0.99 * right.contact_safety
    worst = [int(one.contact_holder.removeprefix("planet_")) for one in by_planet.values()]
    # The same planet as seen from that whose pin is out of place.
    assert len({(other - number) % 3 for number, other in zip(by_planet, worst, strict=True)}) == 1
    assert by_planet[2].root_holder == by_planet[2].contact_holder


def test_both_safeties_are_told_and_that_of_the_standard_has_its_factors():
    """One torque: stresses by hand from sigma_H0 and sigma_F0, K_v, K_gamma and K_Hbeta; its curve gives S."""
    one = planets_with()["im_pinion intermediate"]
    gearbox = Gearbox.from_toml(GRC)
    pair = gearbox.gear_pairs["intermediate"]
    ratio = (one.root_safety * one.root_stress) / (one.standard_root_safety * one.nominal_root)
    height = max(one.tip_radius - one.root_radius for one in (pair.pinion, pair.gear))
    slender = pair.face_width / height
    exponent = slender**2 / (1.0 + slender + slender**2)
    # Both stresses are proportional to torque at one K_Hbeta: safeties are as strengths over stresses are.
    assert ratio == pytest.approx(1.05 * 1.2**exponent / 1.0, rel=2e-3)
    contact = (one.contact_safety * one.contact_stress) / (one.standard_contact_safety * one.nominal_contact)
    # f_ZCa of helical gears without flank modification, ISO 6336-2:2019
    assert contact == pytest.approx(math.sqrt(1.2 * 1.05 * 1.2), rel=2e-3)
    ring = planets_with()["ring ring_planet"]  # its Y_F is that of Corrigendum 1, and its rim counts
    assert 1.0 < ring.standard_root_safety < math.inf and ring.nominal_root > 0.0


def test_the_worst_of_each_figure_is_told_of_flanks_that_are_alike():
    one = planets_with()["planet sun_planet"]
    other = replace(one, contact_holder="planet_2", contact_damage=2.0 * one.contact_damage, root_static=0.5)
    found = worst_of([one, replace(other, compression=one.compression - 1.0)])
    assert found.contact_damage == 2.0 * one.contact_damage
    assert (found.contact_holder, found.root_static) == ("planet_2", 0.5)
    assert found.compression == one.compression - 1.0
    assert worst_of([one]).contact_holder == ""


@pytest.mark.validation
def test_load_sharing_has_the_loads_of_a_hub():
    """K_gamma is the largest of all forces, those under the moment of a hub among them, over the mean of torque."""
    assembly, torque = hub_assembly(), np.array([240e3])
    sizes = np.array([0.0, 0.0, 0.0, 200e3, 0.0])
    balance = static_balance(assembly, "main_shaft", torque, 4, hub=sizes)
    meshes = [number for number, mesh in enumerate(assembly.gearbox.meshes) if mesh.family == "sun_planet"]
    hub = np.array([[0.0, 0.0, 0.0, 150e3, 0.0]])
    forces = balance.at(balance.mesh_force, torque, hub)[0][:, meshes]
    alone = balance.at(balance.mesh_force, torque)[0][:, meshes]
    assert balance.load_sharing(meshes, torque, hub) == pytest.approx(np.abs(forces).max() / np.abs(alone).mean())
    assert balance.load_sharing(meshes, torque, hub) > 1.01 * balance.load_sharing(meshes, torque)


def test_the_dynamic_factor_counts_in_the_range_of_speeds_that_the_loads_have():
    """A resonance at 200 rad/s does nothing to a body that turns at 10 to 20."""
    factor = DynamicFactor(np.array([10.0, 15.0, 20.0, 200.0]), np.array([1.02, 1.05, 1.03, 1.9]), least=1.01)
    assert factor.largest(10.0, 20.0) == 1.05
    assert factor.largest(10.0, 300.0) == 1.9
    assert factor.largest(18.0, 19.2) == pytest.approx(1.038)  # between its speeds in a straight line
    assert factor.largest(1.0, 2.0) == 1.02  # beyond the run its end


def test_loads_far_beyond_a_table_are_refused_before_any_work(tmp_path):
    for torque, refused in ((870.0, True), (99.9 * LARGEST_REACH, False)):
        content = content_of(f"torque_N_m,speed_rpm,hours\n{torque},1500,3\n-{torque},1500,3\n", tmp_path)
        for gear in content["rating"]["gears"].values():
            gear["mean_stress_factor"] = 0.7
        gearbox = Gearbox.from_dict(content, str(tmp_path / "gearbox.toml"))
        project = Project(gearbox, tmp_path / "out", Choice("bushing", "iso6336"))
        if not refused:
            check_reach(gearbox, checked_loads(gearbox), {"spur": 100.0})
            continue
        with pytest.raises(GearboxFileError, match=r"0.87 kN m on shaft_1 is 8.7 times .* static_load.torques_N_m"):
            project.life()
        assert not project.folder.exists()


@pytest.fixture(scope="module")
def broken(tmp_path_factory) -> tuple[Path, Path]:
    """Case and results of a spur pair whose pinion is of lead, and whose bearing is far too small."""
    folder = tmp_path_factory.mktemp("broken")
    (folder / "loads.csv").write_text(TABLE)
    text = SPUR_CASE + "".join(
        f"\n[rating.gears.{gear}]\nsigma_H_lim_MPa = {limit}\nsigma_F_lim_MPa = 500.0\n"
        'curve = "case_hardened"\nroughness_Rz_um = 4.8\nroot_factor = 1.0\n'
        for gear, limit in (("pinion", 300.0), ("wheel", 1500.0))
    )
    text += "\n[rating]\ndynamic_factor = 1.05\nviscosity_40_mm2_per_s = 320.0\n"
    text += '\n[loads]\nbody = "shaft_1"\nlife_years = 10.0\nsources.spectrum = '
    text += '{ file = "loads.csv", hours_per_year = 1000.0 }\n'
    (folder / "gearbox.toml").write_text(text)
    return folder / "gearbox.toml", folder / "out"


@pytest.mark.validation
def test_infinite_damage_is_the_first_thing_told_with_the_stress_that_causes_it(broken):
    case, out = broken
    arguments = ["life", str(case), "--variant", "rigid", "--mesh-model", "iso6336", "--out", str(out)]
    shown = exugear(*arguments)
    assert shown.exit_code == 1, shown.output
    assert shown.stdout.splitlines()[0].endswith("not reached: damage inf., pinion + spur, pitting")
    first = next(line for line in shown.stderr.splitlines() if "infinite damage" in line).removeprefix("Failed: ")
    assert first.startswith("pinion + spur: infinite damage: the loads cause a contact stress of")
    data = read_life(next(out.glob("*/*/life.nc")))
    stress = float(data["flank_contact_worn"].sel(flank="pinion + spur"))
    assert f"{1e-6 * stress:.4g} MPa" in " ".join(shown.stderr.split())
    assert "required life not reached" in shown.stderr
    told = exugear(*arguments, "--json")
    assert told.exit_code == 1
    content = json.loads(told.stdout, parse_constant=lambda token: pytest.fail(f"{token} is no JSON"))
    assert content["failures"][0].startswith("pinion + spur: infinite damage: the loads cause a contact stress of")
    assert content["limits"][0] == {"part": "pinion + spur", "by": "pitting", "damage": INFINITE}
    assert content["flanks"][0]["contact_damage"] == INFINITE
    assert 0.0 < content["flanks"][0]["contact_safety"] < 1.0
    assert any("S_H" in line for line in content["shortfalls"])


@pytest.mark.validation
def test_infinite_damage_is_in_report_and_picture(broken):
    case, out = broken
    report = write_report(out)
    page = report.path.read_text(encoding="utf-8")
    section = page[page.index('<section id="bearings"') : page.index('<section id="gears"')]
    assert ": infinite damage: the loads cause a contact stress of" in section
    assert any("infinite" in line for line in report.statements)
    data = read_life(next(out.glob("*/*/life.nc")))
    draw_life(data)
    _, shares = damage_matrix(data, limits(data))
    assert shares.sum(axis=1) == pytest.approx(np.ones(len(shares)))


def test_no_stress_below_the_curve_is_called_a_failure():
    lives = planets_with().values()
    assert not list(failures(lives))
    one = replace(next(iter(lives)), root_damage=math.inf, root_worn=3e9, root_limit=2e9)
    (line,) = failures([one])
    assert "a root stress of 3000 MPa" in line and "2000 MPa" in line


def test_bearing_lives_below_the_hours_asked_for_are_shortfalls_and_limit(tmp_path, broken):
    """L10 (25,000 h of 50,000 asked for) counts whether or not L10r is longer."""
    content = content_of("torque_N_m,speed_rpm,hours\n150,1500,1\n", tmp_path)
    section = content["bearings"]["bearing_1"]
    section["catalogue"] = {**section["catalogue"], "dynamic_rating_kN": 25.0}
    gearbox = Gearbox.from_dict(content, str(tmp_path / "gearbox.toml"))
    project = Project(gearbox, tmp_path, Choice("bushing", "iso6336"))
    counted = checked_loads(gearbox)
    acting = acting_loads(counted)
    balance = static_balance(project.assembly(), counted.body, acting.torques, 1)
    (one,) = bearing_lives(project.assembly().supports, counted.bearings, acting, balance)
    hours = 1.01 * one.basic_hours
    assert one.reference_hours > hours
    told = list(shortfalls(rating_of(gearbox), [], [one], hours))
    assert len(told) == 1 and told[0].startswith(f"bearing_1: L10 = {one.basic_hours:,.0f} h, required {hours:,.0f} h")
    assert not list(shortfalls(rating_of(gearbox), [], [one], 0.99 * one.basic_hours))
    weak = list(shortfalls(rating_of(gearbox), [], [replace(one, static_safety=0.9)], 1.0))
    assert weak == ["bearing_1: S_0 = 0.9, required 1"]


def test_each_bearing_life_is_among_what_limits():
    import xarray as xr

    data = xr.Dataset(
        {
            "bearing_damage": ("bearing", [2.6]),
            "bearing_reference_damage": ("bearing", [0.8]),
            "bearing_modified_damage": ("bearing", [3.1]),
        }
        | {f"flank_{key}": ("flank", np.zeros(0)) for key in ("contact_damage", "root_damage")},
        {"bearing": ["hss_a"], "flank": np.zeros(0)},
    )
    assert limits(data) == [("hss_a", "L10m", 3.1), ("hss_a", "L10", 2.6), ("hss_a", "L10r", 0.8)]


@pytest.mark.validation
@pytest.mark.validation
def test_a_kept_life_is_summed_up_without_numbers_that_json_has_not(broken):
    _, out = broken
    json.dumps(summary(read_life(next(out.glob("*/*/life.nc")))), allow_nan=False)


@pytest.mark.validation
@pytest.mark.validation
def test_what_a_kill_behind_the_last_file_left_is_removed(broken):
    """The life is written, its solved angles are not yet removed: the next call takes one and removes the others."""
    case, out = broken
    path = next(out.glob("*/*/life.nc"))
    partial = path.with_suffix(".partial.npz")
    partial.write_bytes(b"angles")
    before = path.stat().st_mtime_ns
    project = Project.from_toml(case, out, Choice("rigid", "iso6336"))
    project.life()
    assert not partial.exists() and path.stat().st_mtime_ns == before


def rated_bearing(folder: Path, oil: dict[str, Any] | None, **catalogue: float) -> BearingLife:
    """The bearing of the spur pair under one torque at one speed."""
    content = content_of("torque_N_m,speed_rpm,hours\n150,1500,1\n", folder)
    content["bearings"] = copy.deepcopy(content["bearings"])
    for bearing in content["bearings"].values():
        if "catalogue" in bearing:
            bearing["catalogue"] |= catalogue
    if oil is not None:
        content["rating"].pop("viscosity_40_mm2_per_s")
        content["lubricant"] = oil
    gearbox = Gearbox.from_dict(content, str(folder / "gearbox.toml"))
    project = Project(gearbox, folder, Choice("bushing", "iso6336"))
    counted = checked_loads(gearbox)
    acting = acting_loads(counted)
    balance = static_balance(project.assembly(), counted.body, acting.torques, 1)
    (one,) = bearing_lives(project.assembly().supports, counted.bearings, acting, balance, gearbox.case.lubricant)
    return one


def test_a_modified_life_takes_the_fatigue_load_limit_that_the_catalogue_prints(tmp_path: Path) -> None:
    """a_ISO of e_C C_u / P with the stated C_u; 3.137 for the 6309 of SKF: P_u 1.34 kN, 10 kN, kappa 2.07, e_C 0.6."""
    assert life_factor(2.07, 0.6 * 1.34 / 10.0, "deep_groove_ball") == pytest.approx(3.137, abs=0.01)
    one = rated_bearing(tmp_path, OIL, fatigue_load_limit_kN=1.0)
    factor = life_factor(one.viscosity_ratio, 0.5 * 1.0e3 / one.equivalent, TYPE)
    assert one.modified_hours == pytest.approx(factor * one.basic_hours, rel=0.01)
    assert one.modified_hours < 0.99 * rated_bearing(tmp_path, OIL).modified_hours


@pytest.mark.validation
def test_modified_lives_have_oil_and_cleanliness(tmp_path):
    """At one load and speed L10m is a_ISO times L10; without what the oil is like there is none."""
    one = rated_bearing(tmp_path, OIL)
    pitch = 0.06
    ratio = viscosity_ratio(viscosity_at(70.0, 220.0, 19.0), 1500.0 * math.pi / 30.0, pitch)
    assert one.viscosity_ratio == pytest.approx(ratio, rel=0.02)
    factor = life_factor(ratio, 0.5 * fatigue_limit(53e3, pitch, "cylindrical_roller") / one.equivalent, TYPE)
    assert one.modified_hours == pytest.approx(factor * one.basic_hours, rel=0.03)
    for key in ("viscosity_100_mm2_per_s", "temperature_C", "cleanliness"):
        less = {name: value for name, value in OIL.items() if name != key}
        assert math.isnan(rated_bearing(tmp_path, less).modified_hours)
    dirty = rated_bearing(tmp_path, OIL | {"cleanliness": "severe"})
    assert dirty.modified_hours == pytest.approx(0.1 * dirty.basic_hours)
    assert one.minimum_load == pytest.approx(0.02 * 60e3)


def test_ra_counts_as_a_sixth_of_rz(tmp_path):
    content = content_of(TABLE, tmp_path)
    section = {**content["rating"]["gears"]["pinion"]}
    section.pop("roughness_Rz_um")
    assert roughness_of(StrengthSection(**section, roughness_Ra_um=0.8)) == pytest.approx(4.8e-6)


def test_a_life_in_which_no_part_is_rated_is_not_called_reached(tmp_path):
    """Stated stiffness of teeth and bearings, and no strength of any gear."""
    content = pair()
    duty = {"torque_N_m": [100.0], "speed_rpm": [600.0], "hours": [1000.0]}
    content["loads"] = {"body": "input", "life_years": 1.0, "sources": {"duty": duty}}
    content["rating"] = {"dynamic_factor": 1.0, "viscosity_40_mm2_per_s": 220.0}
    case = tmp_path / "gearbox.toml"
    case.write_text(toml_text(content), encoding="utf-8")
    result = exugear("life", case, "--out", tmp_path / "results")
    assert result.exit_code == 0, result.output
    assert "Life of 1 year, 1,000 h, unknown: no part is rated" in result.stdout
    assert "Warning: no part is rated: the rating of gears requires [rating.gears.NAME]" in result.stderr
