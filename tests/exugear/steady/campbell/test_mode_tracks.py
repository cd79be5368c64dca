"""Modes followed over speed keep what they are, against systems whose modes are known in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from exugear.steady.campbell import MOST, assurance, circle, mode_tracks
from exugear.steady.mean_system.mean_system import vibrations

AXIAL, TRANSVERSE, STIFFNESS = 0.02, 0.012, 3e4
"""A disc on isotropic tilting springs, kg m2 and N m/rad."""


def uncoupled(coupling):
    """Two oscillators with frequencies 10 and 5 to 20 rad/s over speeds 0 to 1, and a spring between them."""

    def modes_at(speed):
        own = np.diag([100.0, (5.0 + 15.0 * speed) ** 2]) + coupling * np.array([[1.0, -1.0], [-1.0, 1.0]])
        return vibrations(np.eye(2), 1e-3 * np.eye(2), own)

    return modes_at


def gyroscopic(speed):
    turning = AXIAL * speed * np.array([[0.0, 1.0], [-1.0, 0.0]])
    return vibrations(TRANSVERSE * np.eye(2), turning, STIFFNESS * np.eye(2))


def test_uncoupled_modes_that_cross_stay_themselves():
    tracks = mode_tracks(uncoupled(0.0), 0.0, 1.0)
    omega = 2.0 * np.pi * tracks.frequency
    straight, rising = np.argsort(np.ptp(omega, axis=0))
    # Damping of 5e-5 of the critical moves frequencies by its square.
    np.testing.assert_allclose(omega[:, straight], 10.0, rtol=1e-7)
    np.testing.assert_allclose(omega[:, rising], 5.0 + 15.0 * tracks.speeds, rtol=1e-7)
    assert np.abs(tracks.shapes[:, straight, 1]).max() < 1e-9 * np.abs(tracks.shapes[:, straight, 0]).min()


def test_coupled_modes_veer_and_exchange_their_shapes():
    """A spring of 2 N/m keeps them apart by 2 c / (2 w) = 0.2 rad/s where they would meet, at a third of the range."""
    tracks = mode_tracks(uncoupled(2.0), 0.0, 1.0)
    low, high = (2.0 * np.pi * tracks.frequency).T
    assert (high > low).all()
    assert (high - low).min() == pytest.approx(0.2, rel=0.05)
    moved = np.abs(tracks.shapes[[0, -1], 0])
    assert moved[0, 1] > 5.0 * moved[0, 0] and moved[1, 0] > 5.0 * moved[1, 1]
    assert 9 < len(tracks.speeds) <= MOST


def test_a_gyroscopic_disc_splits_into_forward_and_backward_whirl():
    """I_t w^2 -+ I_p W w - k = 0: w = +- W I_p / 2 I_t + root((W I_p / 2 I_t)^2 + k / I_t)."""
    tracks = mode_tracks(gyroscopic, 0.0, 800.0)
    half = 0.5 * tracks.speeds * AXIAL / TRANSVERSE
    root = np.sqrt(half**2 + STIFFNESS / TRANSVERSE)
    backward, forward = (2.0 * np.pi * tracks.frequency).T
    np.testing.assert_allclose(forward, root + half, rtol=1e-9)
    np.testing.assert_allclose(backward, root - half, rtol=1e-9)
    turns = [circle(*shape) / float(np.sum(np.abs(shape) ** 2)) for shape in tracks.shapes[-1]]
    np.testing.assert_allclose(turns, [-1.0, 1.0], atol=1e-9)


def test_modes_of_one_system_are_told_apart_however_they_are_damped():
    """Damping that no mass and stiffness make, where shapes overlap by mass; the MAC is the identity to round-off."""
    stiffness, damping = np.array([[300.0, -100.0], [-100.0, 200.0]]), np.array([[6.0, 1.0], [-1.0, 0.0]])
    found = vibrations(np.diag([1.0, 2.0]), damping, stiffness)
    np.testing.assert_allclose(assurance(found, found), np.eye(2), atol=1e-10)
    shapes = found[1][:, :2]
    shapes = shapes / np.sqrt(np.einsum("mi,i,mi->m", shapes.conj(), [1.0, 2.0], shapes))[:, None]
    assert abs(shapes[0].conj() @ np.diag([1.0, 2.0]) @ shapes[1]) > 0.01


def test_modes_of_repeated_eigenvalues_add_up_to_the_response():
    """Modes of one eigenvalue thrice and another twice, in coordinates turned at random, against a direct solution."""
    size, w = 6, 15.0
    random = np.random.default_rng(0)
    for _ in range(20):
        turn, _ = np.linalg.qr(random.normal(size=(size, size)))
        stiffness = turn @ np.diag([100.0, 100.0, 100.0, 400.0, 400.0, 900.0]) @ turn.T
        load = random.normal(size=size)
        values, right, left = vibrations(np.eye(size), 1e-3 * stiffness, stiffness)
        with_partners = [(values, right, left), (values.conj(), right.conj(), left.conj())]
        sums = [(r[:, :size].T * (p[:, size:] @ load / (1j * w - s))).sum(axis=1) for s, r, p in with_partners]
        direct = np.linalg.solve((1.0 + 1e-3j * w) * stiffness - w**2 * np.eye(size), load)
        assert np.abs(sums[0] + sums[1] - direct).max() < 1e-10 * np.abs(direct).max()


def test_a_mode_that_leaves_the_range_of_frequencies_ends_and_others_go_on():
    def below(speed):
        values, right, left = uncoupled(0.0)(speed)
        kept = values.imag < 15.0
        return values[kept], right[kept], left[kept]

    tracks = mode_tracks(below, 0.0, 1.0)
    gone = np.isnan(tracks.frequency)
    assert gone.any(axis=0).sum() == 1
    rising = int(np.argmax(gone.any(axis=0)))
    np.testing.assert_array_equal(gone[:, rising], 5.0 + 15.0 * tracks.speeds >= 15.0)


def test_one_speed_has_its_modes():
    tracks = mode_tracks(uncoupled(0.0), 0.2, 0.2)
    np.testing.assert_allclose(2.0 * np.pi * tracks.frequency, [[8.0, 10.0]], rtol=1e-7)


def test_the_least_damping_is_that_of_the_fastest_mode_of_equal_dampers():
    """Damping d / 2 w of the critical; the rising mode reaches 20 rad/s, and gaps of modes that end do not count."""
    tracks = mode_tracks(uncoupled(0.0), 0.0, 1.0)
    assert tracks.least_damping == pytest.approx(1e-3 / (2.0 * 20.0), rel=1e-6)
    eigenvalues = tracks.eigenvalues.copy()
    eigenvalues[:, np.argmax(tracks.frequency[-1])] = np.nan
    assert replace(tracks, eigenvalues=eigenvalues).least_damping == pytest.approx(1e-3 / (2.0 * 10.0), rel=1e-6)
    assert replace(tracks, eigenvalues=np.full_like(eigenvalues, np.nan)).least_damping == 0.0
