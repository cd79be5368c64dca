"""The diagrams show the numbers they are given, in the units they name."""

import matplotlib
import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

from fe_ste.transmission_error.contact_stress import load_along_face
from fe_ste.transmission_error.diagrams import plot_load_share, plot_ripple, plot_ste_curves, single_load_case
from fe_ste.transmission_error.table import MeshTable

POSITIONS = np.arange(50) / 50


def table(mean=30e-6, swing=2e-6, missing=(), contact_ratio=1.6):
    """A table whose curve is a cosine and whose shares are trapezia over the way of a tooth pair."""
    ste = mean + 0.5 * swing * np.cos(2 * np.pi * POSITIONS)
    converged = np.ones(50, dtype=bool)
    converged[list(missing)] = False
    teeth = np.array([-1, 0, 1])
    way = POSITIONS[None, :] + teeth[:, None] + 0.5 * contact_ratio - 0.5
    load = np.clip(np.minimum(way, contact_ratio - way) / 0.4, 0.0, 1.0)
    dimensions = ("pmc", "torque", "centre_distance", "misalignment")
    return xr.Dataset(
        {
            "ste": (dimensions, ste.reshape(50, 1, 1, 1)),
            "load_share": ((*dimensions, "tooth"), (load / load.sum(axis=0)).T.reshape(50, 1, 1, 1, 3)),
            "converged": (dimensions, converged.reshape(50, 1, 1, 1)),
        },
        coords={"pmc": POSITIONS, "tooth": teeth, "torque": [1e4]},
    )


def test_curves_are_in_micrometres_and_close_the_cycle():
    figure = plot_ste_curves({"sun-planet": table()})
    (panel,) = figure.axes
    position, values = panel.lines[0].get_data()
    assert position[-1] == 1.0 and values[-1] == values[0]
    np.testing.assert_allclose(values[:-1], 30.0 + np.cos(2 * np.pi * POSITIONS))
    assert panel.get_ylabel() == "STE / µm"


def test_titles_give_mean_and_peak_to_peak():
    figure = plot_ste_curves({"sun-planet": table(), "ring-planet": table(mean=20e-6, swing=0.5e-6)})
    titles = [panel.get_title(loc="left") for panel in figure.axes]
    assert titles == [
        "sun-planet\nmean 30.0 µm, peak-to-peak 2.00 µm",
        "ring-planet\nmean 20.0 µm, peak-to-peak 0.50 µm",
    ]


def test_all_panels_span_the_same_range():
    figure = plot_ste_curves({"a": table(), "b": table(mean=20e-6, swing=0.5e-6), "c": table(swing=0.0)})
    spans = [np.ptp(panel.get_ylim()) for panel in figure.axes if panel.get_visible()]
    assert len(spans) == 3
    np.testing.assert_allclose(spans, 1.15 * 2.0)


def test_positions_that_did_not_converge_are_crossed_out_and_not_joined():
    broken = table(missing=(3, 10))
    broken["ste"][10] = np.nan
    broken["ste"][3] = 1.0  # a value that means nothing must not spoil the scale
    panel = plot_ste_curves({"pair": broken}).axes[0]
    curve, crosses = panel.lines[0], panel.lines[1]
    assert np.isnan(curve.get_ydata()[[3, 10]]).all()
    np.testing.assert_allclose(crosses.get_xdata(), POSITIONS[[3, 10]])
    assert crosses.get_label() == "2 not converged" and crosses.get_marker() == "x"
    low, high = panel.get_ylim()
    assert np.all((crosses.get_ydata() >= low) & (crosses.get_ydata() <= high)) and high < 32.0


def test_a_table_without_any_converged_position_is_drawn_as_such():
    panel = plot_ste_curves({"pair": table(missing=range(50))}).axes[0]
    assert panel.get_title(loc="left") == "pair\nno converged position"


@pytest.mark.parametrize("suffix", ["png", "pdf", "svg"])
def test_pictures_are_written_in_the_format_of_the_suffix(tmp_path, suffix):
    path = tmp_path / "new" / f"ste.{suffix}"
    plot_ste_curves({"pair": table()}, path)
    head = {"png": b"\x89PNG", "pdf": b"%PDF", "svg": b"<?xml"}[suffix]
    assert path.read_bytes().startswith(head)


def test_drawing_leaves_the_callers_settings_alone():
    before = dict(matplotlib.rcParams)
    plot_ste_curves({"pair": table()})
    assert dict(matplotlib.rcParams) == before


def test_load_shares_are_per_cent_and_add_up():
    panel = plot_load_share(table()).axes[0]
    shares = np.array([line.get_ydata() for line in panel.lines])
    np.testing.assert_allclose(np.nansum(shares, axis=0), 100.0)
    assert [line.get_label() for line in panel.lines] == ["tooth pair -1", "tooth pair 0", "tooth pair +1"]


@pytest.mark.parametrize("reverse", [False, True], ids=["ascending", "descending"])
def test_way_of_one_tooth_pair_is_continuous(reverse):
    dataset = table()
    if reverse:  # the other way of numbering the pairs
        dataset = dataset.assign_coords(tooth=-dataset["tooth"]).sortby("tooth")
    panel = plot_load_share(dataset).axes[1]
    way = np.concatenate([line.get_xdata() for line in panel.lines])
    share = np.nan_to_num(np.concatenate([line.get_ydata() for line in panel.lines]))
    assert np.all(np.diff(way) > 0.0)
    assert share[0] == share[-1] == 0.0
    # A share rises by 100 % over 0.4 cycles, 5 % in a fiftieth, and more while the others fall.
    assert np.abs(np.diff(share)).max() < 10.0


def test_load_share_marks_what_did_not_converge():
    panel = plot_load_share(table(missing=(7,))).axes[0]
    assert "1 not converged" in [line.get_label() for line in panel.lines]
    assert all(np.isnan(line.get_ydata()[7]) for line in panel.lines[:3])


def test_swept_tables_are_refused_with_the_dimension():
    two = xr.concat([table(), table()], dim="torque")
    with pytest.raises(ValueError, match=r"torque has 2 values; choose one, such as dataset.isel\(torque=0\)"):
        single_load_case(two)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: plot_ste_curves({}), "no dataset"),
        (lambda: plot_load_share(table().drop_vars("load_share")), "no variable 'load_share'"),
        (lambda: single_load_case(table().rename(pmc="position")), "no dimension 'pmc'"),
    ],
)
def test_missing_data_is_named(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_ripple_over_load_shows_peak_to_peak_values_and_marks_the_design_load():
    loads = [table(swing=swing).assign_coords(torque=[load]) for load, swing in ((100.0, 2e-6), (200.0, 5e-6))]
    figure = plot_ripple({"pair": xr.concat(loads, "torque")}, design={"pair": 150.0})
    curve, mark = figure.axes[0].lines
    np.testing.assert_allclose(curve.get_xydata(), [[100.0, 2.0], [200.0, 5.0]])
    np.testing.assert_allclose(mark.get_xydata(), [[150.0, 3.5]])
    with pytest.raises(ValueError, match="no dataset"):
        plot_ripple({})


def stored_table():
    """A table as it is stored: with stiffness, line load and the coordinates of its axes."""
    dataset = table(missing=(7,))
    line_load = xr.DataArray(np.arange(12.0) ** 2, dims="axial_position") * dataset["load_share"]
    stiffness = 1e9 * (1.0 + dataset["ste"])
    axes = {"centre_distance": [0.1], "misalignment": [0.0], "axial_position": 1e-3 * np.arange(12)}
    return MeshTable(dataset.assign(line_load=line_load, mesh_stiffness=stiffness).assign_coords(axes))


def test_a_table_draws_its_quantities_on_axes_of_the_caller_or_new_ones():
    stored = stored_table()
    state = stored.static_state
    panel = Figure().add_subplot()
    assert stored.plot(ax=panel) is panel
    for kind, expected in (("ste", 1e6 * state["ste"]), ("stiffness", 1e-6 * state["mesh_stiffness"])):
        curve, cross = stored.plot(kind).lines[:2]
        assert np.isnan(curve.get_ydata()[7]) and cross.get_xdata() == POSITIONS[7]
        np.testing.assert_array_equal(np.delete(curve.get_ydata()[:-1], 7), np.delete(expected.to_numpy(), 7))
    shares = [line.get_xydata() for line in plot_load_share(state).axes[0].lines]
    for line, expected in zip(stored.plot("load_share").lines, shares, strict=True):
        np.testing.assert_array_equal(line.get_xydata(), expected)
    along = load_along_face(state)
    (curve,) = stored.plot("contact").lines
    np.testing.assert_array_equal(curve.get_xdata(), 1e3 * state["axial_position"])
    np.testing.assert_array_equal(curve.get_ydata(), 1e-3 * along)
    several = stored.dataset.isel(misalignment=[0, 0, 0]).assign_coords(misalignment=[-2e-4, 1e-4, 3e-4])
    middle = several.assign(ste=several["ste"] * xr.DataArray([1.0, 2.0, 3.0], dims="misalignment"))
    panel = MeshTable(middle).plot()
    assert panel.get_title() == "misalignment 100 µrad"
    expected = 2e6 * np.delete(state["ste"].to_numpy(), 7)
    np.testing.assert_allclose(np.delete(panel.lines[0].get_ydata()[:-1], 7), expected, rtol=1e-15)
    assert stored.plot().get_title() == ""
    assert stored.plot("contact").get_ylabel() == "Line load, mean of the mesh cycle / (N/mm)"


def test_a_table_says_which_diagrams_it_has():
    with pytest.raises(ValueError, match="must be one of ste, stiffness, load_share, contact"):
        stored_table().plot("share")
    with pytest.raises(ValueError, match="no variable 'line_load'"):
        MeshTable(stored_table().dataset.drop_vars("line_load")).plot("contact")
