"""Results of a text in `exugear edit`: errors at their lines with corrections, the numbers of the commands."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from typing import Any

import pytest

from exugear.cli.case import assembled_by_iso
from exugear.cli.edit.places import nearest_place, placed, places
from exugear.cli.edit.state import Analyst
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.templates.kinds import KINDS, template
from exugear.gearbox.variant import Variant
from exugear.system.modes import modes_of
from exugear.system.operating_points import bearing_duties
from exugear.system.statics import static_state

PAIR = template("pair")
STEPS = ["check", "picture", "dynamics", "loads", "shapes"]


def line_of(text: str, words: str) -> int:
    return next(number for number, line in enumerate(text.split("\n"), start=1) if line.startswith(words))


def steps_of(text: str, **options: str) -> dict[str, dict[str, Any]]:
    return {step["step"]: step for step in Analyst("pair.toml").steps(text, **options)}


def pictured(steps: Iterable[dict[str, Any]]) -> dict[str, Any]:
    return next(step for step in steps if step["step"] == "picture")


@pytest.mark.parametrize("kind", KINDS)
def test_every_key_of_a_template_is_found_at_a_line_that_has_it(kind):
    text = template(kind)
    lines = text.split("\n")
    known = places(text)

    def check(content, before):
        for name, value in content.items():
            key = f"{before}.{name}" if before else name
            if isinstance(value, dict):
                check(value, key)
                continue
            line = nearest_place(key, known)
            assert line is not None
            assert any(part in lines[line - 1] for part in key.split("."))
            assert key not in known or name in lines[line - 1]

    check(tomllib.loads(text), "")


def test_brackets_in_texts_and_comments_do_not_open_an_array():
    assert places('a = "["  # [\nb = """\n[no.table]\n"""\n[c]\nd = [ # ]\n 1,\n]\n[e]\n') == {
        "a": 1,
        "b": 2,
        "c": 5,
        "c.d": 6,
        "e": 9,
    }


@pytest.mark.parametrize(
    ("old", "new", "words", "correction"),
    [
        ("teeth = 24", "teth = 24", "teth = 24", ("teth", "teeth")),
        ('pair = "helical"', 'pairs = "helical"', "pairs =", ("pairs", "pair")),
        ('cleanliness = "normal" ', 'cleanliness = "norml" ', "cleanliness", ('"norml"', '"normal"')),
        ("teeth = 24\n", "", "[gears.pinion]", ("", "teeth = 21")),
        ("= 128.0\n", "= 130.0\n", "centre_distance_mm", ("", "")),
        ("factor = 0.5", "factor = -0.5", "factor", ("", "")),
        ("[housing]", "[housing", "[housing", ("", "")),
    ],
)
def test_an_error_stands_at_its_line_and_its_correction_makes_the_file_valid(old, new, words, correction):
    text = PAIR.replace(old, new, 1)
    assert text != PAIR
    (remark, *_) = steps_of(text)["check"]["remarks"]
    assert remark["kind"] == "error"
    assert remark["line"] == line_of(text, words)
    assert (remark["old"], remark["new"]) == correction
    if remark["new"]:
        lines = text.split("\n")
        place = remark["line"] - 1
        lines[place] = lines[place].replace(*correction, 1) if remark["old"] else f"{lines[place]}\n{remark['new']}"
        after = steps_of("\n".join(lines))["check"]
        assert remark["text"] not in [one["text"] for one in after["remarks"]]


def test_a_message_without_a_place_is_about_the_whole_file():
    (remark,) = placed(["x.toml: no place"], "error", "x.toml", PAIR)
    assert (remark.text, remark.line) == ("no place", None)


def test_the_numbers_are_those_of_the_commands():
    steps = steps_of(PAIR)
    assembly = assembled_by_iso(Gearbox.from_dict(tomllib.loads(PAIR)), Variant.bushing)
    modes = modes_of(assembly)
    rows = steps["shapes"]["tables"]["modes"]["rows"]
    assert [row["cells"][1] for row in rows] == [f"{modes.frequency[int(row['key'])]:.1f}" for row in rows]
    meshes = steps["loads"]["tables"]["meshes"]["rows"]
    assert meshes[0]["cells"][2] == f"{1e3 * static_state(assembly).misalignment[0]:.3f}"
    frequency = steps["check"]["tables"]["frequencies"]["rows"][0]["cells"]
    assert float(frequency[2]) == pytest.approx(1500.0 / 60.0 * 24)
    assert steps["dynamics"]["campbell"]["fastest"] == 3000.0
    diagram = steps["dynamics"]["campbell"]
    shown = [own for own in diagram["modes"] if own["frequency"] <= diagram["top"]]
    assert steps["dynamics"]["first"] == max(shown, key=lambda own: modes.overall[own["mode"]])["mode"]


def test_results_do_not_depend_on_what_was_typed_before():
    """The search for the static state begins at the last one: under ten times the load and on stiffer seats."""
    before = template("parallel")
    after = before.replace("input = 100.0", "input = 1000.0").replace("factor = 0.5", "factor = 0.9")
    assert after != before
    analyst = Analyst("parallel.toml")
    list(analyst.steps(before))
    later = {step["step"]: step for step in analyst.steps(after)}
    fresh = {step["step"]: step for step in Analyst("parallel.toml").steps(after)}
    for step in ("check", "loads", "shapes"):
        assert later[step]["tables"] == fresh[step]["tables"]
    found, expected = ([own["frequency"] for own in steps["dynamics"]["campbell"]["modes"]] for steps in (later, fresh))
    assert found == pytest.approx(expected, rel=2e-6)  # six digits are sent


def test_one_bearing_of_a_planet_set_stands_for_all_and_is_that_of_the_commands():
    text = template("planetary")
    duties = bearing_duties(assembled_by_iso(Gearbox.from_dict(tomllib.loads(text)), Variant.bushing))
    rows = steps_of(text)["loads"]["tables"]["bearings"]["rows"]
    firsts = {duty.family: duty for duty in reversed(duties)}
    assert len(firsts) < len(duties)
    assert {row["key"] for row in rows} == {f"bearings.{family}" for family in firsts}
    for row in rows:
        duty = firsts[row["key"].removeprefix("bearings.")]
        assert row["cells"][0] == duty.name
        assert float(row["cells"][1]) == pytest.approx(1e-3 * duty.radial_load, rel=6e-3)


def test_parts_of_planets_are_selected_together():
    parts = {part["key"]: part for part in steps_of(template("planetary"))["check"]["parts"]}
    planets = next(part for key, part in parts.items() if key.startswith("bodies.") and len(part["bodies"]) > 1)
    assert len(planets["places"]) == len(planets["bodies"]) == 3


def test_bodies_are_sent_once_and_again_after_their_shape_has_changed():
    analyst = Analyst("pair.toml")
    first = pictured(analyst.steps(PAIR))
    softer = pictured(analyst.steps(PAIR.replace("factor = 0.5", "factor = 0.4"), geometry=first["geometry"]))
    assert softer["geometry"] == first["geometry"]
    assert softer["arrays"] == {}
    wide = PAIR.replace("face_width_mm = 42.0", "face_width_mm = 44.0")
    wider = pictured(analyst.steps(wide, geometry=first["geometry"]))
    assert wider["geometry"] != first["geometry"]
    assert {body[part]["blob"] for body in wider["stage"]["bodies"] for part in ("points", "triangles")} == set(
        wider["arrays"]
    )
    assert pictured(analyst.steps(PAIR)) == first


def test_the_picture_waits_for_no_balance_and_no_modes(monkeypatch):
    def fail(*_):
        raise AssertionError("the picture waits for modes")

    monkeypatch.setattr("exugear.cli.edit.state.assembled_by_iso", fail)
    steps = Analyst("pair.toml").steps(PAIR)
    assert [next(steps)["step"], next(steps)["step"]] == STEPS[:2]


def test_a_newer_request_of_the_same_tab_ends_an_older_one():
    analyst = Analyst("pair.toml")
    older = analyst.steps(PAIR, "a")
    assert next(older)["step"] == "check"
    analyst.ask("a")
    assert [step["step"] for step in older] == ["superseded"]
    assert [step["step"] for step in analyst.steps(PAIR, "b")] == STEPS


def test_a_gearbox_without_bearings_says_what_is_missing():
    cut = PAIR[: PAIR.index("# Variant `bushing`")] + PAIR[PAIR.index("[load_cases.run_up]") :]
    steps = steps_of(cut)
    assert "bearing" in steps["loads"]["unavailable"]
    assert steps["loads"]["tables"]["bearings"]["rows"] == steps["loads"]["tables"]["meshes"]["rows"] == []
    assert steps["shapes"]["tables"]["modes"]["rows"]


@pytest.mark.parametrize("text", ["", "\x00", "a = 1", "[" * 5000, f"a = {'9' * 9999}", "name = 1\n" * 3, "\ud800"])
def test_nonsense_gives_errors_only(text):
    steps = steps_of(text)
    assert list(steps) == ["check"]
    assert steps["check"]["remarks"]
    assert not steps["check"]["ok"]


def test_files_outside_the_folder_and_scripts_are_not_read(tmp_path):
    secret = tmp_path / "secret.csv"
    secret.write_text("torque\n1\n")
    folder = tmp_path / "box"
    folder.mkdir()
    text = PAIR.replace("torques_N_m = { input = 150.0, output = 368.23 }", 'torque_file = "../secret.csv"')
    steps = {step["step"]: step for step in Analyst(folder / "pair.toml").steps(text)}
    assert not steps["check"]["ok"]
