"""Amplitudes at the ends of the range of damping are those of gearboxes with that damping."""

from __future__ import annotations

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.report.findings.ranking import ranking_of
from exugear.steady.damping_band import damping_limits
from exugear.steady.mean_system.mean_system import mean_modes, mean_system
from exugear.steady.settings import SpeedRange, SteadySettings
from exugear.steady.steady_file import complex_amplitudes, response_quantities, steady_response
from exugear.system.build import assemble

SPEEDS = SpeedRange.from_text("11:28:60")


def response(gearbox: Gearbox, stiffness: dict, method: str, variant: str = "bushing"):
    return steady_response(gearbox, Choice(variant), stiffness, settings=SteadySettings(SPEEDS, method))


def sizes_of(data, quantity, line: int) -> np.ndarray:
    return quantity.sizes(complex_amplitudes(data)[:, line]).max(axis=1)


@pytest.mark.validation
@pytest.mark.sample
@pytest.mark.parametrize("method", ["parametric", pytest.param("linear", marks=pytest.mark.long)])
def test_peaks_at_both_ends_are_those_of_whole_responses(grc: Gearbox, stiffness: dict, method: str) -> None:
    """Of the ten highest peaks of each quantity: half within 0.5 %, all within 3.5 %."""
    modal = {"modal_percent": 2.0, "modal_band_percent": (1.0, 4.0)}
    data = response(grc.varied({"damping": modal}), stiffness, method)
    whole = [response(grc.varied({"damping": {"modal_percent": end}}), stiffness, method) for end in (1.0, 4.0)]
    points, lines, found = (data[name].to_numpy() for name in ("band_point", "band_line", "band_amplitude"))
    quantities = response_quantities(data)
    speed = data["speed"].to_numpy()
    errors = []
    for number, quantity in enumerate(quantities):
        of_peaks = [sizes_of(data, quantity, line)[point] for point, line in zip(points, lines, strict=True)]
        for k in np.argsort(of_peaks)[::-1][:10]:
            own = sizes_of(data, quantity, lines[k])
            if own[points[k]] < own[max(points[k] - 1, 0) : points[k] + 2].max():
                continue  # no peak of this quantity
            for end, other in enumerate(whole):
                near = np.abs(other["speed"].to_numpy() / speed[points[k]] - 1.0) < 0.007
                expected = sizes_of(other, quantity, lines[k])[near].max()
                errors.append(abs(found[k, number, end] / expected - 1.0))
    assert len(errors) > 20
    assert np.median(errors) < 5e-3
    assert max(errors) < 0.035


def test_limits_of_the_damping_change_damping_alone(grc: Gearbox, stiffness: dict) -> None:
    modal = {"modal_percent": 2.0, "modal_band_percent": (1.0, 4.0)}
    for section, factors in ((modal, (0.5, 2.0)), ({"mesh_time_s": 4e-6, "bearing_time_s": 4e-6}, (0.5, 2.0))):
        assembly = assemble(grc.varied({"damping": section}), Choice("bushing"), stiffness)
        system = mean_system(assembly, np.array([0.5, 2.2]))
        values, _, _ = mean_modes(system, 0.5)
        for limit, factor in zip(damping_limits(system), factors, strict=True):
            changed, _, _ = mean_modes(limit, 0.5)
            assert changed.imag == pytest.approx(values.imag, rel=2e-3)
            assert np.median(changed.real / values.real) == pytest.approx(factor, rel=1e-3)


@pytest.mark.validation
def test_the_ranking_says_where_a_rank_depends_on_the_damping(grc: Gearbox, stiffness: dict) -> None:
    ranking = ranking_of(response(grc.varied({"damping": {"modal_percent": 2.0}}), stiffness, "parametric"))
    first = ranking.resonances[0].amplitudes
    limits = [own.limits for own in first.values()]
    assert all(found is not None for found in limits)
    for own in first.values():
        assert own.limits is not None
        least, largest = own.limits
        assert least.amplitude > 0.99 * own.amplitude > 0.98 * largest.amplitude
    places = [own.places for one in ranking.resonances for own in one.amplitudes.values() if own.places is not None]
    assert all(best <= worst for best, worst in places)
    assert any(best < worst for best, worst in places)
