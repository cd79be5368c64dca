"""Diagrams of modes and of the static state show the arrays of the results, on axes of the caller or new ones."""

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from exugear.gearbox.choice import Choice
from exugear.gearbox.load_cases import operating_range
from exugear.gearbox.units import RPM
from exugear.results.spectra.run_spectra import mobility_shares, report_mode
from exugear.results.spectra.waterfall import order_lines
from exugear.system.build import assemble
from exugear.system.diagrams import draw_campbell, draw_energies, draw_misalignment
from exugear.system.modes import VISIBLE, modes_of
from exugear.system.operating_points import mesh_duties
from exugear.system.statics import static_state
from fe_ste.tools.drawing import axes_or_new


@pytest.fixture(scope="module")
def modes(grc, stiffness):
    return modes_of(assemble(grc, Choice("bushing"), stiffness))


def test_campbell_has_the_visible_modes_and_their_crossings_with_the_mesh_orders(grc, modes):
    panel = Figure().add_subplot()
    assert modes.plot(ax=panel) is panel
    assert (panel.get_xlabel(), panel.get_ylabel()) == ("Input speed / rpm", "Frequency / kHz")
    data = modes.to_dataset()
    seen = [report_mode(data, n) for n in np.flatnonzero(mobility_shares(data) >= VISIBLE)]
    top = panel.get_ylim()[1]
    frequencies = [1e-3 * mode.frequency for mode in seen if 0.0 < mode.frequency <= 1e3 * top]
    lines = order_lines(grc)
    levels = panel.lines[: -len(lines)]
    np.testing.assert_array_equal([line.get_ydata()[0] for line in levels], frequencies)
    assert [line.get_label() for line in panel.lines[-len(lines) :]] == [line.name for line in lines]
    fastest = panel.get_xlim()[1]
    assert fastest == pytest.approx(operating_range(grc)[1] / RPM)
    assert top <= 1.0501e-3 * max(line.frequency(fastest * RPM) for line in lines)
    for line, marks in zip(lines, panel.collections, strict=True):
        speed, frequency = np.asarray(marks.get_offsets()).T
        np.testing.assert_allclose(1e-3 * line.frequency(speed * RPM), frequency)
        reached = [value for value in frequencies if value <= 1e-3 * float(line.frequency(fastest * RPM))]
        np.testing.assert_array_equal(frequency, reached)


def test_energies_are_a_map_of_bodies_and_elements_over_the_modes(modes):
    panel = modes.plot("energies")
    shares = modes.energies()
    assert [label.get_text() for label in panel.get_yticklabels()] == list(shares)
    np.testing.assert_array_equal(panel.images[0].get_array(), 100.0 * np.array(list(shares.values())))
    kinetic = sum(values for name, values in shares.items() if name.endswith(", kinetic"))
    strain = sum(values for name, values in shares.items() if name.endswith(", strain"))
    np.testing.assert_allclose(kinetic, 1.0)
    np.testing.assert_allclose(strain, modes.frequency > 0.0, atol=1e-12)
    with pytest.raises(ValueError, match="must be one of campbell, energies"):
        modes.plot("shape")


def test_the_static_state_draws_the_misalignment_that_the_command_lists(modes):
    state = static_state(modes.assembly)
    panel = state.plot()
    names = [label.get_text() for label in panel.get_yticklabels()]
    drawn = dict(zip(names, (bar.get_width() for bar in panel.patches), strict=True))
    assert drawn == pytest.approx({duty.name: 1e3 * duty.misalignment for duty in mesh_duties(modes.assembly)})
    assert panel.get_xlabel() == "Misalignment / mrad"


def test_any_name_can_be_drawn_on_axes_of_the_caller():
    figure = Figure()
    first, second, third = figure.subplots(1, 3)
    names = ["$\\frac", "a\x1bb"]
    draw_misalignment(names, np.array([1e-3, -1e-3]), first)
    draw_energies(dict.fromkeys(names, np.array([0.5, 1.0])), second)
    with axes_or_new(third) as panel:
        draw_campbell(panel, np.array([100.0]), {names[0]: 20.0, names[1]: 40.0}, 50.0, 200.0, np.ones(1))
        panel.legend()
    FigureCanvasAgg(figure).draw()
    assert [label.get_text() for label in first.get_yticklabels()] == ["$\\frac", "a\ufffdb"]
