"""Gearboxes and their parts show themselves in one short line, and in a notebook as tables in which no text acts."""

from __future__ import annotations

from dataclasses import replace
from html.parser import HTMLParser
from typing import Any

import numpy as np
import pytest
from pydantic import BaseModel

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.load_cases import summarise_loads
from exugear.gearbox.parts import WheelDeviation

HOSTILE = "<script>alert('1')</script>\n</td>"
LONGEST = 200


class Page(HTMLParser):
    """Elements and text of a piece of HTML."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: set[str] = set()
        self.text = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        self.elements.add(tag)

    def handle_data(self, data: str) -> None:
        self.text += data


def parts(gearbox: Gearbox) -> list[Any]:
    """All parts of a gearbox."""
    return [
        *gearbox.bodies(),
        *gearbox.joints,
        *gearbox.bearings,
        *gearbox.mounts,
        *gearbox.couplings,
        *gearbox.meshes,
        *gearbox.pairs.values(),
        *gearbox.load_cases.values(),
        WheelDeviation(300, np.linspace(0.0, 1e-5, 300), 1e-5, 0.0),
    ]


def sections(value: Any) -> list[BaseModel]:
    """A section and all that lie in it."""
    if isinstance(value, BaseModel):
        return [value, *(section for key in type(value).model_fields for section in sections(getattr(value, key)))]
    entries = value.values() if isinstance(value, dict) else value if isinstance(value, tuple) else ()
    return [section for entry in entries for section in sections(entry)]


def shown(grc: Gearbox) -> list[Any]:
    loads = summarise_loads(grc, grc.load_cases["reference"])
    return [grc, grc.train, loads, *parts(grc), *sections(grc.case)]


def test_all_that_a_gearbox_holds_is_one_short_line(grc: Gearbox) -> None:
    lines = [repr(item) for item in shown(grc)]
    assert len(lines) > 100
    assert [line for line in lines if len(line) > LONGEST or "\n" in line] == []


def test_the_line_of_a_gearbox_tells_name_ratio_bodies_and_meshes(grc: Gearbox) -> None:
    assert repr(grc) == "<Gearbox 'GRC 750 kW': ratio 81.4907, 9 bodies, 8 meshes>"
    shown = grc._repr_html_()
    assert Page(shown).text.count("sun_planet_3") == 1
    assert shown.count("<img ") == 1
    assert len(shown) < 60_000


def test_parts_are_told_with_their_units(grc: Gearbox) -> None:
    assert repr(grc.body("planet_1")) == "<Body 'planet_1': planet on carrier, 125 kg, 3.6 kg m2 about its axis>"
    assert repr(grc.pairs["sun_planet"]) == "<PairSpec 'sun_planet': 21 and 39 teeth, 14000 N m on gear 1, flank -1>"
    assert repr(grc.load_cases["reference"]) == "<LoadCase 'reference': 30 s, no drive, torques on 2 bodies>"


def test_a_section_tells_the_keys_that_were_given(grc: Gearbox) -> None:
    assert repr(grc.case.joints["carrier"]) == str(grc.case.joints["carrier"])
    assert repr(grc.case.overall) == "<OverallSection: input = 'carrier', output = 'hss', output_gear = 'hs_pinion'>"
    assert "gear_body = 'planet'" in repr(grc.case.meshes["sun_planet"])
    assert "position_angle_deg" not in repr(grc.case.meshes["sun_planet"])


@pytest.mark.parametrize("number", range(9))
def test_names_that_are_html_are_shown_and_do_not_act(grc: Gearbox, number: int) -> None:
    hostile = {
        0: grc.varied({"name": HOSTILE}),
        1: grc.varied({"name": HOSTILE}).case,
        2: replace(grc.train, torques={HOSTILE: 1.0}),
        3: replace(grc.body("hss"), name=HOSTILE),
        4: replace(grc.bearings[0], name=HOSTILE),
        5: replace(grc.meshes[0], name=HOSTILE),
        6: replace(grc.pairs["sun_planet"], name=HOSTILE),
        7: replace(grc.load_cases["reference"], name=HOSTILE),
        8: replace(summarise_loads(grc, grc.load_cases["reference"]), name=HOSTILE),
    }[number]
    page = Page(hostile._repr_html_())
    assert page.elements - {"img"} == {"table", "caption", "tr", "th", "td"}
    assert "<script>alert(" in page.text
    assert len(repr(hostile)) <= LONGEST
    assert "\n" not in repr(hostile)


def test_a_long_title_is_cut(grc: Gearbox) -> None:
    assert len(repr(grc.varied({"name": "x" * 200}))) <= LONGEST
