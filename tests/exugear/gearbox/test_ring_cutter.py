"""The cutter of a ring in the gearbox file: what its keys make of the root circle and the fillet."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.templates.kinds import template

from ..cases.command import exugear


def gearbox_of(cutter: dict[str, Any], **changes: Any) -> Gearbox:
    content = tomllib.loads(template("planetary"))
    content["gears"]["ring"] |= {"cutter": cutter, **changes}
    return Gearbox.from_dict(content, "case.toml")


def test_a_cutter_reaches_the_root_circle_of_the_ring_and_ends_its_flank_elsewhere_than_the_arc():
    plain = Gearbox.from_dict(tomllib.loads(template("planetary")), "case.toml").gears["ring"]
    cut = gearbox_of({"teeth": 30, "tip_radius": 0.2}).gears["ring"]
    assert cut.root_radius == plain.root_radius
    assert abs(cut.form_radius - plain.form_radius) > 1e-6


def test_an_addendum_is_the_tip_diameter_of_the_same_cutter():
    """d_a0 = m_n (z_0 + 2 (x_0 + h_a0*)) of a spur cutter."""
    by_addendum = gearbox_of({"teeth": 30, "tip_radius": 0.2, "profile_shift": 0.1, "addendum": 1.25})
    module = 1e3 * by_addendum.gears["ring"].normal_module
    tip = module * (30 + 2.0 * 1.35)
    by_diameter = gearbox_of({"teeth": 30, "tip_radius": 0.2, "profile_shift": 0.1, "tip_diameter_mm": tip})
    one, other = (gearbox.gears["ring"] for gearbox in (by_addendum, by_diameter))
    assert one.helix_angle == 0.0
    assert one.root_radius == pytest.approx(other.root_radius, rel=1e-14)
    assert one.form_radius == pytest.approx(other.form_radius, rel=1e-14)


@pytest.mark.parametrize(
    ("cutter", "changes", "message"),
    [
        (
            {"teeth": 30, "tip_radius": 0.2, "addendum": 1.2, "tip_diameter_mm": 97.0},
            {},
            "set addendum or tip_diameter_mm, not both: each defines the tip of the cutter",
        ),
        (
            {"teeth": 30, "tip_radius": 0.2, "addendum": 1.2},
            {"root_diameter_mm": 260.0},
            "root_diameter_mm follows from cutter.addendum; remove one of them",
        ),
        ({"teeth": 30, "tip_radius": 0.9}, {}, "cutter.tip_radius = 0.9 does not fit on the cutter's tip: at most 0"),
        ({"tip_radius": 0.2}, {}, "gears.ring.cutter.teeth: this key is missing"),
    ],
)
def test_cutters_that_cannot_be_are_refused(cutter: dict[str, Any], changes: dict[str, Any], message: str):
    with pytest.raises(GearboxFileError, match=message):
        gearbox_of(cutter, **changes)


def test_a_cutter_of_an_external_gear_is_refused():
    content = tomllib.loads(template("planetary"))
    content["gears"]["sun"]["cutter"] = {"teeth": 30, "tip_radius": 0.2}
    with pytest.raises(GearboxFileError, match=r"gears.sun: a cutter is for ring gears \(internal = true\)"):
        Gearbox.from_dict(content, "case.toml")


@pytest.mark.validation
def test_check_passes_a_ring_with_its_cutter(tmp_path: Path):
    path = tmp_path / "case.toml"
    text = template("planetary")
    path.write_text(f"{text}\n[gears.ring.cutter]\nteeth = 30\ntip_radius = 0.2\n", encoding="utf-8")
    told = exugear("check", path)
    assert told.exit_code == 0, told.output
