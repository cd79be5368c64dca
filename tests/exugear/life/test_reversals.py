"""Law `table`: torques that change their sign find their balance, through backlash and onto the other flanks."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.templates.kinds import template
from exugear.life.static_balance import static_balance
from exugear.system.build import assemble
from exugear.system.statics import accelerating_start

from ..cases import table as table_case
from ..cases.spur import SPUR_CASE

WEIGHT = {"gravity.acceleration_m_per_s2": [0.0, -9.81, 0.0]}
STIFFNESS = 5e8
"""Mean stiffness of tables of pairs that have none of their own, N/m."""


def gearbox_of(name: str) -> Gearbox:
    if name == "spur":
        return Gearbox.from_dict(tomllib.loads(SPUR_CASE))
    if name.startswith("grc"):
        grc = Gearbox.from_toml("cases/grc750/gearbox.toml")
        return grc.varied(WEIGHT) if name.endswith("weight") else grc
    return Gearbox.from_dict(tomllib.loads(template(name)))


def surfaces_of(gearbox: Gearbox, monkeypatch: pytest.MonkeyPatch) -> dict:
    names = dict.fromkeys(mesh.pair.name for mesh in gearbox.meshes)
    for name in names:
        if name not in table_case.STIFFNESS:
            monkeypatch.setitem(table_case.STIFFNESS, name, STIFFNESS)
    return {name: table_case.surface_of(gearbox, name) for name in names}


@pytest.mark.sample
@pytest.mark.parametrize("variant", ["rigid", "bushing"])
@pytest.mark.parametrize("name", ["spur", "parallel", "planetary", "wind", "grc", "grc with weight"])
def test_reversed_torques_of_any_size_find_their_balance(monkeypatch, name, variant):
    """From the full static torque to a two-hundredth of it: forces of either sign are those of the rolling train."""
    gearbox = gearbox_of(name)
    assembly = assemble(gearbox, Choice(variant, "table"), surfaces_of(gearbox, monkeypatch))
    body, torque = next(iter(gearbox.case.static_load.torques_N_m.items()))
    per_torque = gearbox.train.static_mesh_forces({body: torque})
    families = [mesh.family for mesh in gearbox.meshes]
    ratios = [[-1.0], [1.0, -0.3], [0.05, -0.9]]
    for loads in ratios:
        balance = static_balance(assembly, body, torque * np.array(loads), 1)
        assert len(balance.torque) == 5 * len(loads)
        found = balance.mesh_force.values[:, 0]
        for family in dict.fromkeys(families):
            own = [number for number, other in enumerate(families) if other == family]
            static = abs(per_torque[gearbox.meshes[own[0]].name])
            mean = found[:, own].mean(axis=1)
            # Weight of shafts hangs in the meshes, too: up to 6 % of a small load.
            assert mean == pytest.approx(static * balance.torque / torque, rel=0.02, abs=2e-3 * static)


def test_a_reversed_torque_presses_flanks_that_lie_behind_the_backlash(monkeypatch):
    """Deflections of one spur pair under both signs differ by the backlash and what the load bends."""
    gearbox = gearbox_of("spur")
    assembly = assemble(gearbox, Choice("rigid", "table"), surfaces_of(gearbox, monkeypatch))
    element = assembly.elements[0]
    assert element.table is not None
    balance = static_balance(assembly, "shaft_1", np.array([100.0, -100.0]), 1)
    assert balance.mesh_force.values[0, 0, 0] == pytest.approx(-balance.mesh_force.values[-1, 0, 0], rel=1e-6)
    starts = [accelerating_start(assembly, {"shaft_1": sign, "shaft_2": sign * 1.4}) for sign in (0.5, -0.5)]
    for sign, start in zip((1.0, -1.0), starts, strict=True):
        assert sign * assembly.mesh_states(start.q, 0 * start.q)[0, 4] > 0.0


def test_states_outside_a_table_are_named(monkeypatch):
    gearbox = gearbox_of("spur")
    assembly = assemble(gearbox, Choice("rigid", "table"), surfaces_of(gearbox, monkeypatch))
    assert static_balance(assembly, "shaft_1", np.array([190.0]), 1).outside == ()
    assert static_balance(assembly, "shaft_1", np.array([210.0]), 1).outside == ("spur",)
