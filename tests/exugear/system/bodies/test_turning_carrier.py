"""An elastic planet carrier in the gearbox, in its own turning frame: both solvers, modes, energy."""

from __future__ import annotations

import importlib.util
from dataclasses import replace

import numpy as np
import pytest
import skfem

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.named_files import Permissions
from exugear.system.loads import LoadTable
from exugear.system.modes import modes_of, unusual_damping
from exugear.system.statics import accelerating_start, locked_equilibrium
from exugear.system.system import Assembly
from exugear.transient.compiled.solver import CompiledSystem, Observer

from ...cases.assembled import assembled
from ...cases.both_ways import (
    assert_matrices_of_exudyn_are_those_of,
    compiled_states,
    errors_and_mesh_forces,
    exudyn_states,
    relative_error,
)
from ...cases.limit import unchecked
from ...cases.plain_motion import accelerations_of
from ...cases.plain_signals import energies_of, sampled
from ...cases.stated_loads import STATED_LOADS

pytestmark = pytest.mark.skipif(importlib.util.find_spec("meshio") is None, reason="meshio (extra mesh) is missing")

LOAD = {"carrier": 240e3, "hss": -3000.0}
STEP = 1e-5
HEAVY = {"gravity.acceleration_m_per_s2": [0.0, -9.81, 0.5]}


@pytest.fixture(scope="module")
def carrying(grc_shafts: Gearbox, tmp_path_factory: pytest.TempPathFactory) -> Gearbox:
    """The GRC with a block of 168 elements for a carrier, with a seat across z at each of its bearings."""
    meshio = pytest.importorskip("meshio", reason="meshio (extra mesh) is missing")
    x = np.array([-0.4, -0.254, -0.154, -0.054, 0.054, 0.208, 0.308, 0.408])
    y = np.array([-0.3667, -0.2667, -0.1667, -0.0833, 0.0, 0.0833, 0.1667, 0.2667, 0.3667])
    mesh = skfem.MeshHex.init_tensor(x, y, np.array([-0.31, -0.1545, -0.0545, 0.0975]))
    cells = mesh.t.T[:, np.argsort([6, 2, 5, 7, 1, 3, 4, 0])]  # order of VTK
    file = tmp_path_factory.mktemp("block") / "block.vtu"
    meshio.Mesh(1e3 * mesh.p.T, [("hexahedron", cells)]).write(file)
    diameters = {"plc_a": 240.0, "plc_b": 240.0, "pl_a": 290.0, "pl_b": 290.0}
    solid = {
        "file": str(file),
        "band_Hz": 1000.0,
        "seats": {name: {"diameter_mm": wide, "inner_diameter_mm": 0.0} for name, wide in diameters.items()},
    }
    permitted = replace(grc_shafts, permissions=Permissions(below=file.parent))
    return permitted.varied({"bodies.carrier.flexibility": "elastic", "bodies.carrier.solid": solid})


@pytest.fixture(scope="module")
def flexible(carrying: Gearbox, stiffness: dict) -> Assembly:
    return assembled(carrying, Choice("flexible"), stiffness)


@pytest.mark.validation
def test_a_flexible_carrier_has_damping_times_where_the_file_states_a_share(
    carrying: Gearbox, flexible: Assembly, stiffness: dict
) -> None:
    """Its modes have no constant shapes; the warning about their damping names the carrier."""
    stated = assembled(carrying.varied({"damping": {"modal_percent": 2.0}}), Choice("flexible"), stiffness)
    assert stated.modal is None
    np.testing.assert_array_equal(stated.connectors.damping, flexible.connectors.damping)
    assert np.any(stated.connectors.damping > 0.0)
    assert "the flexible body carrier turns with planets" in unusual_damping(modes_of(stated))


def turned_state(assembly: Assembly, angle: float, speed: float = 22.5) -> tuple[np.ndarray, np.ndarray]:
    """Preloaded state at a speed (rad/s), turned by an angle of the carrier, moved at random."""
    start = accelerating_start(assembly, LOAD, speed)
    random = np.random.default_rng(7)
    q = start.q + 1e-6 * random.normal(size=assembly.size)
    v = start.v + 1e-2 * random.normal(size=assembly.size)
    speeds = assembly.gearbox.train.rolling_speeds("carrier", angle)
    c, s = np.cos(angle), np.sin(angle)
    for body in assembly.bodies:
        o = assembly.coordinates[body.name][5]
        if body.name not in assembly.elastic_bodies:
            q[o] += speeds[body.name]
        if body.carrier is not None:  # a whole turn of the carrier's frame, planets with it
            place, own = np.array(body.axis), q[o - 5 : o - 3]
            turn = np.array([[c, -s], [s, c]])
            q[o - 5 : o - 3] = turn @ (place + own) - place
            v[o - 5 : o - 3] = turn @ v[o - 5 : o - 3]
    for name, place in assembly.elastic_slices.items():
        if name not in assembly.turning:
            q[place] += speeds[name] * assembly.elastic_bodies[name].reduced.spin
            continue
        body = assembly.turning[name]
        places = -body.quarter_turned(body.reduced.spin)
        q[place] = body.rotated(q[place] + places, angle) - places
        q[place.start + 5 : place.start + 6 * body.seat_count : 6] += angle
        v[place] = body.rotated(v[place], angle)
    return q, v


def unloaded_frequencies(gearbox: Gearbox, stiffness: dict) -> np.ndarray:
    """Without what a load adds as it turns with the seats of its bearings: up to 1e-3 for planets along their axes."""
    return modes_of(assembled(gearbox, Choice("flexible"), stiffness), preload=False).frequency[1:60]


@pytest.mark.validation
def test_a_stiff_carrier_is_the_rigid_one(grc_shafts: Gearbox, carrying: Gearbox, stiffness: dict) -> None:
    # Second method: the shafts elastic, the carrier a rigid body, which it becomes as one over its stiffness.
    limit = {"elasticity.limit_Hz": 1e6}  # no masses are added to slow anything down
    rigid = unloaded_frequencies(grc_shafts.varied(limit | STATED_LOADS), stiffness)
    gaps = []
    for factor in (10.0, 100.0):
        modulus = {"bodies.carrier.solid.material.youngs_modulus_GPa": 206.0 * factor}
        case = unchecked(carrying.varied(STATED_LOADS), modulus | limit)
        found = unloaded_frequencies(case, stiffness)
        assert np.all(found < rigid * (1 + 1e-6))  # compliance can only lower
        gaps.append(np.abs(found / rigid - 1).mean())
    assert gaps[1] < 1e-4
    assert gaps[1] == pytest.approx(gaps[0] / 10, rel=0.2)


@pytest.mark.validation
def test_compiled_accelerations_are_those_of_the_plain_kernels(
    carrying: Gearbox, flexible: Assembly, stiffness: dict
) -> None:
    for assembly in (flexible, assembled(carrying.varied(HEAVY), Choice("flexible"), stiffness)):
        for angle in (0.0, 0.7, -40.0):
            q, v = turned_state(assembly, angle)
            found = CompiledSystem(assembly, q, v, LoadTable(LOAD), STEP).accelerations()
            expected = accelerations_of(assembly, q, v, assembly.torque_vector(LOAD))
            # The high-speed shaft has turned by 3260 rad, known to 5e-13 rad; its mesh makes 1e-8 of that.
            assert np.abs(found - expected).max() < 2e-8 * np.abs(expected).max()


def test_signals_and_energies_are_those_of_the_plain_kernels(flexible: Assembly) -> None:
    q, v = turned_state(flexible, 0.7)
    _, energies, powers = Observer(flexible, LoadTable(LOAD)).observe(np.zeros(1), q[None], v[None])
    plain = energies_of(flexible, q[None], v[None])
    scale = np.abs(plain) + np.abs(plain[:, 2]).max()
    assert (np.abs(np.column_stack([energies, powers[:, 1:]]) - plain) / scale).max() < 1e-9


@pytest.mark.sample
@pytest.mark.parametrize("keys", [{}, HEAVY])
def test_the_account_of_energy_of_a_run_closes(carrying: Gearbox, stiffness: dict, keys: dict) -> None:
    # 20 ms at 46 rpm; powers by Simpson's rule over the steps, whose error is far below.
    assembly = assembled(carrying.varied(keys), Choice("flexible"), stiffness)
    start = accelerating_start(assembly, LOAD, -4.8)
    q, v = compiled_states(assembly, start.q, start.v, LOAD, 2000, STEP)
    _, energies, powers = Observer(assembly, LoadTable(LOAD)).observe(STEP * np.arange(2001), q, v)
    weights = np.full(2001, 2.0)
    weights[1::2], weights[[0, -1]] = 4.0, 1.0
    work = STEP / 3.0 * weights @ powers
    change = energies[-1] - energies[0]
    residual = work[0] - work[1:].sum() - change.sum()
    assert abs(residual) < 1e-6 * abs(change[0])


@pytest.mark.parametrize("loaded", [False, True])
def test_matrices_of_exudyn_are_those_of_the_assembly(flexible: Assembly, loaded: bool) -> None:
    q = np.zeros(flexible.size)
    if loaded:
        load = flexible.gearbox.case.static_load
        q = locked_equilibrium(flexible, load.torques_N_m, load.locked, flexible.mean_meshes)
    # Both differentiate numerically. Under load Exudyn's rigid bodies and dampers know their tilts of 1e-5 rad in mass
    # and damping; the assembly's masses do not.
    assert_matrices_of_exudyn_are_those_of(flexible, q, 1e-5 if loaded else 1e-7)


@pytest.mark.validation
def test_the_compiled_solver_follows_exudyn(flexible: Assembly) -> None:
    start = accelerating_start(flexible, LOAD, -4.8)
    q, v = compiled_states(flexible, start.q, start.v, LOAD, 500, STEP)
    expected = exudyn_states(flexible, start.q, start.v, LOAD, 500, STEP)
    columns = errors_and_mesh_forces(flexible)
    signals = (sampled(flexible, *both)[:, columns] for both in ((q, v), expected))
    assert relative_error(*signals) < 1e-5
    # The carrier's own coordinates, too: by their motion against a steady turning.
    place = flexible.elastic_slices["carrier"]
    moved = np.abs(expected[0][:, place] - q[:, place]).max()
    assert moved < 1e-5 * np.ptp(q[:, place] - q[0, place] - STEP * np.arange(501)[:, None] * v[0, place])


def test_a_run_starts_in_steady_rotation_of_the_carrier(flexible: Assembly) -> None:
    # Its deflection under load, inertia and centrifugal forces turns with it: no vibration is left at the start.
    start = accelerating_start(flexible, LOAD, 22.5)
    a = accelerations_of(flexible, start.q, start.v, flexible.torque_vector(LOAD))
    expected = flexible.rolling_acceleration(
        start.q, flexible.gearbox.train.rolling_speeds("carrier", 22.5), start.rates
    )
    place = flexible.elastic_slices["carrier"]
    assert np.abs(a - expected)[place].max() < 1e-6 * np.abs(expected[place]).max()


def test_kinetic_and_strain_shares_count_the_carrier(flexible: Assembly) -> None:
    modes = modes_of(flexible)
    assert np.allclose(modes.kinetic.sum(axis=(1, 2)), 1.0)
    assert modes.kinetic.min() > -1e-9
    assert modes.strain[:, modes.element_names.index("carrier_body")].max() > 0.05
