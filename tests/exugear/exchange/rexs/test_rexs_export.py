"""Results go back into the file that was read, under the names of its version; the gearbox in it stays the same."""

from __future__ import annotations

import json
import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from exugear.cli.app import app
from exugear.exchange.rexs.containers import parsed, read_rexs
from exugear.exchange.rexs.export.export import rotated_stiffness, with_results
from exugear.exchange.rexs.export.names import name_in, origins_of, stiffness_names
from exugear.exchange.rexs.mapping import RESULTS
from exugear.exchange.rexs.to_case.conversion import to_case
from exugear.exchange.rexs.tree import Model, RexsError
from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.project import Project

from .own_files import spur_pair

DATA = Path(__file__).parent / "data"
SEW = "SEW_3-stage_cylindrical_gearbox_1.0.rexs"
SPECTRUM = "FVA-Industriegetriebe_2_stufig_1-6.rexs"
PLANETARY = "FVA_Planetary_stage_-_Minus_gearing_1.1_vers2.rexsj"
IMPORTED = [
    SEW,
    SPECTRUM,
    PLANETARY,
    "FVA-Industriegetriebe_2stufig_1-4.rexs",
    "FVA-Industriegetriebe_2stufig_1-4.rexsj",
    "FVA_Planetary_stage_-_Minus_gearing_1.1.rexs",
    "FVA_Planetary_stage_-_Minus_gearing_1.1.rexsz",
]


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """Gearbox, and the model of the file with the results of its folder."""
    known = {}

    def of(name) -> tuple[Gearbox, Model]:
        if name not in known:
            gearbox = to_case(read_rexs(DATA / name), name).gearbox
            known[name] = (
                gearbox,
                parsed(with_results(gearbox, tmp_path_factory.mktemp("none"), DATA / name).content, name),
            )
        return known[name]

    return of


@pytest.mark.sample
@pytest.mark.parametrize("name", IMPORTED)
def test_a_file_with_results_gives_the_same_gearbox_as_without(name, exported):
    _, model = exported(name)
    first, second = (tomllib.loads(to_case(one, name).text) for one in (read_rexs(DATA / name), model))
    assert first == second


@pytest.mark.parametrize("name", IMPORTED)
def test_every_attribute_that_is_not_our_own_is_one_of_the_version(name, exported):
    """Names and versions as the lists of attributes of REXS have them; ours begin with custom_exugear_."""
    _, model = exported(name)
    version = tuple(map(int, model.version.split(".")[:2]))
    known = {key for result in RESULTS.values() for since, key in result.names.items() if since <= version}
    before = read_rexs(DATA / name)
    for number, part in model.components.items():
        new = part.attributes.keys() - before.components[number].attributes.keys()
        assert all(key.startswith("custom_exugear_") or key in known | _present(known) for key in new), new


def _present(names):
    from exugear.exchange.rexs.mapping import ATTRIBUTES

    return {ATTRIBUTES.get(name, name) for name in names}


def test_numbers_of_a_pair_are_those_of_its_closed_forms(exported):
    """By hand for the first stage of the 1.6 file: a = 190 mm, z 27/51, m_n 4.5, and the angles of ISO 21771."""
    _, model = exported(SPECTRUM)
    stage = next(
        s for s in model.components_of_type("cylindrical_stage") if s.quantity("gear_ratio") == pytest.approx(51 / 27)
    )
    assert stage.quantity("center_distance", "mm") == 190.0
    data = {
        model.components[one.roles["gear"]].whole("number_of_teeth"): model.components[one.roles["stage_gear_data"]]
        for one in model.relations_of("stage_gear_data")
        if one.roles["stage"] == stage.number
    }
    assert data[27].quantity("pitch_diameter", "mm") == pytest.approx(2.0 * 190.0 * 27 / 78, rel=1e-9)
    assert data[51].quantity("pitch_diameter", "mm") == pytest.approx(2.0 * 190.0 * 51 / 78, rel=1e-9)
    gears = {g.whole("number_of_teeth"): g for g in model.components_of_type("cylindrical_gear")}
    helix = math.radians(gears[27].quantity("helix_angle_reference_diameter", "deg"))
    transverse = math.atan(math.tan(math.radians(20.0)) / math.cos(helix))
    base = 27 * 4.5 / math.cos(helix) * math.cos(transverse)
    assert gears[27].quantity("base_diameter", "mm") == pytest.approx(base, rel=1e-9)
    working = math.degrees(math.acos(base / data[27].quantity("pitch_diameter", "mm")))
    key = "operating_pressure_angle_in_the_transverse_section"
    assert data[27].quantity(key, "deg") == pytest.approx(working, rel=1e-8)
    width = min(gears[z].quantity("face_width", "mm") for z in (27, 51))
    overlap = width * math.sin(abs(helix)) / (math.pi * 4.5)
    assert stage.quantity("overlap_contact_ratio") == pytest.approx(overlap, rel=1e-9)
    total = stage.quantity("radial_contact_ratio") + overlap
    assert stage.quantity("total_contact_ratio") == pytest.approx(total, rel=1e-9)
    pitch = math.pi * base / 27
    length = stage.quantity("length_of_path_of_contact", "mm")
    assert length == pytest.approx(stage.quantity("radial_contact_ratio") * pitch, rel=1e-8)
    # The path of contact ends at the active diameters: (d_Na / 2)^2 - r_b^2 less likewise at the root.
    diameters = [data[27].quantity(f"usable_{end}_circle_diameter", "mm") for end in ("root", "addendum")]
    ends = [math.sqrt(diameter**2 - base**2) / 2 for diameter in diameters]
    assert ends[1] - ends[0] == pytest.approx(length, rel=1e-6)


def test_the_static_load_belongs_to_the_load_case_that_has_its_torque(exported):
    """789 N m is the torque of load case 4: force = torque over base radius of the first pinion."""
    gearbox, model = exported(SPECTRUM)
    key = "nominal_tangential_force_at_base_circle"
    cases = {case.number: case.changes for case in model.load_cases}
    with_force = {number for number, changes in cases.items() for found in changes.values() if key in found}
    assert with_force == {4}
    stage = next(
        s for s in model.components_of_type("cylindrical_stage") if s.quantity("gear_ratio") == pytest.approx(51 / 27)
    )
    force = float(cases[4][stage.number][key].value)
    assert force == pytest.approx(789.0 / gearbox.gears["gear_1"].base_radius, rel=1e-9)
    assert not any(key in part.attributes for part in model.components.values())


def test_each_planet_gets_its_results(exported):
    _, model = exported(PLANETARY)
    planets = [g for g in model.components_of_type("cylindrical_gear") if g.whole("number_of_teeth") == 22]
    assert len(planets) == 3
    base = 88.0 * math.cos(math.radians(20.0))
    assert [gear.quantity("base_diameter", "mm") for gear in planets] == pytest.approx([base] * 3, rel=1e-9)
    stages = model.components_of_type("cylindrical_stage")
    assert len(stages) == 6
    forces = {s.quantity("nominal_tangential_force_at_base_circle", "N") for s in stages}
    torque = 100e3 / (1500.0 * math.pi / 30.0)  # 100 kW at 1500 rpm, on three planets
    expected = torque / 3.0 / (0.034 * math.cos(math.radians(20.0)))
    assert all(force == pytest.approx(expected, rel=1e-9) for force in forces)


def test_bearings_of_planets_are_found_on_each_planet():
    name = "FVA_Planetary_stage_-_Minus_gearing_1.1.rexs"
    model = read_rexs(DATA / name)
    origins = origins_of(to_case(model, name).found)
    first = [model.components[number] for number in origins.bearings["bearing_1"]]
    assert len(first) == 3
    places = [part.vector("support_vector") for part in first]
    assert len({place[0] for place in places}) == 1
    angles = [math.degrees(math.atan2(place[2], place[1])) % 360.0 for place in places]
    assert angles == pytest.approx([90.0, 210.0, 330.0])  # in the order of the case file
    assert len(origins.bearings["bearing_3"]) == 1


@pytest.mark.validation
def test_modes_bearings_and_tables_of_the_folder_are_in_the_file(tmp_path):
    path = tmp_path / "gearbox.toml"
    path.write_text(to_case(read_rexs(DATA / SEW), SEW, path).text, encoding="utf-8")
    project = Project.from_toml(path, tmp_path / "results", Choice("bushing", "iso6336"))
    modes, duties = project.modes(), project.bearings()
    table = project.tables(["stage_3"], 4)["stage_3"]
    exported = with_results(project.gearbox, project.folder, DATA / SEW)
    assert exported.left_out == ()
    model = parsed(exported.content, SEW)
    unit = model.components_of_type("gear_unit")[0]
    found = [float(one) for one in unit.attributes["custom_exugear_eigenfrequencies_bushing_iso6336_geometry"].value]
    assert found == pytest.approx(modes.frequency[modes.frequency > 0.0], rel=1e-9)
    stage = next(
        s for s in model.components_of_type("cylindrical_stage") if s.quantity("center_distance", "mm") == 77.0
    )
    error = [float(one) for one in stage.attributes["custom_exugear_transmission_error"].value]
    assert error == pytest.approx(1e6 * table.static_state["ste"].to_numpy(), rel=1e-9)
    assert stage.quantity("custom_exugear_face_load_factor") >= 1.0
    bearings = [p for p in model.components.values() if p.given("custom_exugear_radial_load")]
    assert len(bearings) == len(duties) == 9
    loads = sorted(part.quantity("custom_exugear_radial_load", "kN") for part in bearings)
    assert loads == pytest.approx(sorted(1e-3 * duty.radial_load for duty in duties), rel=1e-9)
    # Axes of this file: v, w, u are x, y, z; 1.0 has its own way of writing the entries.
    duty = duties[0]
    part = min(bearings, key=lambda p: abs(p.quantity("custom_exugear_radial_load", "kN") - 1e-3 * duty.radial_load))
    assert part.quantity("operating_point_stiffness_dF_v_d_v", "N / m") == pytest.approx(duty.stiffness[0, 0], rel=1e-9)
    tilt = part.quantity("operating_point_stiffness_dM_w_d_v_rot", "N mm / rad")
    assert tilt == pytest.approx(1e3 * duty.stiffness[4, 3], rel=1e-9)


def test_a_form_diameter_of_the_file_stays_and_ours_stands_beside_it(tmp_path):
    file, _ = spur_pair(root_form_diameter=None)
    gears = [part.number for part in file.model().components_of_type("cylindrical_gear")]
    file.give(gears[1], root_form_diameter=114.0)  # below what the tool's rounding leaves: the import takes the tool's
    path = tmp_path / "gearbox.rexs"
    path.write_text(file.text())
    gearbox = to_case(read_rexs(path), path.name).gearbox
    exported = with_results(gearbox, tmp_path, path)
    assert exported.replaced == ()
    first, second = (parsed(exported.content, path).components[number] for number in gears)
    assert second.quantity("root_form_diameter", "mm") == 114.0
    ours = 2e3 * gearbox.gears["gear_2"].form_radius
    assert ours > 114.5
    assert second.quantity("custom_exugear_root_form_diameter", "mm") == pytest.approx(ours, rel=1e-9)
    assert first.quantity("root_form_diameter", "mm") == pytest.approx(2e3 * gearbox.gears["gear_1"].form_radius)
    assert not first.given("custom_exugear_root_form_diameter")


def test_spur_gears_have_no_overlap_ratio_and_no_axial_pitch(exported):
    """REXS asks for more than 0 of both; helical gears have them: p_x = pi m_n / sin(beta) (ISO 21771)."""
    _, model = exported(PLANETARY)
    assert not any(stage.given("overlap_contact_ratio") for stage in model.components_of_type("cylindrical_stage"))
    assert not any(gear.given("axial_pitch") for gear in model.components_of_type("cylindrical_gear", "ring_gear"))
    _, model = exported(SPECTRUM)
    for gear in model.components_of_type("cylindrical_gear"):
        helix = math.radians(abs(gear.quantity("helix_angle_reference_diameter", "deg")))
        pitch = math.pi * gear.quantity("normal_module", "mm") / math.sin(helix)
        assert gear.quantity("axial_pitch", "mm") == pytest.approx(pitch, rel=1e-9)


def test_tooth_thicknesses_are_those_of_the_reference_circle(tmp_path):
    """By hand: s_n = m_n (pi / 2 + 2 x tan 20 deg) less the thinning, which is assumed in the transverse section."""
    for version, ends in (
        ("1.4", ("normal_tooth_thickness_at_pitch_diameter", "tooth_thickness_at_pitch_diameter")),
        ("1.6", [f"{kind}_tooth_thickness_at_reference_diameter" for kind in ("normal", "transverse")]),
    ):
        file, _ = spur_pair(version)
        path = tmp_path / f"gearbox{version}.rexs"
        path.write_text(file.text())
        gearbox = to_case(read_rexs(path), path.name).gearbox
        model = parsed(with_results(gearbox, tmp_path, path).content, path)
        for gear in model.components_of_type("cylindrical_gear"):
            for key in ends:
                assert gear.quantity(key, "mm") == pytest.approx(3.0 * math.pi / 2.0 - 0.06, rel=1e-9)


def test_speeds_that_the_file_leaves_out_are_put_into_each_load_case(tmp_path):
    file, shafts = spur_pair()
    gears = [part.number for part in file.model().components_of_type("cylindrical_gear")]
    file.load_case({shafts[0]: {"rotational_speed": 900.0}, shafts[1]: {"rotational_speed": -450.0}})
    file.load_case({shafts[0]: {"rotational_speed": -600.0}, shafts[1]: {"rotational_speed": 300.0}})
    path = tmp_path / "gearbox.rexs"
    path.write_text(file.text())
    model = parsed(with_results(to_case(read_rexs(path), path.name).gearbox, tmp_path, path).content, path)
    found = [[float(case.changes[gear]["rotational_speed"].value) for gear in gears] for case in model.load_cases]
    assert found == [pytest.approx([900.0, -450.0]), pytest.approx([-600.0, 300.0])]
    assert not any("rotational_speed" in model.components[gear].attributes for gear in gears)


def test_shafts_move_by_what_their_bearings_carry_over_their_stiffness(tmp_path):
    """Levers by hand: of the load at 40 mm the bearing at 10 mm takes 5/8, that at 90 mm 3/8; each yields by 1e-9 m/N.

    That the teeth resist misalignment moves the load along the face by less than a hundredth of the lever; the sum of
    both bearings stays.

    A shaft that points against z has its nodes in its own sense, its displacements along its own axes.
    """
    file, shafts = spur_pair()
    file.give(
        shafts[0], support_vector=(100.0, 0.0, 0.0), u_axis_vector=(-1.0, 0.0, 0.0), w_axis_vector=(0.0, 0.0, 1.0)
    )
    file.give(shafts[0], rotational_speed=-1500.0)
    path = tmp_path / "gearbox.rexs"
    path.write_text(file.text())
    case = tmp_path / "gearbox.toml"
    case.write_text(to_case(read_rexs(path), path.name, case).text, encoding="utf-8")
    project = Project.from_toml(case, tmp_path / "results", Choice("bushing", "iso6336"))
    project.modes()
    model = parsed(with_results(project.gearbox, project.folder, path).content, path)
    force = 100.0 / 0.030  # tangential, at the pitch circle; radially its share by tan(20 deg)
    radial = force * math.tan(math.radians(20.0))
    first, second = (
        {key: [float(one) for one in model.components[shaft].attributes[key].value] for key in NODES}
        for shaft in shafts
    )
    assert first["u_coordinates_of_beam_nodes"] == pytest.approx([10.0, 60.0, 90.0])
    assert second["u_coordinates_of_beam_nodes"] == pytest.approx([10.0, 40.0, 90.0])
    shares = [0.625, 0.53125, 0.375]  # in the middle by the line between the ends
    for axis, sizes in (("v", radial), ("w", force)):
        moved = [1e-3 * sizes * share for share in shares]
        assert [abs(one) for one in second[f"displacement_{axis}_of_nodes"]] == pytest.approx(moved, rel=5e-3)
        assert [abs(one) for one in first[f"displacement_{axis}_of_nodes"]][::-1] == pytest.approx(moved, rel=5e-3)
        for one in (first, second):
            ends = one[f"displacement_{axis}_of_nodes"][::2]
            assert abs(sum(ends)) == pytest.approx(1e-3 * sizes, rel=3e-4)
    # Torque about -z on the first shaft: its teeth are pushed along +y of the gear unit, away from the mate along -x;
    # v of a shaft that is turned about w points against that of the gear unit.
    assert first["displacement_v_of_nodes"][0] * second["displacement_v_of_nodes"][0] > 0.0
    assert second["displacement_v_of_nodes"][0] > 0.0
    assert first["displacement_w_of_nodes"][0] * second["displacement_w_of_nodes"][0] < 0.0


NODES = ("u_coordinates_of_beam_nodes", *(f"displacement_{axis}_of_nodes" for axis in "uvw"))


def test_the_trace_of_a_turned_stiffness_stays():
    """Stiffness in a bearing's own axes, whichever way these point: traces of its blocks do not change."""
    raw = np.arange(36.0).reshape(6, 6)
    stiffness = raw + raw.T
    axes = np.array([[0.0, 0.0, -1.0], [0.6, 0.8, 0.0], [0.8, -0.6, 0.0]])
    new = rotated_stiffness(stiffness, axes)
    assert np.trace(new[:3, :3]) == pytest.approx(np.trace(stiffness[:3, :3]))
    assert new[0, 0] == pytest.approx(stiffness[2, 2])
    assert new[0, 3] == pytest.approx(stiffness[2, 5])


def test_results_of_another_input_are_left_out_and_told(tmp_path):
    path = tmp_path / "gearbox.toml"
    path.write_text(to_case(read_rexs(DATA / SEW), SEW, path).text, encoding="utf-8")
    Project.from_toml(path, tmp_path / "results", Choice("rigid", "iso6336")).modes()
    other = Gearbox.from_toml(path).varied({"bodies.shaft_1.inertia.geometry.mass_kg": 3.0})
    exported = with_results(other, tmp_path / "results", DATA / SEW)
    assert any("modes.nc: was computed from another input" in line for line in exported.left_out)
    assert b"eigenfrequencies" not in exported.content


def test_the_file_of_another_gearbox_is_refused(tmp_path):
    gearbox = to_case(read_rexs(DATA / SPECTRUM), SPECTRUM).gearbox
    with pytest.raises(RexsError, match="gears.gear_1 has teeth = 27, in this file it is 23"):
        with_results(gearbox, tmp_path, DATA / SEW)


def test_a_result_of_another_program_is_replaced_and_told(tmp_path):
    text = (DATA / SPECTRUM).read_text(encoding="utf-8-sig")
    number = read_rexs(DATA / SPECTRUM).components_of_type("cylindrical_gear")[0].number
    head = next(line for line in text.splitlines() if f'<component id="{number}"' in line)
    path = tmp_path / "gearbox.rexs"
    path.write_text(text.replace(head, head + '<attribute id="base_circle_diameter" unit="mm">1.0</attribute>', 1))
    gearbox = to_case(read_rexs(path), path.name).gearbox
    exported = with_results(gearbox, tmp_path, path)
    assert len(exported.replaced) == 1
    assert exported.replaced[0].endswith(": base_circle_diameter")
    assert parsed(exported.content, path).components[number].quantity("base_diameter", "mm") > 100.0


def test_names_follow_the_versions():
    assert name_in("base_diameter", (1, 7)) == "base_circle_diameter"
    assert name_in("base_diameter", (2, 0)) == "base_diameter"
    assert name_in("active_tip_diameter", (1, 0)) == "custom_exugear_active_tip_diameter"
    old, new = (list(stiffness_names(version)) for version in ((1, 0), (1, 1)))
    assert len(old) == len(new) == 25
    assert old[3][0] == "operating_point_stiffness_dF_u_d_v_rot"
    assert new[3][0] == "operating_point_stiffness_f_u_rot_v"


def test_the_verb_writes_a_new_file_and_never_over_one(tmp_path):
    runner = CliRunner()
    folder = tmp_path / "case"
    assert runner.invoke(app, ["import", str(DATA / SEW), "--out", str(folder)]).exit_code == 0
    arguments = ["export", str(folder / "gearbox.toml"), str(DATA / SEW), "--out", str(tmp_path / "results"), "--json"]
    to = tmp_path / "new.rexs"
    outcome = runner.invoke(app, [*arguments, "--to", str(to)])
    assert outcome.exit_code == 0, outcome.output
    summary = json.loads(outcome.stdout)
    assert summary["file"] == str(to)
    assert summary["custom_attributes"] > 50
    assert read_rexs(to).version == "1.0"
    written = to.read_bytes()
    again = runner.invoke(app, [*arguments, "--to", str(to)])
    assert again.exit_code == 2
    assert "exists already" in again.output
    assert to.read_bytes() == written
    wrong = runner.invoke(app, [arguments[0], arguments[1], str(DATA / SPECTRUM), "--to", str(tmp_path / "wrong.rexs")])
    assert wrong.exit_code == 2
    assert not (tmp_path / "wrong.rexs").exists()
