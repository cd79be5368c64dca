"""Signals of a steady-state response: transmission errors, forces, torques, speeds, accelerations, surface velocity.

Bearings of planets have multi-blade components, along radius and tangent, as the planets themselves.

The amplitude of a force or an acceleration on an order is the largest magnitude of its vector, whose tip moves along an
ellipse. For planets it is the rms value over the planets. Of several bearings the largest counts.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from exugear.steady.harmonics.branches import STANDS, peaks_of_lines
from exugear.steady.mean_system.mean_system import RATE_STEP, MeanSystem, place_step
from exugear.steady.mean_system.mesh_waves import MeshWaves, wave_name
from exugear.steady.mean_system.planet_sets import PlanetSet
from exugear.steady.mean_system.rotating_frame import RotatingFrame
from exugear.steady.mean_system.standing_loads import (
    GEAR_FORCE,
    GEAR_MOMENT,
    REACTION_FORCE,
    REACTION_MOMENT,
    moment_supports,
    reacting_excitations,
    standing_gears,
)
from exugear.system.kernels.coordinates import TILT
from exugear.system.modes import overall_row
from exugear.system.signals import coupling_rows, turning_bodies
from exugear.system.system import Assembly
from fe_ste.tools.arrays import Booleans, Complexes, Floats, Integers, SingleComplexes

AXES = ("x", "y", "z")
PLANET_AXES = ("radial", "tangential", "z")


@dataclass(frozen=True)
class SignalName:
    """A signal of the steady response."""

    name: str
    """``quantity``, or ``quantity of what, which part``."""
    quantity: str
    units: str


SURFACE_VELOCITY = SignalName("surface_velocity", "surface_velocity", "m/s")
"""Normal velocity of the outer surface of a flexible housing, root mean square over the surface, without a phase."""


COUPLING_TORQUE = SignalName("coupling_torque", "coupling_torque", "N m")
"""Torque of a coupling by its spring and damper, positive where it accelerates the first body about +z."""
BODY_SPEED = SignalName("body_speed", "body_speed", "rad/s")
"""Fluctuation of the speed of a body about its mean, about +z; of a flexible body at its main seat."""


SUPPORT_MOMENT = "support_moment"
"""Moment of a bearing on its body, about its seat, where the other body stands still."""


@dataclass(frozen=True, eq=False)
class SignalRows:
    """Rows that give signals from the motion u at one speed of the input: (A + i w B - w^2 C) u."""

    names: tuple[SignalName, ...]
    """Of these rows: overall transmission error, bearing forces, seat accelerations, moments, coupling torques,
    speeds."""
    by_place: Floats
    by_rate: Floats
    by_acceleration: Floats
    """(signals, size)"""

    def of(self, motion: Complexes, frequencies: Floats) -> Complexes:
        """Coefficients (lines, signals) of the signals of a motion (lines, size) at angular frequencies."""
        w = 1j * frequencies[:, None]
        # Rows are real, and most have one part or two: products with the real numbers of the motion in those.
        parts = np.concatenate([motion.real, motion.imag])
        lines = len(motion)
        found = np.zeros((lines, len(self.names)), dtype=np.complex128)
        for factor, rows in ((1.0, self.by_place), (w, self.by_rate), (w**2, self.by_acceleration)):
            own = np.flatnonzero(rows.any(axis=1))
            values = parts @ rows[own].T
            found[:, own] += factor * (values[:lines] + 1j * values[lines:])
        return found


def mesh_signal_names(waves: MeshWaves) -> tuple[SignalName, ...]:
    """Names of errors and forces of the meshes, of loads of gears and of reactions of excitations.

    There are forces of as many waves as there are planets.
    """
    errors = tuple(SignalName(f"mesh_dte {wave.name}", "mesh_dte", "m") for wave in waves.waves)
    forces = tuple(SignalName(f"mesh_force {waves.waves[n].name}", "mesh_force", "N") for n in waves.force_waves)
    standing = [(GEAR_FORCE, GEAR_MOMENT, gear) for gear in standing_gears(waves.system.frame)]
    reacting = reacting_excitations(waves.assembly.gearbox)
    standing += [(REACTION_FORCE, REACTION_MOMENT, excitation) for excitation in reacting]
    loads = tuple(
        SignalName(f"{quantity} {name} {axis}", quantity, units)
        for force, moment, name in standing
        for quantity, units in ((force, "N"), (moment, "N m"))
        for axis in AXES
    )
    return (*errors, *forces, *loads)


def signal_rows(system: MeanSystem, speed: float) -> SignalRows:
    """Rows of the signals that follow from the motion, at a speed of the input (rad/s)."""
    frame = system.frame
    assembly = system.frame.assembly
    t, t1, t2 = frame.matrices(0.0)
    none = np.zeros(assembly.size)
    found: list[tuple[SignalName, Floats, Floats, Floats]] = []

    def add(names: Sequence[SignalName], *parts: Floats) -> None:
        """Add rows by place, rate and acceleration, (names, size) or the same for all."""
        found.extend(zip(names, *(np.broadcast_to(own, (len(names), assembly.size)) for own in parts), strict=True))

    add([SignalName("overall_dte", "overall_dte", "m")], overall_row(assembly) @ t, none, none)
    if assembly.supports:
        turn, labels = support_waves(assembly, frame.sets)
        # Bearings of planets that are not alike count by their mean here; `varying_bearings` has the rest.
        unlike = any(frame.varying_bearings(name).size for name in frame.varying_carriers)
        if unlike:
            by_place, by_rate = frame.mean(lambda own, psi: _load_rows(system, own, speed, psi))
        else:
            by_place, by_rate = _load_rows(system, frame, speed, 0.0)
        count = 3 * len(assembly.supports)
        seats = turn @ _seat_rows(assembly)
        forces = [SignalName(f"support_force {label}", "support_force", "N") for label in labels]
        add(forces, by_place[:count], by_rate[:count], none)
        accelerations = [SignalName(f"seat_acceleration {label}", "seat_acceleration", "m/s2") for label in labels]
        add(accelerations, speed**2 * seats @ t2, 2.0 * speed * seats @ t1, seats @ t)
        standing = moment_supports(assembly)
        moments = [
            SignalName(f"{SUPPORT_MOMENT} {assembly.supports[n].name} {axis}", SUPPORT_MOMENT, "N m")
            for n in standing
            for axis in AXES
        ]
        of_standing = (count + 3 * standing[:, None] + np.arange(3)).ravel()
        add(moments, by_place[of_standing], by_rate[of_standing], none)
    twisting, winding = coupling_rows(assembly)
    add([_part(COUPLING_TORQUE, name) for name in assembly.spring_names], twisting @ t, winding @ t, none)
    turning = turning_bodies(assembly.gearbox, assembly.spin)
    add([_part(BODY_SPEED, name) for name in turning], none, t[[assembly.spin[name] for name in turning]], none)
    names, place, rate, acceleration = zip(*found, strict=True)
    return SignalRows(names, np.array(place), np.array(rate), np.array(acceleration))


def _part(signal: SignalName, name: str) -> SignalName:
    """Name a signal of a part."""
    return SignalName(f"{signal.name} {name}", signal.quantity, signal.units)


def _load_rows(system: MeanSystem, frame: RotatingFrame, speed: float, psi: float) -> Floats:
    """Return `_loads`, forces in multi-blade components, by coordinates and rates of the frame, (2, 6 s, size)."""
    assembly = frame.assembly
    t, t1, _ = frame.matrices(psi)
    q, v, _ = frame.state(psi, speed, system.static_at(speed))
    step = place_step(assembly)
    changes = np.eye(assembly.size)
    by_q = _loads(assembly, q + step * changes, v) - _loads(assembly, q - step * changes, v)
    by_v = _loads(assembly, q, v + RATE_STEP * changes) - _loads(assembly, q, v - RATE_STEP * changes)
    by_q, by_v = by_q.T / (2.0 * step), by_v.T / (2.0 * RATE_STEP)
    turn = support_waves(assembly, frame.sets, psi)[0]
    for values in (by_q, by_v):
        values[: len(turn)] = turn @ values[: len(turn)]
    return np.array([by_q @ t + speed * by_v @ t1, by_v @ t])


def _loads(assembly: Assembly, q: Floats, v: Floats) -> Floats:
    """Return forces (N), then moments (N m), on the bodies of all supports along the global axes, (..., 6 supports)."""
    q, v = np.broadcast_arrays(q, v)
    loads = -assembly.bearing_loads(q, v)
    return np.concatenate([loads[..., part].reshape(*q.shape[:-1], -1) for part in (slice(0, 3), slice(3, 6))], axis=-1)


def carried_seats(assembly: Assembly) -> dict[str, bool]:
    """Return for each bearing, planets' by family, whether its seat's acceleration is that of the supporting body.

    This applies where the supporting body is flexible, such as a housing; otherwise it is the acceleration of the
    shaft.
    """
    mounts = mount_names(assembly)
    carried = zip(assembly.supports, _carried(assembly), strict=True)
    return {support.family: own for support, own in carried if support.name not in mounts}


def mount_names(assembly: Assembly) -> tuple[str, ...]:
    """Return the names of the supports that are mounts; all others are bearings."""
    mounts = {mount.name for mount in assembly.gearbox.mounts}
    return tuple(support.name for support in assembly.supports if support.name in mounts)


def _carried(assembly: Assembly) -> list[bool]:
    starts = assembly.connectors.bodies
    return [
        bool(starts[n][0] >= 0 and support.on in assembly.elastic_bodies) for n, support in enumerate(assembly.supports)
    ]


def _seat_rows(assembly: Assembly) -> Floats:
    """Displacement of the seat of each support by the coordinates, (3 supports, size).

    The seat is that in the housing where it is elastic, else that on the body.
    """
    rows = np.zeros((3 * len(assembly.supports), assembly.size))
    carried = _carried(assembly)
    for n, (starts, local) in enumerate(zip(assembly.connectors.bodies, assembly.connectors.local, strict=True)):
        end = 0 if carried[n] or starts[1] < 0 else 1
        if starts[end] < 0:
            continue
        x, y, z = local[end]
        row = rows[3 * n : 3 * n + 3, starts[end] : starts[end] + TILT + 2]
        row[:, :3] = np.eye(3)
        row[:, TILT:] = [[0.0, z], [-z, 0.0], [y, -x]]
    return rows


def support_waves(assembly: Assembly, sets: tuple[PlanetSet, ...], psi: float = 0.0) -> tuple[Floats, list[str]]:
    """Matrix from values along global axes (3 supports,) to waves along radius and tangent, and what they are.

    The input has turned by the angle psi, rad.
    """
    count = len(assembly.supports)
    turn = np.eye(3 * count)
    labels = [f"{support.name} {axis}" for support in assembly.supports for axis in AXES]
    for planets in sets:
        families = sorted({support.family for support in assembly.supports if support.body in planets.names})
        for family in families:
            names = [
                n
                for body in planets.names
                for n, support in enumerate(assembly.supports)
                if support.body == body and support.family == family
            ]
            if len(names) != planets.waves:
                continue
            inverse = np.linalg.inv(planets.shapes(psi)[0])
            c = np.cos(planets.ratio * psi + planets.angles)
            s = np.sin(planets.ratio * psi + planets.angles)
            radial = np.stack(
                [np.stack([c, s, 0 * c], 1), np.stack([-s, c, 0 * c], 1), np.stack([0 * c, 0 * c, 1 + 0 * c], 1)], 1
            )
            for wave, at in enumerate(names):
                for axis in range(3):
                    row = np.zeros(3 * count)
                    for n, support in enumerate(names):
                        row[3 * support : 3 * support + 3] = inverse[wave, n] * radial[n, axis]
                    turn[3 * at + axis] = row
                    place = f"{family} {wave_name(wave, planets.waves)}"
                    if planets.is_single:
                        place = assembly.supports[at].name
                    labels[3 * at + axis] = f"{place} {PLANET_AXES[axis]}"
    return turn, labels


MEAN_OF_OTHERS = 0.5
"""Mean square over the planets of each multi-blade component, except for the common one."""
ALTERNATING = "alternating"
"""The wave that changes its sign from planet to planet: its square is the same at all."""


def vector_peak(components: Complexes) -> Floats:
    """Return the largest magnitude (...) of vectors whose components (..., axes) oscillate at one frequency.

    The tip of Re(a exp(i w t)) moves along an ellipse. The square of its larger semi-axis is half of the sum of squares
    of the components' magnitudes plus half of the magnitude of the sum of their squares. The root of the first sum
    alone exceeds it by up to a factor of sqrt(2), for a vector that rotates.

    Examples
    --------
    A rotating vector, and one along a fixed line:

    >>> vector_peak(np.array([[1.0, 1.0j, 0.0], [3.0, 4.0, 0.0]]))
    array([1., 5.])
    """
    squares = (np.abs(components) ** 2).sum(axis=-1)
    return np.asarray(np.sqrt(0.5 * (squares + np.abs((components**2).sum(axis=-1)))))


@dataclass(frozen=True, eq=False)
class Quantity:
    """One of the quantities, and what it is made of."""

    name: str
    """One of `SIGNALS`."""
    units: str
    places: tuple[str, ...]
    """Bearings or mounts, of planets their family; of the transmission error one place without a name."""
    signals: tuple[Integers, ...]
    """(waves, axes) signals of each place."""
    weights: tuple[Floats, ...]
    """(waves,) mean square over the planets of each multi-blade component."""

    def components(self, amplitude: Complexes | SingleComplexes, place: int) -> Complexes:
        """Return the complex amplitudes (..., waves * axes) of a place from those of all signals (..., signals)."""
        return np.asarray(amplitude[..., self.signals[place].ravel()], dtype=np.complex128)

    def size(self, components: Complexes, place: int) -> Floats:
        """Return the amplitude (...) of a place from its `components`."""
        vectors = components.reshape(*components.shape[:-1], *self.signals[place].shape)
        return np.asarray(np.sqrt(vector_peak(vectors) ** 2 @ self.weights[place]))

    def sizes(self, amplitude: Complexes | SingleComplexes) -> Floats:
        """Return the amplitudes (..., places) from the complex amplitudes (..., signals) of all signals."""
        return np.stack([self.size(self.components(amplitude, n), n) for n in range(len(self.places))], axis=-1)

    def peaks(
        self, sizes: Floats, counted: Booleans | bool = True, prominence: float = STANDS
    ) -> list[tuple[int, int]]:
        """Return point and line of the peaks over speed of amplitudes, the highest first, without those of round-off.

        The latter are measured by the highest peak and by the highest order at their speed: one that turns the gear
        train as a whole is no peak, but limits the accuracy of others.

        Parameters
        ----------
        sizes : (points, lines) amplitudes
        counted : (points, lines), or of a shape that fits, which peaks count
        prominence : see `exugear.steady.harmonics.branches.standing_peaks`
        """
        counts = np.broadcast_to(counted, sizes.shape)
        found = [peak for peak in peaks_of_lines(sizes, prominence) if counts[peak]]
        if not found:
            return []
        points, lines = np.transpose(found)
        heights = sizes[points, lines]
        highest = float(heights.max())
        least = np.array([round_off(self.name, max(highest, float(top))) for top in np.fmax.reduce(sizes, axis=1)])
        descending = np.argsort(-heights, kind="stable")
        return [found[n] for n in descending[(heights > least[points])[descending]]]


SIGNALS = {
    "error": ("overall_dte", "m"),
    "force": ("support_force", "N"),
    "acceleration": ("seat_acceleration", "m/s2"),
    "mount_acceleration": ("seat_acceleration", "m/s2"),
    "surface_velocity": ("surface_velocity", "m/s"),
}
"""Signals of each quantity and their units."""
ROUND_OFF = {
    "error": 1e-12,
    "force": 1e-6,
    "acceleration": 1e-9,
    "mount_acceleration": 1e-9,
    "surface_velocity": 1e-12,
}
"""Amplitudes up to which nothing vibrates, in the units of the quantities."""
RELATIVE_ROUND_OFF = 1e-6
"""Share of the highest peak of a quantity up to which a peak may come from the accuracy of the solution: the harmonic
balance of forces in time is solved to 1e-8 of the static deflections."""


def round_off(quantity: str, highest: float) -> float:
    """Return the amplitude of a quantity up to which nothing vibrates, where its highest one is known."""
    return max(ROUND_OFF[quantity], RELATIVE_ROUND_OFF * highest)


def quantities_of(names: Sequence[str], mounts: Collection[str]) -> tuple[Quantity, ...]:
    """Find the quantities among signals; a gearbox without bearings or mounts has no forces and accelerations there.

    Parameters
    ----------
    names : of the signals, as `exugear.steady.mean_system.signals.SignalName` has them
    mounts : names of the mounts of the housing; all other supports are bearings

    Examples
    --------
    >>> names = ["overall_dte", *(f"support_force pin_a{wave} radial" for wave in (" mean", " cosine", " sine"))]
    >>> error, force = quantities_of(names, ())
    >>> force.places, float(force.sizes(np.array([0.0, 3.0, 4.0, 4.0]))[0])
    (('pin_a',), 5.0)
    """
    found = []
    for quantity, (signal, units) in SIGNALS.items():
        places: dict[str, dict[str, list[int]]] = {}
        for at, name in enumerate(names):
            kind, _, rest = name.partition(" ")
            place, *wave = rest.split(" ")[:-1] or [""]
            if kind == signal and (
                quantity in ("error", "surface_velocity") or (place in mounts) == quantity.startswith("mount")
            ):
                places.setdefault(place, {}).setdefault(" ".join(wave), []).append(at)
        if places:
            signals = tuple(np.array([*waves.values()]) for waves in places.values())
            weights = tuple(
                np.array([1.0 if wave in ("", "mean", ALTERNATING) else MEAN_OF_OTHERS for wave in waves])
                for waves in places.values()
            )
            found.append(Quantity(quantity, units, tuple(places), signals, weights))
    return tuple(found)


def named_amplitudes(names: Sequence[str], amplitude: Complexes | SingleComplexes, signal: str) -> Floats | None:
    """Return the amplitudes of a signal from those of all signals (..., signals); None for an unknown name.

    The name of a bearing without a direction, such as ``support_force left``, stands for the radial amplitude: the
    largest magnitude of the radial vector, of planets the rms value over them.

    Examples
    --------
    >>> names = ["overall_dte", *(f"support_force left {axis}" for axis in AXES)]
    >>> float(named_amplitudes(names, np.array([0.0, 3.0, 4.0, 9.0]), "support_force left"))
    5.0
    """
    if signal in names:
        return np.abs(amplitude[..., list(names).index(signal)].astype(np.complex128))
    radial = [n for n, name in enumerate(names) if not name.endswith(f" {AXES[2]}")]
    kind, _, place = signal.partition(" ")
    for quantity in quantities_of([names[n] for n in radial], ()):
        if SIGNALS[quantity.name][0] == kind and place in quantity.places:
            sizes = quantity.sizes(amplitude[..., radial])
            return np.asarray(sizes[..., quantity.places.index(place)])
    return None
