"""Weight and constant forces in the static balance over torques: they do not grow with the torque."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.templates.kinds import template
from exugear.life.static_balance import static_balance
from exugear.system.build import assemble
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness

LOADS = {
    "weight": {"gravity.acceleration_m_per_s2": [0.0, -9.81, 0.0]},
    "force": {"forces": {"belt": {"body": "input", "z_mm": 0.0, "force_N": [0.0, -500.0, 0.0]}}},
}
STATIC_TORQUE = 100.0
"""Torque on the input in the template, N m."""


def assembled(gearbox: Gearbox) -> Assembly:
    return assemble(gearbox, Choice("bushing", "iso6336"), mesh_stiffness(gearbox, "iso6336"))


@pytest.mark.parametrize("load", LOADS)
def test_bearing_loads_of_weight_do_not_grow_with_the_torque_between_solved_torques(load):
    """Interpolated loads against the balance solved at these torques, the smallest below all solved ones."""
    given = Gearbox.from_dict(tomllib.loads(template("parallel")))
    gearbox = given.varied(LOADS[load]) if load == "weight" else Gearbox.from_dict({**given.content, **LOADS[load]})
    assembly = assembled(gearbox)
    balance = static_balance(assembly, "input", np.array([STATIC_TORQUE]), 1)
    for share in (0.05, 0.175, 0.375):
        torque = np.array([share * STATIC_TORQUE])
        found = balance.at(balance.bearing_load, torque)[0, 0, :, :3]
        solved = static_balance(assembly, "input", torque, 1).bearing_load.values[-1, 0, :, :3]
        assert found == pytest.approx(solved, abs=0.02 * np.abs(solved).max())


def test_weight_loads_bearings_without_torque():
    gearbox = Gearbox.from_dict(tomllib.loads(template("parallel"))).varied(LOADS["weight"])
    assembly = assembled(gearbox)
    balance = static_balance(assembly, "input", np.array([STATIC_TORQUE, -STATIC_TORQUE]), 1)
    vertical = balance.at(balance.bearing_load, np.zeros(1))[0, 0, :, 1].sum()
    weight = 9.81 * sum(body.mass for body in assembly.bodies if not gearbox.named_bodies[body.name].fixed)
    assert vertical == pytest.approx(-weight, rel=0.05)
