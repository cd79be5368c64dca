"""REXS files gone wrong, as strangers and programs make them: a sentence each, or a gearbox, never a traceback."""

from __future__ import annotations

import io
import json
import random
import re
import zipfile
from pathlib import Path

import pytest
from typer.testing import CliRunner

from exugear.cli.app import app
from exugear.exchange.rexs.containers import parsed, read_rexs, with_additions
from exugear.exchange.rexs.parsing import parse_model
from exugear.exchange.rexs.to_case.conversion import to_case
from exugear.exchange.rexs.tree import Addition, RexsError

from .own_files import spur_pair
from .test_rexs_industry import FLOATING, cylindrical, helical, planetary, two_row_tapered

DATA = Path(__file__).parent / "data"
SEW = "SEW_3-stage_cylindrical_gearbox_1.0.rexs"
PLANETARY = "FVA_Planetary_stage_-_Minus_gearing_1.1.rexs"
SPECTRUM = "FVA-Industriegetriebe_2_stufig_1-6.rexs"
REFERENCE = re.compile(r'<ref [^>]*id="(\d+)"')
VALUE = re.compile(r"<attribute [^>]*>([^<]+)</attribute>")
ODD = ("0", "-1", "1e300", "-1e-300", "1e-9", "nan", "", "abc", "1e9", "0.001", "true", "9" * 5000)


def ribbed(file, shaft):
    for u in (20.0, 180.0):
        cylindrical(file, shaft, u, "both_directions")


OWN = {
    "floating sun": lambda: planetary(FLOATING).text(),
    "two rows": lambda: helical(two_row_tapered(("negative", "positive"))).text(),
    "ribs": lambda: helical(ribbed).text(),
}


def text_of(name):
    if name in OWN:
        return OWN[name]()
    return (DATA / name).read_bytes().decode("utf-8-sig")


def swapped(text, chance):
    first, second = sorted(chance.sample(list(REFERENCE.finditer(text)), 2), key=lambda one: one.start(1))
    return text[: first.start(1)] + second[1] + text[first.end(1) : second.start(1)] + first[1] + text[second.end(1) :]


def redirected(text, chance):
    one, other = chance.sample(list(REFERENCE.finditer(text)), 2)
    return text[: one.start(1)] + other[1] + text[one.end(1) :]


def with_an_odd_value(text, chance):
    one = chance.choice(list(VALUE.finditer(text)))
    return text[: one.start(1)] + chance.choice(ODD) + text[one.end(1) :]


def without(pattern):
    def cut(text, chance):
        one = chance.choice(list(re.finditer(pattern, text, re.DOTALL)))
        return text[: one.start()] + text[one.end() :]

    return cut


DAMAGES = (
    swapped,
    redirected,
    with_an_odd_value,
    without("<relation .*?</relation>"),
    without("<attribute .*?</attribute>"),
    without("<component .*?</component>"),
)


def damaged(seed):
    chance = random.Random(seed)
    text = text_of(chance.choice((SEW, PLANETARY, SPECTRUM, *OWN)))
    damage = chance.choice(DAMAGES)
    for _ in range(chance.choice((1, 1, 2, 4))):
        text = damage(text, chance)
    return text


def imports_or_is_refused_in_words(text):
    """True for a gearbox; a refusal is `RexsError` with sentences, and anything else ends the test."""
    try:
        to_case(parse_model(text.encode()), "damaged.rexs")
    except RexsError as error:
        assert error.errors
        assert all(len(line) > 10 for line in error.errors)
        return False
    return True


@pytest.mark.validation
@pytest.mark.parametrize("seeds", [range(60), pytest.param(range(1000, 2000), marks=pytest.mark.long)], ids=str)
def test_damaged_files_are_refused_in_words_or_imported(seeds):
    outcomes = [imports_or_is_refused_in_words(damaged(seed)) for seed in seeds]
    assert {True, False} == set(outcomes)  # the damage is neither too small nor too large to tell anything


def test_a_component_of_the_wrong_type_is_named_with_its_role():
    text = text_of(PLANETARY)
    pins = re.search(r'<relation[^>]*type="planet_pin">.*?</relation>', text, re.DOTALL)
    stage, shaft = (re.search(rf'<ref[^>]*role="{role}"[^>]*>', pins[0])[0] for role in ("planetary_stage", "shaft"))
    numbers = [re.search(r'id="(\d+)"', one)[1] for one in (stage, shaft)]
    wrong = pins[0].replace(stage, stage.replace(numbers[0], numbers[1]))
    wrong = wrong.replace(shaft, shaft.replace(f'"{numbers[1]}"', f'"{numbers[0]}"'))
    with pytest.raises(RexsError, match=rf"'planet_pin' has planetary_stage {numbers[0]}.* as shaft; expected .*shaft"):
        to_case(parse_model(text.replace(pins[0], wrong).encode()), PLANETARY)


ENCODINGS = ("utf-8", "utf-16", "utf-16-le", "utf-32", "iso-8859-1", "cp1252", "gb18030", "shift_jis", "euc_kr")


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_files_in_encodings_of_the_world_are_read_and_written_in_them(encoding, tmp_path):
    name = {"gb18030": "齿轮箱", "shift_jis": "歯車箱", "euc_kr": "기어박스"}.get(encoding, "Größe")
    text = f"""<?xml version="1.0" encoding="{encoding}"?>
<model version="1.4"><components><component id="4" type="shaft" name="{name}"/></components></model>"""
    path = tmp_path / "gearbox.rexs"
    path.write_bytes(text.encode(encoding))
    assert read_rexs(path).components[4].name == name
    new = with_additions(path, [Addition(4, "custom_exugear_x", "", name)])
    assert parse_model(new).components[4].text("custom_exugear_x") == name
    assert new.decode(encoding).startswith(text[:60])


@pytest.mark.parametrize(
    "encoding", ["foo", "utf-7", "punycode", "idna", "zlib", "rot13", "unicode_escape", "utf_8_sig"]
)
def test_an_encoding_that_is_no_encoding_of_xml_is_refused_by_name(encoding):
    text = f'<?xml version="1.0" encoding="{encoding}"?><model version="1.4"/>'
    with pytest.raises(RexsError, match=f"the encoding '{encoding}', which is not supported; expected UTF-8"):
        parse_model(text.encode())


def test_bytes_that_are_not_in_the_encoding_are_told_with_their_place():
    content = '<model version="1.4" applicationId="ä"/>'.encode("latin-1")
    with pytest.raises(RexsError, match="the file does not match its encoding utf-8: invalid byte 0xe4 at 36"):
        parse_model(content)


def test_whole_numbers_without_end_cost_no_time_and_are_no_quantities():
    digits = "1" * 5_000_000
    content = f'{{"model": {{"version": "1.4", "components": [{{"id": {digits}, "type": "shaft"}}]}}}}'
    with pytest.raises(RexsError, match="expected a whole number"):
        parse_model(content.encode())
    entry = {"id": "length", "unit": "mm", "integer": 0}
    text = json.dumps({"model": {"version": "1.4", "components": [{"id": 1, "type": "shaft", "attributes": [entry]}]}})
    model = parse_model(text.replace('"integer": 0', f'"integer": {digits}').encode())
    with pytest.raises(RexsError, match="is not a finite number"):
        model.components[1].quantity("length", "mm")


def test_numbers_that_nothing_has_are_refused_before_they_are_multiplied():
    text = text_of(SEW)
    face = re.search(r'<attribute id="face_width" unit="mm">([^<]+)', text)
    with pytest.raises(RexsError, match="face_width = '1e300' is larger than any quantity"):
        to_case(parse_model((text[: face.start(1)] + "1e300" + text[face.end(1) :]).encode()), SEW)
    with pytest.raises(RexsError, match="face_width = 0 is impossible; expected 0.001 to 100000"):
        to_case(parse_model((text[: face.start(1)] + "0" + text[face.end(1) :]).encode()), SEW)


def test_numbers_that_make_no_pair_of_gears_are_told_before_they_are_divided_by():
    file, _ = spur_pair()
    second = file.model().components_of_type("cylindrical_gear")[1].number
    file.give(second, tip_diameter=100.0)
    on_one_axis = spur_pair()[0].text().replace("<c>90.0</c><c>0.0</c></array>", "<c>0.0</c><c>0.0</c></array>")
    for text, words in (
        (file.text(), "mm is inside its base diameter of"),
        (on_one_axis, ": both gears are on one axis; correct support_vector of one of them"),
        (spur_pair()[0].text().replace('cylindrical_gear"', 'ring_gear"'), "two ring gears cannot mesh"),
    ):
        with pytest.raises(RexsError, match=words):
            to_case(parse_model(text.encode()), "own.rexs")
    text = planetary(FLOATING).text()
    small = text.replace(
        '<attribute id="number_of_teeth" unit="none">72<', '<attribute id="number_of_teeth" unit="none">24<'
    )
    with pytest.raises(RexsError, match=": a ring gear of 24 teeth is too small for 24"):
        to_case(parse_model(small.encode()), "own.rexs")


# -- archives ------------------------------------------------------------------------------------------------


def archive(members, compression=zipfile.ZIP_DEFLATED):
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", compression) as file:
        for name, data in members.items():
            file.writestr(name, data)
    return content.getvalue()


@pytest.mark.parametrize("compression", [zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_a_damaged_member_of_any_compression_is_one_sentence(compression):
    content = archive({"a.rexs": text_of(SEW)}, compression)
    for place in (60, 100, 1000, len(content) - 100, len(content) - 30):
        broken = content[:place] + bytes(255 - one for one in content[place : place + 20]) + content[place + 20 :]
        with pytest.raises(RexsError, match="the archive|holds|must hold"):
            parsed(broken, "a.rexsz")


def test_archives_with_any_byte_wrong_are_read_or_refused_in_words():
    content = archive({"a.rexs": '<model version="1.4"/>', "b.txt": "ä"}, zipfile.ZIP_LZMA)
    chance, refused = random.Random(7), 0
    for _ in range(3000):
        place, broken = chance.randrange(len(content)), bytearray(content)
        broken[place] = chance.randrange(256)
        try:
            parsed(bytes(broken), "a.rexsz")
        except RexsError:
            refused += 1
    assert 300 < refused < 3000


def test_a_member_whose_name_is_no_utf_8_is_one_sentence():
    content = archive({"ä.rexs": '<model version="1.4"/>'})
    with pytest.raises(RexsError, match="the archive is damaged"):
        parsed(content.replace("ä".encode(), b"a\xff"), "a.rexsz")


def encrypted(content, name):
    """The archive with the mark of encryption on a member, in both of its heads."""
    broken = bytearray(content)
    for head, flags in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        length = 30 if head == b"PK\x03\x04" else 46
        place = content.index(head)
        while content[place + length : place + length + len(name)] != name.encode():
            place = content.index(head, place + 4)
        broken[place + flags] |= 1
    return bytes(broken)


def test_members_beside_the_model_stay_to_the_bit_also_encrypted_and_damaged_ones(tmp_path):
    members = {"first.txt": "1" * 99, "a.rexs": text_of(SEW), "ä/secret.gde": "2" * 999, "last.bin": b"\x00\xff" * 50}
    content = encrypted(archive(members), "last.bin")
    content = encrypted(content, "first.txt")
    path = tmp_path / "gearbox.rexsz"
    path.write_bytes(content)
    new = with_additions(path, [Addition(4, "custom_exugear_x", "mm", 1.0)])
    assert parsed(new, path).components[4].quantity("custom_exugear_x", "mm") == 1.0
    with zipfile.ZipFile(io.BytesIO(content)) as before, zipfile.ZipFile(io.BytesIO(new)) as after:
        assert sorted(after.namelist()) == sorted(before.namelist())
        assert after.read("ä/secret.gde") == b"2" * 999
        for name in ("first.txt", "last.bin"):
            assert after.getinfo(name).flag_bits & 1
            old, one = (raw(archive_, data, name) for archive_, data in ((before, content), (after, new)))
            assert old == one


def raw(file, content, name):
    """Head and packed bytes of a member."""
    info = file.getinfo(name)
    return content[info.header_offset : info.header_offset + 30 + len(name) + info.compress_size]


def test_two_members_at_one_place_are_refused():
    content = archive({"a.rexs": '<model version="1.4"/>', "b.rexz": '<model version="1.4"/>'})
    with zipfile.ZipFile(io.BytesIO(content)) as file:
        second = file.getinfo("b.rexz").header_offset
    place = content.rindex(b"PK\x01\x02") + 42
    assert int.from_bytes(content[place : place + 4], "little") == second
    with pytest.raises(RexsError, match="the archive is damaged: two of its members overlap"):
        parsed(content[:place] + bytes(4) + content[place + 4 :], "a.rexsz")


# -- the verbs -----------------------------------------------------------------------------------------------


def verb(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def test_a_refusal_names_the_file_ends_with_code_2_and_writes_nothing(tmp_path):
    path = tmp_path / "foo.rexs"
    path.write_text('<model version="1.4"><components/></model>')
    outcome = verb("import", path, "--out", tmp_path / "out")
    assert outcome.exit_code == 2
    assert f"{path}: the file has no stage" in " ".join(outcome.output.split())
    assert not (tmp_path / "out").exists()
