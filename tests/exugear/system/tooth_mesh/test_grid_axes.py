"""Axes of tables that follow from how the gears stand at rest, and which tables serve in their place."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import exugear.system.tooth_mesh.tables
from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.project import Project
from exugear.system.build import assemble
from exugear.system.statics import static_state
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness
from exugear.system.tooth_mesh.tables import (
    LEAST,
    REACH,
    axes_reaching,
    fitting_table,
    requested_tables,
    rounded_up,
    wanted_table,
)
from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.transmission_error.table import MeshTable, TableError

from ...cases.spur import COARSE_INPUT, SPUR_CASE

GEAR = Gear(name="gear", teeth=30, normal_module=3e-3, face_width=20e-3, held_diameter=50e-3, tooth_thinning=1e-4)
PAIR = GearPair(name="pair", pinion=GEAR, gear=GEAR, centre_distance=90e-3)


@pytest.mark.parametrize("place", [0.0, 1e-6, 7e-6, 33e-6, 90e-6, 4e-4])
def test_axes_reach_three_times_the_static_state_and_at_least_twenty_micrometres(place: float) -> None:
    axes = axes_reaching(PAIR, place, place)
    openings, offsets = np.array(axes.openings), np.array(axes.offsets)
    for values in (openings, offsets):
        assert (np.diff(values) > 0.0).all() and 0.0 in values
    least = max(LEAST, REACH * place)
    assert least <= openings.max() <= 1.5 * least and openings.min() == -openings.max()
    assert least <= offsets.max() <= 1.5 * least
    assert 5 <= len(openings) <= 9


def test_centre_distances_end_where_the_backlash_does() -> None:
    for distance in (90e-3 + np.array(axes_reaching(PAIR, 0.0, 400e-6).offsets)).tolist():
        PAIR.with_centre_distance(distance)  # refuses one at which flanks overlap
    tight = dataclasses.replace(GEAR, tooth_thinning=0.0)
    without = GearPair(name="tight", pinion=tight, gear=tight, centre_distance=90e-3)
    assert axes_reaching(without).offsets[0] == 0.0
    assert axes_reaching(without).offsets[-1] == pytest.approx(100e-6)


def test_ends_are_round_numbers() -> None:
    for value in np.geomspace(1e-5, 1e-3, 200).tolist():
        end = rounded_up(value)
        assert value * (1.0 - 1e-9) <= end <= 1.5 * value
        assert rounded_up(end) == end


def test_axes_of_a_gearbox_follow_from_its_static_state(grc: Gearbox, tmp_path: Path) -> None:
    axes = Project(grc, tmp_path).grid_axes()
    state = static_state(assemble(grc, Choice("bushing", "iso6336"), mesh_stiffness(grc, "iso6336")))
    assert set(axes) == set(grc.pairs)
    for mesh, misalignment in zip(grc.meshes, state.misalignment, strict=True):
        own = axes[mesh.pair.name]
        assert max(own.openings) >= REACH * abs(misalignment) * mesh.pair.face_width
        wanted = wanted_table(grc, mesh.pair.name, 50, grid=True, axes=own)
        assert max(wanted.misalignment) == pytest.approx(max(own.openings) / mesh.pair.face_width)
    widths = {name: max(own.openings) for name, own in axes.items()}
    assert widths["sun_planet"] > 2.0 * widths["intermediate"]  # which a planet's tilt makes
    assert Project(grc, tmp_path).requested_tables(grid=True)[0].wanted.misalignment[-1] > 0.0


def test_axes_of_a_gearbox_whose_static_state_is_not_known_are_the_usual_ones(tmp_path: Path) -> None:
    alone = Gearbox.from_toml(_case(tmp_path, SPUR_CASE.split("[bearings.bearing_1]")[0] + _after_bearings()))
    assert Project(alone, tmp_path).grid_axes() == {}
    wanted = Project(alone, tmp_path).requested_tables(grid=True)[0].wanted
    assert wanted.misalignment[-1] * 15e-3 == pytest.approx(60e-6)


def _after_bearings() -> str:
    return "[meshes]" + SPUR_CASE.split("[meshes]")[1]


def _case(folder: Path, text: str) -> Path:
    path = folder / "gearbox.toml"
    path.write_text(text.replace("positions = 8", "positions = 8, torque_factors = [1.0]"), encoding="utf-8")
    return path


@pytest.mark.validation
def test_keys_of_the_file_are_taken_as_they_are_and_a_table_that_reaches_far_enough_serves(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(exugear.system.tooth_mesh.tables, "TableInput", COARSE_INPUT)
    spur = Gearbox.from_toml(_case(tmp_path, SPUR_CASE))
    near = axes_reaching(spur.pairs["spur"].pair, 0.0, 0.0)
    (request,) = requested_tables(spur, tmp_path, grid=True, axes={"spur": near})
    request.compute()
    twice, thrice = (axes_reaching(spur.pairs["spur"].pair, place, 0.0) for place in (12e-6, 20e-6))
    assert isinstance(fitting_table(spur, "spur", tmp_path, grid=True, axes=twice), MeshTable)
    with pytest.raises(TableError, match=": its axes end too close to the static state; recompute it"):
        fitting_table(spur, "spur", tmp_path, grid=True, axes=thrice)
    (again,) = requested_tables(spur, tmp_path, grid=True, axes={"spur": thrice})
    assert again.stored is None and "too close" in again.replaces
    named = _case(tmp_path, SPUR_CASE.replace("ste = { ", "ste = { misalignment_um = [-20.0, -5.0, 0.0, 20.0], "))
    own = Gearbox.from_toml(named)
    with pytest.raises(TableError, match="another input"):
        fitting_table(own, "spur", tmp_path, grid=True)
    (request,) = requested_tables(own, tmp_path / "own", grid=True, axes={"spur": thrice})
    request.compute()  # what the file names is enough, however far the gears tilt
    assert fitting_table(own, "spur", tmp_path / "own", grid=True, axes=thrice).failures == []
