"""Eigenmodes in figures: shares of mobility, the mode nearest to a frequency, what a mode strains and moves."""

from __future__ import annotations

import pytest

from exugear.results.spectra.run_spectra import mobility_shares, nearest_mode, report_mode

from .run_ups import modes_dataset


def test_shares_of_mobility_add_up_to_one():
    shares = mobility_shares(modes_dataset([0.0, 1.0, 2.0], [0.0, 3.0, 4.0]))
    assert shares == pytest.approx([0.0, 0.36, 0.64], rel=1e-15)
    assert not mobility_shares(modes_dataset([0.0], [0.0])).any()


def test_the_nearest_mode_is_elastic_and_has_the_share_asked_for():
    modes = modes_dataset([0.0, 90.0, 104.0], [0.0, 0.5, 1e-3])
    near, seen = nearest_mode(modes, 100.0), nearest_mode(modes, 100.0, least_share=0.01)
    assert near is not None
    assert seen is not None
    assert (near.index, seen.index) == (2, 1)
    assert near.is_near(100.0)
    assert not seen.is_near(100.0)
    assert nearest_mode(modes_dataset([0.0], [0.0]), 100.0) is None


def test_a_mode_in_figures_names_the_mesh_that_excites_it_most():
    mode = report_mode(modes_dataset([0.0, 90.0], [0.0, 0.5]), 1)
    assert (mode.mesh, mode.amplification) == ("b", 3.0)
    assert mode.strain == {"a": 0.25, "bearing": 0.75}
    assert mode.kinetic == {"one": 0.5, "two": 0.5}
