"""A pair that falls short of its safety against pitting gets a helix slope that closes the gap, followed and rated."""

from __future__ import annotations

import html
import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.templates.kinds import template
from exugear.project import Project
from exugear.report import design_study
from exugear.report.findings.margins import families_short_of_pitting
from exugear.report.findings.proposals import alignment_change
from exugear.results.folder import read_stored_gearbox
from exugear.system.statics import static_state


@pytest.fixture(scope="module")
def parallel() -> Gearbox:
    """Two parallel stages, of which the first falls short of a safety against pitting of 1.5."""
    content = tomllib.loads(template("parallel"))
    content["rating"]["minimum_S_H"] = 1.5
    return Gearbox.from_dict(content)


def test_material_goes_where_the_teeth_carry_and_on_top_of_what_is_there(parallel: Gearbox) -> None:
    carries_at_plus_z = alignment_change(parallel, "stage_1", -4.9e-6)
    assert carries_at_plus_z is not None
    assert carries_at_plus_z.keys == {"gears.pinion_1.modification.helix_slope_um": 5.0}
    assert carries_at_plus_z.requirement == "S_H"
    corrected = parallel.varied(carries_at_plus_z.keys)
    again = alignment_change(corrected, "stage_1", 2.0e-6)
    assert again is not None
    assert again.keys == {"gears.pinion_1.modification.helix_slope_um": 3.0}
    assert alignment_change(parallel, "stage_1", 0.4e-6) is None


def test_the_sun_is_modified_rather_than_planets_that_mesh_with_the_ring_too(grc: Gearbox) -> None:
    for family, gear in (("sun_planet", "sun"), ("ring_planet", "ring")):
        change = alignment_change(grc, family, 10e-6)
        assert change is not None
        assert change.keys == {f"gears.{gear}.modification.helix_slope_um": -10.0}


def test_families_are_those_with_a_flank_below_the_requirement(parallel: Gearbox) -> None:
    flanks = ["pinion_1 + stage_1", "wheel_1 + stage_1", "pinion_2 + stage_2", "wheel_2 + stage_2"]
    data = xr.Dataset(
        {
            "flank_contact_safety": ("flank", [1.6, math.nan, 1.7, math.nan]),
            "flank_contact_static": ("flank", [2.0, 1.4, math.nan, math.nan]),
        },
        {"flank": np.array(flanks, dtype=object)},
    )
    rating = parallel.case.rating
    assert rating is not None
    assert families_short_of_pitting(data, rating) == {"stage_1"}


@pytest.mark.validation
@pytest.mark.long
def test_the_advice_raises_the_safety_as_a_file_with_it_does(
    parallel: Gearbox, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(design_study, "propose_changes", lambda *given: [])
    project = Project(parallel, tmp_path, Choice("bushing"))
    study = project.design_changes()
    assert study is not None
    raised = [result for result in study.results if result.remedy]
    assert raised, [(result.change.words, result.price, result.refusal) for result in study.results]
    stored = read_stored_gearbox(tmp_path / design_study.FOLDER / raised[0].change.name)
    followed = Project(stored, tmp_path / "followed", Choice("bushing"))
    before, after = (
        float(np.nanmin([own["flank_contact_safety"].min(), own["flank_contact_static"].min()]))
        for own in (project.life(), followed.life())
    )
    assert after > 1.02 * before
    # The helix slope also moves load to the tip edges, which carry more than permitted before it.
    remedy, side = raised[0].remedy.split(", but ")
    assert remedy == f"S_H {before:.3g} to {after:.3g} (1.5 required)"
    assert "load on tip edges" in side
    # The flanks then carry over the whole face: the slope is the gap, which hardly depends on it.
    state = static_state(followed.assembly())
    mesh = next(n for n, own in enumerate(state.assembly.elements) if own.mesh.pair.name in raised[0].change.words)
    gap = state.misalignment[mesh] * state.assembly.elements[mesh].mesh.pair.face_width
    assert 1e6 * gap == pytest.approx(-next(iter(raised[0].change.keys.values())), abs=2.0)
    project.steady(design_study.settings_of_study(parallel))
    page = html.unescape(project.report().path.read_text(encoding="utf-8"))
    assert raised[0].remedy in page
