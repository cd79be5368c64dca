"""Mesh laws: one table of all, which the rest of the program and its documents go by; what a form must fulfil."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.system.build import assemble
from exugear.system.kernels.cubics import periodic_cubic
from exugear.system.tooth_mesh.element import MeshCurve
from exugear.system.tooth_mesh.laws.line_of_action import (
    CURVE_FORM,
    STIFFNESS_FORM,
    curve_coefficients,
)
from exugear.system.tooth_mesh.laws.mesh_forces import row_law
from exugear.system.tooth_mesh.laws.registry import LAWS, law_of
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness
from exugear.system.tooth_mesh.laws.table import TABLE_FORM
from exugear.system.tooth_mesh.placement import MeshError

from ...cases.table import surfaces

GUIDE = Path(__file__).parents[4] / "docs" / "reference" / "model_settings.md"
WITH_FORCE = [name for name, law in LAWS.items() if law.has_force]
ALONG_A_ROW = [name for name in WITH_FORCE if law_of(name).form != TABLE_FORM]
SAMPLES = 3e9 * (1.0 + 0.1 * np.sin(2.0 * np.pi * np.arange(12) / 12.0))


@pytest.mark.parametrize("name", LAWS)
def test_the_page_of_model_settings_lists_each_law_with_the_tables_that_it_needs(name: str) -> None:
    law = LAWS[name]
    shown = f"`{name}` (default)" if name == "line_of_action" else f"`{name}`"
    tables = "needed, best with `--grid`" if law.needs_axes else "needed" if law.needs_tables else ""
    (row,) = [line for line in GUIDE.read_text(encoding="utf-8").splitlines() if line.startswith(f"| {shown} |")]
    assert row.split("|")[-2].strip() == tables


@pytest.mark.parametrize("name", ["kinematic", "springs"])
def test_what_has_no_force_is_refused_with_the_laws_that_have_one(name: str) -> None:
    with pytest.raises(
        MeshError, match=rf"mesh model '{name}' has no force element; choose one of {', '.join(WITH_FORCE)}"
    ):
        law_of(name)


@pytest.mark.parametrize("name", LAWS)
def test_a_law_that_needs_tables_asks_for_their_folder(grc: Gearbox, name: str) -> None:
    if LAWS[name].needs_tables:
        with pytest.raises(MeshError, match=f"mesh model '{name}' requires transmission error tables"):
            mesh_stiffness(grc, name)
    else:
        assert len(mesh_stiffness(grc, name)) == (len(grc.pairs) if LAWS[name].has_force else 0)


CURVE = CURVE_FORM, curve_coefficients(SAMPLES, SAMPLES * (1.2 + 0.1 * np.sin(np.arange(12.0))), 85e3)
"""Straight at the origin up to 0.05 of 25 to 31 um."""


@pytest.mark.parametrize(
    ("form", "coefficients", "delta", "step"),
    [
        *(
            (law_of(name).form, law_of(name).coefficients(SAMPLES), delta, 1e-9)
            for name in ALONG_A_ROW
            for delta in (-20e-6, 5e-6, 30e-6)
        ),
        *((*CURVE, delta, 1e-10) for delta in (-40e-6, -15e-6, 1e-6, 1.4e-6, 5e-6, 30e-6)),
    ],
)
def test_force_tangent_and_energy_belong_together(
    form: int, coefficients: np.ndarray, delta: float, step: float
) -> None:
    """Force is the slope of the energy, the tangent that of the force; pmc likewise; against finite differences."""

    def at(delta: float, pmc: float) -> np.ndarray:
        return np.array(row_law(form, coefficients, len(coefficients), delta, pmc, 50.0))

    force, tangent, by_pmc, _, cycle_power = at(delta, 0.3)
    pmc_step = 1e-5
    by_delta = (at(delta + step, 0.3) - at(delta - step, 0.3)) / (2.0 * step)
    over_cycle = (at(delta, 0.3 + pmc_step) - at(delta, 0.3 - pmc_step)) / (2.0 * pmc_step)
    assert by_delta[3] == pytest.approx(force, rel=1e-6)
    assert by_delta[0] == pytest.approx(tangent, rel=1e-6)
    assert over_cycle[0] == pytest.approx(by_pmc, rel=1e-6)
    assert -50.0 * over_cycle[3] == pytest.approx(cycle_power, rel=1e-6)


def test_a_curve_has_the_deflection_and_the_tangent_of_its_table() -> None:
    tangent = SAMPLES * (1.2 + 0.1 * np.sin(np.arange(12.0)))
    coefficients = curve_coefficients(SAMPLES, tangent, 85e3)
    for n, (secant, slope) in enumerate(zip(SAMPLES, tangent, strict=True)):
        found = row_law(CURVE_FORM, coefficients, 12, 85e3 / secant, n / 12.0, 0.0)
        assert found[:2] == pytest.approx((85e3, slope), rel=1e-12)
        # Other loads of one pair, planets' for example, lie on the same curve.
        other = MeshCurve(SAMPLES, tangent, 85e3).at(60e3)
        again = curve_coefficients(other.stiffness, other.tangent, 60e3)
        expected = row_law(CURVE_FORM, coefficients, 12, 20e-6, n / 12.0, 0.0)
        same = row_law(CURVE_FORM, again, 12, 20e-6, n / 12.0, 0.0)
        assert (same[0], same[1], same[3]) == pytest.approx((expected[0], expected[1], expected[3]), rel=1e-12)


def test_a_curve_whose_tangent_is_its_secant_is_the_straight_line() -> None:
    straight, curve = periodic_cubic(SAMPLES), curve_coefficients(SAMPLES, SAMPLES, 85e3)
    for delta in (-30e-6, 1e-7, 5e-6, 60e-6):
        for pmc in (0.1, 0.77):
            expected = row_law(STIFFNESS_FORM, straight, 12, delta, pmc, 50.0)
            assert row_law(CURVE_FORM, curve, 12, delta, pmc, 50.0) == pytest.approx(expected, rel=1e-12)


def test_contact_by_hertz_lies_on_its_curve_at_all_loads() -> None:
    """A point contact: deflection as the load's power 2/3, so that one load with its tangent tells all others."""
    load, stiffness = 50e3, 2e9
    deflection = load / stiffness
    coefficients = curve_coefficients(np.array([stiffness]), np.array([1.5 * stiffness]), load)
    for share in (0.02, 0.25, 1.5, 3.0):
        found = row_law(CURVE_FORM, coefficients, 1, deflection * share ** (2.0 / 3.0), 0.0, 0.0)
        assert found[0] == pytest.approx(share * load, rel=1e-12)


@pytest.mark.parametrize("name", ["line_of_action", "constant", "tangential"])
def test_only_the_law_line_of_action_is_curved(grc: Gearbox, curves: dict, stiffness: dict, name: str) -> None:
    """Straight laws take from a curve its secant, and a stated stiffness is straight in every law."""
    choice = Choice("rigid", name)
    assembly, straight = assemble(grc, choice, curves), assemble(grc, choice, stiffness)
    assert set(assembly.meshes.form) == {CURVE_FORM if name == "line_of_action" else STIFFNESS_FORM}
    assert set(straight.meshes.form) == {STIFFNESS_FORM}
    if name != "line_of_action":
        assert np.array_equal(assembly.meshes.stiffness, straight.meshes.stiffness)


@pytest.mark.parametrize("name", WITH_FORCE)
def test_linear_models_have_the_form_of_a_stiffness_and_no_table(grc: Gearbox, stiffness: dict, name: str) -> None:
    data = surfaces(grc) if LAWS[name].needs_axes else stiffness
    assembly = assemble(grc, Choice("rigid", name), data)
    assert set(assembly.meshes.form) == {law_of(name).form}
    linear = assembly.linear_meshes()
    assert set(linear.form) == {STIFFNESS_FORM}
    assert not linear.table.shape.any()
    means = [element.stiffness.mean() for element in assembly.elements]
    assert linear.stiffness[:, 0, 0] == pytest.approx(means, rel=1e-14)
