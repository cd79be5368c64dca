"""Constant forces and moments on bodies: bearings hold them, whatever the body is made of and whichever solver runs."""

from __future__ import annotations

import copy
import tomllib
from typing import Any

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.life.static_balance import is_linear
from exugear.system.kernels.connectors import add_connector_forces
from exugear.system.loads import LoadTable
from exugear.system.modes import eigenmodes
from exugear.system.statics import locked_equilibrium
from exugear.system.system import Assembly
from exugear.transient.compiled.solver import CompiledSystem
from exugear.transient.exudyn_model.system import ExudynSystem

from ..cases.assembled import assembled
from ..cases.plain_motion import accelerations_of
from ..cases.spur import SPUR_CASE
from ..transient.solvers.test_exudyn_system import trajectory

STIFFNESS = {"spur": 3e8}
FORCE, MOMENT, PLACE = (300.0, -200.0, 5000.0), (4.0, -7.0), 30.0
SHAPE = {
    "start_z_mm": -40.0,
    "sections": [{"length_mm": 120.0, "outer_diameter_mm": 25.0}],
}


def content(force: dict[str, Any] | None = None, elastic: bool = False) -> dict[str, Any]:
    """Case of two shafts, the first on two bearings and with a thrust, a belt and a moment."""
    found = tomllib.loads(SPUR_CASE)
    for number, z in ((1, -35.0), (2, 55.0)):
        found["bearings"][f"left_{number}"] = copy.deepcopy(found["bearings"]["bearing_1"])
        found["bearings"][f"left_{number}"] |= {"body": "shaft_1", "z_mm": z}
    del found["bearings"]["bearing_1"]
    acting = {"body": "shaft_1", "z_mm": PLACE, "force_N": list(FORCE), "moment_N_m": list(MOMENT)}
    found["forces"] = {"thrust": acting if force is None else force}
    if elastic:
        found["bodies"]["shaft_1"] |= {"shape": SHAPE, "flexibility": "elastic"}
        found["elasticity"] = {"band_Hz": 12e3, "limit_Hz": 30e3}
    return found


def gearbox_of(**given: Any) -> Gearbox:
    return Gearbox.from_dict(content(**given), "case.toml")


def held_by_supports(assembly: Assembly, q: np.ndarray, body: str) -> np.ndarray:
    """Force and moment about x and y (5,), about the origin, with which supports act on a body on the z axis."""
    f = np.zeros(assembly.size)
    add_connector_forces(q, np.zeros(assembly.size), assembly.connectors, f)
    places = {body: assembly.gearbox.body(body).centre_of_mass_z}
    if body in assembly.elastic_bodies:
        places = {f"{body}.{seat.name}": seat.position[2] for seat in assembly.elastic_bodies[body].reduced.seats}
    total = np.zeros(6)
    for key, z in places.items():
        wrench = f[list(assembly.coordinates[key])]
        total += np.concatenate([wrench[:3], wrench[3:] + np.cross([0.0, 0.0, z], wrench[:3])])
    return total[:5]


@pytest.mark.parametrize("variant", ["bushing", "flexible"])
def test_bearings_hold_forces_and_moments_at_their_place(variant: str) -> None:
    """Statics of one shaft beside soft teeth: F, and its moment about the origin with F at z = 30 mm."""
    assembly = assembled(gearbox_of(elastic=variant == "flexible"), Choice(variant), {"spur": 1.0})
    q = locked_equilibrium(assembly, {"shaft_1": 1e-6}, ("shaft_2",))
    moment = np.array([*MOMENT, 0.0]) + np.cross([0.0, 0.0, 1e-3 * PLACE], FORCE)
    expected = -np.array([*FORCE, *moment[:2]])
    assert held_by_supports(assembly, q, "shaft_1") == pytest.approx(expected, rel=1e-4)


def test_an_elastic_shaft_bends_as_a_beam_under_a_force_between_its_bearings() -> None:
    """Beam on two supports, F L^3 / (48 E I) at its middle, and shear with the coefficient 0.89 of a round section."""
    found = content({"body": "shaft_1", "z_mm": 10.0, "force_N": [1000.0, 0.0, 0.0]}, elastic=True)
    found["bodies"]["shaft_1"]["shape"] = {
        "start_z_mm": -300.0,
        "sections": [{"length_mm": 620.0, "outer_diameter_mm": 30.0}],
    }
    stiff = {"radial_N_per_m": 1e12, "axial_N_per_m": 1e12}
    for number, z in ((1, -290.0), (2, 310.0)):
        found["bearings"][f"left_{number}"] = {"body": "shaft_1", "z_mm": z, "stiffness": stiff}
    assembly = assembled(Gearbox.from_dict(found, "case.toml"), Choice("flexible"), {"spur": 1.0})
    q = locked_equilibrium(assembly, {"shaft_1": 1e-6}, ("shaft_2",))
    bent = q[assembly.coordinates["shaft_1.thrust"][0]]
    bending = 206e9 * np.pi / 64.0 * 0.03**4
    shear = 77e9 * np.pi / 4.0 * 0.03**2
    expected = 1000.0 * 0.6**3 / (48.0 * bending) + 1000.0 * 0.6 / (4.0 * shear) / 0.89
    assert bent == pytest.approx(expected, rel=0.01)


def test_the_compiled_solver_accelerates_by_the_force() -> None:
    assembly = assembled(gearbox_of(), Choice("bushing"), STIFFNESS).unloaded
    rest = np.zeros(assembly.size)
    found = CompiledSystem(assembly, rest, rest, LoadTable({}), 1e-6).accelerations()
    first = assembly.coordinates["shaft_1"][0]
    assert found[first : first + 3] == pytest.approx(np.array(FORCE) / assembly.gearbox.body("shaft_1").mass, rel=1e-9)


@pytest.mark.parametrize("variant", ["bushing", "flexible"])
def test_exudyn_accelerates_by_the_force_as_the_equations_do(variant: str) -> None:
    assembly = assembled(gearbox_of(elastic=variant == "flexible"), Choice(variant), STIFFNESS).unloaded
    rest = np.zeros(assembly.size)
    system = ExudynSystem(assembly, rest, rest, LoadTable(), with_meshes=False)
    step = 1e-9
    end = trajectory(system, 1, step)[-1]
    first = assembly.coordinates["shaft_1.thrust" if variant == "flexible" else "shaft_1"][0]
    expected = accelerations_of(assembly, rest, rest, rest)[first : first + 5]
    assert end[1 + assembly.size + first : 1 + assembly.size + first + 5] / step == pytest.approx(expected, rel=1e-4)


def test_loads_are_not_proportional_to_torque_where_a_force_stays() -> None:
    plain = content()
    del plain["forces"]
    assert is_linear(assembled(Gearbox.from_dict(plain, "case.toml"), Choice("bushing", "iso6336"), STIFFNESS))
    assert not is_linear(assembled(gearbox_of(), Choice("bushing", "iso6336"), STIFFNESS))


def test_a_force_changes_no_frequency_of_a_linear_gearbox() -> None:
    plain = content()
    del plain["forces"]
    without, with_force = (
        eigenmodes(Gearbox.from_dict(one, "case.toml"), Choice("bushing", "iso6336"), STIFFNESS).frequency
        for one in (plain, content())
    )
    np.testing.assert_allclose(with_force[1:], without[1:], rtol=1e-4)


@pytest.mark.parametrize(
    ("force", "message"),
    [
        ({"body": "shaft_1", "z_mm": 0.0}, "forces.thrust.*set force_N = .*, not all zero"),
        (
            {"body": "ground", "z_mm": 0.0, "force_N": [1.0, 0.0, 0.0]},
            "forces.thrust.body = 'ground': a force on the ground has no effect; set a moving body",
        ),
        ({"body": "shaft_9", "z_mm": 0.0, "force_N": [1.0, 0.0, 0.0]}, "forces.thrust: no body 'shaft_9'"),
        ({"body": "shaft_1", "z_mm": 0.0, "force_N": [1.0, 0.0]}, "forces.thrust.force_N"),
        ({"body": "shaft_1", "z_mm": 0.0, "force_N": [1e12, 0.0, 0.0]}, "must lie between"),
    ],
)
def test_forces_that_cannot_be_are_refused(force: dict[str, Any], message: str) -> None:
    with pytest.raises(GearboxFileError, match=message):
        gearbox_of(force=force)


def test_a_force_that_has_the_name_of_a_bearing_is_refused() -> None:
    found = content()
    found["forces"] = {"bearing_2": found["forces"]["thrust"]}
    with pytest.raises(GearboxFileError, match="forces.bearing_2: also a name in"):
        Gearbox.from_dict(found, "case.toml")
