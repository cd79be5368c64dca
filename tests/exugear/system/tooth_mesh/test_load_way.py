"""The load of a mesh that moves along the face over the mesh cycle: its moment, its flanks, and who has none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.system.build import assemble
from exugear.system.kernels.coordinates import TILT
from exugear.system.kernels.meshes import FORCE, PMC
from exugear.system.tooth_mesh.contact_state import ContactCycle
from exugear.system.tooth_mesh.element import MeshCurve
from exugear.system.tooth_mesh.placement import loaded_flanks

from ...cases.contact import contacts

MESH = "high_speed"


@pytest.mark.parametrize("flank", [1, -1])
def test_the_moment_is_that_of_the_load_and_of_what_is_added_to_it(grc: Gearbox, curves: dict, flank: int) -> None:
    """At several places in the cycle, against the same mesh whose load stays.

    Under the load of the contact it is that load times its way; a load less takes the way of what is added from it.
    """
    usual = loaded_flanks(grc)[MESH]
    torques = grc.case.static_load.torques_N_m
    turned = {name: flank * usual * torque for name, torque in torques.items()}
    gearbox = grc.varied({f"static_load.torques_N_m.{name}": torque for name, torque in turned.items()})
    still = {name: MeshCurve(own.stiffness, own.tangent, own.force) for name, own in curves.items()}
    moving, resting = (assemble(gearbox, Choice("bushing"), own) for own in (curves, still))
    number = moving.mesh_names.index(MESH)
    element, (way, added_way) = moving.elements[number], moving.elements[number].load_ways
    assert element.flank == flank
    for found, centre in ((way, curves[MESH].load_centroid), (added_way, curves[MESH].tangent_load_centroid)):
        np.testing.assert_allclose(found, flank * (centre - centre.mean()), atol=1e-15)
    one, other, rest = moving.meshes.one(number), resting.meshes.one(number), np.zeros(moving.size)
    own = moving.coordinates[element.mesh.pinion]
    tilts = element.misalignment[[TILT, TILT + 1]]
    for place in (0, 13, 37):
        q = np.zeros(moving.size)
        # Teeth roll to one of the samples, and the other gear closes them by 20 um.
        q[own[5]] = (place / len(way) - element.phase) / element.cycles
        closed = 20e-6 - element.deflection[5] * q[own[5]]
        q[moving.coordinates[element.mesh.gear][5]] = closed / element.deflection[11]
        state = moving.mesh_states(q, rest, one)[0]
        assert (state[PMC] * len(way)) % len(way) == pytest.approx(place, abs=1e-6)
        added = (moving.mesh_forces(q, rest, one) - moving.mesh_forces(q, rest, other))[list(own[TILT : TILT + 2])]
        moment = element.load * way[place] + (state[FORCE] - element.load) * added_way[place]
        np.testing.assert_allclose(added, moment * tilts, rtol=1e-6)
        assert np.abs(added).max() > 1.0


@pytest.mark.parametrize("flank", [1, -1])
def test_the_cycle_is_that_of_the_contact_where_the_gears_stand(grc: Gearbox, curves: dict, flank: int) -> None:
    """Harmonics that ten positions tell apart, on either flank; the ninth stays that of the table."""
    usual = loaded_flanks(grc)[MESH]
    torques = grc.case.static_load.torques_N_m
    gearbox = grc.varied({f"static_load.torques_N_m.{name}": flank * usual * own for name, own in torques.items()})
    fine, few = (2.0 * np.pi * np.arange(count) / count for count in (50, 10))
    curve = curves[MESH]
    ninth = 1.0 + 1e-3 * np.cos(9 * fine)
    given = curves | {MESH: replace(curve, stiffness=curve.stiffness / ninth)}
    state = contacts(grc)[MESH]
    force, slope = state.force, state.tangent_stiffness
    yielding = 1.2 * force / slope
    number = [mesh.name for mesh in gearbox.meshes].index(MESH)
    even = assemble(gearbox, Choice("bushing"), given).elements[number]
    of_table = np.fft.rfft(force / even.stiffness)[9]

    def changes(cycle: np.ndarray) -> tuple[np.ndarray, ...]:
        """Deflection, stiffness, load centre and that of what is added over the mesh cycle."""
        softness = 1.0 + 0.1 * np.cos(cycle - 1.0)
        deflection = 2e-6 * np.cos(cycle) + 1e-6 * np.sin(3 * cycle) + (of_table * np.exp(9j * cycle)).real / 25
        return deflection, slope / softness, -2e-3 + 4e-3 * np.sin(2 * cycle), 1e-3 + 5e-3 * np.cos(cycle)

    found = ContactCycle(*(tuple(own) for own in changes(few)))
    contact = {MESH: replace(state, deflection=yielding, cycle=found)}
    element = assemble(gearbox, Choice("bushing"), given, contact=contact).elements[number]
    assert element.flank == even.flank == flank
    deflection, stiffness, *centres = changes(fine)
    for way, centre in zip(element.load_ways, centres, strict=True):
        np.testing.assert_allclose(way, flank * (centre - centre.mean()), atol=1e-12)
    # Means are those of the state, by stiffness: shapes are compared.
    shape = force / element.stiffness
    assert np.fft.rfft(shape)[9] == pytest.approx(of_table, rel=0.02)
    np.testing.assert_allclose(np.fft.rfft(shape)[1:5] / 25, np.fft.rfft(deflection)[1:5] / 25, atol=2e-8)
    np.testing.assert_allclose(element.tangent * stiffness[0] / element.tangent[0], stiffness, rtol=2e-3)
    assert np.mean(element.tangent) == pytest.approx(slope, rel=1e-12)


@pytest.mark.parametrize("law", ["tangential", "constant", "iso6336"])
def test_laws_without_a_table_s_contact_have_the_load_where_it_is(grc: Gearbox, curves: dict, law: str) -> None:
    assert not assemble(grc, Choice("bushing", law), curves, contact=contacts(grc)).meshes.way_pieces.any()


def test_the_flank_behind_a_stated_stiffness_and_spins_alone_have_none(
    grc: Gearbox, stiffness: dict, curves: dict
) -> None:
    behind = {name: -flank for name, flank in loaded_flanks(grc).items()}
    for other in (
        assemble(grc, Choice("bushing"), curves, flanks=behind),
        assemble(grc, Choice("bushing"), stiffness),
        assemble(grc, Choice("rigid"), curves),
    ):
        assert not other.meshes.way_pieces.any()
    usual = assemble(grc, Choice("bushing"), curves)
    assert usual.meshes.way_pieces.all()
    assert not usual.mean_meshes.way_pieces.any()
