"""What is told of results: shifts that a full solution confirms, followed modes that swap, windows that disagree."""

from __future__ import annotations

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.report.findings import facts
from exugear.report.findings.facts import sensitivities_of
from exugear.report.findings.parameter_variations import BestChange, best_change, track_mode
from exugear.report.findings.words import Labels
from exugear.results.spectra.run_spectra import is_among, other_windows, survives
from exugear.system.modes import modes_of
from exugear.system.sensitivity import Parameter, ParameterVariation

from ...cases.assembled import assembled
from ...results.spectra.run_ups import STORED_LINE

STIFFNESS = {"sun_planet": 3.8e9, "ring_planet": 4.9e9, "intermediate": 3.1e9, "high_speed": 1.9e9}


@pytest.fixture(scope="module")
def gearbox() -> Gearbox:
    return Gearbox.from_toml("cases/grc750/gearbox.toml")


def frequency_of(gearbox: Gearbox, mode: int, stiffness: dict[str, float]) -> float:
    return float(modes_of(assembled(gearbox, Choice("rigid"), stiffness)).frequency[mode])


@pytest.mark.parametrize("pair, words", [("high_speed", "mesh high-speed"), ("intermediate", "mesh intermediate")])
def test_first_order_shifts_are_those_of_a_full_solution(gearbox, pair, words):
    """Another way to the number: the eigenproblem solved anew with a little more stiffness, scaled to 10 %.

    Little, for modes at 1459 and 1473 Hz mix when they move: with 1 % more stiffness by a quarter of the shift.
    """
    little = 1e-5
    modes = modes_of(assembled(gearbox, Choice("rigid"), STIFFNESS))
    dataset = modes.to_dataset()
    for mode in np.flatnonzero(modes.frequency > 100.0):
        lever = next((own for own in sensitivities_of(Labels(gearbox), dataset, int(mode)) if own.what == words), None)
        before = float(modes.frequency[mode])
        after = frequency_of(gearbox, int(mode), STIFFNESS | {pair: (1.0 + little) * STIFFNESS[pair]})
        # The curvature of the square root over 10 % is 2.4 % of the shift; smaller ones are left out.
        shift = 0.1 / little * (after - before)
        assert (lever.shift if lever else 0.0) == pytest.approx(shift, rel=0.03, abs=1e-3 * before)


def swapping() -> ParameterVariation:
    """Two modes that come near at 2 and swap what they do; the followed one fades, the other takes over."""
    values = (1.0, 1.5, 2.0, 2.5, 3.0)
    parameter = Parameter("stiffness", values, 1.0, lambda value: pytest.fail("nothing is built"))
    frequency = np.array([[500.0, 640.0], [540.0, 630.0], [580.0, 620.0], [600.0, 640.0], [610.0, 680.0]])
    amplification = np.array([[80.0, 2.0], [70.0, 15.0], [40.0, 42.0], [12.0, 74.0], [2.0, 82.0]])
    return ParameterVariation(parameter, frequency, amplification / 100.0, amplification, 0.01 * np.ones((5, 2)))


def test_a_followed_mode_that_fades_is_no_gain_where_another_takes_over():
    seen = track_mode(swapping(), 500.0)
    assert seen.amplification[-1] / seen.amplification[0] == pytest.approx(2.0 / 80.0)
    assert seen.loudest.tolist() == [80.0, 70.0, 42.0, 74.0, 82.0]
    best = best_change(swapping(), 500.0)
    assert best.value == 2.0
    assert best.gain == pytest.approx(20.0 * np.log10(80.0 / 42.0))
    assert best.span == pytest.approx(20.0 * np.log10(82.0 / 42.0))


def test_the_words_on_a_variation_are_those_of_the_plotted_curve(gearbox):
    """The text 'No effect' appears only where the curve is flat; where other values raise it, the text says so."""
    words = Labels(gearbox)
    lowered = facts.best_words(words, BestChange("mesh damping time / µs", 16.0, 4.0, 5.6, 6.0))
    assert lowered == "Lowest TE amplification within one octave: −5.6 dB, with mesh damping time 16 instead of 4 µs."
    flat = facts.best_words(words, BestChange("mesh damping time / µs", 4.0, 4.0, 0.0, 0.05))
    assert flat == "No effect on the TE amplification within one octave."
    raised = facts.best_words(words, BestChange("mesh damping time / µs", 4.0, 4.0, 0.0, 7.0))
    assert "only raise" in raised and "7 dB" in raised


def test_resonances_of_resonators_survive_all_windows_and_one_that_is_not_there_does_not(runs):
    bushing, rigid = runs
    windows = other_windows([rigid, bushing], [STORED_LINE])
    assert len(windows) == 4
    for finding in bushing.findings():
        assert survives(finding.strongest, "bushing", windows)
    alone = [finding.strongest for finding in bushing.findings() if finding.resonance.frequency > 700.0]
    for peak in alone:
        assert not survives(peak, "rigid", windows)
        assert all(is_among(peak, window.absent["bushing", "rigid"]) for window in windows)


def test_words_are_labels_and_copies_are_numbered(gearbox):
    words = Labels(gearbox.varied({"labels.planet": "planet wheel"}))
    assert words.of("planet_2") == "planet wheel 2"
    assert words.family("pl_a_3") == "pl_a"
    assert words.family("sun_planet_1") == "sun_planet"
    assert words.family("hss") == "hss"


def test_a_card_has_25_words_at_most_whatever_the_names():
    """Names of four words at each place: what has no room is left to the table."""
    names = ("generator side planet carrier", "rotor side cylindrical roller bearing")
    damping = facts.short("Strain energy 16 %.", *(f"A change of {name}: −2.5 dB." for name in 4 * names))
    assert len(damping.split()) <= facts.MOST_WORDS == 25


def test_orders_have_one_name_whatever_they_are_read_from(gearbox):
    words = Labels(gearbox)
    second = words.order("2 x sun_planet", 198.0)
    assert words.line(second) == "2 × sun–planet and ring–planet"
    assert words.pairs(second) == (2, ["sun_planet", "ring_planet"])
    combined = words.order("high_speed - 2 x intermediate", 900.0)
    assert words.line(combined) == "high-speed - 2 × intermediate"
    assert words.line_sentence(combined).startswith("the combination high-speed")
    assert words.pairs(combined) == (1, [])


def test_an_order_of_a_rotation_is_no_combination_and_names_the_torque_of_the_file(grc):
    ripple = {"body": "hss", "orders": [6], "pole_pairs": 2, "torque_N_m": [30.0]}
    words = Labels(grc.varied({"excitations": {"generator": ripple}}))
    order = words.order("12 x rotation of hss", 12.0 * grc.train.ratio)
    shaft = words.of("hss")
    assert words.line_sentence(order) == f"the 12th order of the rotation of {shaft} (excitation generator)"
    assert words.line_sentence(words.order("rotation of hss", 81.5)) == f"the 1st order of the rotation of {shaft}"
    carried = words.line_sentence(words.order("2 x rotation of planet in carrier", 5.1))
    assert carried == f"the 2nd order of the rotation of {words.of('planet')} in {words.of('carrier')}"
    assert words.pairs(order) == (1, [])
    assert words.line(order) == "12 × rotation of high-speed shaft (generator)"
