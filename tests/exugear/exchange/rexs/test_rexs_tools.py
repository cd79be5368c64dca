"""Tools of a REXS file: the deepest cuts the root, the last one finishes the flank, a protuberance cuts into it."""

from __future__ import annotations

import math

import pytest

from exugear.exchange.rexs.to_case.conversion import to_case
from exugear.exchange.rexs.to_case.meshing import with_form_circles
from exugear.exchange.rexs.to_case.notes import Notes
from exugear.exchange.rexs.to_case.toothing import Toothing, toothing_of

from .own_files import OwnFile, spur_pair

HOB = {"addendum_coefficient_reference_profile": 1.4, "tip_radius_factor": 0.2}
GRINDING = {"addendum_coefficient_reference_profile": 1.25, "tip_radius_factor": 0.2}
ALLOWANCE = {"machining_allowance": 0.1}


def machined(file: OwnFile, part: int, *tools: tuple[dict[str, float], dict[str, float]]) -> None:
    """Let a gear or flank be made by tools in their order, each with its settings."""
    for order, (tool, settings) in enumerate(tools, 1):
        number = file.add("rack_shaped_tool", f"tool {order}", **tool)
        roles = {"workpiece": part, "tool": number}
        if settings:
            roles["manufacturing_settings"] = file.add("cylindrical_gear_manufacturing_settings", **settings)
        file.relate("manufacturing_step", order, **roles)


def imported(*tools: tuple[dict[str, float], dict[str, float]]) -> Toothing:
    """Read a gear of 40 teeth, made by tools, as an import takes it."""
    file = OwnFile()
    shaft = file.shaft((0.0, 0.0, 0.0), [(0.0, 100.0, 30.0)])
    gear = file.gear(shaft, (40.0, 0.0, 0.0), 40, 3.0)
    machined(file, gear, *tools)
    model = file.model()
    return with_form_circles(toothing_of(model, model.components[gear], (), Notes()), Notes())


@pytest.mark.parametrize("of_flank", [False, True])
def test_the_deepest_tool_makes_the_root_and_the_last_one_finishes_the_flank(of_flank: bool) -> None:
    """By hand: d_f = 60 - 2 * 1.4 * 3 mm; the grinding tool is straight to 1.25 - 0.2 (1 - sin 20 deg)."""
    file, _ = spur_pair()
    for number in (part.number for part in file.model().components_of_type("cylindrical_gear")):
        flank = file.model().related("flank", "gear", number, "left")[0].number
        machined(file, flank if of_flank else number, (HOB, ALLOWANCE), (GRINDING, {}))
    imported_gears = to_case(file.model(), "own").gearbox
    pinion = min(imported_gears.gears.values(), key=lambda gear: gear.teeth)
    assert 2e3 * pinion.root_radius == pytest.approx(51.6, abs=1e-9)
    assert pinion.rack.dedendum == 1.4
    wheel = max(imported_gears.gears.values(), key=lambda gear: gear.teeth)
    angle = math.radians(20.0)
    base = 60.0 * math.cos(angle)
    roll = base * math.tan(angle) - 3.0 * (1.25 - 0.2 * (1.0 - math.sin(angle))) / math.sin(angle)
    assert 1e3 * wheel.root_form_radius == pytest.approx(math.hypot(base, roll), abs=1e-3)
    assert wheel.root_form_radius > wheel.form_radius


def test_the_deepest_tool_counts_in_any_order_and_a_single_one_ends_no_flank() -> None:
    assert imported((GRINDING, {})).root_form is None
    assert imported((HOB, ALLOWANCE), (GRINDING, {})).dedendum.value == 1.4
    assert imported((GRINDING, {}), (HOB, {})).dedendum.value == 1.4


@pytest.mark.parametrize(
    ("teeth", "module", "helix", "shift", "root", "form"),
    [
        (19, 18.0, 7.35, 0.35, 312.0075752, 330.9693220),
        (81, 14.0, 14.5, -0.213698660697, 1129.5286231, 1143.9133095),
        (79, 9.0, 17.0, -0.119540307031, 718.2581431, 727.9423644),
    ],
)
def test_a_protuberance_ends_the_flank_where_a_rating_program_has_it(
    teeth: int, module: float, helix: float, shift: float, root: float, form: float
) -> None:
    """Results in fva_wind-turbine_1-3_results.rexsj of github.com/fva-net/rexs-diff; shifts without thinning."""
    file = OwnFile()
    shaft = file.shaft((0.0, 0.0, 0.0), [(0.0, 100.0, 30.0)])
    values = {"helix_angle_reference_diameter": helix, "shift": shift, "root_diameter": root}
    gear = file.gear(shaft, (40.0, 0.0, 0.0), teeth, module, **values)
    tool = {"addendum_coefficient_reference_profile": 1.25, "tip_radius_factor": 0.25}
    machined(file, gear, (tool | {"protuberance_amount": 0.25, "protuberance_angle": 10.0}, {}))
    model = file.model()
    found = with_form_circles(toothing_of(model, model.components[gear], (), Notes()), Notes())
    assert found.root_form is not None
    assert found.root_form.value == pytest.approx(form, abs=0.06)


def test_an_allowance_as_large_as_the_protuberance_leaves_the_flank_alone() -> None:
    """The hob then touches nothing of the finished flank, which ends where the grinding tool ends it."""
    protuberance = {"protuberance_amount": 0.1, "protuberance_angle": 10.0}
    plain = imported((HOB, ALLOWANCE), (GRINDING, {}))
    assert imported((HOB | protuberance, ALLOWANCE), (GRINDING, {})).root_form == plain.root_form
    relieved = imported((HOB | protuberance, {"machining_allowance": 0.02}), (GRINDING, {}))
    assert relieved.root_form is not None and plain.root_form is not None
    assert relieved.root_form.value > plain.root_form.value + 0.1
