"""Tables of the reference analysis: kept position by position, never taken for the superelement's."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from fe_ste.elasticity.gear_mesh import ContactMesh
from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.reference.newton import NewtonSettings
from fe_ste.reference.position import NonlinearSettings
from fe_ste.reference.table import NonlinearInput, NonlinearTable
from fe_ste.transmission_error.table import MeshTable, TableError, TableInput

from ..damage import damages

GEAR = Gear(name="gear", teeth=30, normal_module=3e-3, face_width=20e-3, held_diameter=60e-3)
PAIR = GearPair(name="pair", pinion=GEAR, gear=GEAR, centre_distance=90e-3)
SETTINGS = NonlinearSettings(
    teeth=3,
    mesh=ContactMesh(layers=3, contact_elements=3, growth=1.0, thickness=5, fillet=2, root=2, rim=4, far_flank=4),
)
WANTED = NonlinearInput(pair=PAIR, torque=100.0, positions=2, settings=SETTINGS)


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    path = tmp_path_factory.mktemp("tables") / "pair-nonlinear.nc"
    NonlinearTable.compute(WANTED, path)
    return path


@pytest.mark.validation
def test_a_table_says_what_it_is_and_names_its_units(path):
    table = NonlinearTable.open(path, WANTED)
    data = table.dataset
    assert table.complete
    assert data.sizes == {"pmc": 2, "torque": 1, "tooth": 3}
    assert all("units" in data[name].attrs for name in data.variables)
    assert data.attrs["method"].startswith("non-linear finite elements on whole gears with 3 teeth meshed")
    assert np.allclose(data["load_share"].sum("tooth"), 1.0)
    assert (data["mesh_stiffness"] * data["ste"] == data["line_of_action_force"]).all()
    assert (data["max_von_mises"] > 0).all() and (data["wall_time"] > 0).all()
    # A line for each iteration under a line for each position.
    assert data.attrs["convergence"].count("position ") == 2
    assert len(data.attrs["convergence"].splitlines()) == 2 * 2 + int(data["iterations"].sum())


@pytest.mark.validation
def test_a_table_is_refused_for_another_input_and_as_one_of_the_superelement(path, tmp_path):
    with pytest.raises(TableError, match="another input"):
        NonlinearTable.open(path, dataclasses.replace(WANTED, torque=101.0))
    with pytest.raises(TableError, match="is not a file of static transmission error table"):
        MeshTable.open(path, TableInput(pair=PAIR, torque=(100.0,), positions=2))
    with pytest.raises(TableError, match="no such file"):
        NonlinearTable.open(tmp_path / "none.nc")
    (tmp_path / "text.nc").write_text(": is not a netCDF file")
    with pytest.raises(TableError, match="no checksum at its end"):
        NonlinearTable.open(tmp_path / "text.nc")


@pytest.mark.validation
def test_no_damaged_table_is_used(path, tmp_path):
    copy = tmp_path / "pair-nonlinear.nc"
    for damaged in damages(path.read_bytes(), 100):
        copy.write_bytes(damaged)
        with pytest.raises(TableError, match=r"nonlinear\.nc: (has no checksum at its end|is damaged)"):
            NonlinearTable.open(copy, WANTED)


@pytest.mark.validation
def test_what_converged_before_a_stop_is_kept_and_taken_up_again(tmp_path):
    path, seen = tmp_path / "pair-nonlinear.nc", []

    def stop_in_the_second(done, of, iteration):
        seen.append((done, of))
        if done == 1 and iteration is not None:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        NonlinearTable.compute(WANTED, path, stop_in_the_second)
    kept = NonlinearTable.open(path, WANTED)
    assert kept.dataset["converged"].values[:, 0].tolist() == [True, False]
    first = kept.dataset["ste"].values[0, 0], kept.dataset["wall_time"].values[0, 0]
    whole = NonlinearTable.compute(WANTED, path, lambda done, of, iteration: seen.append((done, of)))
    assert whole.complete
    assert (whole.dataset["ste"].values[0, 0], whole.dataset["wall_time"].values[0, 0]) == first
    assert (0, 2) in seen and seen[-1] == (2, 2)


@pytest.mark.validation
def test_a_position_that_fails_is_not_a_number_and_says_why():
    # Two iterations do not reach rounding.
    hurried = dataclasses.replace(SETTINGS, newton=NewtonSettings(most_iterations=2, force_tolerance=1e-13))
    table = NonlinearTable.compute(dataclasses.replace(WANTED, settings=hurried, positions=1))
    assert not table.complete
    assert np.isnan(table.dataset["ste"].values).all()
    assert len(table.failures) == 1
    assert table.failures[0].startswith("position 0 of the mesh cycle, torque 100 N m: load step 1")


def test_a_table_without_positions_is_refused():
    with pytest.raises(ValueError, match="at least 1"):
        dataclasses.replace(WANTED, positions=0)
