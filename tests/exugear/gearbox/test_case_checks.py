"""What `check` refuses by name, what it warns of, and what it says of the variants; what it passes works."""

from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.load_cases import summarise_loads
from exugear.gearbox.reading import GearboxFileError
from exugear.system.gearbox_checks import check_parts, gearbox_warnings, lacking
from exugear.system.modes import eigenmodes
from exugear.system.statics import locked_equilibrium
from exugear.system.tooth_mesh.tables import wanted_table

from ..cases import gear_trains
from ..cases.assembled import assembled, modes_with_bodies
from ..cases.case_mutations import bases, toml_text
from ..cases.command import exugear

ISO = {"sun_planet": np.array([3.8e9]), "ring_planet": np.array([4.9e9])}
HELD = {"radial_N_per_m": 1e9, "axial_N_per_m": 1e9, "tilt_N_m_per_rad": 1e7}


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, dict[str, Any]]]:
    folder = tmp_path_factory.mktemp("cases")
    return folder / "case.toml", bases(folder)


@pytest.fixture
def case(cases: tuple[Path, dict[str, dict[str, Any]]]) -> Any:
    """Give a gearbox from the name of a case and changes of it by dotted keys."""
    file, contents = cases

    def built(base: str, /, **changes: Any) -> Gearbox:
        content = copy.deepcopy(contents[base])
        return Gearbox.from_dict(changed(content, changes), str(file))

    return built


def changed(content: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """Replace keys, written with two underscores for a dot; None deletes."""
    for dotted, value in changes.items():
        *parents, last = dotted.split("__")
        section = content
        for part in parents:
            section = section.setdefault(part, {})
        if value is None:
            del section[last]
        else:
            section[last] = value
    return content


def equal_planets(count: int) -> dict[str, Any]:
    # Every sun and ring of 21 and 99 teeth takes planets at multiples of 3 deg: these are as equal as that allows.
    return {"bodies__planet__planet_angles_deg": [float(3 * round(120 * n / count)) for n in range(count)]}


# -- trains that ended in a traceback -------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [1, 3])
def test_planets_share_the_load_of_the_carrier(case: Any, count: int) -> None:
    gearbox = case("planetary", **equal_planets(count), pins={})
    forces = gearbox.train.static_mesh_forces()
    # The sun takes the carrier's torque over the ratio 1 + z_ring / z_sun, in equal parts.
    expected = 240e3 / (1.0 + 99.0 / 21.0) / gearbox.gears["sun"].base_radius / count
    assert len(forces) == 2 * count
    assert [abs(force) for force in forces.values()] == pytest.approx([expected] * (2 * count), rel=1e-9)


@pytest.mark.parametrize("variant", ["rigid", "bushing"])
@pytest.mark.parametrize("count", [1, 3, 4])
@pytest.mark.parametrize("torque", [1.0, 240e3])
def test_meshes_carry_what_statics_say_under_any_load(case: Any, variant: str, count: int, torque: float) -> None:
    # Rounding of springs of 1e10 N/m is 1e-6 N: under 1 N m it is not below 1e-9 of the load.
    gearbox = case("planetary", **equal_planets(count), static_load__torques_N_m={"carrier": torque}, pins={})
    assembly = assembled(gearbox, Choice(variant), ISO)
    q = locked_equilibrium(assembly, {"carrier": torque}, ["shaft"], assembly.mean_meshes)
    found = assembly.mesh_states(q, np.zeros_like(q), assembly.mean_meshes)[:, 4]
    expected = sum(abs(force) for force in gearbox.train.static_mesh_forces().values())
    assert np.abs(found).sum() == pytest.approx(expected, rel=1e-3 if variant == "bushing" else 1e-6)


@pytest.mark.validation
def test_a_brake_that_is_locked_holds_the_train_as_its_shaft_would(case: Any) -> None:
    gearbox = case("grc", static_load__locked=["brake"])
    plain = case("grc")
    assert gearbox.train.ratio == pytest.approx(plain.train.ratio, rel=1e-12)
    assert gearbox.train.static_mesh_forces() == pytest.approx(plain.train.static_mesh_forces(), rel=1e-9)
    stiffness = {name: np.array([3e9]) for name in gearbox.pairs}
    for variant in ("rigid", "bushing"):
        held, free = (modes_with_bodies(one, Choice(variant), stiffness).frequency for one in (gearbox, plain))
        assert held == pytest.approx(free, rel=1e-6, abs=1e-3)


def test_balanced_torques_need_no_lock(case: Any) -> None:
    balanced = {"shaft_1": 100.0, "shaft_2": 150.0}
    free = case("spur", static_load={"torques_N_m": balanced, "locked": []})
    held = case("spur")
    stiffness = {"spur": np.array([2e8])}
    assert free.train.static_mesh_forces() == pytest.approx(held.train.static_mesh_forces())
    assert eigenmodes(free, Choice("bushing"), stiffness).frequency == pytest.approx(
        eigenmodes(held, Choice("bushing"), stiffness).frequency, rel=1e-6, abs=1e-3
    )


MASS = {"mass_kg": 500.0, "axial_kg_m2": 160.0, "transverse_kg_m2": 90.0, "centre_of_mass_z_mm": 0.0}
DIFFERENTIAL = {
    "bodies__rim": {
        "axis_position_mm": [0.0, 0.0],
        "gears_z_mm": {"ring": 0.0},
        "inertia": {"given": MASS},
    },
    "joints__rim": {"body": "rim", "z_mm": 0.0},
    "bearings__rim": {"body": "rim", "z_mm": 0.0, "stiffness": HELD},
    "bearings__carrier__on": "ground",
}  # fmt: skip


@pytest.mark.parametrize(
    ("locked", "torques"),
    [(["shaft", "rim"], {"carrier": 240e3}), (["shaft"], {"carrier": 240e3, "rim": -198e3})],
)
def test_a_differential_has_modes_and_runs_and_no_steady_response(
    case: Any, cases: Any, tmp_path: Path, locked: list[str], torques: dict[str, float]
) -> None:
    static = {"static_load": {"torques_N_m": torques, "locked": locked}}
    if locked == ["shaft"]:  # nothing says which of the two stands
        with pytest.raises(GearboxFileError, match="2 degrees of freedom"):
            case("planetary", **DIFFERENTIAL, **static)
        return
    gearbox = case("planetary", **DIFFERENTIAL, **static)
    assert any("2 degrees of freedom" in line for line in gearbox_warnings(gearbox))
    for variant in ("rigid", "bushing"):
        assert (modes_with_bodies(gearbox, Choice(variant), ISO).frequency < 0.1).sum() == 2
    file = tmp_path / "case.toml"
    file.write_text(toml_text(dict(gearbox.content)), encoding="utf-8")
    how = ("--variant", "rigid", "--mesh-model", "iso6336", "--out", tmp_path / "out")
    assert exugear("run", file, *how, "--duration", 0.02).exit_code == 0
    outcome = exugear("steady", file, *how, "--speeds", "10:20", "--points", "2")
    assert (outcome.exit_code, "2 degrees of freedom" in outcome.stderr) == (2, True)


def test_a_held_carrier_of_a_train_that_turns_has_modes(case: Any) -> None:
    static = {"torques_N_m": {"rim": -1e4}, "locked": ["shaft", "carrier"]}
    held = {"static_load": static, "overall__input": "rim"}
    gearbox = case("planetary", **DIFFERENTIAL, **held)
    assert gearbox.train.ratio == pytest.approx(-99.0 / 21.0, rel=1e-12)  # Willis, the carrier at rest
    for variant in ("rigid", "bushing"):
        assert (modes_with_bodies(gearbox, Choice(variant), ISO).frequency < 0.1).sum() == 2


@pytest.mark.parametrize(
    ("base", "changes", "said"),
    [
        ("planetary", {"bodies__planet__carrier": "nobody"}, "bodies.planet.carrier = 'nobody': no such body"),
        ("planetary", {"bodies__planet__carrier": "planet"}, "a carrier cannot be a planet"),
        ("spur", {"bodies__ground": {"fixed": True, "axis_position_mm": [0.0, 0.0]}}, "bodies.ground: ground is the"),
        ("spur", {"overall__output": "shaft_1"}, "overall.output = 'shaft_1': is also the input; set the body"),
        ("spur", {"overall__output_gear": "pinion"}, "overall.output_gear = 'pinion': does not rotate with shaft_2"),
        ("spur", {"meshes__spur__gear_body": "ground"}, "meshes.spur.gear_body = 'ground': set a rotating body"),
        ("spur", {"couplings": {"c": {"bodies": ["shaft_1", "ground"], "stiffness_N_m_per_rad": 1e3}}},
         "couplings.c.bodies: 'ground' has no rotation of its own; a coupling connects two of"),
        ("planetary", {"bodies__planet_1": {"fixed": True, "axis_position_mm": [0.0, 0.0]}}, "planets are numbered"),
        ("planetary", {"bodies__planet__planet_angles_deg": [0.0, 120.0, 0.0, 120.0]}, "planet_1 and planet_3 collide"),
        ("planetary", {"bodies__planet__planet_angles_deg": [0.0] * 41}, "at most 40 entries"),
        ("everything", {"pins__again": {"body": "planet_1", "radial_um": 1.0}}, "pins: two tables for the same planet"),
    ],
)  # fmt: skip
def test_trains_that_do_not_work_are_named(case: Any, base: str, changes: dict[str, Any], said: str) -> None:
    with pytest.raises(GearboxFileError) as caught:
        case(base, **changes)
    assert said in str(caught.value)


# -- stiffness, damping, masses ---------------------------------------------------------------------------------------


def matrix(*diagonal: float, **entries: float) -> dict[str, Any]:
    rows = np.diag(diagonal)
    for place, value in entries.items():
        rows[int(place[1]) - 1, int(place[2]) - 1] = value
    return {"matrix": rows.tolist()}


PLAIN = (2e7, 2e7, 1e8, 1e6, 1e6, 0.0)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {"stiffness": matrix(*PLAIN, k12=1e6)},
            "stiffness.matrix: is not symmetric: 1e+06 in row 1, column 2, but 0 in",
        ),
        ({"stiffness": matrix(2e7, 2e7, -1e8, 1e6, 1e6, 0.0)}, "stiffness.matrix: is not positive semi-definite"),
        ({"stiffness": matrix(*PLAIN, k12=3e7, k21=3e7)}, "stiffness.matrix: is not positive semi-definite"),
        ({"stiffness": matrix(*PLAIN, k16=1e3, k61=1e3)}, "stiffness.matrix: is not positive semi-definite"),
        ({"stiffness": matrix(*[0.0] * 6)}, "stiffness: is zero in all directions"),
        ({"stiffness": {}}, "stiffness: is zero in all directions"),
        ({"stiffness": {"radial_N_per_m": -1.0}}, "radial_N_per_m = -1.0: must lie between 0 and 1e+13"),
        (
            {"stiffness": {"radial_N_per_m": 1e7, **matrix(*PLAIN)}},
            "matrix: cannot be combined with radial_N_per_m",
        ),
        ({"damping": matrix(1.0, -1.0, 1.0, 1.0, 1.0, 0.0)}, "damping.matrix: is not positive semi-definite"),
    ],
)
def test_matrices_that_no_bearing_has_are_named(case: Any, changes: dict[str, Any], said: str) -> None:
    with pytest.raises(GearboxFileError) as caught:
        case("spur", **{f"bearings__bearing_1__{key}": value for key, value in changes.items()})
    assert "bearings.bearing_1." in str(caught.value)
    assert said in str(caught.value)


def test_a_matrix_symmetric_to_its_printed_digits_is_taken(case: Any) -> None:
    rounded = matrix(*PLAIN, k15=1.2345e6, k51=1.2344e6)
    assert lacking(case("spur", bearings__bearing_1__stiffness=rounded), "bushing") == ""


@pytest.mark.parametrize(
    ("base", "key", "value"),
    [
        ("spur", "damping__mesh_time_s", 1.0),
        ("spur", "bodies__shaft_1__inertia__disc__mass_kg", 1e30),
        ("spur", "gears__pinion__material", {"youngs_modulus_GPa": 206e9}),
        ("spur", "gears__pinion__material", {"density_kg_per_m3": 7.85}),
        ("spur", "gears__pinion__material", {"poissons_ratio": 0.495}),
        ("spur", "gears__pinion__face_width_mm", 15e6),
        ("spur", "gears__pinion__teeth", 10**9),
        ("modified", "gears__pinion__modification__tip_relief_um", 20e3),
        ("modified", "bearings__bearing_2__catalogue__radial_clearance_mm", 20.0),
        ("everything", "deviations__planet__runout_um", 1e6),
        ("box", "bodies__box__solid__elements_around", 10**6),
        ("spur", "ste__positions", 10**6),
    ],
)
def test_values_that_nothing_has_are_refused_in_one_line_with_the_key(
    case: Any, base: str, key: str, value: Any
) -> None:
    with pytest.raises(GearboxFileError) as caught:
        case(base, **{key: value})
    (line,) = str(caught.value).splitlines()
    assert key.replace("__", ".") in line
    assert "must lie between" in line


def test_a_relief_deeper_than_half_a_module_is_refused(case: Any) -> None:
    with pytest.raises(GearboxFileError, match=r"tip_relief_um = 1600: must be at most 1500, half a normal module"):
        case("modified", gears__pinion__modification__tip_relief_um=1600.0)


def test_a_topography_deeper_than_half_a_module_is_refused(case: Any, cases: Any) -> None:
    deep = "radius_mm,-7.0,7.0\n29.0,1601.0,0.0\n31.0,0.0,2.0\n"
    (cases[0].parent / "deep.csv").write_text(deep, encoding="utf-8")
    with pytest.raises(
        GearboxFileError, match=r"pinion.modification.topography, removed_um = 1601: must be at most 1500"
    ):
        case("modified", gears__pinion__modification__topography="deep.csv")


def test_what_carries_nothing_in_the_static_load_is_told(case: Any) -> None:
    gearbox = case("spur", static_load={"torques_N_m": {"shaft_1": 100.0}, "locked": ["shaft_1"]})
    assert gearbox.train.static_mesh_forces() == {"spur": 0.0}  # not the rounding of zero
    assert any(
        "so no table is computed: mesh stiffness to ISO 6336-1, no excitation" in line
        for line in gearbox_warnings(gearbox)
    )
    still = case("grc", static_load__torques_N_m={"carrier": 0.0})
    assert set(still.train.static_mesh_forces().values()) == {0.0}
    (loads,) = {summarise_loads(still, still.load_cases["reference"]).reversed_flanks}
    assert loads == ()


def test_more_locks_than_freedoms_are_refused(case: Any) -> None:
    with pytest.raises(GearboxFileError, match=": more bodies than the degrees of freedom of the train"):
        case("spur", static_load={"torques_N_m": {"shaft_1": 100.0}, "locked": ["shaft_1", "shaft_2"]})


def test_unusual_values_are_warnings(case: Any) -> None:
    gearbox = case("spur", gears__pinion__material={"youngs_modulus_GPa": 0.5}, load_cases__run_up__duration_s=1e4)
    assert gearbox.warnings == (
        "gears.pinion.material.youngs_modulus_GPa = 0.5: unusual, most lie between 1 and 700; check the unit",
        "load_cases.run_up.duration_s = 10000: unusual, most lie between 0.01 and 3600; check the unit",
    )
    assert case("grc").warnings == case("spur").warnings == ()
    twisted = case("spur", bearings__bearing_1__stiffness={**HELD, "torsion_N_m_per_rad": 10.0})
    assert twisted.warnings == (
        "bearings.bearing_1.stiffness: torsion 10 N m/rad constrains shaft_1, which rotates; remove it",
    )


# -- bodies that nothing holds ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("stiffness", "motion"),
    [
        ({"radial_N_per_m": 1e8, "tilt_N_m_per_rad": 1e6}, "move along z"),
        ({"radial_N_per_m": 1e8, "axial_N_per_m": 1e8}, "tilt about"),
        ({"axial_N_per_m": 1e8, "tilt_N_m_per_rad": 1e6}, "move along"),
        (matrix(0.0, 1e8, 1e8, 1e6, 1e6, 0.0), "move along"),
    ],
)
def test_a_body_free_to_move_is_named_with_the_direction(case: Any, stiffness: dict[str, Any], motion: str) -> None:
    loose = case("spur", bearings__bearing_2__stiffness=stiffness)
    said = lacking(loose, "bushing")
    assert "shaft_2" in said or "shaft_1" in said
    assert motion in said
    assert lacking(loose, "rigid") == ""  # its joints hold it
    assert lacking(case("spur"), "bushing") == ""


def test_two_bearings_without_tilt_stiffness_hold_a_shaft(case: Any) -> None:
    plain = {"radial_N_per_m": 1e8, "axial_N_per_m": 1e8}
    second = {"body": "shaft_2", "z_mm": 40.0, "stiffness": {"radial_N_per_m": 1e8}}
    held = case("spur", bearings__bearing_2__stiffness=plain, bearings__second=second)
    assert lacking(held, "bushing") == ""


def test_variants_that_cannot_be_built_are_told_and_refused_before_anything_is_written(
    tmp_path: Path, cases: Any
) -> None:
    content = changed(copy.deepcopy(cases[1]["spur"]), {"joints": {"joint_1": {"body": "shaft_1", "z_mm": 0.0}}})
    content["bearings"]["bearing_2"]["stiffness"] = {"radial_N_per_m": 1e8, "tilt_N_m_per_rad": 1e6}
    file = tmp_path / "case.toml"
    file.write_text(toml_text(content), encoding="utf-8")
    found = json.loads(exugear("check", file, "--json").stdout)["variants"]
    assert found["rigid"] == "no joint supports shaft_2; add one in [joints]"
    assert (
        found["bushing"] == "body shaft_2 can move along z without resistance; add a bearing or increase its stiffness"
    )
    assert found["flexible"].startswith("no flexible body is defined; add")
    for variant, reason in found.items():
        for verb in ("modes", "run"):
            outcome = exugear(verb, file, "--variant", variant, "--mesh-model", "iso6336", "--out", tmp_path / "out")
            assert outcome.exit_code == 2
            assert f"variant {variant}: {reason}" in outcome.stderr
    assert not (tmp_path / "out").exists()


BLANK = {"mass_kg": 1.0, "axial_kg_m2": 1.0, "transverse_kg_m2": 1.0}

# -- all parts before anything is written ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("base", "changes", "said"),
    [
        ("modified", {"bearings__bearing_2__catalogue__bore_mm": 80.0}, "catalogue: bore_mm = 80 must be below"),
        ("modified", {"bearings__bearing_2__catalogue__radial_load_kN": 0.0}, "bearing_2.catalogue: bearing: force"),
        ("shafts", {"bodies__shaft_1__shape__sections": [
            {"length_mm": 60.0, "outer_diameter_mm": 20.0, "inner_diameter_mm": 30.0}]}, "= 30 must be below"),
        ("shafts", {"bodies__shaft_1__shape__start_z_mm": 0.0}, "shaft_1.shape: seat bearing_1: extends from z ="),
        ("shafts", {"bodies__shaft_1__shape__blanks__lid": BLANK}, "bodies.shaft_1.shape.blanks.lid: no such seat"),
        ("shafts", {"bodies__shaft_1__shape__sections": [{"length_mm": 1e5, "outer_diameter_mm": 2000.0}]},
         "elements over its section; at most 50000 are permitted"),
        ("box", {"bodies__box__solid__file": "missing.vtu"}, "bodies.box.solid.file = 'missing.vtu': no such file"),
        ("box", {"bodies__box__solid__seats__foot__same_as": "bearing_1"}, "same_as cannot be combined"),
        ("modified", {"load_cases__series__torque_series": "flank.csv"}, "flank.csv: expected a header time_s"),
        ("modified", {"gears__pinion__modification__topography": "series.csv"}, "gears.pinion.modification: "),
        ("spur", {"ste__grid": True, "ste__centre_distance_offsets_um": [-3000.0, 0.0]}, "offsets_um: -3000"),
        ("spur", {"ste": {"positions": 2000, "torque_factors": [n / 10 for n in range(1, 51)]}}, "table states"),
    ],
)  # fmt: skip
def test_parts_that_cannot_be_built_are_refused_before_anything_is_written(
    cases: Any, tmp_path: Path, base: str, changes: dict[str, Any], said: str
) -> None:
    file, contents = cases
    file.write_text(toml_text(changed(copy.deepcopy(contents[base]), changes)), encoding="utf-8")
    for arguments in (["check", file], ["ste", file, "--out", tmp_path / "out"]):
        outcome = exugear(*arguments)
        assert outcome.exit_code == 2, outcome.exception
        assert said in outcome.stderr
    assert not (tmp_path / "out").exists()


def test_axes_that_follow_from_the_static_state_stay_where_the_gears_run(case: Any) -> None:
    fine = case("spur", gears__pinion__tooth_thinning_mm=0.0)
    assert fine.ste.centre_distance_offsets_um is None and fine.table_distances("spur") == ()
    assert wanted_table(fine, "spur", 8, grid=True).centre_distance[0] == fine.gear_pairs["spur"].centre_distance
    check_parts(fine)


# -- all errors at once, types, files --------------------------------------------------------------------------------


def test_each_fault_has_a_line_and_there_is_an_end_to_them(case: Any) -> None:
    with pytest.raises(GearboxFileError) as caught:
        case("spur", gears__pinion__teeth="20", gears__wheel__internal=1, pairs__spur__table="yes", ste__positions=50.0,
             gears__wheel__theeth=3, name=True)  # fmt: skip
    lines = str(caught.value).splitlines()
    assert [line.split(": ", 1)[1] for line in lines] == [
        "name = True: must be text in quotes",
        "gears.pinion.teeth = '20': must be a whole number, without quotes and decimal point",
        "gears.wheel.internal = 1: must be true or false",
        "gears.wheel.theeth = 3: unknown key; did you mean 'teeth'?",
        "pairs.spur.table = 'yes': must be true or false",
        "ste.positions = 50.0: must be a whole number, without quotes and decimal point",
    ]
    with pytest.raises(GearboxFileError) as caught:
        case("spur", gears={f"gear_{n}": {} for n in range(40)})
    assert len(str(caught.value).splitlines()) == 25
    assert str(caught.value).endswith("and 136 more errors")


def test_faults_that_have_nothing_to_do_with_each_other_are_told_at_once(tmp_path: Path) -> None:
    """Of gears, joints and ends of the train; in the message, in JSON and in the error."""
    content = gear_trains.planetary("ring")
    content["gears"]["sun"]["profile_shift"] = 3.0
    content["joints"]["sun"]["body"] = "nobody"
    content["overall"]["output"] = "housing"
    file = tmp_path / "case.toml"
    file.write_text(toml_text(content), encoding="utf-8")
    outcome = exugear("check", file, "--json")
    assert outcome.exit_code == 2
    errors = json.loads(outcome.stdout)["errors"]
    told = ("gears.sun", "joints.sun", "overall.output")
    assert all(any(f": {key}" in error for error in errors) for key in told), errors
    assert all(error in outcome.stderr for error in errors)
    with pytest.raises(GearboxFileError) as caught:
        Gearbox.from_toml(file)
    assert list(caught.value.errors) == errors


def test_faults_of_writing_hide_no_faults_of_what_could_be_read(tmp_path: Path) -> None:
    """A misspelt key of one gear, a missing table: another gear, a bearing and a matrix are judged all the same."""
    content = gear_trains.planetary("ring")
    content["gears"]["planet"]["theeth"] = 3
    content["gears"]["sun"]["profile_shift"] = 3.0
    del content["static_load"]
    first = next(iter(content["bearings"].values()))
    first.pop("stiffness", None)
    first["catalogue"] = {
        "type": "cylindrical_roller", "bore_mm": 50.0, "outer_diameter_mm": 90.0, "width_mm": 20.0,
        "element_count": 60, "element_diameter_mm": 13.0, "radial_load_kN": 1.0,
    }  # fmt: skip
    file = tmp_path / "case.toml"
    file.write_text(toml_text(content), encoding="utf-8")
    outcome = exugear("check", file, "--json")
    assert outcome.exit_code == 2
    errors = json.loads(outcome.stdout)["errors"]
    assert [error.split(": ")[1] for error in errors[:2]] == ["static_load", "gears.planet.theeth = 3"]
    assert any(": gears.sun: " in error for error in errors)
    assert any(".catalogue: " in error for error in errors)
    # What rests on the planet is left alone: its pairs, and the body that carries it.
    assert not any(f": {key}" in error for error in errors for key in ("pairs.", "bodies.", "meshes."))


def test_a_gear_that_follows_from_a_pair_is_left_alone_where_the_pair_cannot_be_read(case: Any) -> None:
    with pytest.raises(GearboxFileError) as caught:
        case("spur", gears__pinion__profile_shift=0.0, gears__pinion__profile_shift_from_centre_distance=True,
             pairs__spur__centre_distance_mm="far")  # fmt: skip
    assert len(caught.value.errors) == 1
    assert "pairs.spur.centre_distance_mm = 'far': must be a number" in caught.value.errors[0]


@pytest.mark.parametrize("gears", [3, {"pinion": 4}, {"pinion": {"teeth": []}}])
def test_tables_that_are_none_are_told_and_nothing_more(case: Any, gears: Any) -> None:
    with pytest.raises(GearboxFileError, match="gears") as caught:
        case("spur", gears=gears)
    assert not any("no such gear" in error for error in caught.value.errors)


def test_a_seat_beside_its_shaft_makes_the_variant_flexible_impossible() -> None:
    gearbox = Gearbox.from_dict(gear_trains.pair()).varied({"bodies.input.shape.start_z_mm": -20.0})
    with pytest.raises(GearboxFileError, match=r"bodies.input.shape: seat") as caught:
        check_parts(gearbox)
    assert lacking(gearbox, "flexible") in str(caught.value)
    assert [lacking(gearbox, variant) for variant in ("rigid", "bushing")] == ["", ""]


def test_faults_of_several_parts_are_told_together(case: Any) -> None:
    with pytest.raises(GearboxFileError) as caught:
        case("spur", bearings__bearing_1__body="one", bearings__bearing_2__on="two", meshes__spur__pair="three")
    lines = str(caught.value).splitlines()
    assert ["one" in lines[0], "two" in lines[1], "three" in lines[2]] == [True] * 3


def test_one_phase_for_each_mesh_of_a_set_is_taken(case: Any) -> None:
    gearbox = case("planetary", meshes__sun_planet__phase=[0.0, 20.0, 0.5])
    assert gearbox.warnings == ("meshes.sun_planet.phase.1 = 20: unusual, most lie between -10 and 10; check the unit",)


def test_whole_numbers_serve_where_a_length_is_asked(case: Any) -> None:
    assert case("spur", pairs__spur__centre_distance_mm=75).train.ratio == case("spur").train.ratio


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a = " + "[" * 5000 + "]" * 5000, "nested too deep"),
        ("a = " + "9" * 5000, "digits"),
        ("a = 0x" + "f" * 5000, "an integer of 20000 bits: unknown key"),
        ("name = 'a\x00'", "not valid TOML"),
        (f"{'k' * 100_000} = 1", "unknown key"),
        ('name = "a\\u0000b"', "must be text without control characters"),
    ],
)
def test_texts_that_break_parsers_are_told(tmp_path: Path, text: str, said: str) -> None:
    file = tmp_path / "case.toml"
    file.write_text(text, encoding="utf-8")
    outcome = exugear("check", file)
    assert (outcome.exit_code, said in outcome.stderr) == (2, True), outcome.stderr
    assert max(map(len, outcome.stderr.splitlines())) < 500


def test_a_mark_of_byte_order_does_no_harm_and_other_files_are_told(cases: Any, tmp_path: Path) -> None:
    file = tmp_path / "case.toml"
    file.write_text("\ufeff" + toml_text(cases[1]["spur"]), encoding="utf-8")
    assert exugear("check", file).exit_code == 0
    assert "a folder; a regular file is required" in exugear("check", tmp_path).stderr
    with file.open("wb") as handle:
        handle.truncate(20_000_000)
    assert "20 MB; at most 10 MB are read" in exugear("check", file).stderr


def test_the_method_of_the_file_is_that_of_the_tables(cases: Any, tmp_path: Path) -> None:
    file = tmp_path / "case.toml"
    file.write_text(toml_text(changed(copy.deepcopy(cases[1]["spur"]), {"ste__method": "nonlinear"})), encoding="utf-8")
    outcome = exugear("ste", file, "--grid", "--out", tmp_path / "out")
    assert outcome.exit_code == 2
    assert "the method nonlinear computes the static load only" in outcome.stderr
