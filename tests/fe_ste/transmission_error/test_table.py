"""Tables on disk: what they depend on, and that no file is ever half written or wrongly used."""

from __future__ import annotations

import dataclasses
import errno
import json
import os
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray as xr

import fe_ste.elasticity.flank
import fe_ste.transmission_error.table
from fe_ste.contact.kinematics import ContactSettings
from fe_ste.elasticity.hexmesh import MeshSettings
from fe_ste.flanks import FlankModification
from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.tools.stores import write_dataset
from fe_ste.transmission_error.table import MeshTable, TableError, TableInput

from ..cases.gears import GEAR_30, PAIR_30
from ..damage import damages

WANTED = TableInput(
    pair=PAIR_30,
    torque=(50.0, 100.0),
    positions=3,
    misalignment=(0.0, 1e-4),
    mesh=MeshSettings(layers=4, flank=8, thickness=6, rim=5),
    contact=ContactSettings(slices=8),
)

CHANGES: dict[str, Any] = {
    "pair": dataclasses.replace(PAIR_30, gear=dataclasses.replace(GEAR_30, held_diameter=51e-3)),
    "torque": (50.0,),
    "positions": 4,
    "centre_distance": (90.01e-3,),
    "misalignment": (0.0,),
    "mesh": MeshSettings(layers=5, flank=8, thickness=6, rim=5),
    "contact": ContactSettings(slices=9),
    "pinion_modification": FlankModification(lead_crowning=1e-6),
    "gear_modification": FlankModification(profile_crowning=1e-6),
    "static_torque": 50.0,
}


@pytest.fixture(scope="module")
def table() -> MeshTable:
    return MeshTable.compute(WANTED)


@pytest.mark.parametrize("key", [field.name for field in dataclasses.fields(TableInput)])
def test_hash_changes_with_every_input(key: str) -> None:
    assert dataclasses.replace(WANTED, **{key: CHANGES[key]}).hash != WANTED.hash


def test_table_has_all_axes_and_is_labelled(table: MeshTable) -> None:
    data = table.dataset
    assert data.ste.dims == ("pmc", "torque", "centre_distance", "misalignment")
    assert data.ste.shape == (3, 2, 1, 2)
    assert bool(data.converged.all()) and table.failures == []
    assert json.loads(data.attrs["input"])["torque"] == [50.0, 100.0]
    # The compliance depends on what holds the gears, so the table says it.
    assert data.attrs["pinion_held_diameter"] == data.attrs["gear_held_diameter"] == GEAR_30.held_diameter


def test_static_state_is_chosen_by_value_not_by_place(table: MeshTable) -> None:
    with pytest.raises(TableError, match="torque"):
        _ = table.static_state  # of two torques none is named
    assert table.plot().get_title() == "torque 50 N m"
    assert "No diagram" not in table._repr_html_()
    named = MeshTable(table.dataset.assign_attrs(static_torque=100.0))
    assert float(named.static_state.torque) == 100.0
    assert float(named.static_state.misalignment) == 0.0
    assert named.static_state.ste.dims == ("pmc",)
    assert np.array_equal(named.static_state.ste, table.dataset.ste.isel(torque=1, centre_distance=0, misalignment=0))


def test_saved_table_opens_with_the_same_numbers_and_by_xarray_alone(table: MeshTable, tmp_path: Path) -> None:
    path = tmp_path / "new folder" / "pair.nc"
    table.save(path)
    again = MeshTable.open(path, WANTED)
    xr.testing.assert_identical(again.dataset, table.dataset)
    with xr.open_dataset(path, engine="h5netcdf") as plain:
        assert np.array_equal(plain["ste"], table.dataset["ste"])
        assert plain["ste"].attrs["units"] == "m"
    assert [entry.name for entry in path.parent.iterdir()] == ["pair.nc"]


def test_table_of_another_input_is_refused(table: MeshTable, tmp_path: Path) -> None:
    table.save(tmp_path / "pair.nc")
    with pytest.raises(TableError, match="another input"):
        MeshTable.open(tmp_path / "pair.nc", dataclasses.replace(WANTED, positions=4))


def test_failure_while_writing_leaves_the_old_file(
    table: MeshTable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "pair.nc"
    table.save(path)
    before = path.read_bytes()

    def full(handle: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match=r"No space left on device: '.*pair\.nc'"):
        table.save(path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("content", [b"", b"no netCDF at all", None])
def test_unreadable_files_are_refused_by_name(content: bytes | None, tmp_path: Path) -> None:
    path = tmp_path / "broken.nc"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(TableError, match="broken.nc"):
        MeshTable.open(path)


def test_no_damaged_or_edited_table_is_used(table: MeshTable, tmp_path: Path) -> None:
    path = tmp_path / "pair.nc"
    table.save(path)
    content = path.read_bytes()
    for damaged in damages(content, 400):
        path.write_bytes(damaged)
        with pytest.raises(TableError, match=r"pair\.nc: (has no checksum at its end|is damaged)"):
            MeshTable.open(path, WANTED)
    path.write_bytes(content)
    with h5py.File(path, "r+") as file:  # under its old hash
        file["ste"][...] = 2.0 * file["ste"][...]
    with pytest.raises(TableError, match=r"pair\.nc: (has no checksum at its end|is damaged)"):
        MeshTable.open(path, WANTED)


def test_netcdf_without_a_table_is_refused(tmp_path: Path) -> None:
    write_dataset(tmp_path / "other.nc", xr.Dataset({"other": ("x", [1.0])}))
    with pytest.raises(TableError, match="is not a file of static transmission error table"):
        MeshTable.open(tmp_path / "other.nc")


def test_a_gear_that_meshes_twice_is_computed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """On either flank, under another name or not."""
    calls = []
    compute = fe_ste.elasticity.flank.flank_compliance

    def counted(gear: Gear, *rest: Any, **options: Any) -> Any:
        calls.append(gear.face_width)
        return compute(gear, *rest, **options)

    monkeypatch.setattr(fe_ste.elasticity.flank, "flank_compliance", counted)
    monkeypatch.setenv("EXUGEAR_FLANKS", "off")  # a test before may have kept it
    gear = dataclasses.replace(GEAR_30, face_width=1.01 * GEAR_30.face_width)
    pair = GearPair(name="pair", pinion=gear, gear=dataclasses.replace(gear, name="other"), centre_distance=90e-3)
    compliance = fe_ste.transmission_error.table.prepared_compliance(dataclasses.replace(WANTED, pair=pair))
    assert calls == [gear.face_width]
    assert [flank.gear.name for flank in compliance.flanks] == [gear.name, "other"]
