"""Checks of matrices on interface nodes: what is wrong with a body is said, with the node, before it is used."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg

from exugear.system.bodies.matrix_files.checks import review
from exugear.system.bodies.matrix_files.interface import UNIT_SYSTEMS, InterfaceMatrices

from ...cases.beams import DENSITY, POSITIONS, SIDE, beams_between, frame


def only_translations(body: InterfaceMatrices) -> InterfaceMatrices:
    """As solid elements give it: no entries of rotations."""
    kept = np.ones(body.size)
    kept[: 6 * len(body.nodes)] = np.tile([1.0, 1.0, 1.0, 0.0, 0.0, 0.0], len(body.nodes))
    return replace(body, mass=body.mass * np.outer(kept, kept), stiffness=body.stiffness * np.outer(kept, kept))


def turned_node(body: InterfaceMatrices, node: int, angle: float) -> InterfaceMatrices:
    """Displacements of a node in axes turned about z."""
    turn = np.eye(body.size)
    c, s = np.cos(angle), np.sin(angle)
    for start in (6 * node, 6 * node + 3):
        turn[start : start + 2, start : start + 2] = [[c, s], [-s, c]]
    return replace(body, mass=turn @ body.mass @ turn.T, stiffness=turn @ body.stiffness @ turn.T)


def moved_node(body: InterfaceMatrices, node: int, distance: float) -> InterfaceMatrices:
    positions = body.positions.copy()
    positions[node, 2] += distance
    return replace(body, positions=positions)


def translations_first(body: InterfaceMatrices) -> InterfaceMatrices:
    count = len(body.nodes)
    order = np.r_[
        np.arange(6 * count).reshape(count, 6)[:, :3].ravel(),
        np.arange(6 * count).reshape(count, 6)[:, 3:].ravel(),
        6 * count : body.size,
    ]
    return replace(body, mass=body.mass[np.ix_(order, order)], stiffness=body.stiffness[np.ix_(order, order)])


def held(body: InterfaceMatrices) -> InterfaceMatrices:
    """On springs at one node, which resist displacements."""
    stiffness = body.stiffness.copy()
    stiffness[6:9, 6:9] += 3.5e7 * np.eye(3)
    return replace(body, stiffness=stiffness)


def noisy(body: InterfaceMatrices) -> InterfaceMatrices:
    noise = 1.0 + 1e-5 * np.random.default_rng(1).standard_normal((body.size, body.size))
    return replace(body, stiffness=0.5 * (body.stiffness * noise + (body.stiffness * noise).T))


def half(matrix: np.ndarray) -> np.ndarray:
    return np.tril(matrix)


def swapped(body: InterfaceMatrices) -> InterfaceMatrices:
    return replace(body, positions=body.positions[[1, 0, 2, 3]])


def of_one_direction(body: InterfaceMatrices) -> InterfaceMatrices:
    """As with a mass element that acts along x alone."""
    mass = body.mass.copy()
    mass[0, 0] += 20.0
    return replace(body, mass=mass)


def loose_parts(body: InterfaceMatrices) -> InterfaceMatrices:
    """Two beams that nothing connects."""
    one, two = (beams_between(body.positions[at], np.array(body.nodes)[at]) for at in ([0, 1], [2, 3]))
    stiffness, mass = (scipy.linalg.block_diag(getattr(one, key), getattr(two, key)) for key in ("stiffness", "mass"))
    return replace(body, modal=(), stiffness=stiffness, mass=mass)


DAMAGES: dict[str, tuple[Callable[[InterfaceMatrices], InterfaceMatrices], str]] = {
    "stiffness as a triangle": (lambda b: replace(b, stiffness=half(b.stiffness)), "stiffness: not symmetric"),
    "mass as a triangle": (lambda b: replace(b, mass=half(b.mass)), "mass: not symmetric"),
    "no rotations": (only_translations, "12 coordinates have none, the first is node 12 rx"),
    "one node held": (held, "stiffness: 3 motions are free of strain energy instead of six; remove supports"),
    "noise of 1e-5": (noisy, r"stiffness: (negative strain energy|\d motions)"),
    "negated": (lambda b: replace(b, stiffness=-b.stiffness), "negative strain energy"),
    "two loose parts": (loose_parts, "12 motions are free of strain energy instead of six; parts are loose"),
    "mass and stiffness exchanged": (lambda b: replace(b, mass=b.stiffness, stiffness=b.mass), "0 motions are free"),
    "no mass": (lambda b: replace(b, mass=0.0 * b.mass), "mass: all entries are zero; write the mass matrix, or state"),
    "negative mass": (lambda b: replace(b, mass=-b.mass), "mass: negative kinetic energy"),
    "node 1 mm off": (lambda b: moved_node(b, 2, 1e-3), "the most at node 101, as if it was off by"),
    "node in axes turned by 1 degree": (lambda b: turned_node(b, 1, np.pi / 180.0), "the most at node 15"),
    "two nodes swapped": (swapped, "the most at node 1[25]"),
    "all translations first": (translations_first, "order of the coordinates"),
    "positions in mm": (lambda b: replace(b, positions=1e3 * b.positions), "unit of length"),
    "y and z exchanged": (lambda b: replace(b, positions=b.positions[:, [0, 2, 1]]), "rotation x, rotation y"),
    "mass along x only": (of_one_direction, r"mass: \d+.* kg along x, y, z; a body has the same mass"),
}


def test_a_sound_body_has_the_mass_and_centre_of_its_beams() -> None:
    found = review(frame(0))
    assert not found.errors + found.warnings
    pairs = [(a, b) for a in range(4) for b in range(a)]
    lengths = np.array([np.linalg.norm(POSITIONS[a] - POSITIONS[b]) for a, b in pairs])
    middles = np.array([(POSITIONS[a] + POSITIONS[b]) / 2.0 for a, b in pairs])
    assert found.mass == pytest.approx(DENSITY * SIDE**2 * lengths.sum(), rel=1e-9)
    assert found.centre == pytest.approx(lengths @ middles / lengths.sum(), rel=1e-9)
    assert found.size == 0.6


@pytest.mark.parametrize("damage", DAMAGES)
def test_what_is_wrong_is_said_in_one_error(damage: str) -> None:
    change, message = DAMAGES[damage]
    found = review(change(frame()))
    assert len(found.errors) == 1, found
    with pytest.raises(AssertionError, match=message):
        raise AssertionError(found.errors[0])
    assert found.errors[0].count("; ") >= 1  # what to do follows


def test_a_node_off_by_a_hundredth_of_a_millimetre_or_single_precision_are_let_pass() -> None:
    body = frame()
    single = replace(
        body,
        mass=body.mass.astype(np.float32).astype(np.float64),
        stiffness=body.stiffness.astype(np.float32).astype(np.float64),
    )
    assert not review(moved_node(body, 2, 1e-5)).errors
    assert not review(single).errors


@pytest.mark.parametrize("units", [name for name in UNIT_SYSTEMS if name != "SI"])
def test_a_body_in_another_unit_system_is_a_question(units: str) -> None:
    # Consistent in itself, so that only density and speed of sound tell.
    found = review(frame().from_si(units))
    assert not found.errors
    assert any("check units, the unit system of the files" in line for line in found.warnings), found.warnings


@pytest.mark.parametrize(("key", "factor", "kind"), [("mass", 1e3, "mass"), ("stiffness", 1e-6, "stiffness")])
def test_one_matrix_in_another_unit_is_a_question(key: str, factor: float, kind: str) -> None:
    body = frame()
    found = review(replace(body, **{key: factor * getattr(body, key)}))
    assert not found.errors
    assert any(line.startswith(f"{kind}: ") and "check units" in line for line in found.warnings), found.warnings


def test_motions_without_mass_are_a_warning() -> None:
    """Lumped masses: rotations have none."""
    body = frame(0)
    mass = np.diag(np.tile([20.0, 20.0, 20.0, 0.0, 0.0, 0.0], 4))
    found = review(replace(body, mass=mass))
    assert not found.errors
    assert "mass: some motions have none" in found.warnings[0]
    assert found.mass == pytest.approx(80.0)


def test_nodes_at_one_position_are_a_body() -> None:
    """Sectors of a ring share their centre; beams between nodes moved there by rigid arms."""
    body = frame(0)
    arms = np.eye(24)
    for n, (x, y, z) in enumerate(body.positions):
        arms[6 * n : 6 * n + 3, 6 * n + 3 : 6 * n + 6] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    moved = replace(
        body, positions=np.zeros((4, 3)), mass=arms.T @ body.mass @ arms, stiffness=arms.T @ body.stiffness @ arms
    )
    assert not review(moved).errors
    assert review(moved).mass == pytest.approx(review(body).mass)
