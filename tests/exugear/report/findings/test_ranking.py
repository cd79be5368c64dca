"""Resonances ranked by three quantities: places by hand, ranges of operation, and whose accelerations they are."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray as xr

from exugear.gearbox.choice import Choice
from exugear.gearbox.load_cases import operating_range
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.units import RPM
from exugear.report.findings.ranking import HOUSING, SHAFTS, envelopes, order_amplitudes, ranking_of, resonances
from exugear.report.pictures.diagrams import plot_response
from exugear.steady.mean_system.signals import quantities_of, vector_peak
from exugear.steady.settings import SpeedRange, SteadySettings
from exugear.steady.steady_file import to_dataset, with_names
from exugear.steady.steady_response import response_of
from exugear.system.build import assemble

SPEED = np.linspace(1.0, 5.0, 401)
SIGNALS = ("overall_dte", *(f"{kind} brg {axis}" for kind in ("support_force", "seat_acceleration") for axis in "xyz"))


def hill(at, height):
    return height / (1.0 + ((SPEED - at) / 0.05) ** 2)


def response(operation, carried=False):
    """Two lines: one is loud in the error at 2, the other in force and acceleration near 4, and in the error at 1.5."""
    amplitude = np.zeros((len(SPEED), 3, len(SIGNALS)), dtype=np.float32)
    amplitude[:, 1, 0] = hill(2.0, 5e-6)
    amplitude[:, 1, 1] = hill(2.0, 10.0)
    amplitude[:, 2, 0] = hill(1.5, 2e-6) + hill(4.0, 1e-6)
    amplitude[:, 2, 1], amplitude[:, 2, 2] = hill(3.99, 30.0), hill(3.99, 40.0)
    amplitude[:, 2, 4] = hill(4.01, 7.0)
    return xr.Dataset(
        {
            "speed": ("point", -SPEED),
            "loads_at_mean_angles": ("point", np.zeros(len(SPEED), dtype=np.int8)),
            "amplitude": (("point", "line", "signal"), amplitude),
            "phase": (("point", "line", "signal"), np.zeros_like(amplitude)),
            "index": (("line", "base"), np.array([[0], [1], [2]])),
            "order": ("line", np.array([0.0, 10.0, 20.0])),
            # Of two peaks: the force of the second line is the higher one, and with little damping that of the first.
            "band_point": ("peak", [int(np.argmax(hill(2.0, 1.0))), int(np.argmax(hill(3.99, 1.0)))]),
            "band_line": ("peak", [1, 2]),
            "band_amplitude": (
                ("peak", "quantity", "damping_limit"),
                np.array([[[9e-6, 3e-6], [80.0, 6.0], [0.0, 0.0]], [[1e-6, 1e-6], [70.0, 30.0], [9.0, 4.0]]]),
            ),
        },
        {
            "quantity": ["error", "force", "acceleration"],
            "signal": list(SIGNALS),
            "base": ["mesh"],
            "line": ["mean", "mesh", "2 x mesh"],
        },
        {"operating_range": json.dumps(operation), "carried_seats": json.dumps({"brg": carried}), "mounts": "[]"},
    )


def test_resonances_are_sorted_by_the_chosen_quantity_and_have_their_rank_in_each():
    ranking = ranking_of(response(None), wanted="transmission_error")
    assert ranking.whole and ranking.accelerates == SHAFTS
    first, third, second = ranking.resonances
    assert (first.line, first.best, second.line, second.best) == ("mesh", 1, "2 x mesh", 1)
    assert (first.amplitudes["error"].place, first.amplitudes["force"].place) == (1, 2)
    assert first.amplitudes["acceleration"].place is None
    assert second.frequency == pytest.approx(20.0 * 4.0 / (2.0 * np.pi))  # where the deciding quantity is highest
    assert second.amplitudes["force"].amplitude == pytest.approx(50.0, rel=1e-6)  # 30, 40 and 50: Pythagoras
    assert {name: own.place for name, own in second.amplitudes.items()} == {"error": 3, "force": 1, "acceleration": 1}
    assert (third.line, third.best, third.speed) == ("2 x mesh", 2, pytest.approx(-1.5))
    low, high = first.amplitudes["force"].limits
    assert (low.amplitude, low.place, high.amplitude, high.place) == (80.0, 1, 6.0, 2)
    assert first.amplitudes["force"].places == second.amplitudes["force"].places == (1, 2)
    assert third.amplitudes["error"].limits is None and third.amplitudes["error"].places is None


@pytest.mark.parametrize(
    ("wanted", "quantity", "first"),
    [(None, "force", "2 x mesh"), ("bearing_force", "force", "2 x mesh"), ("transmission_error", "error", "mesh")],
)
def test_the_bearing_force_decides_by_default_and_any_quantity_by_choice(wanted, quantity, first):
    ranking = ranking_of(response(None), wanted=wanted)
    assert (ranking.quantity, ranking.resonances[0].line) == (quantity, first)
    assert ranking.leader("error").line == "mesh"
    assert ranking.leader("force").line == "2 x mesh"


def test_mounts_are_told_from_bearings_and_decide_by_default():
    """The foot of a housing has the highest acceleration; that at bearings is another one, at another speed."""
    data = response(None).reindex(quantity=["error", "force", "acceleration", "mount_acceleration"], fill_value=0.0)
    foot = [name.replace(" brg ", " foot ") for name in SIGNALS[1:]]
    of_foot = data.isel(signal=slice(1, None)).assign_coords(signal=foot)
    of_foot = of_foot.assign(amplitude=3.0 * of_foot["amplitude"].roll(point=7))
    both = xr.concat([data, of_foot], "signal", data_vars="minimal").assign_attrs(mounts=json.dumps(["foot"]))
    ranking = ranking_of(both)
    first = ranking.resonances[0]
    assert (ranking.quantity, first.amplitudes["mount_acceleration"].at) == ("mount_acceleration", "foot")
    assert first.amplitudes["mount_acceleration"].amplitude == pytest.approx(21.0, rel=1e-6)
    assert ranking.leader("acceleration").amplitudes["acceleration"].amplitude == pytest.approx(7.0, rel=1e-6)
    assert ranking.leader("force").amplitudes["force"].at == "brg"  # forces of mounts are no bearing forces


@pytest.mark.parametrize("seed", range(5))
def test_the_amplitude_of_a_vector_is_its_largest_magnitude_over_a_period(seed):
    vector = np.random.default_rng(seed).normal(size=(3, 2)) @ (1.0, 1.0j)
    angle = np.linspace(0.0, 2.0 * np.pi, 20001)
    magnitude = np.linalg.norm(np.real(vector[:, None] * np.exp(1j * angle)), axis=0)
    assert vector_peak(vector) == pytest.approx(magnitude.max(), rel=1e-7)
    assert vector_peak(vector) <= np.linalg.norm(vector)


def test_the_table_of_resonances_has_their_places_and_amplitudes():
    table = resonances(response(None))
    rows = [own.summary() for own in ranking_of(response(None)).resonances]
    assert table["line"].to_list() == [row["line"] for row in rows] == ["2 x mesh", "mesh", "2 x mesh"]
    assert table["force_N"].to_list() == [row["force_N"] for row in rows]
    assert table["speed_rpm"].to_list() == pytest.approx([-3.99 / RPM, -2.0 / RPM, -1.5 / RPM])
    assert [table["acceleration_place"].isna()[n] for n in range(3)] == [False, True, True]
    assert table["force_places_over_damping"][0] == (1, 2)
    assert resonances(response(None), "transmission_error")["line"].to_list() == ["mesh", "2 x mesh", "2 x mesh"]


@pytest.mark.parametrize(("quantity", "factor"), [("error", 1e6), ("force", 1e-3), ("acceleration", 1.0)])
def test_the_diagram_over_speed_marks_the_ranked_peaks_on_the_curves_of_their_orders(quantity, factor):
    data = response([1.0, 4.5])
    table = resonances(data).dropna(subset=f"{quantity}_place").sort_values(f"{quantity}_place")
    panel = plot_response(data, quantity)
    curves = {line.get_label(): line.get_xydata() for line in panel.lines if len(line.get_xdata()) > 1}
    amplitude = factor * order_amplitudes(data)[quantity]
    envelope = envelopes(data)[quantity]  # what the page draws
    np.testing.assert_array_equal(curves.pop("highest order").T, [envelope.speed / RPM, factor * envelope.amplitude])
    np.testing.assert_allclose(factor * envelope.amplitude, amplitude.max(axis=1), rtol=1e-12)
    assert list(curves) == list(dict.fromkeys(table["line"]))
    for name, curve in curves.items():
        np.testing.assert_array_equal(curve[:, 1], amplitude[:, ["mesh", "2 x mesh"].index(name)])
    unit = {"error": "m", "force": "N", "acceleration": "m_per_s2"}[quantity]
    marks = [line.get_xydata()[0] for line in panel.lines if len(line.get_xdata()) == 1]
    assert [mark[1] for mark in marks] == pytest.approx((factor * table[f"{quantity}_{unit}"]).to_list())
    written = [text.get_text() for text in panel.texts]
    assert [text for text in written if text.isdigit()] == [str(place) for place in table[f"{quantity}_place"]]
    assert {"highest order", *curves} == {text for text in written if not text.isdigit()}
    assert all(any((mark == point).all() for curve in curves.values() for point in curve) for mark in marks)


def test_a_response_without_bearings_has_no_forces_to_draw():
    data = response(None).isel(signal=[0])
    with pytest.raises(ValueError, match="quantity = 'force': must be one of error"):
        plot_response(data, "force")


def test_only_speeds_of_operation_are_ranked_and_all_where_none_of_them_was_computed():
    inside = ranking_of(response([1.8, 3.0], carried=True))
    assert [own.line for own in inside.resonances] == ["mesh"]
    assert (inside.speeds, inside.whole, inside.accelerates) == ((1.8, 3.0), False, HOUSING)
    assert inside.resonances[0].amplitudes["force"].place == 1
    beyond = ranking_of(response([50.0, 60.0]))
    assert beyond.whole and len(beyond.resonances) == 3


def test_forces_of_planets_are_the_mean_square_over_them():
    """Three waves make the forces of three planets; both ways give one root of the mean square."""
    waves = np.array([3.0 + 1.0j, 2.0 - 1.0j, 0.5 + 2.0j])
    theta = 2.0 * np.pi * np.arange(3) / 3
    planets = waves[0] + waves[1] * np.cos(theta) + waves[2] * np.sin(theta)
    names = [f"support_force pin{wave} radial" for wave in (" mean", " cosine", " sine")]
    (force,) = quantities_of(names, ())
    assert force.sizes(waves)[0] == pytest.approx(np.sqrt(np.mean(np.abs(planets) ** 2)), rel=1e-12)


def test_the_range_of_operation_is_stated_or_follows_from_the_rated_speed(grc):
    assert operating_range(grc) == pytest.approx((0.5 * 22.1 * RPM, 1.25 * 22.1 * RPM))
    assert operating_range(grc.varied({"operation.speed_range_rpm": [10.0, 30.0]})) == pytest.approx(
        (10.0 * RPM, 30.0 * RPM)
    )
    with pytest.raises(GearboxFileError, match=": set the lower speed first"):
        grc.varied({"operation.speed_range_rpm": [30.0, 10.0]})
    with pytest.raises(GearboxFileError, match="speed_range_rpm"):
        grc.varied({"operation.speed_range_rpm": [-30.0, 10.0]})


@pytest.mark.validation
def test_the_ranking_of_the_grc_is_of_its_speeds_of_operation_and_of_shafts(grc, stiffness):
    assembly = assemble(grc, Choice("bushing"), stiffness)
    data = with_names(to_dataset(response_of(assembly, SteadySettings(SpeedRange(-1.0, -3.0, 40), harmonics=4))))
    ranking = ranking_of(data)
    low, high = operating_range(grc)
    assert (ranking.speeds, ranking.whole, ranking.accelerates) == ((low, high), False, SHAFTS)
    assert all(low <= -own.speed <= high for own in ranking.resonances)
    ranks = [own.amplitudes["force"].place for own in ranking.resonances]
    ranked = [rank for rank in ranks if rank is not None]
    assert ranks == list(range(1, len(ranked) + 1)) + [None] * (len(ranks) - len(ranked))
    for quantity in ("error", "force", "acceleration"):
        found = {own.amplitudes[quantity].place: own.amplitudes[quantity].amplitude for own in ranking.resonances}
        placed = [found[place] for place in sorted(place for place in found if place is not None)]
        assert placed == sorted(placed, reverse=True)
