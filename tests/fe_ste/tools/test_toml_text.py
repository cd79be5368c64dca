"""Numbers in the text of TOML files are replaced, and nothing else."""

from __future__ import annotations

import random
import tomllib
from typing import Any

import pytest

from fe_ste.tools.toml_text import tokens, with_numbers

TEXT = """# factor = 1 in a comment
name = "factor = 2"
a.b . c = 1e-3# close
"quoted key"."x" = +1_000.5 # dotted
inline = { one = 1.0, "two" = {'three'=-3, four = [4.0]} }
list = [1.0]
many = [
  2.0, # factor = 3
  { one = 5.0 },
]
flag = true
text = \'\'\'
[housing]
factor = 9\'\'\'
[housing]   # [other]
factor = 0.5\t# of the "seats"
[[array]]
factor = 0.25
[more.'sub']
hex = 0x10
not = nan
date = 1979-05-27 07:32:00
"""


@pytest.mark.parametrize(
    ("key", "old", "new"),
    [
        ("housing.factor", "factor = 0.5\t#", "factor = 0.55\t#"),
        ("a.b.c", "a.b . c = 1e-3#", "a.b . c = 0.55#"),
        ("quoted key.x", "+1_000.5 #", "0.55 #"),
        ("inline.one", "one = 1.0,", "one = 0.55,"),
        ("inline.two.three", "'three'=-3,", "'three'=0.55,"),
        ("more.sub.hex", "0x10", "0.55"),
        ("more.sub.not", "nan", "0.55"),
    ],
)
@pytest.mark.parametrize("ends", ["\n", "\r\n"])
def test_a_number_is_replaced_wherever_its_key_is_written(key: str, old: str, new: str, ends: str) -> None:
    text = TEXT.replace("\n", ends)
    assert text.count(old) == 1
    assert with_numbers(text, {key: 0.55}) == text.replace(old, new)


@pytest.mark.parametrize(
    "key", ["list", "many", "inline.two.four", "flag", "name", "array.factor", "factor", "housing", "more.sub.date", ""]
)
def test_what_is_no_single_number_is_refused_by_name(key: str) -> None:
    with pytest.raises(ValueError, match=f"^{key}.*the file has no single number of this key"):
        with_numbers(TEXT, {"housing.factor": 0.55, key: 1.0})


@pytest.mark.parametrize("text", ["a = ", "a = 1\na = 2", 100_000 * "[", "a = " + 5000 * "1"])
def test_a_text_that_is_not_toml_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"\w"):
        with_numbers(text, {"a": 1.0})


def some_key(rng: random.Random) -> tuple[str, str]:
    """Name and its text: bare, or quoted in either way."""
    name = "".join(rng.choices("ab-_1", k=rng.randint(1, 3)))
    if rng.random() < 0.3:
        name += rng.choice([" ", "#", "=", "]", "}", ",", "ü", "'", '"', "\\"])
        return (name, "'" + name + "'") if "'" not in name else (name, f'"{name}"')
    return name, rng.choice([name, name, f'"{name}"', f"'{name}'"])


def some_value(rng: random.Random, depth: int) -> str:
    kinds = [
        "1",
        "-2.5",
        "3e-4",
        "true",
        '"a # b = 1"',
        "'c]'",
        '"""d\n[e]"""',
        "[1, 2.0]",
        "[ # 1\n 5.0,]",
        "1979-05-27",
    ]
    if depth and rng.random() < 0.3:
        entries = {name: f"{text} = {some_value(rng, depth - 1)}" for name, text in (some_key(rng) for _ in range(3))}
        return "{ " + ", ".join(entries.values()) + " }"
    return rng.choice(kinds)


def leaves(content: Any, path: tuple[str, ...] = ()) -> dict[tuple[str, ...], Any]:
    if not isinstance(content, dict):
        return {path: content}
    return {own: value for key, part in content.items() for own, value in leaves(part, (*path, key)).items()}


def test_random_texts_change_in_the_one_number_only() -> None:
    """400 random texts with comments, tables, dotted and quoted keys: parsed, all other values are the old ones."""
    rng = random.Random(4)
    replaced = 0
    for _ in range(400):
        lines = []
        for _ in range(rng.randint(1, 8)):
            keys = [some_key(rng)[1] for _ in range(rng.randint(1, 2))]
            name = rng.choice([".", " . "]).join(keys)
            lines.append(f"[{name}]" if rng.random() < 0.2 else f"{name} ={some_value(rng, 2)}")
            lines[-1] += rng.choice(["", " # x = 1", "   ", "\n# [y]"])
        text = "\n".join(lines)
        try:
            before = leaves(tomllib.loads(text))
        except tomllib.TOMLDecodeError:
            continue
        assert {token.path for token in tokens(text) if token.kind != "key"} >= {
            path for path, value in before.items() if not isinstance(value, list | dict)
        }
        for path, value in before.items():
            if type(value) not in (int, float) or any("." in part for part in path):
                continue
            changed = with_numbers(text, {".".join(path): 7.125})
            assert leaves(tomllib.loads(changed)) == {**before, path: 7.125}
            assert len(changed.split("\n")) == len(text.split("\n"))
            replaced += 1
    assert replaced > 100
