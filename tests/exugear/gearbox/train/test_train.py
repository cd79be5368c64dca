"""The gear train: how it rolls, and what its meshes carry at rest."""

from __future__ import annotations

import copy
import math
import pickle
from dataclasses import dataclass

import numpy as np
import pytest

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.train import (
    UNLOADED,
    Train,
    coupling_row,
    holding_forces,
    kinematic_modes,
    mesh_row,
    turn_together,
    without_round_off,
)
from fe_ste.geometry.gears import GearPair


@dataclass(frozen=True)
class Mesh:
    """A mesh as a train sees it."""

    name: str
    pair: GearPair
    pinion: str
    gear: str
    frame: str


@dataclass(frozen=True)
class Coupling:
    """A coupling as a train sees it."""

    first: str
    second: str


def train_of(grc: Gearbox, locked: tuple[str, ...] = ("b",), **changes: object) -> Train:
    """Two wheels on fixed axes and a third shaft behind a coupling; 10 N m drive it at one end."""
    mesh = Mesh("mesh", grc.gear_pairs["high_speed"], "a", "b", "ground")
    values = {
        "spins": ("a", "b", "c"),
        "meshes": (mesh,),
        "couplings": (Coupling("c", "a"),),
        "input": "b",
        "output": "c",
        "torques": {"c": 10.0},
        "locked": locked,
        "error": ValueError,
    }
    return Train(**(values | changes))


# -- of the example gearbox ----------------------------------------------------------------------------------------


def test_ratio_is_the_product_of_the_tooth_numbers(grc: Gearbox) -> None:
    assert grc.train.ratio == pytest.approx((1 + 99 / 21) * 82 / 23 * 88 / 22, rel=1e-13)


def test_mesh_frequencies_per_rpm_of_the_carrier(grc: Gearbox) -> None:
    # Closed form: z_ring n / 60, then times the ratios; printed with five decimals in the case data.
    found = grc.train.mesh_frequencies(math.pi / 30)
    assert found["sun_planet_1"] == pytest.approx(1.65000, abs=5e-6)
    assert found["ring_planet_3"] == pytest.approx(1.65000, abs=5e-6)
    assert found["intermediate"] == pytest.approx(7.80952, abs=5e-6)
    assert found["high_speed"] == pytest.approx(29.87992, abs=5e-6)


def test_line_of_action_forces_agree_with_the_case_data(grc: Gearbox) -> None:
    # 140.8 / 140.8 / 128.7 / 55.5 kN, four digits printed.
    forces = {name: abs(force) for name, force in grc.train.static_mesh_forces().items()}
    assert forces["sun_planet_2"] == pytest.approx(140.8e3, rel=5e-4)
    assert forces["ring_planet_2"] == pytest.approx(140.8e3, rel=5e-4)
    assert forces["intermediate"] == pytest.approx(128.7e3, rel=5e-4)
    assert forces["high_speed"] == pytest.approx(55.5e3, rel=5e-4)


def test_turning_ring_gives_two_degrees_of_freedom(grc: Gearbox) -> None:
    content = copy.deepcopy(dict(grc.content))
    content["bodies"]["housing"].pop("fixed")
    content["bodies"]["housing"]["inertia"] = {
        name: {"mass_kg": 509.0, "axial_kg_m2": 160.0, "transverse_kg_m2": 92.0, "centre_of_mass_z_mm": -104.5}
        for name in ("assemblies", "gears")
    }
    content["static_load"]["locked"] = ["hss", "housing"]
    gearbox = Gearbox.from_dict(content)
    assert gearbox.train.degrees_of_freedom == 2
    assert gearbox.train.ratio == pytest.approx((1 + 99 / 21) * 82 / 23 * 88 / 22, rel=1e-12)  # the ring held
    content["overall"]["input"] = "housing"  # now nothing holds the carrier
    with pytest.raises(GearboxFileError, match=r"2 degrees of freedom.*static_load.locked"):
        _ = Gearbox.from_dict(content).train.ratio


def test_a_train_is_computed_once_and_survives_a_copy_to_another_process(grc: Gearbox) -> None:
    assert grc.train is grc.train
    assert grc.train.kinematic_modes is grc.train.kinematic_modes
    copied = pickle.loads(pickle.dumps(grc)).train
    assert copied.static_mesh_forces() == grc.train.static_mesh_forces()
    with pytest.raises(GearboxFileError, match="body 'nobody' does not rotate; bodies are"):
        copied.rolling_speeds("nobody", 1.0)


# -- of its own ----------------------------------------------------------------------------------------------------


def test_a_train_knows_no_gearbox(grc: Gearbox) -> None:
    train = train_of(grc)
    teeth = train.meshes[0].pair.gear.teeth / train.meshes[0].pair.pinion.teeth
    assert train.degrees_of_freedom == 1
    assert train.ratio == pytest.approx(-teeth, rel=1e-12)
    assert train.rolling_speeds("c", 3.0)["a"] == pytest.approx(3.0, rel=1e-12)
    forces = train.static_mesh_forces()
    assert forces["mesh"] == pytest.approx(10.0 / train.meshes[0].pair.pinion.base_radius, rel=1e-12)


def test_what_a_train_cannot_do_is_told_as_it_was_asked_to(grc: Gearbox) -> None:
    with pytest.raises(ValueError, match="body 'd' does not rotate; bodies are a, b, c"):
        train_of(grc).rolling_speeds("d", 1.0)
    with pytest.raises(ValueError, match="meshes: the gear train is locked by its meshes and couplings; check them"):
        _ = train_of(grc, couplings=(Coupling("c", "a"), Coupling("a", "b"))).ratio
    with pytest.raises(ValueError, match="does not balance the torques"):
        train_of(grc, locked=()).static_mesh_forces()
    with pytest.raises(ValueError, match=": more bodies than the degrees of freedom of the train"):
        train_of(grc, locked=("b", "a")).static_mesh_forces()
    with pytest.raises(ValueError, match="static_load.locked = 'd': no such rotating body; bodies are"):
        train_of(grc, locked=("d",)).static_mesh_forces()
    with pytest.raises(
        ValueError,
        match="2 degrees of freedom; the rotation of b does not determine",
    ):
        _ = train_of(grc, couplings=()).ratio


def test_meshes_close_with_the_spins_over_the_frame(grc: Gearbox) -> None:
    spins = ("lss", "planet_1", "carrier")
    external, internal = (mesh for mesh in grc.meshes if mesh.name in ("sun_planet_1", "ring_planet_1"))
    sun, planet = external.pair.pinion.base_radius, external.pair.gear.base_radius
    assert mesh_row(spins, external) == pytest.approx([sun, planet, -(sun + planet)], rel=1e-15)
    planet, ring = internal.pair.pinion.base_radius, internal.pair.gear.base_radius
    assert mesh_row(spins, internal) == pytest.approx([0.0, planet, ring - planet], rel=1e-15)


def test_a_coupling_twists_with_the_difference_of_its_spins() -> None:
    assert coupling_row(("a", "b", "c"), Coupling("c", "a")).tolist() == [-1.0, 0.0, 1.0]


def test_kinematic_modes_are_seen_by_no_row_whatever_its_unit() -> None:
    rows = np.array([[1.0, 2.0, 0.0, 0.0], [0.0, 3e-9, 1e-9, 0.0]])
    modes = kinematic_modes(rows)
    assert modes.shape == (4, 2)
    assert np.abs(rows @ modes).max() < 1e-15
    assert modes.T @ modes == pytest.approx(np.eye(2), abs=1e-14)
    assert kinematic_modes(np.zeros((0, 3))).shape == (3, 3)


def test_bodies_turn_together_in_either_sense() -> None:
    assert turn_together(np.array([1.0, 2.0]), np.array([-3.0, -6.0]))
    assert not turn_together(np.array([1.0, 2.0]), np.array([2.0, 1.0]))


def test_equal_paths_share_a_load_equally() -> None:
    assert holding_forces(np.array([[1.0, 1.0]] * 3), np.array([6.0, 6.0])) == pytest.approx([2.0] * 3, rel=1e-12)


def test_round_off_of_a_balance_is_no_force() -> None:
    forces = np.array([5.0, 0.9 * UNLOADED * 10.0 / 0.1, -1.1 * UNLOADED * 10.0 / 0.1])
    assert without_round_off(forces, 10.0, 0.1).tolist() == [5.0, 0.0, forces[2]]
