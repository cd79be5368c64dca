"""The compiled solver: an assembly's equations integrated by the classical Runge-Kutta method without Exudyn.

Same coordinates and same laws as the Exudyn system built from the same assembly (see `exugear.equations`), so that
the trajectories differ by round-off only, a hundred times faster.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from exugear.assembly import Assembly
from exugear.channels import Channels
from exugear.elastic import elastic_motion, scratch_for
from exugear.equations import (
    Bodies,
    Connectors,
    Equations,
    Joints,
    Loads,
    Meshes,
    Springs,
    Work,
    advance,
    evaluate,
    observe,
)
from exugear.gearbox import GROUND
from exugear.kernels import ConnectorArrays
from exugear.modes import Linearised, coordinate_labels, linearise, overall_row
from exugear.table_law import scratch_memory
from exugear.turning import turning_memory

Floats = NDArray[np.float64]

STABILITY_LIMIT = 2.6
"""Below this |lambda| h the method is stable for every damped motion, oscillating or creeping."""
STABLE = 2.0
"""Chosen |lambda| h at most: leaves room for k(PMC) at its peaks."""
ACCURATE = 1.02
"""Allowed w h at the top of the band: the response to an excitation there is then 0.15 % in error."""
RESONANCE_ERROR = 1e-3
"""Allowed error on the slope of a resonance, as a share of its peak."""
MEANT = 2.0 / 3.0
"""Share of elastic bodies' band up to which they vibrate as they should on bearings (`exugear.reduction`)."""
LIGHTEST_DAMPING = 2e-3
"""Damping ratio that lighter ones count as: an undamped resonance would ask for no error at all."""
ROUND_OFF = 1e-14
"""Entries of a bearing's matrix this small beside its diagonal are left-overs of rotating it, and left out."""


@dataclass(frozen=True)
class DriveLaw:
    """A machine that turns one body at an angle quadratic in time, behind a spring and damper.

    Attributes
    ----------
    body : name of the driven body
    stiffness, damping : N m/rad, N m s/rad
    angle : coefficients of 1, t, t^2; rad, rad/s, rad/s2
    """

    body: str
    stiffness: float
    damping: float
    angle: tuple[float, float, float]


@dataclass(frozen=True)
class LoadTable:
    """What acts from outside, as numbers: constant torques, torques linear between lines, a drive.

    Attributes
    ----------
    constant : torque by body about +z, N m
    series : by body times (s) and torques (N m)
    drive : optional
    """

    constant: Mapping[str, float] = field(default_factory=dict)
    series: Mapping[str, tuple[Floats, Floats]] = field(default_factory=dict)
    drive: DriveLaw | None = None


def refusal(assembly: Assembly) -> str:
    """Reason why the compiled solver cannot take a variant, empty if it can.

    Every body of an assembly is axially symmetric with its centre of mass on its axis and at its node, as the
    equations need it; what is left to refuse are constraints.
    """
    if assembly.variant == "jointed":
        return "the variant jointed keeps ideal joints as constraints, which an explicit method cannot solve"
    if assembly.floating:
        family = assembly.gearbox.body(next(iter(assembly.floating))).family
        return f"bodies.{family}.flexibility = 'ffrf' runs in Exudyn only, 'nonrotating' in both"
    return ""


def eigenvalues(assembly: Assembly) -> NDArray[np.complex128]:
    """Eigenvalues (1/s) of the system linearised at rest, mean mesh stiffness, damping included."""
    linear = linearise(assembly, np.zeros(assembly.size), assembly.linear_meshes())
    return scipy.linalg.eigvals(_free_motions(linear, assembly.motions)[1]).astype(np.complex128)


def _free_motions(linear: Linearised, free: Floats) -> tuple[Floats, Floats]:
    """Free motions of unit mass (size, n), and the matrix (2n, 2n) of the first-order equations of their amounts."""
    root = np.linalg.cholesky(linear.mass)
    basis = np.linalg.solve(root.T, scipy.linalg.orth(root.T @ free))
    size = free.shape[1]
    lower = np.hstack([-basis.T @ linear.total_stiffness @ basis, -basis.T @ linear.total_damping @ basis])
    return basis, np.vstack([np.eye(size, 2 * size, size), lower])


def highest_rate(assembly: Assembly) -> float:
    """Largest |eigenvalue|, rad/s: it decides whether a step is stable."""
    return float(np.abs(eigenvalues(assembly)).max())


def fastest_motion(assembly: Assembly) -> str:
    """Say in words what the largest |eigenvalue| belongs to: the body that moves, and what holds or damps it.

    Examples
    --------
    >>> from exugear.assembly import assemble
    >>> from exugear.gearbox import Gearbox
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> stiffness = {"sun_planet": 3.8e9, "ring_planet": 4.9e9, "intermediate": 3.1e9, "high_speed": 1.9e9}
    >>> fastest_motion(assemble(gearbox, "rigid", stiffness))
    'the fastest motion, 9.25e+03 rad/s, is of hss.spin against high_speed'
    """
    linear = linearise(assembly, np.zeros(assembly.size), assembly.linear_meshes())
    basis, matrix = _free_motions(linear, assembly.motions)
    values, vectors = scipy.linalg.eig(matrix)
    fastest = int(np.argmax(np.abs(values)))
    rate, shape = float(np.abs(values[fastest])), basis @ vectors[: basis.shape[1], fastest]
    moving = int(np.argmax(np.abs(shape) ** 2 * np.diag(linear.mass)))
    strained = {
        name: abs(shape.conj() @ (k + values[fastest] * linear.damping[name]) @ shape)
        for name, k in linear.stiffness.items()
    }
    holding = max(strained, key=lambda name: strained[name]) if strained else "nothing"
    return f"the fastest motion, {rate:.3g} rad/s, is of {coordinate_labels(assembly)[moving]} against {holding}"


def choose_step(assembly: Assembly, sample_rate: float, band: float) -> float:
    """Longest step (s) that divides the sampling interval, is stable, and keeps amplitudes up to `band` (Hz).

    The method answers an excitation of frequency w with a relative error of about 0.0015 (w h)^4, and shifts an
    eigenfrequency by (w h)^4 / 120, which on the slope of its resonance with the damping ratio zeta costs up to
    0.5 / zeta of that. Resonances count where they are meant: with elastic bodies up to two thirds of the frequency to
    which these are described exactly.

    Examples
    --------
    >>> from exugear.assembly import assemble
    >>> from exugear.gearbox import Gearbox
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> stiffness = {"sun_planet": 3.8e9, "ring_planet": 4.9e9, "intermediate": 3.1e9, "high_speed": 1.9e9}
    >>> choose_step(assemble(gearbox, "rigid", stiffness), sample_rate=20e3, band=6.4e3)
    2.5e-05
    """
    values = eigenvalues(assembly)
    rates = np.maximum(np.abs(values), 1e-9)
    ratio = np.maximum(-values.real / rates, LIGHTEST_DAMPING)
    meant = min(band, MEANT * assembly.gearbox.case.elasticity.band_Hz) if assembly.elastic_bodies else band
    resonant = rates < 2.0 * np.pi * meant
    slopes = (240.0 * ratio[resonant] * RESONANCE_ERROR) ** 0.25 / rates[resonant]
    longest = min(STABLE / rates.max(), ACCURATE / (2.0 * np.pi * band), slopes.min(initial=np.inf))
    return float(1.0 / (sample_rate * np.ceil(1.0 / (sample_rate * longest) - 1e-9)))


def unstable(rate: float, step: float) -> str:
    """Reason why a step (s) is not stable for a largest eigenvalue `rate` (rad/s), empty if it is.

    Examples
    --------
    >>> unstable(1e4, 2.5e-5)
    ''
    >>> unstable(2e5, 2.5e-5)
    'step = 2.5e-05 s is not stable: the fastest motion has 2e+05 rad/s; use 1e-05 s or less'
    """
    if step * rate <= STABILITY_LIMIT:
        return ""
    longest = STABLE / rate
    return f"step = {step:g} s is not stable: the fastest motion has {rate:.4g} rad/s; use {longest:.2g} s or less"


def extended_size(assembly: Assembly) -> int:
    """Count the coordinates with those of travelling seats."""
    return assembly.size + 6 * assembly.travelling.first.size


class _Numbers:
    """Numbering of bodies and of the coordinates whose sine is needed."""

    def __init__(self, assembly: Assembly) -> None:
        self.assembly = assembly
        self.size = extended_size(assembly)
        self.starts = [int(start) for start in assembly.inertia.body]
        # Of elastic bodies only seats in bearings turn anything out of their own coordinates.
        seats = np.setdiff1d(assembly.connectors.bodies, [-1, *self.starts])
        self.starts += [int(start) for start in seats]
        self.turning = [self.size]

    def body(self, start: int) -> int:
        """Find the number of the body that starts at a coordinate; the ground (-1) comes last."""
        return len(self.starts) if start < 0 else self.starts.index(start)

    def slot(self, coordinate: int) -> int:
        """Place of a coordinate's sine, taken up if it is new; 0 for none."""
        if coordinate < 0:
            return 0
        if coordinate not in self.turning:
            self.turning.append(coordinate)
        return self.turning.index(coordinate)


def _connectors(numbers: _Numbers) -> tuple[Connectors, NDArray[np.int64]]:
    """Connectors, and the slot of the sine of each body's spin where a connector needs it."""
    given = numbers.assembly.connectors
    ends = np.array([[numbers.body(int(s)) for s in pair] for pair in given.bodies], dtype=np.int64).reshape(-1, 2)
    order = np.lexsort((ends[:, 1], ends[:, 0])).astype(np.int64)
    given = ConnectorArrays._make(values[order] for values in given)
    ends = ends[order]
    slots = np.zeros(len(numbers.starts) + 1, dtype=np.int64)
    twisting = np.zeros(len(ends), dtype=np.int64)
    first, entries = [0], []
    for n, (i, j) in enumerate(ends):
        stiffness, damping = _without_round_off(given.stiffness[n]), _without_round_off(given.damping[n])
        twisting[(ends == ends[n]).all(axis=1)] |= stiffness[:, 5].any()
        for end, needed in ((i, True), (j, stiffness[:, 5].any() or given.local[n, 1, :2].any())):
            if needed and end < len(numbers.starts):
                slots[end] = numbers.slot(numbers.starts[end] + 5)
        places = np.argwhere((stiffness != 0.0) | (damping != 0.0))
        entries += [(r, c, stiffness[r, c], damping[r, c]) for r, c in places]
        first.append(len(entries))
    columns = list(zip(*entries, strict=True)) if entries else [(), (), (), ()]
    connectors = Connectors(
        number=order,
        ends=ends,
        local=given.local,
        gap=(given.place[:, 1] + given.local[:, 1]) - (given.place[:, 0] + given.local[:, 0]),
        repeated=np.append(0, (ends[1:] == ends[:-1]).all(axis=1)).astype(np.int64)[: len(ends)],
        twisting=twisting,
        first=np.array(first, dtype=np.int64),
        row=np.array(columns[0], dtype=np.int64),
        column=np.array(columns[1], dtype=np.int64),
        stiffness=np.array(columns[2], dtype=np.float64),
        damping=np.array(columns[3], dtype=np.float64),
    )
    return connectors, slots


def _without_round_off(matrix: Floats) -> Floats:
    """Set entries to zero that are nothing beside the translations' and the tilts' stiffness."""
    entries = np.abs(matrix)
    size = np.sqrt(np.repeat([entries[:3, :3].max(), entries[3:, 3:].max()], 3))
    return np.where(entries <= ROUND_OFF * np.outer(size, size), 0.0, matrix)


def _meshes(numbers: _Numbers) -> Meshes:
    given = numbers.assembly.meshes
    place = given.place.copy()
    place[given.coordinates[:, :12].reshape(-1, 2, 6)[:, :, 0] < 0] = 0.0
    others = np.delete(given.coordinates[:, :12], [5, 11], axis=1)
    return Meshes(
        coordinates=np.where(given.coordinates < 0, numbers.size, given.coordinates),
        slot=np.array([numbers.slot(int(c)) for c in given.coordinates[:, 12]], dtype=np.int64),
        place=place,
        deflection=given.deflection,
        force=given.force,
        conjugate=np.all(given.deflection == given.force, axis=1).astype(np.int64),
        spinning=np.all(others < 0, axis=1).astype(np.int64),
        cycles=given.cycles,
        phase=given.phase,
        pieces=given.pieces,
        stiffness=given.stiffness,
        damping=given.damping,
        line_of_action=given.line_of_action,
        error_pieces=given.error_pieces,
        error=given.error,
        table=given.table,
    )


def _joints(numbers: _Numbers) -> Joints:
    assembly = numbers.assembly
    joints = assembly.gearbox.joints if assembly.variant == "rigid" else ()
    bodies = {body.name: body for body in assembly.gearbox.bodies(assembly.inertias)}
    number = {joint.body: n for n, joint in enumerate(joints)}
    ends = [[number.get(e.mesh.pinion, -1), number.get(e.mesh.gear, -1)] for e in assembly.elements]
    planet, carrier = np.zeros((len(joints), 3)), np.full(len(joints), numbers.size)
    for n, joint in enumerate(joints):
        body = bodies[joint.body]
        if body.carrier is not None:
            axis = np.array(body.axis) - np.array(bodies[body.carrier].axis)
            planet[n] = body.mass, axis[0], axis[1]
            carrier[n] = assembly.spin[body.carrier]
    return Joints(
        ends=np.array(ends, dtype=np.int64).reshape(-1, 2),
        host=np.array([-1 if j.on == GROUND else number.get(j.on, -1) for j in joints], dtype=np.int64),
        planet=planet,
        carrier=carrier.astype(np.int64),
        slot=np.array([numbers.slot(int(c)) if c < numbers.size else 0 for c in carrier], dtype=np.int64),
    )


def _loads(assembly: Assembly, loads: LoadTable) -> Loads:
    series = list(loads.series.values())
    drive = () if loads.drive is None else (loads.drive,)
    following = np.zeros(extended_size(assembly) - assembly.size)
    return Loads(
        steady=np.append(assembly.torque_vector(loads.constant) + assembly.weight, following),
        coordinate=np.array([assembly.spin[name] for name in loads.series], dtype=np.int64),
        first=np.cumsum([0] + [len(times) for times, _ in series]).astype(np.int64),
        time=np.concatenate([np.zeros(0)] + [times for times, _ in series]),
        torque=np.concatenate([np.zeros(0)] + [torques for _, torques in series]),
        drive=np.array([assembly.spin[d.body] for d in drive], dtype=np.int64),
        law=np.array([(d.stiffness, d.damping, *d.angle) for d in drive]).reshape(-1, 5),
    )


def equations_of(assembly: Assembly, loads: LoadTable) -> Equations:
    """Arrays of an assembly under loads, as the compiled loops read them."""
    numbers = _Numbers(assembly)
    connectors, slots = _connectors(numbers)
    meshes, joints = _meshes(numbers), _joints(numbers)
    inertia, springs = assembly.inertia, assembly.springs
    bodies = Bodies(
        start=np.append(np.array(numbers.starts, dtype=np.int64), numbers.size),
        slot=slots,
        mass=inertia.mass,
        transverse=inertia.transverse,
        axial=inertia.axial,
        spin=inertia.spin,
        spin_inertia=inertia.spin_inertia,
        inverse=_rolling_inverse(assembly) if assembly.law == "rigid" else np.zeros((0, 0)),
        turning=np.array(numbers.turning, dtype=np.int64),
    )
    return Equations(
        bodies=bodies,
        connectors=connectors,
        meshes=meshes,
        travelling=assembly.travelling,
        springs=Springs(springs.coordinates, springs.stiffness, springs.damping),
        loads=_loads(assembly, loads),
        joints=joints,
        elastic=assembly.elastic,
        motion=elastic_motion(assembly.elastic, _acted(assembly)),
        turning=assembly.turning_arrays,
    )


def _acted(assembly: Assembly) -> NDArray[np.bool_]:
    """Coordinates that forces act on: of what goes on between an elastic body's seats only its weight."""
    acted = assembly.weight != 0.0
    for name, place in assembly.elastic_slices.items():
        acted[place.start : place.start + 6 * len(assembly.elastic_bodies[name].reduced.seats)] = True
    return np.asarray(acted)


def _rolling_inverse(assembly: Assembly) -> Floats:
    """Inverse mass matrix of spins that only roll: B (B^T M B)^-1 B^T with the free motions B."""
    free, mass = assembly.motions, assembly.mass_matrix
    inverse = free @ np.linalg.solve(free.T @ mass @ free, free.T)
    return np.ascontiguousarray(inverse[np.ix_(assembly.inertia.spin, assembly.inertia.spin)])


def work_for(equations: Equations, q: Floats, v: Floats) -> Work:
    """Memory for the compiled loops, at the state q, v (size,)."""
    size = equations.loads.steady.size + 6
    frames = np.zeros((equations.bodies.start.size, 16))
    frames[-1, [0, 4, 8, 13, 15]] = 1.0  # the ground neither turns nor tilts
    return Work(
        q=np.append(q, np.zeros(size - q.size)),
        v=np.append(v, np.zeros(size - q.size)),
        stage_q=np.zeros(size),
        stage_v=np.zeros(size),
        force=np.zeros(size),
        rate=np.zeros(size),
        total=np.zeros(size),
        turns=np.zeros((equations.bodies.turning.size, 2)),
        frames=frames,
        wrench=np.zeros((equations.bodies.start.size, 6)),
        motion=np.zeros((4, 6)),
        gradient=np.zeros((3, 13)),
        series=equations.loads.first[:-1].copy(),
        states=np.zeros((equations.meshes.slot.size, 4)),
        scratch=scratch_for(equations.elastic),
        memory=turning_memory(equations.turning),
        pieces=np.zeros((equations.meshes.slot.size, 2), dtype=np.int64),
        law=scratch_memory(),
        row=np.zeros(12),
    )


class CompiledSystem:
    """An assembly in motion.

    Parameters
    ----------
    assembly : Assembly
    q, v : (size,) arrays
        Initial coordinates and velocities.
    loads : LoadTable
    step : float
        Time step, s; `unstable` tells whether it is stable.
    """

    def __init__(self, assembly: Assembly, q: Floats, v: Floats, loads: LoadTable, step: float) -> None:
        self.step = step
        self.equations = equations_of(assembly, loads)
        self._size = assembly.size
        self._work = work_for(self.equations, q, v)

    def accelerations(self, time: float = 0.0) -> Floats:
        """Accelerations (size,) at the present state and a time (s)."""
        evaluate(time, self._work.q, self._work.v, self.equations, self._work)
        return self._work.rate[: self._size].copy()

    def advance(self, first: int, q: Floats, v: Floats) -> int:
        """Fill q and v (steps, size) with the states after each step from step number `first` on.

        Returns
        -------
        int
            Number of steps that stayed finite.
        """
        return advance(first, self.step, self.equations, self._work, q, v)


class Observer:
    """Signals and energies of states by one compiled loop; columns as those of `exugear.channels.Channels`."""

    def __init__(self, channels: Channels, loads: LoadTable) -> None:
        assembly = channels.assembly
        overall = assembly.gearbox.case.overall
        self._count = channels.count
        self._input = assembly.spin[overall.input]
        self._overall = overall_row(assembly) / channels.radius
        self._equations = equations_of(assembly, loads)
        self._work = work_for(self._equations, np.zeros(assembly.size), np.zeros(assembly.size))

    def observe(self, time: Floats, q: Floats, v: Floats) -> tuple[Floats, Floats, Floats]:
        """Signals (samples, count), energies (samples, 2) in J and powers (samples, 5) in W of states q, v.

        The powers are those of the loads, damping, k(PMC), and non-conservative forces of meshes and bearings.
        """
        signals, energies = np.empty((len(time), self._count)), np.empty((len(time), 7))
        signals[:, 0] = v[:, self._input]
        signals[:, 1] = q @ self._overall
        observe(time, q, v, self._equations, self._work, signals[:, 2:], energies)
        return signals, energies[:, :2], energies[:, 2:]
