"""Campbell diagram of the averaged system: eigenfrequencies and damping over speed, each mode labelled.

The diagram is also read from a file. Two modes at neighbouring speeds are compared by left and right shapes::

    MAC_ij = |(left_i . right_j) (left_j . right_i)|,   left_i . right_i = 1 at each speed

This is 1 for the same mode, and 0 for different ones of one system, however it is damped and however gyroscopic:
shapes of such systems are not orthogonal by mass alone. Where modes veer, steps are halved until shapes change
gradually. Two modes that changed places within a step crossed if MAC_ij is zero; else they are coupled by half a gap

    c = root(MAC_ij) / (1 / D_1 + 1 / D_2),   D their distance in frequency at both ends of the step,

as two modes are that veer, and stay close over 2 c / (D_1 + D_2) of the step: if that is wide enough to be seen, the
step is halved, too.

Equal planets, equally spaced, have three types of modes (Lin and Parker 1999, J. Vib. Acoust. 121, 316): rotational, in
which all planets move alike and central bodies rotate (and move axially); translational, in which planets move as a
cosine and a sine around the carrier and central bodies move radially; planet modes, of higher multi-blade components,
in which no central body moves. The coordinates are multi-blade components already, so the kinetic energy identifies the
type.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from exugear.steady.mean_system.mean_system import MeanSystem, mean_modes
from exugear.steady.mean_system.planet_sets import PlanetSet
from exugear.system.bodies.reduction import TILT_X, TILT_Y, UX, UY
from exugear.system.modes import BODY_MOTIONS, kinetic_shares, mode_name
from exugear.system.statics import linearise
from fe_ste.tools.arrays import Complexes, Floats, Integers
from fe_ste.tools.display import ReprMixin
from fe_ste.tools.threads import side_by_side

if TYPE_CHECKING:
    import xarray as xr

Found: TypeAlias = tuple[Complexes, Complexes, Complexes]
"""Eigenvalues (n,), right and left shapes (n, 2 size), as `exugear.steady.mean_system.mean_system` gives them."""
CLEAR = 0.8
"""MAC from which two modes are taken for one without a look in between."""
LEAST = 0.05
"""MAC below which two modes are none."""
COUNT, MOST = 9, 33
"""Even speeds to begin with, and speeds at most."""
NARROWEST = 1.0 / 512.0
"""Share of the range below which a step is not halved, and a veering is a crossing."""


@dataclass(frozen=True, eq=False)
class ModeTracks:
    """Modes over speed; n speeds, m modes in the order of their frequency."""

    speeds: Floats
    """(n,) ascending, rad/s."""
    eigenvalues: Complexes
    """(n, m) 1/s; NaN where a mode is none: beyond the highest frequency, or overdamped."""
    shapes: Complexes
    left: Complexes
    """(n, m, size) displacements, and the parts of left shapes that loads meet; zero where a mode is none."""

    @property
    def frequency(self) -> Floats:
        """Damped eigenfrequencies (n, m), Hz."""
        return self.eigenvalues.imag / (2.0 * np.pi)

    @property
    def damping(self) -> Floats:
        """Shares (n, m) of critical damping."""
        return np.asarray(-self.eigenvalues.real / np.abs(self.eigenvalues))

    @property
    def least_damping(self) -> float:
        """Lowest share of critical damping of a mode at any speed; 0 without a mode, or where one is not damped."""
        lowest = float(np.fmin.reduce(self.damping, axis=None, initial=np.inf))
        return max(lowest, 0.0) if math.isfinite(lowest) else 0.0


def assurance(one: Found, other: Found) -> Floats:
    """MAC (n, m) of modes of one system with those of another that differs little."""
    return np.asarray(np.abs((one[2] @ other[1].T) * (other[2] @ one[1].T).T))


def mode_tracks(modes_at: Callable[[float], Found], low: float, high: float) -> ModeTracks:
    """Follow modes from one speed to another.

    Parameters
    ----------
    modes_at : from a speed (rad/s) to the modes there
    low, high : ends of the range, rad/s

    Examples
    --------
    A mode that hardens with speed passes one that does not:

    >>> from exugear.steady.mean_system.mean_system import vibrations
    >>> tracks = mode_tracks(
    ...     lambda w: vibrations(np.eye(2), np.zeros((2, 2)), np.diag([100.0, 50.0 + w**2])), 0.0, 20.0
    ... )
    >>> (2.0 * np.pi * tracks.frequency[[0, -1]]).round(3)
    array([[10.   ,  7.071],
           [10.   , 21.213]])
    """
    even = np.linspace(low, high, COUNT).tolist()
    found = dict(zip(even, side_by_side(modes_at, even), strict=True))
    narrowest = NARROWEST * abs(high - low)

    @cache
    def clarity(a: float, b: float) -> float:
        """Clarity of the step between two speeds."""
        return _clarity(found[a], found[b], narrowest / (b - a))

    while len(found) < MOST:
        speeds = sorted(found)
        steps = [(clarity(a, b), 0.5 * (a + b)) for a, b in itertools.pairwise(speeds) if b - a > narrowest]
        unclear = min(steps, default=(1.0, 0.0))
        if unclear[0] >= CLEAR:
            break
        found[unclear[1]] = modes_at(unclear[1])
    speeds = sorted(found)
    return _joined(np.array(speeds), [found[speed] for speed in speeds])


def _matches(values: Floats) -> tuple[Integers, Integers, Floats]:
    """Pairs of modes that are one, each used once so that the sum of the MAC (n, m) is largest, and their MAC."""
    import scipy.optimize  # a quarter of a second that others need not wait

    rows, columns = scipy.optimize.linear_sum_assignment(values, maximize=True)
    kept = values[rows, columns] >= LEAST
    rows = rows[kept]
    columns = columns[kept]
    return rows, columns, values[rows, columns]


def _clarity(one: Found, other: Found, narrowest: float) -> float:
    """Minimum MAC for modes to be matched across a step, or less than `CLEAR` where a veering may be hidden in it."""
    whole = assurance(one, other)
    rows, columns, values = _matches(whole)
    before, after = (modes[0][places].imag for modes, places in ((one, rows), (other, columns)))
    far = np.triu(np.subtract.outer(before, before), 1)
    near = np.triu(np.subtract.outer(after, after), 1)
    first, second = np.nonzero(far * near < 0.0)
    apart = np.abs(far[first, second]), np.abs(near[first, second])
    cross = whole[rows[first], columns[second]]
    share = 2.0 * np.sqrt(cross) / (1.0 / apart[0] + 1.0 / apart[1]) / (apart[0] + apart[1])
    hidden = share[share > narrowest].max(initial=0.0)
    clear = float(values.min(initial=1.0))
    return min(clear, CLEAR * (1.0 - min(1.0, float(hidden)))) if hidden else clear


def _joined(speeds: Floats, found: list[Found]) -> ModeTracks:
    """Tracks from modes at each speed, in the order of their mean frequency."""
    places = [list(range(len(found[0][0])))]
    count = len(found[0][0])
    for before, after in itertools.pairwise(found):
        rows, columns, _ = _matches(assurance(before, after))
        tracks = dict(zip(columns.tolist(), (places[-1][row] for row in rows), strict=True))
        new = [n for n in range(len(after[0])) if n not in tracks]
        tracks |= {n: count + number for number, n in enumerate(new)}
        count += len(new)
        places.append([tracks[n] for n in range(len(after[0]))])
    size = found[0][1].shape[1] // 2
    eigenvalues = np.full((len(speeds), count), complex(np.nan, np.nan))
    shapes, partners = np.zeros((2, len(speeds), count, size), dtype=np.complex128)
    for n, (place, (values, right, left)) in enumerate(zip(places, found, strict=True)):
        eigenvalues[n, place], shapes[n, place], partners[n, place] = values, right[:, :size], left[:, size:]
    order = np.argsort(np.nanmean(eigenvalues.imag, axis=0)) if count else np.zeros(0, dtype=np.int64)
    return ModeTracks(speeds, eigenvalues[:, order], shapes[:, order], partners[:, order])


# Description of modes: types of planetary sets, moving parts, whirl

KINDS = ("rotational", "translational", "planet")
"""Types of modes of a planetary set."""
MIXED = "mixed"
"""Neither: anisotropic bearings, or gears outside the set, couple its multi-blade components."""
OF_SET, OF_PLANETS, OF_KIND = 0.5, 0.1, 0.8
"""Minimum shares of the kinetic energy: of a set for a mode to be one of its own, of the planets for the mode to be
named by type, and of one type within the set."""
LATERAL = 0.01
"""Minimum share of the kinetic energy in lateral and tilting motion of rotating bodies for whirl to be reported."""
TURNING = tuple(BODY_MOTIONS.index(name) for name in ("spin", "axial", "twist", "stretch"))
"""Motions of a central body in rotational modes; all others are those of translational ones."""


class ModeNamer:
    """Names the modes of the averaged system; its elements are linearised once, about the static state at one speed.

    Parameters
    ----------
    speed : of the input, rad/s
    """

    def __init__(self, system: MeanSystem, speed: float) -> None:
        self.system, frame = system, system.frame
        self.assembly, self._turn = frame.assembly, frame.matrices(0.0)[0]
        self._q = frame.state(0.0, speed, system.static_at(speed))[0]
        self._elements = linearise(self.assembly, self._q, frame.mean_meshes).stiffness
        self._senses = {name: float(np.sign(ratio * speed)) for name, ratio in frame.speeds.items()}

    def named(self, shape: Complexes) -> tuple[str, str]:
        """Return kind and name of a shape (size,) of the averaged system.

        The kind is one of `KINDS`, `MIXED`, or empty where no planet set carries the mode; with the carrier where there
        are several. The name has the kinetic energy by body and the strain energy by element.
        """
        # Kinetic energy of the real and imaginary part by body and motion, weighted by their energy.
        parts = (shape.real, shape.imag)
        energies = [float(part @ self.system.mass @ part) for part in parts]
        kinetic = np.zeros((len(self.assembly.bodies), len(BODY_MOTIONS)))
        for part, energy in zip(parts, energies, strict=True):
            if energy > 0.0:
                own = kinetic_shares(self.assembly, (self._turn @ part)[:, None], self._q)[0]
                kinetic += energy / sum(energies) * own
        moved = self._turn @ shape
        strain = np.array([float((moved.conj() @ k @ moved).real) for k in self._elements.values()])
        share = strain / max(float(strain.sum()), 1e-300)
        return self._kind(shape, kinetic), mode_name(self.assembly, tuple(self._elements), kinetic, share)

    def whirl(self, shape: Complexes) -> float:
        """Sense of the whirl of a shape (size,), bodies by their lateral and tilting energy.

        It is 1 for a circular orbit in the sense of rotation of the body, -1 against it, 0 for a straight orbit and
        where radial motion of rotating bodies is negligible.
        """
        circling = total = 0.0
        energy = np.diag(self.system.mass)
        for body in self.assembly.bodies:
            index = self.assembly.coordinates[body.name]
            if body.carrier is not None:
                continue
            for x, y in ((index[UX], index[UY]), (index[TILT_X], index[TILT_Y])):
                if min(x, y) >= 0:
                    circling += self._senses.get(body.name, 0.0) * energy[x] * circle(shape[x], shape[y])
                    total += energy[x] * (abs(shape[x]) ** 2 + abs(shape[y]) ** 2)
        whole = float((shape.conj() @ self.system.mass @ shape).real)
        if total > LATERAL * whole:
            return float(circling / total)
        return 0.0

    def _kind(self, shape: Complexes, kinetic: Floats) -> str:
        sets = [planets for planets in self.system.frame.sets if not planets.is_single]
        shares = [(planets, self._motion_shares(planets, shape, kinetic)) for planets in sets]
        if not shares:
            return ""
        planets, (of_planets, own) = max(shares, key=lambda item: float(item[1][1].sum()))
        if own.sum() < OF_SET or of_planets < OF_PLANETS:
            return ""
        most = int(np.argmax(own))
        kind = KINDS[most] if own[most] >= OF_KIND * own.sum() else MIXED
        return kind if len(sets) == 1 else f"{kind} of {planets.carrier}"

    def _motion_shares(self, planets: PlanetSet, shape: Complexes, kinetic: Floats) -> tuple[float, Floats]:
        """Share of the planets of a set, and shares (3,) of the set by type of motion."""
        places = {body.name: n for n, body in enumerate(self.assembly.bodies)}
        # The coordinates of planet n hold multi-blade component n.
        energies = []
        for name in planets.names:
            index = [i for i in self.assembly.coordinates[name] if i >= 0]
            motion = shape[index]
            energies.append(float((motion.conj() @ self.system.mass[np.ix_(index, index)] @ motion).real))
        waves = np.array(energies)
        by_kind = np.array([waves[0], waves[1:3].sum(), waves[3:].sum()])
        of_planets = float(sum(kinetic[places[name]].sum() for name in planets.names))
        shares = of_planets * by_kind / max(float(by_kind.sum()), 1e-300)
        meshing = [{element.mesh.pinion, element.mesh.gear} for element in self.assembly.elements]
        central = {planets.carrier}.union(*(ends for ends in meshing if ends & set(planets.names)))
        for name in central - set(planets.names):
            if name in places:
                turning = float(kinetic[places[name], TURNING].sum())
                shares[:2] += turning, float(kinetic[places[name]].sum()) - turning
        return of_planets, shares


def circle(x: complex, y: complex) -> float:
    """Product of the axes of an ellipse x, y, twice: ``|x|^2 + |y|^2`` for a circle from x to y, negative against it.

    Examples
    --------
    >>> circle(1.0, -1j), circle(1.0, 1j), circle(1.0, 2.0)
    (2.0, -2.0, 0.0)
    """
    return float(0.0 - 2.0 * (np.conj(x) * y).imag)


_VARIABLES: dict[str, tuple[str, tuple[str, ...], dict[str, str]]] = {
    "campbell_speed": ("speeds", ("campbell_point",), {"units": "rad/s", "long_name": "speed of the overall input"}),
    "mode_frequency": (
        "frequency",
        ("campbell_point", "mode"),
        {"units": "Hz", "long_name": "as seen from the housing"},
    ),
    "mode_damping": ("damping", ("campbell_point", "mode"), {"units": "1", "long_name": "share of critical damping"}),
    "mode_whirl": (
        "whirl",
        ("campbell_point", "mode"),
        {"units": "1", "long_name": "1 forward whirl, -1 backward whirl"},
    ),
    "mode_over_angle": (
        "over_angle",
        ("mode", "bound"),
        {"units": "1", "long_name": "lowest and highest over the carrier's angle, over that at zero angle"},
    ),
    "mode_kind": ("kinds", ("mode",), {}),
    "mode_name": ("names", ("mode",), {}),
}
"""Fields of a diagram by the variables of a file that holds it, with their dimensions and attributes."""
LAYOUT = {name: over for name, (_, over, _) in _VARIABLES.items()}
"""Variables of a file that holds a diagram."""
SAME_FREQUENCY = 0.02
"""Share of a frequency within which a mode is the one that a crossing was found at."""


@dataclass(frozen=True, eq=False)
class Campbell(ReprMixin, line=": {names!n} modes at {speeds!n} speeds"):
    """Modes over speed; n speeds, m modes."""

    speeds: Floats
    """(n,) of the overall input, ascending, rad/s."""
    frequency: Floats
    damping: Floats
    whirl: Floats
    """(n, m) Hz as seen from the housing, share of critical damping, and sense of the whirl as of `ModeNamer.whirl`;
    NaN where a mode is none."""
    over_angle: Floats
    """(m, 2) lowest and highest frequency over the angle of the carrier, over that at zero angle, as
    `frequencies_over_angle` finds them."""
    kinds: tuple[str, ...]
    names: tuple[str, ...]
    """As of `ModeNamer.named`, at the fastest speed."""

    def mode_at(self, speed: float, frequency: float) -> int | None:
        """Find the mode that has a frequency (Hz) at a speed (rad/s), None where none is near."""
        if not len(self.names):
            return None
        own = np.array([np.interp(speed, self.speeds, column) for column in self.frequency.T])
        apart = np.where(np.isnan(own), np.inf, np.abs(own - frequency))
        nearest = int(np.argmin(apart))
        if apart[nearest] <= SAME_FREQUENCY * frequency:
            return nearest
        return None

    def variables(self) -> dict[str, tuple[tuple[str, ...], Any, dict[str, str]]]:
        """Arrays with dimensions and units, as files hold them."""
        found = {}
        for name, (field, over, attributes) in _VARIABLES.items():
            own = getattr(self, field)
            found[name] = over, np.array(own, dtype=object) if isinstance(own, tuple) else own, attributes
        return found


def modes_over_speed(system: MeanSystem, low: float, high: float, highest: float) -> ModeTracks:
    """Follow the modes of an averaged system between two speeds of the input (rad/s), up to a frequency (Hz)."""

    def modes_at(speed: float) -> Found:
        values, right, left = mean_modes(system, speed)
        kept = values.imag <= 2.0 * np.pi * highest
        return values[kept], right[kept], left[kept]

    return mode_tracks(modes_at, low, high)


def frequencies_over_angle(system: MeanSystem, tracks: ModeTracks) -> Floats:
    """Lowest and highest frequency of modes (m, 2) over the angle of the carrier, over that at zero angle.

    The stiffness of a flexible ring gear differs from place to place, and that of planets which are not alike with
    their places: frequencies vary as the planets pass. They are those with the carrier held at angles spread over a
    planet passage, at the middle one of the speeds. Modes that depend on one angle do not cross (von Neumann and Wigner
    1929): the n-th frequency at each angle is that of one mode, whose shape turns with the planets. Both are 1 where
    stiffness does not vary.
    """
    found = np.ones((tracks.frequency.shape[1], 2))
    if not system.over_angles:
        return found
    middle = len(tracks.speeds) // 2
    speed = float(tracks.speeds[middle])
    held = side_by_side(lambda one: mean_modes(one, speed)[0].imag, list(system.at_angles()))
    if not len(held[0]):
        return found
    # Rolling is free at zero angle. Elsewhere the state is not quite the static one, which gives it a low frequency.
    held = [values[values > 0.5 * held[0][0]] for values in held]
    count = min(map(len, held))
    over_zero = np.array([values[:count] / held[0][:count] for values in held])
    own = tracks.eigenvalues[middle].imag
    for mode in np.flatnonzero(~np.isnan(own)).tolist():
        place = int(np.argmin(np.abs(held[0] - own[mode])))
        if place < count:
            found[mode] = over_zero[:, place].min(), over_zero[:, place].max()
    return found


def campbell_of(system: MeanSystem, tracks: ModeTracks) -> Campbell:
    """Campbell diagram of the modes of an averaged system with the carrier held at zero angle, followed over speed."""
    frozen = system.frozen
    low = tracks.speeds[0]
    high = tracks.speeds[-1]
    namer = ModeNamer(frozen, high if abs(high) > abs(low) else low)
    whirl = np.full(tracks.frequency.shape, np.nan)
    for n, m in zip(*np.nonzero(~np.isnan(tracks.frequency)), strict=True):
        whirl[n, m] = namer.whirl(tracks.shapes[n, m])
    # Modes are named at the fastest speed at which they are found.
    found_at = np.where(np.isnan(tracks.frequency), -1.0, np.abs(tracks.speeds)[:, None])
    named = [namer.named(tracks.shapes[n, m]) for m, n in enumerate(found_at.argmax(axis=0))]
    return Campbell(
        tracks.speeds,
        tracks.frequency,
        tracks.damping,
        whirl,
        frequencies_over_angle(system, tracks),
        tuple(kind for kind, _ in named),
        tuple(name for _, name in named),
    )


def campbell_from(data: xr.Dataset) -> Campbell:
    """Read a diagram from the dataset of a file that holds one."""
    values: dict[str, Any] = {field: data[name].to_numpy() for name, (field, _, _) in _VARIABLES.items()}
    return Campbell(**values | {field: tuple(map(str, values[field])) for field in ("kinds", "names")})
