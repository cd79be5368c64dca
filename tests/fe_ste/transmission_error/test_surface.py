"""The surface of a table between its nodes: exact at them, smooth, periodic, rising with the load."""

from __future__ import annotations

import numpy as np
import pytest

from fe_ste.transmission_error.surface import InterpolationError, SteSurface, axis_weights

FORCE = np.array([1e3, 5e3, 1e4, 2e4])
CENTRE = np.array([0.0998, 0.0999, 0.1, 0.1001, 0.1002])
TILT = np.array([-2e-4, -0.5e-4, 0.0, 1e-4, 2e-4])


def shape(pmc: np.ndarray, centre: np.ndarray, tilt: np.ndarray, force: np.ndarray) -> tuple:
    """Smooth transmission error with its slope by the force: softer out of place, Hertz-like in the load."""
    soft = (1.0 + 0.05 * np.cos(2 * np.pi * pmc)) * (1.0 + 100.0 * (centre - 0.1)) * (1.0 + 3e6 * tilt**2)
    load = force / 1e4
    ste = 1e-5 * soft * (load + 0.1 * load**0.7)
    return ste, 1e-9 * soft * (1.0 + 0.07 * load**-0.3), ste * 6e6 * tilt / (1.0 + 3e6 * tilt**2)


def table(positions: int = 24, force: np.ndarray = FORCE) -> tuple[SteSurface, tuple]:
    pmc = np.arange(positions) / positions
    grid = np.meshgrid(pmc, CENTRE, TILT, force, indexing="ij")
    ste, slope, tilting = shape(*grid)
    return SteSurface.from_nodes(CENTRE, TILT, force, ste, 1.0 / slope, tilting), (grid, ste)


def test_exact_at_every_node() -> None:
    surface, (grid, ste) = table(6)
    for pmc, centre, tilt, force, value in zip(*(x.ravel() for x in (*grid, ste)), strict=True):
        assert surface.ste(force, pmc, centre, tilt) == pytest.approx(value, rel=1e-12)


def test_periodic_in_pmc() -> None:
    surface, _ = table()
    for pmc in (0.13, 0.999):
        assert surface.ste(7e3, pmc + 3.0, 0.1, 0.0) == pytest.approx(surface.ste(7e3, pmc, 0.1, 0.0), rel=1e-13)


def test_between_the_nodes_it_is_the_function_it_was_laid_through() -> None:
    surface, _ = table()
    random = np.random.default_rng(1)
    for _ in range(200):
        place = random.uniform(), random.uniform(0.0998, 0.1002), random.uniform(-2e-4, 2e-4), random.uniform(1e3, 2e4)
        pmc, centre, tilt, force = place
        expected = shape(pmc, centre, tilt, force)[0]
        # Parabolic slopes: third derivatives of the misalignment's parabola vanish, those of the load's power do not.
        assert surface.ste(force, pmc, centre, tilt) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("axis", range(4))
def test_slopes_are_continuous_across_the_nodes(axis: int) -> None:
    surface, _ = table()
    nodes = [np.arange(24) / 24, CENTRE, TILT, FORCE][axis]
    scale = [1.0, 1e-4, 1e-4, 1e3][axis]
    at = [0.31, 0.10003, 0.3e-4, 7e3]
    h = 1e-5 * scale
    for node in nodes[1:-1]:
        values = []
        for offset in (-h, 0.0, h):
            at[axis] = node + offset
            pmc, centre, tilt, force = at
            values.append(surface.ste(force, pmc, centre, tilt))
        left, right = np.diff(values) / h
        # One-sided differences of length h differ by h times the second derivative.
        assert left == pytest.approx(right, abs=1e-3 * abs(right) + 1e-3 * values[1] / scale)


def test_outside_the_axes_of_position_it_goes_on_straight() -> None:
    surface, _ = table()
    for place in ((0.1003, 0.1004, 0.1005), (0.0997, 0.0996, 0.0995)):
        a, b, c = (surface.ste(1e4, 0.2, centre, 0.0) for centre in place)
        assert b - a == pytest.approx(c - b, rel=1e-9)
    end, beyond = surface.ste(1e4, 0.2, 0.1002 - 1e-9, 0.0), surface.ste(1e4, 0.2, 0.1002 + 1e-9, 0.0)
    assert beyond == pytest.approx(end, rel=1e-6)


def test_a_flank_in_line_contact_is_linear_from_the_first_newton() -> None:
    """Deflection in proportion to the load comes back exactly, whatever the nodes."""
    force = np.array([2e3, 3e3, 9e3])
    ste = (1e-9 * force).reshape(1, 1, 1, 3)
    surface = SteSurface.from_nodes([0.1], [0.0], force, ste, np.full((1, 1, 1, 3), 1e9))
    for load in (0.0, 1.0, 500.0, 2.5e3, 9e3):
        assert surface.ste(load, 0.4) == pytest.approx(1e-9 * load, rel=1e-12, abs=1e-18)
    assert surface.mean_stiffness(4e3, 0.1) == pytest.approx(1e9, rel=1e-12)


def test_gears_that_stay_in_place_have_the_same_curve() -> None:
    surface, _ = table()
    here = surface.at_nominal(0.10004, 0.7e-4)
    assert here.coefficients.shape[1:3] == (1, 1)
    for pmc in (0.0, 0.4, 0.77):
        assert here.ste(6e3, pmc) == pytest.approx(surface.ste(6e3, pmc, 0.10004, 0.7e-4), rel=1e-12)


def test_less_deflection_under_more_load_is_refused() -> None:
    ste = np.array([1e-6, 0.9e-6]).reshape(1, 1, 1, 2)
    with pytest.raises(InterpolationError, match="does not grow from 1000 N to 2000 N"):
        SteSurface.from_nodes([0.1], [0.0], [1e3, 2e3], ste, np.full((1, 1, 1, 2), 1e9))


def test_axis_that_does_not_increase_is_refused() -> None:
    with pytest.raises(InterpolationError, match="must increase"):
        axis_weights([0.1, 0.1])
    with pytest.raises(InterpolationError, match="positive and increase"):
        SteSurface.from_nodes([0.1], [0.0], [0.0], np.ones((1, 1, 1, 1)), np.ones((1, 1, 1, 1)))


@pytest.mark.sample
@pytest.mark.parametrize("axes", ["all", "place alone", "load alone"])
def test_a_guess_is_told_wherever_it_acts(axes: str) -> None:
    """A state and a guess at it make two surfaces: wherever these differ the interval is marked."""
    centre, tilt, force = CENTRE, TILT, FORCE
    if axes == "place alone":
        force = FORCE[-1:]
    elif axes == "load alone":
        centre, tilt = np.array([0.1]), np.array([0.0])
    pmc = np.arange(12) / 12
    grid = np.meshgrid(pmc, centre, tilt, force, indexing="ij")
    ste, slope, tilting = shape(*grid)
    solved = np.ones(ste.shape, dtype=bool)
    lost = 5, len(centre) // 2, len(tilt) // 2, len(force) // 2
    solved[lost] = False
    one = SteSurface.from_nodes(centre, tilt, force, ste, 1.0 / slope, tilting, solved=solved)
    assert one.guessed is not None and one.guessed[lost] and one.guessed.sum() == 1
    whole = SteSurface.from_nodes(centre, tilt, force, ste, 1.0 / slope, tilting)
    assert whole.guessed is None and not whole.interpolated_intervals().any()
    near = one.interpolated_intervals()
    assert near.shape == (12, max(1, len(centre) - 1), max(1, len(tilt) - 1), len(force))
    assert 0 < near.sum() < 0.9 * near.size
    acting = one.acting_guesses()
    assert np.array_equal(acting[1::2, 1::2, 1::2, 1::2], near)
    # A node is marked where both intervals beside it are; the mesh cycle closes.
    assert np.array_equal(acting[0:-1:2, 1::2, 1::2, 1::2], near & np.roll(near, 1, axis=0))
    assert np.array_equal(acting[1::2, 1::2, 1::2, 2:-1:2], near[..., 1:] & near[..., :-1])
    differing = 0
    for p, c, a, piece in np.ndindex(near.shape):
        place = (
            (p + 0.37) / 12,
            centre[c] if len(centre) == 1 else 0.6 * centre[c] + 0.4 * centre[c + 1],
            tilt[a] if len(tilt) == 1 else 0.6 * tilt[a] + 0.4 * tilt[a + 1],
        )
        root = 0.5 * (one.root_force[piece] + one.root_force[piece + 1])
        differs = abs(one.ste(root**2, *place) - whole.ste(root**2, *place)) > 1e-12
        assert near[p, c, a, piece] or not differs
        differing += differs
    assert differing > 0.2 * near.sum() > 0


def test_marks_stay_where_gears_stay_and_in_the_mean() -> None:
    solved = np.ones((24, 5, 5, 4), dtype=bool)
    solved[3, 0, 4, 3] = False
    pmc = np.arange(24) / 24
    ste, slope, tilting = shape(*np.meshgrid(pmc, CENTRE, TILT, FORCE, indexing="ij"))
    surface = SteSurface.from_nodes(CENTRE, TILT, FORCE, ste, 1.0 / slope, tilting, solved=solved)
    beside, away = surface.at_nominal(float(CENTRE[0]), float(TILT[4])), surface.at_nominal(0.1, 0.0)
    assert beside.interpolated_intervals().any() and not away.interpolated_intervals().any()
    assert surface.averaged().interpolated_intervals()[:, 0, 3].any()
    assert not surface.averaged().interpolated_intervals()[:, 3, 0].any()


def test_too_many_unsolved_states_are_refused() -> None:
    solved = np.ones((24, 5, 5, 4), dtype=bool)
    solved[:, :, :, 3] = False
    pmc = np.arange(24) / 24
    ste, slope, tilting = shape(*np.meshgrid(pmc, CENTRE, TILT, FORCE, indexing="ij"))
    with pytest.raises(InterpolationError, match="600 of 2400 states not converged"):
        SteSurface.from_nodes(CENTRE, TILT, FORCE, ste, 1.0 / slope, tilting, solved=solved)
