"""The table of signals and the kernels that fill it say the same; layouts leave no column out."""

from __future__ import annotations

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.system.build import assemble
from exugear.system.kernels.table_law import GUESSED, LEFT_TABLE
from exugear.system.signals import (
    BALANCE_TERMS,
    ENERGIES,
    MESH_TIMES,
    POWERS,
    SIGNALS,
    signal_layout,
    signals_of,
)
from exugear.transient.compiled import sampling, solver

from ...cases.table import surfaces


def function_named(name: str) -> object:
    """Function of `exugear.transient.compiled.sampling`, or method of `exugear.transient.compiled.solver`."""
    function: object = solver if "." in name else sampling
    for part in name.split("."):
        function = getattr(function, part)
    return function


def test_every_signal_has_one_name_and_something_that_makes_it() -> None:
    assert len({signal.name for signal in SIGNALS}) == len(SIGNALS)
    for signal in SIGNALS:
        for name in signal.filled_by:
            assert callable(function_named(name))
        is_clock = signal.dimensions == (signal.name,)
        assert [bool(signal.filled_by), signal.formula is not None, is_clock].count(True) == 1, signal.name


def test_kernels_know_the_columns_of_all_signals_that_they_fill() -> None:
    by_kernels = [s.name for s in SIGNALS if s.is_sampled and s.filled_by and s.filled_by != ("Observer.complete",)]
    assert list(sampling.Columns._fields) == by_kernels


def test_columns_of_energy_are_the_observed_terms_of_the_account() -> None:
    names = {
        "kinetic_energy": sampling.KINETIC,
        "elastic_energy": sampling.ELASTIC,
        "work_of_loads": sampling.OF_LOADS,
        "dissipated_energy": sampling.DISSIPATED,
        "work_of_varying_stiffness": sampling.OF_VARYING_STIFFNESS,
        "non_conservative_work": sampling.NON_CONSERVATIVE,
        "tooth_friction_work": sampling.OF_FRICTION,
        "bearing_rate_work": sampling.OF_BEARING_RATES,
    }
    assert names == {name: column for column, name in enumerate((*ENERGIES, *POWERS))}
    assert set(names) == set(BALANCE_TERMS)


@pytest.mark.parametrize("choice", [Choice("rigid"), Choice("bushing"), Choice("rigid", "table")])
def test_columns_of_a_layout_follow_each_other_without_a_gap(grc: Gearbox, stiffness: dict, choice: Choice) -> None:
    tabled = choice.mesh_model == "table"
    layout = signal_layout(assemble(grc, choice, surfaces(grc) if tabled else stiffness))
    slices = [layout[signal.name] for signal in SIGNALS if signal.name in layout]
    assert [0, *(columns.stop for columns in slices)] == [*(columns.start for columns in slices), layout.count]
    assert ("misalignment" in layout) == tabled


def test_stored_values_are_those_of_the_columns_and_formulas(grc: Gearbox, stiffness: dict) -> None:
    layout = signal_layout(assemble(grc, Choice("bushing"), stiffness))
    rows = np.arange(3.0 * layout.count).reshape(3, layout.count)
    values = layout.stored_values(np.arange(3.0), rows)
    assert list(values) == [s.name for s in signals_of(False) if s.is_sampled and s.stored]
    assert np.array_equal(values["overall_dte"], layout.radius * rows[:, layout["overall_dte_angle"].start])
    assert values["support_force"].shape == (3, len(layout.names["support"]), 3)


def test_times_of_meshes_count_the_samples_of_their_law(grc: Gearbox) -> None:
    layout = signal_layout(assemble(grc, Choice("rigid", "table"), surfaces(grc)))
    rows = np.ones((4, layout.count))
    rows[:3, layout["mesh_force"].start] = 0.0
    rows[:, layout["outside_table"]] = 0.0
    rows[0, layout["outside_table"].stop - 1] = LEFT_TABLE
    rows[:2, layout["outside_table"].start] = GUESSED
    counts = dict(zip(MESH_TIMES, layout.mesh_times(rows), strict=True))
    assert counts["contact_loss_time"].tolist() == [3.0] + [0.0] * (len(layout.names["mesh"]) - 1)
    assert counts["extrapolation_time"].tolist() == [0.0] * (len(layout.names["mesh"]) - 1) + [1.0]
    assert counts["interpolation_time"].tolist() == [2.0] + [0.0] * (len(layout.names["mesh"]) - 1)
    assert not counts["tensile_time"].any()
