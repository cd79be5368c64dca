"""How meshes along a row resist misalignment: one potential, balanced bodies, flanks that mirror each other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.optimize

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.system.build import assemble
from exugear.system.kernels.coordinates import TILT
from exugear.system.kernels.meshes import (
    CYCLE_POWER,
    DAMPED_POWER,
    ENERGY,
    FORCE,
    TILT_LEVER,
    TILT_MOMENT,
    TILT_REST,
    TILT_STIFFNESS,
)
from exugear.system.kernels.table_law import (
    ENERGY_DERIVATIVES,
    LAW_BY_MISALIGNMENT,
    LAW_FORCE,
    LAW_STIFFNESS,
    NOMINAL_DISTANCE,
    TableArrays,
    scratch_memory,
    surface_law,
)
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.contact_state import MeshContactState
from exugear.system.tooth_mesh.element import MeshCurve
from exugear.system.tooth_mesh.laws.registry import LAWS, law_of
from exugear.system.tooth_mesh.laws.stiffness import pack
from exugear.system.tooth_mesh.placement import loaded_flanks
from exugear.system.tooth_mesh.tables import wanted_table

from ...cases.contact import contacts
from ...cases.table import STIFFNESS, surface_of
from .test_element import mesh_forces, random_state, states

ALONG_A_ROW = [name for name, law in LAWS.items() if law.has_force and not law.needs_axes]
TILTING = [name for name in ALONG_A_ROW if law_of(name).tilts]


@pytest.fixture(scope="module")
def bent(grc: Gearbox, curves: dict[str, MeshCurve]) -> Assembly:
    return assemble(grc, Choice("bushing"), curves, contact=contacts(grc))


def test_contact_that_is_given_is_not_solved_again(
    grc: Gearbox, curves: dict[str, MeshCurve], monkeypatch: pytest.MonkeyPatch
) -> None:
    def solved(places: object) -> None:
        raise LookupError("solved")

    monkeypatch.setattr("exugear.system.operating_points.static_contacts", solved)
    of_tables = {name: replace(curve, table=wanted_table(grc, name, 10)) for name, curve in curves.items()}
    with pytest.raises(LookupError, match="solved"):
        assemble(grc, Choice("bushing"), of_tables)
    given = assemble(grc, Choice("bushing"), of_tables, contact=contacts(grc)).elements
    assert [element.load for element in given] == [contact.force for contact in contacts(grc).values()]


def over_velocity(assembly: Assembly, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Derivatives of the forces by the velocities, in which they are linear: a long step drowns round-off."""
    far = 10.0
    ways = far * np.eye(assembly.size)
    return np.array([mesh_forces(assembly, q, v + e) - mesh_forces(assembly, q, v - e) for e in ways]).T / (2.0 * far)


def test_force_and_moment_are_the_gradient_of_one_energy(bent: Assembly) -> None:
    """At a frozen place in the mesh cycle, whose changes take their power from the rolling train."""
    assembly = replace(bent, meshes=bent.mean_meshes)
    q, _ = random_state(assembly)
    rest, h = np.zeros(assembly.size), 1e-7

    def energy(at: np.ndarray) -> float:
        return float(states(assembly, at, rest)[:, ENERGY].sum())

    gradient = np.array([(energy(q + h * e) - energy(q - h * e)) / (2 * h) for e in np.eye(assembly.size)])
    force = mesh_forces(assembly, q, rest)
    assert np.abs(force + gradient).max() < 2e-6 * np.abs(force).max()
    tilts = [assembly.coordinates[name][TILT] for name in ("lss", "ims", "hss")]
    assert np.abs(force[tilts]).min() > 1e-4 * np.abs(force).max()
    jacobian = assembly.mesh_jacobians(q, rest)[0]
    assert np.abs(jacobian - jacobian.T).max() < 1e-12 * np.abs(jacobian).max()


def test_tangent_is_that_of_the_force(bent: Assembly) -> None:
    q, v = random_state(bent)
    jq, jv = bent.mesh_jacobians(q, v)
    h = 1e-7
    by_q = [(mesh_forces(bent, q + h * e, v) - mesh_forces(bent, q - h * e, v)) / (2 * h) for e in np.eye(bent.size)]
    assert np.abs(jq - np.array(by_q).T).max() < 1e-5 * np.abs(jq).max()
    assert np.abs(jv - over_velocity(bent, q, v)).max() < 1e-6 * np.abs(jv).max()
    assert np.abs(jv - jv.T).max() < 1e-12 * np.abs(jv).max()


def test_power_into_the_bodies_is_what_the_meshes_store_and_lose(bent: Assembly) -> None:
    """-f . v = dU/dt + damped power - power that the changing cycle takes from the rolling train."""
    q, v = random_state(bent)
    h = 1e-7
    rate = (states(bent, q + h * v, v)[:, ENERGY] - states(bent, q - h * v, v)[:, ENERGY]).sum() / (2 * h)
    here = states(bent, q, v)
    assert (here[:, DAMPED_POWER] > 0.0).all()
    expected = rate + here[:, DAMPED_POWER].sum() + here[:, CYCLE_POWER].sum()
    assert -mesh_forces(bent, q, v) @ v == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("law", ALONG_A_ROW)
def test_moments_of_a_mesh_balance_on_its_gears(grc: Gearbox, curves: dict, law: str) -> None:
    """A stage between parallel shafts, turned as a whole about any axis, gains nothing; tilts are turned with it."""
    assembly = assemble(grc, Choice("bushing", law), curves, contact=contacts(grc))
    q = 1e-5 * np.random.default_rng(3).normal(size=assembly.size)
    rest = np.zeros(assembly.size)
    for number, name in enumerate(assembly.mesh_names):
        if name not in ("intermediate", "high_speed"):
            continue
        element, f = assembly.elements[number], np.zeros(assembly.size)
        f = assembly.mesh_forces(q, rest, assembly.meshes.one(number))
        force, moment = np.zeros(3), np.zeros(3)
        nodes = {body.name: np.array([*body.axis, body.centre_of_mass_z]) for body in assembly.bodies}
        for body in (element.mesh.pinion, element.mesh.gear):
            o = assembly.coordinates[body][0]
            force += f[o : o + 3]
            moment += f[o + TILT : o + TILT + 3] + np.cross(nodes[body], f[o : o + 3])
        size = np.abs(f).max()
        # The seed is balanced at the pitch point as well; places stay those of the nominal geometry.
        assert np.abs(force).max() < 1e-12 * size
        assert np.abs(moment).max() < 1e-9 * size


@pytest.mark.parametrize("law", TILTING)
def test_a_law_without_contact_resists_with_k_b_squared_over_twelve(grc: Gearbox, curves: dict, law: str) -> None:
    assembly = assemble(grc, Choice("bushing", law), curves)
    for element, tilt in zip(assembly.elements, assembly.meshes.tilt, strict=True):
        width = element.mesh.pair.face_width
        assert tilt[TILT_STIFFNESS] == pytest.approx(element.tangent.mean() * width**2 / 12.0, rel=1e-12)
        assert not tilt[[TILT_LEVER, TILT_MOMENT, TILT_REST]].any()
        # Teeth that bear evenly, cut into slices: the tangent stiffness of a tilt about the middle.
        slices = (np.arange(1000) + 0.5) / 1000 - 0.5
        sliced = np.sum(element.tangent.mean() / 1000 * (width * slices) ** 2)
        assert tilt[TILT_STIFFNESS] == pytest.approx(sliced, rel=1e-5)


@pytest.mark.parametrize("contact", [False, True])
def test_the_seed_and_gears_that_only_spin_do_not_tilt(grc: Gearbox, curves: dict, contact: bool) -> None:
    given = contacts(grc) if contact else None
    for choice in (Choice("bushing", "tangential"), Choice("rigid")):
        assert not assemble(grc, choice, curves, contact=given).meshes.tilt.any()


def test_the_state_itself_is_a_balance_with_its_moment(bent: Assembly) -> None:
    """At F0 and g0 the deflection is that of the state, the force F0, and the moment F0 zc."""
    element = bent.elements[-1]
    state = element.contact
    assert state is not None
    one, q, rest = bent.mean_meshes.one(len(bent.elements) - 1), np.zeros(bent.size), np.zeros(bent.size)
    # A tilt of gear 1 alone along the misalignment's row, then a turn that brings the deflection.
    hss, ims = (bent.coordinates[name] for name in (element.mesh.gear, element.mesh.pinion))
    tilts = element.misalignment[[TILT, TILT + 1]]
    q[list(ims[TILT : TILT + 2])] = state.misalignment * tilts / (tilts @ tilts)
    q[ims[5]] += (state.deflection - bent.mesh_states(q, rest, bent.mean_meshes)[-1, 0]) / element.deflection[5]
    assert bent.mesh_states(q, rest, bent.mean_meshes)[-1, FORCE] == pytest.approx(state.force, rel=1e-9)
    f = bent.mesh_forces(q, rest, one)
    along = f[list(ims[TILT : TILT + 2])] + state.force * element.deflection[[TILT, TILT + 1]]
    assert along @ tilts == pytest.approx(state.force * state.load_centroid, rel=1e-6)
    assert np.isfinite(f[list(hss)]).all()


@pytest.mark.parametrize("flank", [1, -1])
def test_contact_of_a_table_is_its_law_near_the_state_on_either_flank(grc: Gearbox, flank: int) -> None:
    """Moment, tangent and damping of the law `table` in deflection and tilts are those of the state that it gives.

    Gear 1 is turned by hand so that it presses and tilts; the push between the axes, which the state leaves out, is
    taken off the table's law.
    """
    number = [mesh.name for mesh in grc.meshes].index("high_speed")
    flanks = loaded_flanks(grc) | {"high_speed": flank}
    tables = {name: surface_of(grc, name, hollow=-0.2) for name in STIFFNESS}
    table = assemble(grc, Choice("bushing", "table"), tables, flanks=flanks)
    element, one = table.elements[number], table.mean_meshes.one(number)
    one = one._replace(table=one.table._replace(centre=np.zeros_like(one.table.centre)))
    own = list(table.coordinates[element.mesh.pinion][TILT:])
    # Beside all nodes of the table: misalignment 150 urad as the table sees it, and a load near the static one.
    q, rest = np.zeros(table.size), np.zeros(table.size)
    row = element.misalignment[[TILT, TILT + 1]]
    q[own[:2]] = flank * 150e-6 * row / (row @ row)
    q[own[2]] = (30e-6 - element.deflection[[TILT, TILT + 1]] @ q[own[:2]]) / element.deflection[5]
    state = contact_of(one.table, float(table.mesh_states(q, rest, one)[0, FORCE]), 150e-6)
    assert state.deflection == pytest.approx(30e-6, rel=1e-9)
    assert abs(state.load_centroid) > 1e-3
    curve = np.array([state.force / state.deflection]), np.array([state.tangent_stiffness])
    law = law_of("line_of_action")
    seen = replace(element, law=law, contact=state.seen_by(flank), table=None, load=state.force)
    seen = replace(seen, stiffness=curve[0], tangent=curve[1], damping=element.damping_time * state.tangent_stiffness)
    plain = pack((seen,), table.coordinates)
    assert table.mesh_forces(q, rest, plain)[own] == pytest.approx(table.mesh_forces(q, rest, one)[own], rel=1e-5)
    # In motions that tilt and that close the teeth, all others being free.
    motions = np.zeros((table.size, 2))
    motions[own[:2], 0], motions[own[2], 1] = row, 1.0
    for ours, theirs in zip(table.mesh_jacobians(q, rest, plain), table.mesh_jacobians(q, rest, one), strict=True):
        basis = np.linalg.cholesky(-motions.T @ theirs @ motions)
        both = np.linalg.solve(basis, np.linalg.solve(basis, motions.T @ ours @ motions).T)
        assert np.abs(both + np.eye(2)).max() < 1e-3


def contact_of(tables: TableArrays, force: float, misalignment: float) -> MeshContactState:
    """State of contact by differences of the law of the first table, whose deflection at a load is looked for."""
    memory, centre = scratch_memory(), float(tables.nominal[0, NOMINAL_DISTANCE])

    def at(delta: float, tilt: float) -> np.ndarray:
        surface_law(delta, 0.0, centre, tilt, 0, tables, 0, ENERGY_DERIVATIVES, memory)
        return memory.law.copy()

    def deflection(load: float, tilt: float) -> float:
        found = scipy.optimize.brentq(lambda d: at(d, tilt)[LAW_FORCE] - load, 1e-6, 2e-4, xtol=1e-18, rtol=1e-14)
        return float(found)

    def moment(load: float, tilt: float) -> float:
        return -float(at(deflection(load, tilt), tilt)[LAW_BY_MISALIGNMENT])

    s, h = deflection(force, misalignment), 1e-7
    tangent = float(at(s, misalignment)[LAW_STIFFNESS])
    lever = (deflection(force, misalignment + h) - deflection(force, misalignment - h)) / (2.0 * h)
    falling = (moment(force, misalignment - h) - moment(force, misalignment + h)) / (2.0 * h)
    return MeshContactState(force, s, tangent, misalignment, moment(force, misalignment) / force, lever, falling)
