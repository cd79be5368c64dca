"""What spectra show of themselves in a notebook: short, without arrays, whatever the names."""

import re

import pytest

from exugear.results.spectra.resonances import group_by_frequency, order_cut, pick_resonances
from exugear.results.spectra.run_spectra import compare, report_mode
from exugear.results.spectra.waterfall import OrderLine

from .run_ups import MESH, RATE, modes_dataset, run_up, swept_pair


@pytest.fixture(scope="module")
def spectra(runs):
    """One of each kind, and what its short text begins with."""
    run = swept_pair([600.0, 1300.0])
    time, speed, _ = run_up(duration=2.0)
    cut = order_cut(time, speed, RATE, OrderLine("<b>" + 300 * "long ", 60.0), window_length=0.1)
    conditions = "load case run_up, mesh model line_of_action, inertia set gears"
    return {
        "<Waterfall: 995 spectra of 820 lines, ": run,
        "<OrderCut: order 60 (<b>long long": cut,
        "<WaterfallResonance 60": group_by_frequency(pick_resonances(run, [MESH]))[0],
        f"<VariantRun bushing, {conditions}, 3 peaks>": runs[0],
        f"<Comparison bushing with rigid, {conditions}: only first 2, only second 0>": compare(*runs),
    }


def test_the_short_text_names_what_matters_in_one_line(spectra):
    for start, noun in spectra.items():
        assert repr(noun).startswith(start), repr(noun)
        assert len(repr(noun)) < 200
        assert "\n" not in repr(noun)
        assert "array" not in repr(noun)


def test_the_table_of_a_notebook_is_one_table_in_which_no_name_acts(spectra):
    for noun in spectra.values():
        table = noun._repr_html_()
        assert set(re.findall(r"</?(\w+)", table)) - {"img"} == {"table", "caption", "tr", "th", "td"}
        assert table.count("<table>") == table.count("</table>") == 1


def test_a_comparison_lists_what_only_one_run_shows(runs):
    table = compare(*runs)._repr_html_()
    assert re.search(r"<th>only bushing</th><td>(79\d|80\d) Hz, 11[45]\d Hz</td>", table)
    assert "<th>only rigid</th><td>none</td>" in table


def test_a_mode_in_figures_is_short_whatever_moves():
    modes = modes_dataset([0.0, 90.0], [0.0, 0.5])
    modes["name"][1] = 50 * "planet_1 spin 3 %, "
    assert repr(report_mode(modes, 1)).startswith("<ModeReport 1: 90.0 Hz, share 1e+02 %, planet_1 spin")
    assert len(repr(report_mode(modes, 1))) < 200
