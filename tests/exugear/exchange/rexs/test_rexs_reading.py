"""REXS files of other programs are read in all containers; what a stranger's file may not do is refused."""

from __future__ import annotations

import base64
import io
import json
import struct
import zipfile
from pathlib import Path

import pytest

from exugear.exchange.rexs.containers import LARGEST, read_rexs
from exugear.exchange.rexs.parsing import DEEPEST, parse_model
from exugear.exchange.rexs.tree import RexsError, unit_factor

DATA = Path(__file__).parent / "data"
FILES = sorted(path.name for path in DATA.iterdir() if path.suffix not in (".txt", ".md"))
HEAD = '<model version="1.4" applicationId="test">'


def model_of(components, version="1.4", relations=""):
    return parse_model(
        f'<model version="{version}" applicationId="test"><relations>{relations}</relations>'
        f"<components>{components}</components></model>".encode()
    )


def test_every_file_of_other_programs_is_read():
    assert len(FILES) == 12
    for name in FILES:
        model = read_rexs(DATA / name)
        assert model.components, name
        assert model.relations, name


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("FVA-Industriegetriebe_2stufig_1-4.rexs", "FVA-Industriegetriebe_2stufig_1-4.rexsj"),
        ("example_xml.rexs.zip", "example_json.rexs.zip"),
    ],
)
def test_xml_and_json_give_the_same_numbers(one, other):
    first, second = read_rexs(DATA / one), read_rexs(DATA / other)
    assert {n: c.type for n, c in first.components.items()} == {n: c.type for n, c in second.components.items()}
    compared = 0
    for number, part in first.components.items():
        for key in ("normal_module", "face_width", "length", "outer_diameter_begin", "width", "inner_diameter"):
            assert part.quantity(key, "mm") == second.components[number].quantity(key, "mm"), (number, key)
            compared += part.given(key)
    assert compared
    assert [case.changes.keys() for case in first.load_cases] == [case.changes.keys() for case in second.load_cases]


def test_packed_arrays_are_those_that_the_file_writes_out():
    bearing = read_rexs(DATA / "example_xml.rexs.zip").components[4]
    assert bearing.vector("support_vector") == (70.0, 0.0, 0.0)  # also written as u_coordinate_on_shaft_inner_side
    assert bearing.vector("w_axis_vector") == (0.0, 0.0, 1.0)
    matrix = read_rexs(DATA / "example_json.rexs.zip").components[3].attributes["topographical_deviation_normals"]
    assert matrix.value == ((1.0, 2.0, 3.0), (4.0, 5.0, 6.0), (7.0, 8.0, 9.0))


@pytest.mark.parametrize(("code", "form"), [("int32", "<3i"), ("float32", "<3f"), ("float64", "<3d")])
def test_each_code_of_packed_numbers_is_little_endian(code, form):
    packed = base64.b64encode(struct.pack(form, 1, -2, 3)).decode()
    model = model_of(
        f'<component id="1" type="shaft"><attribute id="support_vector" unit="mm"><array code="{code}">{packed}</array>'
        "</attribute></component>"
    )
    assert model.components[1].vector("support_vector") == (1.0, -2.0, 3.0)


def test_units_are_those_of_the_file():
    model = model_of(
        '<component id="1" type="cylindrical_gear"><attribute id="normal_module" unit="mum">4500</attribute>'
        '<attribute id="face_width">50</attribute><attribute id="tip_diameter" unit="kg">1</attribute></component>'
    )
    gear = model.components[1]
    assert gear.quantity("normal_module", "mm") == pytest.approx(4.5, rel=1e-14)
    assert gear.quantity("face_width", "mm") == 50.0
    with pytest.raises(RexsError, match="tip_diameter has the unit 'kg'"):
        gear.quantity("tip_diameter", "mm")
    assert unit_factor("°", "deg") == 1.0
    assert unit_factor("N mm / rad", "N m / rad") == 1e-3


def test_old_names_are_read_as_the_present_ones():
    model = model_of(
        '<component id="1" type="flank_geometry"/><component id="2" type="rolling_bearing_with_catalog_geometry">'
        '<attribute id="dynamic_capacity" unit="kN">14</attribute></component>'
        '<component id="3" type="shaft"/><component id="4" type="shaft"/><component id="5" type="coupling"/>',
        version="1.0",
        relations='<relation id="1" type="coupling"><ref id="5" role="assembly"/><ref id="3" role="side_1"/>'
        '<ref id="4" role="side_2"/></relation>',
    )
    assert model.components[1].type == "cylindrical_gear_flank"
    assert model.components[2].quantity("radial_dynamic_load_rating", "kN") == 14.0
    assert [part.number for part in model.related("side", "assembly", 5, "outer_part")] == [4]


ENTITY = '<!DOCTYPE model [<!ENTITY a "b">]>'
REFUSED = {
    "DOCTYPE": (f"<?xml version='1.0'?>{ENTITY}{HEAD}</model>", "DOCTYPE"),
    "external entity": (f'<!DOCTYPE model SYSTEM "file:///etc/passwd">{HEAD}</model>', "DOCTYPE"),
    "nesting": (HEAD + "<a>" * (DEEPEST + 1), "deeper"),
    "nesting of JSON": ('{"model":' * 200_000, "nested"),
    "cut short": (HEAD, "not an XML file"),
    "JSON cut short": ('{"model": {', "not a JSON file"),
    "another root": ("<html/>", "'html'"),
    "JSON of something else": ("[1, 2]", "not a REXS file"),
    "text": ("hello", "neither XML nor JSON"),
    "nothing": ("", "neither XML nor JSON"),
    "newer": ('<model version="3.1"/>', "'3.1'; versions 1.0 to 2.0"),
    "no version": ("<model/>", "version ''"),
    "one id twice": (
        f'{HEAD}<components><component id="1" type="shaft"/><component id="1" type="shaft"/></components></model>',
        "two components have the id 1",
    ),
    "an id of no component": (
        f'{HEAD}<relations><relation id="7" type="stage"><ref id="9" role="stage"/></relation></relations></model>',
        "relation 7 .stage.: component 9",
    ),
    "data outside": (
        f'{HEAD}<components><component id="1" type="shaft"><attribute id="data_source">../x.rexs</attribute>'
        "</component></components></model>",
        "data_source refers to data outside the file, which are not read",
    ),
    "damaged base64": (
        f'{HEAD}<components><component id="1" type="shaft"><attribute id="a"><array code="float64">AAA</array>'
        "</attribute></component></components></model>",
        "base64 is damaged",
    ),
    "half a number": (
        f'{HEAD}<components><component id="1" type="shaft"><attribute id="a"><array code="float64">AAAA</array>'
        "</attribute></component></components></model>",
        "base64 is damaged",
    ),
    "NaN": ('{"model": {"version": "1.4", "a": NaN}}', "', which is not a finite number"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_file_that_asks_for_too_much_is_refused_in_a_sentence(case, tmp_path):
    text, words = REFUSED[case]
    path = tmp_path / "case.rexs"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(RexsError, match=words) as refusal:
        read_rexs(path)
    assert str(refusal.value).startswith(str(path))


def archive(**members):
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as file:
        for name, text in members.items():
            file.writestr(name.replace("_", "."), text)
    return content.getvalue()


def test_an_archive_holds_one_model_of_bounded_size_and_is_whole(tmp_path):
    path, model = tmp_path / "case.rexsz", '<model version="1.4"/>'
    for content, words in (
        (archive(a_rexs=model, b_rexsj="{}"), "the archive must contain one model"),
        (archive(readme_txt=model), "it contains none"),
        (archive(a_rexs=" " * (LARGEST + 1)), "larger than"),
        (archive(a_rexs=model)[:-30], "damaged"),
    ):
        path.write_bytes(content)
        with pytest.raises(RexsError, match=words):
            read_rexs(path)
    path.write_bytes(archive(a_rexs=model, gde_gde="left alone"))
    assert read_rexs(path).components == {}


def test_a_value_that_is_no_number_names_its_component():
    model = model_of(
        '<component id="3" type="shaft" name="A"><attribute id="length" unit="mm">inf</attribute></component>'
    )
    with pytest.raises(RexsError, match="shaft 3 'A': length = 'inf' is not a finite number"):
        model.components[3].quantity("length", "mm")


def test_a_list_of_load_spectra_gives_all_their_load_cases():
    case = {"id": 1, "components": [{"id": 5, "attributes": [{"id": "power", "unit": "kW", "floating_point": 2.0}]}]}
    spectra = [{"id": 1, "load_cases": [case]}, {"id": 2, "load_cases": [{**case, "id": 2}]}]
    model = parse_model(json.dumps({"model": {"version": "1.6", "load_spectrum": spectra}}).encode())
    assert [one.number for one in model.load_cases] == [1, 2]
    assert model.load_cases[1].changes[5]["power"].value == 2.0
