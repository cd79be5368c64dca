"""Crossings of orders with modes of the averaged system: speeds to evaluate, and the strength of the response there.

With a damping ratio of half a per mille a peak is as wide as a per mille of its speed: equal steps miss it. Modes are
taken from the Campbell diagram, followed over speed by their shapes; where an order crosses a mode, the linear response
of that mode shows whether it is relevant. One speed there and its neighbours then locate the maximum.

With the method `linear` an order of the overall transmission error is a sum over meshes, and over modes of the averaged
system. Shares are the components of each along the sum, so that they add up to one; components opposed to the sum are
negative.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from exugear.results.sound.radiated_power import RadiatedPower
from exugear.steady.balance.interface import Interface
from exugear.steady.balance.model import HarmonicBalanceModel
from exugear.steady.balance.response import mean_deviation_forces, transmission_errors
from exugear.steady.campbell import ModeTracks
from exugear.steady.mean_system.mean_system import MeanSystem, mean_modes
from exugear.steady.mean_system.mesh_places import DEFLECTION, MISALIGNMENT
from fe_ste.tools.arrays import Booleans, Complexes, Floats
from fe_ste.tools.threads import side_by_side

Forcing = Callable[[Interface], Complexes]
HARMONICS = 3
"""Multiples of the fastest mesh frequency up to which modes are followed."""
LEAST_SHARE = 1e-3
"""Peaks below this share of the largest of their signal, in the range of operation too, are left to the even steps."""
MOST = 240
"""Crossings at most, the strongest first."""
WIDE = 0.5
"""Half-width of a resonance where its amplitude is 1 / sqrt(2) of the top, in steps between speeds, from which the
speeds show its top."""
ROUNDS = 4
"""Iterations to a mode at the speed where a line meets it; their error is squared each time."""
COINCIDE = 1e-6
"""Share of the speed within which two speeds are one."""
SAME = 0.5
"""Minimum MAC with the followed mode for the final mode to be the same mode."""


@dataclass(frozen=True)
class Crossing:
    """A line that meets a mode."""

    speed: float
    """Of the input, rad/s."""
    line: int
    """Place in the line set."""
    mode: int
    """Place among the modes that were followed."""
    frequency: float
    """Of the mode there, Hz."""
    damping: float
    """Share of critical damping."""
    share: float
    """Peak over the largest of its signal, whichever signal shows it most."""


@dataclass(frozen=True, eq=False)
class Mode:
    """A mode at a speed: eigenvalue, displacements (size,), and the left shape (size,), which loads meet."""

    value: complex
    shape: Complexes
    left: Complexes

    def assurance(self, other: Mode, mass: Floats, damping: Floats) -> float:
        """MAC of two modes, 1 for the same and 0 for different ones of the quadratic eigenvalue problem."""

        def between(mode: Mode, two: Mode) -> complex:
            return complex(mode.left @ (((mode.value + two.value) * mass + damping) @ two.shape))

        own = between(self, self) * between(other, other)
        return abs(between(self, other) * between(other, self) / own)


def crossings(
    model: HarmonicBalanceModel, tracks: ModeTracks, forcing: Forcing, operation: tuple[float, float] | None = None
) -> tuple[Crossing, ...]:
    """Crossings of lines of single bases with modes over the speeds of these, the strongest first.

    `forcing` gives the forces of the meshes (lines, m, f), N, that vary in the static state. Between the speeds
    `operation` (rad/s, without sign) peaks are held against the largest of those there.
    """
    index = model.lines.index[:, : len(model.waves.base_orders)]
    # Orders of a single mesh frequency and their sidebands, or of a shaft; a flexible ring gear makes sidebands of all.
    several = np.count_nonzero(index, axis=1) > 1
    if model.waves.neighbours:
        several |= model.beside_others
    lines = [int(line) for line in np.flatnonzero(~several) if line]
    model = model.frozen
    followed = FollowedModes(model.system, tracks)
    middle = float(model.system.speeds[1])
    forces = forcing(model.at(middle))[lines]
    loads = model.shaft_loads(middle)[lines]
    met = _passages(tracks, model.lines.orders[lines])
    if not met:
        return ()
    peaks = np.array(
        [_peak(model, followed.near(mode, speed), speed, forces[at], loads[at]) for mode, at, speed in met]
    )
    shares = _shares(peaks)
    counted = shares.copy()
    inside = in_operation(np.array([speed for _, _, speed in met]), operation)
    counted[inside] = _shares(peaks[inside])
    strongest = [n for n in np.argsort(-counted, kind="stable") if counted[n] >= LEAST_SHARE][:MOST]
    strongest.sort(key=lambda n: -shares[n])
    system = model.system

    def exact(n: int) -> Crossing:
        """Find a crossing with the mode as it is at that speed, by Rayleigh quotients from either side.

        Ostrowski (1959); their error is cubed from one to the next, and the speed goes with them.
        """
        mode, at, speed = met[n]
        order = float(model.lines.orders[lines[at]])
        start = followed.near(mode, speed)
        found = Mode(complex(start.value.real, order * abs(speed)), start.shape, start.left)
        crossed = speed
        for _ in range(ROUNDS):
            found = improved(found, system.mass, system.damping_at(crossed), system.stiffness_at(crossed))
            crossed = float(np.copysign(found.value.imag / order, crossed))
        if start.assurance(found, system.mass, system.damping_at(crossed)) < SAME:
            found, crossed = start, speed
        damping = float(-found.value.real / abs(found.value))
        return Crossing(crossed, lines[at], mode, found.value.imag / 2.0 / np.pi, damping, float(shares[n]))

    low = tracks.speeds[0]
    high = tracks.speeds[-1]
    return tuple(crossing for crossing in side_by_side(exact, strongest) if low <= crossing.speed <= high)


def in_operation(speeds: Floats, operation: tuple[float, float] | None) -> Booleans:
    """Return which speeds (n,) are in an operating range, rad/s without sign; all without a range or a speed in it."""
    if operation is not None:
        inside = (np.abs(speeds) >= operation[0]) & (np.abs(speeds) <= operation[1])
        if inside.any():
            return np.asarray(inside)
    return np.ones(len(speeds), dtype=bool)


def _shares(peaks: Floats) -> Floats:
    """Peaks (n, signals) over the largest of their signal, of whichever signal shows it most, (n,)."""
    largest = np.maximum(peaks.max(axis=0, initial=0.0), 1e-300)
    return np.asarray(np.max(peaks / largest, axis=1), dtype=np.float64)


def with_crossings(speeds: Floats, found: tuple[Crossing, ...], resolved: float = math.inf) -> Floats:
    """Return speeds (n,) and those of narrow crossings between them, ascending; what all but coincides is one.

    Parameters
    ----------
    resolved : half-width of a resonance, in steps between the speeds, from which it is wide and its crossing left out
    """
    step = float(np.diff(speeds).max(initial=0.0))
    narrow = [own.speed for own in found if own.damping * abs(own.speed) < resolved * step]
    inside = [speed for speed in narrow if speeds.min() <= speed <= speeds.max()]
    both = np.sort(np.concatenate([speeds, inside]))
    return np.asarray(both[np.append(True, np.diff(both) > COINCIDE * np.abs(both[1:]))])


def _passages(tracks: ModeTracks, orders: Floats) -> list[tuple[int, int, float]]:
    """Where lines of given orders pass modes: mode, place of the line, and speed (rad/s) on straight lines between."""
    found = []
    speed = tracks.speeds
    for at, order in enumerate(orders):
        above = tracks.eigenvalues.imag - order * np.abs(speed)[:, None]
        # A line that meets a mode at one of the speeds to the last bit passes it once.
        passed = ((above[:-1] < 0.0) != (above[1:] < 0.0)) & np.isfinite(above[:-1] + above[1:])
        for step, mode in zip(*np.nonzero(passed), strict=True):
            before = above[step, mode]
            after = above[step + 1, mode]
            share = before / (before - after)
            found.append((int(mode), at, float(speed[step] + share * (speed[step + 1] - speed[step]))))
    return found


class FollowedModes:
    """Modes that were followed over speed, with the left shapes that loads meet."""

    def __init__(self, system: MeanSystem, tracks: ModeTracks) -> None:
        self._tracks = tracks
        left = tracks.left.reshape(-1, system.size)
        self._left = np.linalg.solve(system.mass.T, left.T).T.reshape(tracks.left.shape)

    def near(self, mode: int, speed: float) -> Mode:
        """Mode at the followed speed that is nearest to another, rad/s."""
        tracks = self._tracks
        apart = np.where(np.isnan(tracks.eigenvalues[:, mode].imag), np.inf, np.abs(tracks.speeds - speed))
        n = int(np.argmin(apart))
        return Mode(complex(tracks.eigenvalues[n, mode]), tracks.shapes[n, mode], self._left[n, mode])


def _peak(model: HarmonicBalanceModel, followed: Mode, speed: float, force: Complexes, load: Complexes) -> Floats:
    """Find what a mode makes at resonance of a line with forces (m, f) of the meshes and a load (size,), (signals,).

    Signals are the overall transmission error and the deflections of the meshes.
    """
    ports = model.ports_at(speed)
    rows = np.vstack([model.row_of_overall(speed)[None], ports.readings[:, DEFLECTION]])
    pushed = abs(followed.left @ (load - model.loads(ports) @ force.ravel()))
    return np.asarray(np.abs(rows @ followed.shape) * pushed / abs(followed.value.real))


def improved(mode: Mode, mass: Floats, damping: Floats, stiffness: Floats) -> Mode:
    """Improve a mode by inverse iteration of its shapes and the Rayleigh quotient of both."""
    slope = 2.0 * mode.value * mass + damping
    matrix = mode.value**2 * mass + mode.value * damping + stiffness
    # With few degrees of freedom the eigenvalue may be exact to the last bit, and the matrix crossed singular. A pivot
    # of round-off in place of zero then gives the shape to full accuracy (Wilkinson 1965, as in LAPACK's xHSEIN).
    factor, pivots, _ = scipy.linalg.lapack.zgetrf(matrix)
    diagonal = np.einsum("ii->i", factor)
    diagonal[diagonal == 0.0] = np.finfo(np.float64).eps * np.abs(matrix).max()
    right: Complexes = scipy.linalg.lu_solve((factor, pivots), slope @ mode.shape)
    left: Complexes = scipy.linalg.lu_solve((factor, pivots), slope.T @ mode.left, trans=1)
    right = right / np.linalg.norm(right)
    left = left / np.linalg.norm(left)
    value = mode.value - complex(left @ matrix @ right) / complex(left @ slope @ right)
    return Mode(value, right, left)


# Cause of a peak: exciting mesh, mode, and sensitivity

LEAST_MODE = 0.01
"""Minimum share of a mode to be reported."""


@dataclass(frozen=True)
class Contributions:
    """Contributions to an order of the overall transmission error, or of the sound power, at one speed."""

    speed: float
    """Of the input, rad/s."""
    amplitude: float
    """Peak amplitude of the line at the level `linear`, m; of the surface velocity, m/s."""
    meshes: Mapping[str, float]
    """Share by family of meshes, and by stated torque."""
    shuttling: Mapping[str, float]
    """Part of the share of a family that is due to the moment of the load that shuttles along the face."""
    modes: tuple[tuple[float, float], ...]
    """Frequency (Hz) and share of each mode that carries a hundredth or more, the strongest first."""
    supports: Mapping[str, float]
    bodies: Mapping[str, float]
    """Relative change of the amplitude per relative change of a bearing's stiffness, and of a body's inertia, the
    mean stiffness of the meshes and the excitation staying as they are."""


def contributions(
    model: HarmonicBalanceModel, speed: float, line: int, radiated: RadiatedPower | None = None
) -> Contributions:
    """Find what makes a line of the overall transmission error, or of the sound power, at a speed.

    The surface velocity is the root mean square over the surface. What a part of the motion contributes is its part
    along the whole, integrated over the surface: shares of the sound power add up to one like those of a signal.

    Parameters
    ----------
    model : of a law along a row, which has a first-order excitation
    speed : of the input, rad/s
    line : place in the line set, of one base alone: combinations are no sum over meshes
    radiated : surface whose velocity is explained; by default the overall transmission error is
    """
    frequency = abs(speed) * float(model.lines.orders[line])
    forces, loads = _excitation(model, speed, line)
    dynamic = model.system.dynamic(speed, frequency)
    # One solution from either side: what the signal sees of any load, and what moves under these loads.
    motion = np.linalg.solve(dynamic, loads).astype(np.complex128)
    row = model.row_of_overall(speed).astype(np.complex128)
    if radiated is not None:
        row = radiated.row_along(motion, frequency)
    adjoint = np.linalg.solve(dynamic.T, row).astype(np.complex128)
    total = complex(row @ motion)
    meshes: dict[str, float] = {}
    shuttling: dict[str, float] = {}
    parts = (adjoint @ forces).reshape(len(model.waves.waves), model.ports_at(speed).forces.shape[1])
    for wave, by_force in zip(model.waves.waves, parts, strict=True):
        meshes[wave.family] = meshes.get(wave.family, 0.0) + _share(complex(by_force.sum()), total)
        if model.shuttles:
            moment = _share(complex(by_force[MISALIGNMENT]), total)
            shuttling[wave.family] = shuttling.get(wave.family, 0.0) + moment
    for source in dict.fromkeys(filter(None, model.shaft_orders.source)):
        if part := complex(2.0 * adjoint @ model.shaft_loads(speed, source)[line]):
            meshes[source] = meshes.get(source, 0.0) + _share(part, total)
    supports, bodies = _derivatives(model.system, frequency, adjoint, motion, total)
    modes = _modes(model, speed, frequency, loads, row, total)
    return Contributions(speed, abs(total), meshes, shuttling, modes, supports, bodies)


def loudest_near(model: HarmonicBalanceModel, speed: float, width: float, line: int) -> float:
    """Return the speed (rad/s) of the largest `linear` amplitude of an order, within a share `width` of another speed.

    At the maximum, the height of a peak changes with a parameter as the amplitude at that fixed speed does: the shift
    of the peak has no first-order effect.
    """
    import scipy.optimize  # a quarter of a second that others need not wait

    def quietness(factor: float) -> float:
        at = speed * factor
        dynamic = model.system.dynamic(at, abs(at) * float(model.lines.orders[line]))
        return -abs(complex(model.row_of_overall(at) @ np.linalg.solve(dynamic, _excitation(model, at, line)[1])))

    found = scipy.optimize.minimize_scalar(
        quietness, bounds=(1.0 - width, 1.0 + width), method="bounded", options={"xatol": 1e-4 * width}
    )
    return speed * float(found.x)


def _excitation(model: HarmonicBalanceModel, speed: float, line: int) -> tuple[Complexes, Complexes]:
    """Generalized peak forces of each wave (size, m f) on a line, and their sum (size,)."""
    ports = model.ports_at(speed)
    excess = transmission_errors(model, ports, speed)[line]
    excess[:, DEFLECTION] += mean_deviation_forces(model, speed)[line]
    forces = -2.0 * model.loads(ports) * excess.ravel()
    return forces, np.asarray(forces.sum(axis=1) + 2.0 * model.shaft_loads(speed)[line])


def _share(part: complex, total: complex) -> float:
    """Part along the total, over its size."""
    return float((part * total.conjugate()).real / abs(total) ** 2)


def _modes(
    model: HarmonicBalanceModel, speed: float, frequency: float, loads: Complexes, row: Complexes, total: complex
) -> tuple[tuple[float, float], ...]:
    """Shares of the modes of the averaged system, those of negative frequency counted with their conjugates."""
    values, right, left = mean_modes(model.system, speed)
    size = model.system.size
    pushed = np.linalg.solve(model.system.mass, loads)
    found = []
    seen, conjugate = right[:, :size] @ row, right[:, :size].conj() @ row
    for value, own, other, partner in zip(values, seen, conjugate, left[:, size:], strict=True):
        part = own * (partner @ pushed) / (1j * frequency - value)
        part += other * (partner.conj() @ pushed) / (1j * frequency - np.conj(value))
        found.append((abs(value) / (2.0 * np.pi), _share(complex(part), total)))
    return tuple(sorted((share for share in found if abs(share[1]) >= LEAST_MODE), key=lambda share: -abs(share[1])))


def _derivatives(
    system: MeanSystem, frequency: float, adjoint: Complexes, motion: Complexes, total: complex
) -> tuple[dict[str, float], dict[str, float]]:
    """Relative changes of the amplitude per relative change of bearings' stiffness and of bodies' inertia.

    A change dD of the dynamic stiffness D changes the signal by -(row D^-1) dD (D^-1 loads). Damping goes with the
    stiffness.
    """
    frame = system.frame
    assembly = frame.assembly
    t = frame.matrices(0.0)[0]
    elements = system.elements
    adjoint = t @ adjoint
    motion = t @ motion
    supports: dict[str, float] = {}
    for support in assembly.supports:
        forces = elements.stiffness[support.name] @ motion
        forces = forces + 1j * frequency * (elements.damping[support.name] @ motion)
        share = _share(-complex(adjoint @ forces), total)
        supports[support.family] = supports.get(support.family, 0.0) + share
    bodies: dict[str, float] = {}
    for body in assembly.bodies:
        place = assembly.elastic_slices.get(body.name)
        index = [i for i in assembly.coordinates[body.name] if i >= 0]
        index = index if place is None else list(range(place.start, place.stop))
        inertia = -(frequency**2) * (elements.mass[np.ix_(index, index)] @ motion[index])
        bodies[body.family] = bodies.get(body.family, 0.0) + _share(-complex(adjoint[index] @ inertia), total)
    return supports, bodies
