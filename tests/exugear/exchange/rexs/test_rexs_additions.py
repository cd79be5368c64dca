"""Attributes are put into a REXS file of any kind, and everything else that it says stays."""

from __future__ import annotations

import io
import json
import re
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import pytest

from exugear.exchange.rexs.containers import parsed, read_rexs, with_additions
from exugear.exchange.rexs.parsing import parse_model
from exugear.exchange.rexs.tree import Addition, RexsError

from .own_files import spur_pair

DATA = Path(__file__).parent / "data"
FILES = sorted(path.name for path in DATA.iterdir() if path.suffix not in (".txt", ".md"))
SEW = "SEW_3-stage_cylindrical_gearbox_1.0.rexs"
SPECTRUM = "FVA-Industriegetriebe_2_stufig_1-6.rexs"


def additions_for(model):
    """One of each kind for every component, and one for every load case."""
    for number in model.components:
        yield Addition(number, "custom_exugear_list", "N / mm^2", (1.0, -2.5e-7))
        yield Addition(number, "custom_exugear_text", "°", 'ä <&> "x"')
        yield Addition(number, "normal_module", "mm", 7.0)
    for case in model.load_cases:
        for number in model.components:
            yield Addition(number, "custom_exugear_force", "N", 1e20, case.number)


@pytest.mark.parametrize("name", FILES)
def test_all_that_was_there_is_read_again_with_what_was_added(name):
    before = read_rexs(DATA / name)
    after = parsed(with_additions(DATA / name, additions_for(before)), name)
    assert (after.version, after.program, after.relations) == (before.version, before.program, before.relations)
    assert after.components.keys() == before.components.keys()
    for number, part in before.components.items():
        twin = after.components[number]
        assert (twin.type, twin.name) == (part.type, part.name)
        new = {"custom_exugear_list", "custom_exugear_text", "normal_module"}
        kept = {key: value for key, value in part.attributes.items() if key not in new}
        assert {key: value for key, value in twin.attributes.items() if key not in new} == kept
        assert [float(value) for value in twin.attributes["custom_exugear_list"].value] == [1.0, -2.5e-7]
        assert twin.text("custom_exugear_text") == 'ä <&> "x"'
        assert twin.attributes["custom_exugear_text"].unit == "°"
        assert twin.quantity("normal_module", "mm") == 7.0
    for case, again in zip(before.load_cases, after.load_cases, strict=True):
        for number in before.components:
            assert float(again.changes[number]["custom_exugear_force"].value) == 1e20
            for key, attribute in case.changes.get(number, {}).items():
                assert again.changes[number][key] == attribute


@pytest.mark.parametrize("name", [name for name in FILES if name.endswith(".rexs")])
def test_new_attributes_change_no_line_of_xml(name):
    model = read_rexs(DATA / name)
    filled = [number for number, part in model.components.items() if part.attributes]
    new = with_additions(DATA / name, [Addition(number, "custom_exugear_x", "mm", 1.0) for number in filled])
    without, count = re.subn(rb'\s*<attribute id="custom_exugear_x".*?</attribute>', b"", new)
    assert count == len(filled) > 0
    assert without == (DATA / name).read_bytes()


@pytest.mark.parametrize("name", [name for name in FILES if name.endswith(".rexsj")])
def test_new_attributes_change_no_value_of_json(name):
    number = next(iter(read_rexs(DATA / name).components))
    new = json.loads(with_additions(DATA / name, [Addition(number, "custom_exugear_x", "mm", 1.0)]))
    part = next(one for one in new["model"]["components"] if one["id"] == number)
    assert part["attributes"].pop() == {"id": "custom_exugear_x", "unit": "mm", "floating_point": 1.0}
    assert new == json.loads((DATA / name).read_text(encoding="utf-8-sig"))


def test_comments_around_and_in_xml_stay(tmp_path):
    path = tmp_path / "gearbox.rexs"
    text = (
        '<?xml version="1.0"?>\n<!-- <model> ä --><?a b?>\n<model version="1.4"><components><!--c-->'
        '<component id="1" type="shaft"><attribute id="length" unit="mm">1<!--d-->2</attribute></component>'
        "</components></model>\n<!--e-->\n"
    )
    path.write_text(text, encoding="utf-8")
    assert with_additions(path, []).decode() == text
    new = with_additions(path, [Addition(1, "custom_exugear_x", "", "A & <B>")])
    assert parse_model(new).components[1].quantity("length", "mm") == 12.0
    assert re.sub(b'<attribute id="custom_exugear_x".*?</attribute>', b"", new, flags=re.DOTALL).split() == (
        path.read_bytes().split()
    )


def json_with(tmp_path, text):
    path = tmp_path / "gearbox.rexsj"
    path.write_text(f'{{\n "model": {{"version": "1.4", "components": [{{"id": 1, "type": "shaft"}}], "a": {text}}}}}')
    return path


def test_a_number_of_json_that_cannot_be_written_is_refused(tmp_path):
    with pytest.raises(RexsError, match="the file has a number beyond 1e308, which cannot be written; correct it"):
        with_additions(json_with(tmp_path, "1e999"), [Addition(1, "a", "mm", 1.0)])


def test_json_of_any_depth_is_written_or_refused(tmp_path):
    refused = 0
    for depth in (100, *range(800, 1000, 10), 2000):
        path = json_with(tmp_path, "[" * depth + "]" * depth)
        try:
            with_additions(path, [Addition(1, "a", "mm", 1.0)])
        except RexsError as error:
            assert "the file is nested far deeper than any REXS file" in str(error)
            refused += 1
    assert 0 < refused < 22


def test_half_a_character_of_json_stays_as_it_is(tmp_path):
    path = json_with(tmp_path, r'"\ud800 \u00e4"')
    new = with_additions(path, [Addition(1, "a", "mm", 1.0)])
    assert json.loads(new)["model"]["a"] == "\ud800 ä"


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "iso-8859-1"])
def test_the_encoding_stays(encoding, tmp_path):
    text = (DATA / SEW).read_text(encoding="utf-8").replace('encoding="UTF-8"', f'encoding="{encoding}"')
    text = text.replace("ANW [4]", "Wälle [4]")
    path = tmp_path / "gearbox.rexs"
    path.write_bytes(text.encode(encoding))
    new = with_additions(path, [Addition(4, "custom_exugear_x", "°", "Größe")])
    part = parse_model(new).components[4]
    assert (part.name, part.text("custom_exugear_x")) == ("Wälle [4]", "Größe")
    decoded = new.decode(encoding)
    start = decoded.index("custom_exugear_x")
    assert decoded[:start].rsplit("\n", 1)[0] == text[: len(decoded[:start].rsplit("\n", 1)[0])]
    assert len(decoded) - len(text) == decoded[start:].index("\n") + len('\n      <attribute id="')


def test_an_archive_keeps_its_other_members():
    name = "example_xml.rexs.zip"
    number = next(iter(read_rexs(DATA / name).components))
    new = with_additions(DATA / name, [Addition(number, "custom_exugear_x", "mm", 2.0)])
    with zipfile.ZipFile(DATA / name) as before, zipfile.ZipFile(io.BytesIO(new)) as after:
        assert after.namelist() == before.namelist()
        others = [one for one in before.namelist() if not one.endswith(".rexs")]
        assert [after.read(one) for one in others] == [before.read(one) for one in others]


def test_json_without_attributes_or_spaces_takes_them(tmp_path):
    content = {"model": {"version": "1.4", "relations": [], "components": [{"id": 1, "type": "shaft"}, {"id": 2}]}}
    content["model"]["components"][1]["attributes"] = [{"id": [1], "string": "odd"}]
    path = tmp_path / "gearbox.rexsj"
    path.write_text(json.dumps(content, separators=(",", ":")))
    new = with_additions(path, [Addition(1, "a", "mm", 1.0), Addition(2, "b", "mm", (1.0,)), Addition(2, "c", "", "x")])
    model = parse_model(new)
    assert model.components[1].quantity("a", "mm") == 1.0
    assert model.components[2].text("c") == "x"


def test_elements_with_a_prefix_get_new_ones_with_that_prefix(tmp_path):
    """Without it the new elements would lie outside of the namespace, and no program would find them."""
    file, shafts = spur_pair()
    file.load_case({shafts[0]: {"rotational_speed": 900.0}})
    empty = file.add("lubricant")
    path = tmp_path / "gearbox.rexs"
    path.write_text(file.text("r").replace("></r:component>", "/>").replace('">\n  </r:component>', '"/>'))
    assert f'<r:component id="{empty}" type="lubricant" name=""/>' in path.read_text()
    new = [
        Addition(shafts[0], "rotational_speed", "1 / min", 1.0),
        Addition(shafts[0], "custom_exugear_list", "mm", (1.0, 2.0)),
        Addition(empty, "custom_exugear_x", "mm", 3.0),
        Addition(shafts[0], "custom_exugear_case", "mm", 4.0, 1),
        Addition(shafts[1], "custom_exugear_new", "mm", 5.0, 1),
    ]
    content = with_additions(path, new)
    tree = ElementTree.fromstring(content)
    assert {element.tag.partition("}")[0] for element in tree.iter()} == {"{https://rexs.info"}
    model = parse_model(content)
    assert model.components[shafts[0]].quantity("rotational_speed", "1 / min") == 1.0
    assert model.components[shafts[0]].attributes["custom_exugear_list"].value == ("1.0", "2.0")
    assert model.components[empty].quantity("custom_exugear_x", "mm") == 3.0
    changes = model.load_cases[0].changes
    assert float(changes[shafts[0]]["custom_exugear_case"].value) == 4.0
    assert float(changes[shafts[1]]["custom_exugear_new"].value) == 5.0


def test_a_component_that_is_not_there_is_refused():
    with pytest.raises(RexsError, match=": component 999"):
        with_additions(DATA / SEW, [Addition(999, "custom_exugear_x", "mm", 1.0)])
    with pytest.raises(RexsError, match="component 1 does not exist, load case 7"):
        with_additions(DATA / SPECTRUM, [Addition(1, "custom_exugear_x", "mm", 1.0, 7)])


def test_two_results_of_one_name_are_refused():
    twice = [Addition(1, "custom_exugear_x", "mm", value) for value in (1.0, 2.0)]
    with pytest.raises(RexsError, match=": two results have the name custom_exugear_x"):
        with_additions(DATA / SEW, twice)
