"""Bearings that locate in one axial direction, loaded from the other side."""

from __future__ import annotations

import tomllib

import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.system.build import assemble
from exugear.system.operating_points import bearing_duties
from exugear.system.statics import BalanceError

from ...cases.bearing import BEARING_CASE, STIFFNESS

FORCE = """
[forces.axial]
body = "shaft_1"
z_mm = 0.0
force_N = [1.0, 0.0, {axial}]
"""
KINDS = {
    "angular_contact_ball": "contact_angle_deg = 40.0",
    "tapered_roller": "contact_angle_deg = 14.0",
}


def loaded(kind: str, towards: str, axial: float) -> Gearbox:
    """A shaft that one bearing alone locates, under an axial force."""
    one = f'type = "{kind}"\n{KINDS[kind]}\nlocates_towards = "{towards}"'
    text = BEARING_CASE.replace('type = "deep_groove_ball"', one) + FORCE.format(axial=axial)
    return Gearbox.from_dict(tomllib.loads(text))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("towards", "axial"), [("+z", -2000.0), ("-z", 2000.0)])
def test_a_bearing_loaded_from_behind_has_no_static_state(kind: str, towards: str, axial: float) -> None:
    """The force of a row along z is the sum of Q sin(alpha), of one sign: it cannot balance the opposite one."""
    with pytest.raises(BalanceError, match=r"ball, .*: located axially in one direction only"):
        assemble(loaded(kind, towards, axial), Choice("bushing", "iso6336"), STIFFNESS)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("towards", "axial"), [("+z", 2000.0), ("-z", -2000.0)])
def test_a_bearing_loaded_towards_its_shoulder_carries_the_force(kind: str, towards: str, axial: float) -> None:
    assembly = assemble(loaded(kind, towards, axial), Choice("bushing", "iso6336"), STIFFNESS)
    duty = next(duty for duty in bearing_duties(assembly) if duty.name == "ball")
    assert duty.axial_load == pytest.approx(axial, rel=1e-5)
