"""Parts of pages: what is vendored is what was taken, modules become one script, arrays come out as they went in."""

from __future__ import annotations

import base64
import hashlib
import json
import re
import zlib
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from markupsafe import Markup

from exugear.report.web.document import (
    ArrayStore,
    bundle,
    libraries,
    licences,
    module_order,
    script_source,
    vendored,
    whole_page,
)

ROOT = Path(__file__).parents[4]
SCRIPTS = sorted(path.stem for path in (ROOT / "exugear" / "report" / "web" / "scripts").glob("*.js"))

VENDORED = ("uPlot.iife.min.js", "three.min.js", "codemirror.min.js")


def test_vendored_files_are_those_that_were_taken():
    listed = {name: digest for library in libraries() for name, digest in library.files}
    folder = files("exugear.report.web").joinpath("vendor")
    assert {entry.name for entry in folder.iterdir()} == {*listed, "vendor.json"}
    for name, digest in listed.items():
        assert hashlib.sha256(folder.joinpath(name).read_bytes()).hexdigest() == digest, name


def test_vendored_versions_are_those_that_npm_is_pinned_to():
    pinned = json.loads((ROOT / "web" / "package.json").read_text(encoding="utf-8"))["devDependencies"]
    assert {library.name: library.version for library in libraries()} == {
        name: pinned[name] for name in ("uplot", "three", "codemirror")
    }
    assert all(re.fullmatch(r"[\d.]+", version) for version in pinned.values())


def test_every_library_comes_with_its_licence():
    for library in libraries():
        assert library.licence == "MIT"
        assert "Permission is hereby granted" in vendored(library.licence_file)
        assert f"{library.name} {library.version}" in licences([library.name])


@pytest.mark.parametrize("text", [vendored(name) for name in VENDORED] + [bundle("report"), bundle("edit")])
def test_no_script_ends_its_element_or_hides_what_follows(text):
    assert not re.search(r"</script|<!--|\r|\x00", text, re.IGNORECASE)


@pytest.mark.parametrize("main", ["report", "mode_page", "edit"])
def test_a_bundle_leaves_no_import_and_no_export(main):
    whole = bundle(main)
    assert not re.search(r"^\s*(import|export)\b", whole, re.MULTILINE)
    for name in module_order(main):
        assert whole.count(f"const ${name} = (() => {{") == 1


def test_every_script_is_part_of_a_page():
    assert {*module_order("report"), *module_order("mode_page"), *module_order("edit")} == set(SCRIPTS)


@pytest.mark.parametrize("name", SCRIPTS)
def test_scripts_put_names_in_as_text(name):
    dangerous = r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\(|new Function"
    assert not re.search(dangerous, script_source(name))


def unpacked(store: ArrayStore, reference: dict) -> np.ndarray:
    """What the scripts do with an array."""
    (data,) = re.findall(rf'id="{reference["blob"]}">([^<]*)<', store.elements())
    kind = {"u8": "u1", "i8": "i1", "u16": "<u2", "i16": "<i2", "u32": "<u4", "f32": "<f4"}[reference["type"]]
    values = np.frombuffer(zlib.decompress(base64.b64decode(data)), dtype=kind).reshape(reference["shape"])
    return np.cumsum(values, axis=0, dtype=values.dtype) if reference["differences"] else values


@pytest.mark.parametrize("kind", ["u1", "i1", "u2", "i2", "u4"])
@pytest.mark.parametrize("differences", [True, False])
def test_whole_numbers_come_out_as_they_went_in(kind, differences):
    limits = np.iinfo(kind)
    values = np.random.default_rng(3).integers(limits.min, limits.max, (40, 3), endpoint=True).astype(kind)
    store = ArrayStore()
    np.testing.assert_array_equal(unpacked(store, store.add(values, differences=differences)), values)


def test_equal_arrays_are_kept_once():
    store = ArrayStore()
    first, second = (store.add(np.arange(5, dtype="f4")) for _ in range(2))
    assert first == second
    assert store.elements().count("<script") == 1


def test_the_policy_lets_these_scripts_run_and_nothing_leave():
    page = whole_page(
        "<title>", Markup("<p>body</p>"), "mode_page", {"name": "</script>"}, ArrayStore(), ["three.min.js"]
    )
    (policy,) = re.findall(r'http-equiv="Content-Security-Policy" content="([^"]*)"', page)
    rules = dict(rule.strip().split(" ", 1) for rule in policy.split(";"))
    assert rules["default-src"] == "'none'"
    assert rules["img-src"] == "data: blob:"
    assert set(rules) == {"default-src", "script-src", "style-src", "img-src", "base-uri", "form-action"}
    for kind, tag in (("script-src", "<script>"), ("style-src", "<style>")):
        contents = re.findall(rf"{tag}(.*?)</", page, re.DOTALL)
        hashes = {base64.b64encode(hashlib.sha256(text.encode("utf-8")).digest()).decode("ascii") for text in contents}
        assert {f"'sha256-{digest}'" for digest in hashes} == set(rules[kind].split())
    assert not re.search(r' style="', page)
