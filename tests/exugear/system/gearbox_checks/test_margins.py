"""Margins told before long work: they foresee which contact comes to form circles, and proposals that mend them."""

from __future__ import annotations

import re
from typing import Any

import pytest

from exugear.gearbox.gearbox import Gearbox
from exugear.system.gearbox_checks import gearbox_warnings
from exugear.system.part_warnings import PROPOSED_MARGIN, pair_margins, pair_warnings
from fe_ste.contact.kinematics import reaches_form_circle
from fe_ste.standards.pitting import nominal_contact_stress
from fe_ste.transmission_error.search import contact_state, pitch_point_pressure
from fe_ste.transmission_error.table import MeshTable, prepared_compliance

from ...cases.gear_trains import pair
from ...cases.spur import COARSE_INPUT


def spur(shift: float = 0.0, **large: Any) -> Gearbox:
    """A spur pair whose profile shifts cancel out, with a table."""
    content = pair(helix_deg=0.0)
    content["gears"]["small"]["profile_shift"], content["gears"]["large"]["profile_shift"] = shift, -shift
    content["gears"]["large"] |= large
    del content["pairs"]["helical"]["stiffness"]
    return Gearbox.from_dict(content)


def table_of(gearbox: Gearbox, torque: float = 100.0) -> MeshTable:
    spec = gearbox.pairs["helical"]
    return MeshTable.compute(COARSE_INPUT(pair=spec.pair, torque=(torque,), positions=24, static_torque=torque))


def at_form_circle(gearbox: Gearbox, torque: float = 100.0) -> int:
    """Positions of 24 at which contact comes to a form circle."""
    spec = gearbox.pairs["helical"]
    wanted = COARSE_INPUT(pair=spec.pair, torque=(torque,), positions=24, static_torque=torque)
    compliance = prepared_compliance(wanted)
    states = [contact_state(compliance, torque, p / 24) for p in range(24)]
    return sum(reaches_form_circle(compliance.flanks, state.cells, state.solution.force) for state in states)


@pytest.mark.validation
def test_a_small_margin_foretells_contact_at_the_form_circle_and_the_proposal_mends_it() -> None:
    gearbox = spur(0.9)
    assert pair_margins(gearbox.pairs["helical"]).form[0] < 0.01
    (doubt,) = (
        line for line in gearbox_warnings(gearbox) if "% of the profile length from the root form diameter of" in line
    )
    assert doubt.startswith("gears.large.tip_diameter_mm = ")
    assert at_form_circle(gearbox) > 0
    assert not table_of(gearbox).failures
    proposed = re.search(r"; (\d+\.\d+) leaves 2\.5 %", doubt)
    assert proposed is not None
    mended = spur(0.9, tip_diameter_mm=float(proposed[1]))
    assert pair_margins(mended.pairs["helical"]).form[0] == pytest.approx(PROPOSED_MARGIN, abs=1e-4)
    assert not list(pair_warnings(mended))
    assert at_form_circle(mended) == 0


def test_a_chamfer_or_form_diameter_ends_contact_for_the_margin_and_its_proposal() -> None:
    """A chamfered tip touches the mating root where one that is shorter by the chamfer does."""
    tip = 2e3 * spur(0.9).gears["large"].tip_radius
    (margin, _), (shorter, _) = (
        pair_margins(spur(0.9, **large).pairs["helical"]).form
        for large in ({"tip_chamfer_mm": 0.02}, {"tip_diameter_mm": tip - 0.04})
    )
    assert margin == pytest.approx(shorter, rel=1e-9)
    ends = {"tip_chamfer_mm": 0.02}, {"tip_form_diameter_mm": tip - 0.04}
    for end, key in zip(ends, ("tip_diameter_mm", "tip_form_diameter_mm"), strict=True):
        (doubt,) = (line for line in pair_warnings(spur(0.9, **end)) if "% of the profile length from" in line)
        told = re.match(rf"gears\.large\.{key} = .*; (\d+\.\d+) leaves 2\.5 %", doubt)
        assert told is not None
        mended = spur(0.9, **{**end, key: float(told[1])})
        assert pair_margins(mended.pairs["helical"]).form[0] == pytest.approx(PROPOSED_MARGIN, abs=1e-4)
        assert not list(pair_warnings(mended))


def test_a_pressure_that_no_steel_bears_is_a_warning() -> None:
    """By Hertz it grows as the root of the torque: 3 GPa at the torque that gives it, and 97 GPa at (97/3)^2 times."""
    content = pair(helix_deg=0.0)
    spur_pair = Gearbox.from_dict(content).pairs["helical"].pair
    bearable = nominal_contact_stress(spur_pair, 1.0 / spur_pair.pinion.reference_radius)
    for pressure, told in ((2.9e9, False), (3.1e9, True), (97e9, True)):
        torque = (pressure / bearable) ** 2
        content["static_load"]["torques_N_m"] = dict.fromkeys(content["static_load"]["torques_N_m"], torque)
        gearbox = Gearbox.from_dict(content)
        stress = 1e-6 * pair_margins(gearbox.pairs["helical"]).nominal_contact_stress
        expected = f"pairs.helical: nominal contact stress sigma_H0 = {stress:.4g} MPa"
        assert any(line.startswith(expected) for line in gearbox_warnings(gearbox)) == told


def test_a_thin_tip_is_a_warning_and_a_pointed_one_a_fault() -> None:
    thin = spur(1.2)
    assert pair_margins(thin.pairs["helical"]).tip_thickness[0] == pytest.approx(0.120, abs=1e-3)
    assert any(
        "0.120 m_n; usual minimum 0.2 m_n, 0.4 m_n for case-hardened teeth" in line for line in gearbox_warnings(thin)
    )
    with pytest.raises(ValueError, match="at least 0.1 is needed"):
        spur(1.25)


def test_the_greatest_pressure_of_a_spur_table_is_about_that_of_hertz_at_the_pitch_point() -> None:
    """Where one tooth pair carries all, near the pitch point; cells average it, and curvature varies: 5 %."""
    gearbox = spur()
    table = table_of(gearbox, 300.0)
    expected = pitch_point_pressure(gearbox.pairs["helical"].pair, 300.0)
    assert float(table.dataset["max_pressure"].max()) == pytest.approx(expected, rel=0.05)
