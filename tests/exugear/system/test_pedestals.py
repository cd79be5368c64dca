"""Bodies that only bearings and mounts hold, and couplings to bodies that stand still."""

from __future__ import annotations

import copy
import tomllib
from typing import Any

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.system.gearbox_checks import lacking
from exugear.system.modes import eigenmodes

from ..cases.spur import SPUR_CASE

FOOT = {"radial_N_per_m": 1e8, "axial_N_per_m": 1e8, "tilt_N_m_per_rad": 1e6, "torsion_N_m_per_rad": 1e6}


def pedestal(foot: dict[str, float] | None = None, mounted: bool = False) -> dict[str, Any]:
    """The spur pair whose first shaft turns in a pedestal of 5 kg, which stands on the ground."""
    found = tomllib.loads(SPUR_CASE)
    mass = {"mass_kg": 5.0, "axial_kg_m2": 0.05, "transverse_kg_m2": 0.05, "centre_of_mass_z_mm": 0.0}
    found["bodies"]["pedestal"] = {"axis_position_mm": [0.0, 0.0], "inertia": {"disc": mass}}
    found["bearings"]["bearing_1"]["on"] = "pedestal"
    stiffness = copy.deepcopy(FOOT if foot is None else foot)
    if mounted:
        found["mounts"] = {"foot": {"body": "pedestal", "position_mm": [0.0, 0.0, 0.0], "stiffness": stiffness}}
    else:
        found["bearings"]["foot"] = {"body": "pedestal", "z_mm": 0.0, "stiffness": stiffness}
    return found


@pytest.mark.parametrize("mounted", [False, True])
def test_a_shaft_in_a_pedestal_moves_along_its_axis_as_two_masses_on_two_springs(mounted: bool) -> None:
    """Closed form: 1 kg on 1e8 N/m times 0.5 of the housing factor on 5 kg on the foot; a mount has no such factor."""
    gearbox = Gearbox.from_dict(pedestal(mounted=mounted), "case.toml")
    assert not lacking(gearbox, "bushing")
    found = eigenmodes(gearbox, Choice("bushing", "iso6336"), {"spur": 3e8}).frequency
    bearing = 0.5e8
    foot = 1e8 if mounted else 0.5e8
    matrix = np.diag([1.0, 1.0 / 5.0]) @ np.array([[bearing, -bearing], [-bearing, bearing + foot]])
    for frequency in np.sqrt(np.linalg.eigvals(matrix)) / (2.0 * np.pi):
        assert np.min(np.abs(found / frequency - 1.0)) < 1e-3


def test_a_very_stiff_foot_is_the_ground() -> None:
    foot = {key: 1e5 * value for key, value in FOOT.items()}
    held = eigenmodes(
        Gearbox.from_dict(pedestal(foot), "c.toml"), Choice("bushing", "iso6336"), {"spur": 3e8}
    ).frequency
    plain = Gearbox.from_dict(tomllib.loads(SPUR_CASE), "c.toml")
    expected = eigenmodes(plain, Choice("bushing", "iso6336"), {"spur": 3e8}).frequency
    np.testing.assert_allclose(held[: expected.size], expected, rtol=1e-4, atol=0.1)


def test_a_pedestal_that_can_turn_is_refused_with_what_it_needs() -> None:
    with pytest.raises(
        GearboxFileError, match="pedestal are not connected to shaft_1 by a .*needs torsion_N_m_per_rad"
    ):
        Gearbox.from_dict(pedestal(FOOT | {"torsion_N_m_per_rad": 0.0}), "case.toml")


@pytest.mark.parametrize("order", [("shaft_2", "house"), ("house", "shaft_2")])
def test_a_coupling_to_a_fixed_body_is_the_torsion_of_a_bearing_on_it(order: tuple[str, str]) -> None:
    coupled, held = tomllib.loads(SPUR_CASE), tomllib.loads(SPUR_CASE)
    for found in (coupled, held):
        found["bodies"]["house"] = {"axis_position_mm": [75.0, 0.0], "fixed": True}
    coupled["couplings"] = {"arm": {"bodies": list(order), "stiffness_N_m_per_rad": 1e5}}
    held["bearings"]["arm"] = {"body": "shaft_2", "on": "house", "z_mm": 0.0, "housing_factor_applies": False,
                               "stiffness": {"torsion_N_m_per_rad": 1e5}}  # fmt: skip
    found, expected = (
        eigenmodes(Gearbox.from_dict(one, "case.toml"), Choice("bushing", "iso6336"), {"spur": 3e8}).frequency
        for one in (coupled, held)
    )
    assert expected[0] > 1.0
    assert lacking(Gearbox.from_dict(coupled, "case.toml"), "rigid").startswith(
        "couplings.arm connects a rotating body to a fixed one, which"
    )
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_a_coupling_of_two_fixed_bodies_is_refused() -> None:
    found = tomllib.loads(SPUR_CASE)
    for name in ("house", "wall"):
        found["bodies"][name] = {"axis_position_mm": [0.0, 0.0], "fixed": True}
    found["couplings"] = {"arm": {"bodies": ["house", "wall"], "stiffness_N_m_per_rad": 1e5}}
    with pytest.raises(
        GearboxFileError, match="couplings.arm.bodies: 'house' has no rotation of its own; a coupling connects two of"
    ):
        Gearbox.from_dict(found, "case.toml")
