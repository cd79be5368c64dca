"""Gear meshes in the rotating frame: scalar signals through which all variations act.

The meshes of N planets are written as multi-blade components around the carrier, as the planets are: with the gradient
g_n of the deflection of mesh n by the frame's coordinates u

    d_n = d_0 + d_c cos theta_n + d_s sin theta_n,   rows g_0 = mean g_n, g_c = 2/N sum g_n cos theta_n, g_s likewise,

and a force F_n in each mesh is a generalized force -(N g_0 F_0 + N/2 g_c F_c + N/2 g_s F_s). Planets that mesh in phase
have one position in the mesh cycle, so that their stiffness k multiplies each component by itself. Planets out of phase
have all N components, and the carrier's angle is a base of its own: harmonic h of the stiffness couples a component to
another, and its order to a sideband, by a whole number of the carrier's revolutions. Planets that are not alike are
families of one each, with a mean, a cosine and a sine: what the other gear of the mesh does there.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from exugear.steady.harmonics.lines import Modulator, fourier_coefficients
from exugear.steady.mean_system.displaced_pins import displaced_carriers
from exugear.steady.mean_system.mean_system import MeanSystem
from exugear.steady.mean_system.planet_sets import IN_PHASE, PlanetSet, phases_ahead, wave_kinds
from exugear.steady.mean_system.rotating_frame import RotatingFrame
from exugear.system.kernels.coordinates import BODY_SIZE, SPIN
from exugear.system.kernels.meshes import (
    FRAME,
    MOMENT_BEYOND,
    ROW_SIZE,
    TILT_DAMPING,
    TILT_MOMENT,
    TILT_STIFFNESS,
    frame_row,
)
from exugear.system.kernels.turning import travelling_tangent
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.laws.line_of_action import CURVE_FORM, EXPONENT
from fe_ste.tools.arrays import Booleans, Complexes, Floats, Integers

SAMPLES = 64
"""Samples of each cubic piece of a stiffness for its Fourier coefficients: aliases are below 1e-7 of it."""
FEWEST, MOST_HARMONICS = 10, 1000
"""Minimum number of harmonics of a mesh frequency, and the largest number permitted."""
MAX_NEGLECTED = 2e-2
"""Share of the variation of a mesh's compliance that truncation of harmonics may neglect.

With it the ten highest peaks of the GRC and of a spur planetary gearbox agree within 1e-2 with results for 1.5 times as
many harmonics."""
NEIGHBOURS = 12
"""Multiples of the planet passing frequency by which each order is coupled to others, at most, where stiffness varies.

Those that carry hardly any vibration are left out later (`exugear.steady.balance.neighbours`). With four, main orders
of the GRC are within 1e-3 of those with twelve at most speeds, with six within 2e-4; but where a neighbour of the sixth
multiple meets a mode, six leave out 2e-3 of the vibration, twelve 4e-4."""
CONSTANT = 1e-9
"""Variation of a compliance over its mean below which there is none."""
SAME_BASE = 1e-9
"""Share by which mesh frequencies of one base may differ."""
CycleQuantity = Literal["tangent", "secant", "exponent", "compliance", "way", "moment"]
"""Of a mesh at its static load: slope of the load, load over deflection (N/m), the curve's exponent less one, one over
the secant (m/N), which is the static transmission error of a unit load, the way along the face of what a little more
deflection adds to the load (m), and the moment that the static load has beyond it (N m)."""
WAVES = ("mean", "cosine", "sine")
"""The first three, which central bodies feel."""


def wave_name(number: int, planets: int) -> str:
    """Name of a wave of a set of planets.

    Examples
    --------
    >>> [wave_name(n, 4) for n in range(4)]
    ['mean', 'cosine', 'sine', 'alternating']
    """
    kind, m = wave_kinds(planets, number + 1)[number]
    return kind if m < 2 or kind == "alternating" else f"{kind} {m}"


@dataclass(frozen=True)
class MeshWave:
    """One wave of the meshes of a family, or a single mesh."""

    name: str
    """Family, with the wave where there are several."""
    family: str
    first: int
    """Mesh that stands for the family in the assembly's arrays."""
    wave: int
    """0 mean, 1 cosine, 2 sine, and on where planets mesh out of phase."""
    weight: float
    """What a unit of its force counts in generalized forces."""
    base: int
    """Base whose angle is that of the mesh cycle."""
    sense: float
    """Mesh cycles per cycle of the base when the input turns about +z: 1 or -1."""
    carrier: float
    """Rotations of the components per revolution of the input."""
    ahead: tuple[float, ...] = ()
    """Cycles by which each planet's mesh leads the first; empty where the mean over a revolution represents all."""


@dataclass(frozen=True, eq=False)
class MeshWaves:
    """All mesh components of an averaged system; m components."""

    system: MeanSystem
    waves: tuple[MeshWave, ...]
    base_orders: Floats
    """(bases,) mesh frequencies over the frequency of the input's turns."""
    base_names: tuple[str, ...]
    """Meshes of each base."""
    passing: int = 0
    """Multiples of the planet passing frequency (three times per revolution of the carrier for three planets) whose
    orders are included: planets in phase are then modelled individually as they rotate, like planets out of phase, and
    not by their mean."""
    neighbours: int = 0
    """Multiples of that frequency on either side of each order that a flexible ring gear couples it to."""

    @property
    def assembly(self) -> Assembly:
        """What was linearised."""
        return self.system.frame.assembly

    @cached_property
    def groups(self) -> tuple[tuple[tuple[int, ...], PlanetSet | None], ...]:
        """Meshes and planets of each family, in the order of the waves' families."""
        return mesh_groups(self.system.frame)

    @cached_property
    def carriers(self) -> tuple[tuple[str, Modulator], ...]:
        """Carriers whose planets are modelled individually, and the sidebands of mesh orders due to their rotation."""
        found: dict[str, tuple[PlanetSet, set[int], set[int | None]]] = {}
        for wave in self.waves:
            planets = self.planets(wave)
            if wave.ahead and planets is not None and wave.wave == 0:
                _, bases, steps = found.setdefault(planets.carrier, (planets, set(), set()))
                bases.add(wave.base)
                steps.add(_turns_per_cycle(wave, planets))
        return tuple(
            (
                name,
                Modulator(
                    abs(planets.ratio),
                    tuple(sorted(bases)),
                    planets.waves,
                    next(iter(steps)) if len(steps) == 1 else None,
                    planets.passing if name in self.varying_carriers else 0,
                ),
            )
            for name, (planets, bases, steps) in found.items()
        )

    @property
    def varying_carriers(self) -> tuple[str, ...]:
        """Carriers of planets whose meshes have more waves than there are planets.

        They pass a flexible ring gear, or are not alike.
        """
        return self.system.frame.varying_carriers

    def planets(self, wave: MeshWave) -> PlanetSet | None:
        """Planets of the meshes of a wave, None of a single mesh."""
        return next(planets for meshes, planets in self.groups if wave.first in meshes)

    @property
    def force_waves(self) -> Integers:
        """Waves from which the force of each planet's mesh follows: those of a flexible ring beyond repeat it."""
        kept = [n for n, wave in enumerate(self.waves) if not wave.ahead or wave.wave < len(wave.ahead)]
        return np.array(kept, dtype=np.int64)

    @cached_property
    def weights(self) -> Floats:
        """(m,) array."""
        return np.array([wave.weight for wave in self.waves])

    @cached_property
    def mean_stiffness(self) -> Floats:
        """Mean stiffness of each wave's mesh in the law's coordinate, (m,), N/m: of a curve the tangent."""
        return np.array([float(np.mean(self.assembly.elements[wave.first].tangent)) for wave in self.waves])

    @cached_property
    def rest(self) -> Floats:
        """Deflection at which the mean stiffness of each wave has no force, (m,), m: zero but for means of curves."""
        return np.array([self.assembly.elements[wave.first].rest * (wave.wave == 0) for wave in self.waves])

    @cached_property
    def loads(self) -> Floats:
        """Load of each wave's mesh at which stiffness and curve are, (m,), N; 0 of no curve."""
        elements = [self.assembly.elements[wave.first] for wave in self.waves]
        return np.array([element.load if element.is_curved else 0.0 for element in elements])

    @cached_property
    def damping(self) -> Floats:
        """Damping of each wave's mesh in the law's coordinate, (m,), N s/m."""
        return self.system.damper_factor * np.array([self.assembly.meshes.damping[wave.first] for wave in self.waves])

    @cached_property
    def line_of_action(self) -> Floats:
        """Force on the transverse line of action per force of the law, (m,)."""
        return np.array([self.assembly.meshes.line_of_action[wave.first] for wave in self.waves])

    @cached_property
    def partners(self) -> Floats:
        """Return the inputs of a mesh that travels through the components, in addition to their own rates, (m, m).

        The rate of component a is d_a' + W p_ab d_b at the speed W of the input.
        """
        rates = np.zeros((len(self.waves),) * 2)
        for n, wave in enumerate(self.waves):
            planets = self.planets(wave)
            if planets is None:
                continue
            kind, m = planets.kinds(wave.wave + 1)[-1]
            if kind == "cosine":
                rates[n, n + 1], rates[n + 1, n] = m * wave.carrier, -m * wave.carrier
        return rates

    def gradients(self, rows: Floats, speed: float) -> Floats:
        """Waves (m, size) of the gradients of rows (meshes, 12) by the frame's coordinates, at a speed (rad/s)."""
        frame = self.system.frame
        u = self.system.static_at(speed)

        def at(psi: float) -> Floats:
            return _rows(self.assembly, frame.state(psi, speed, u)[0], rows)[1] @ frame.matrices(psi)[0]

        return self._waves_of(at)

    def values(self, rows: Floats, speed: float) -> Floats:
        """Waves (m,) of the values of rows (meshes, 12) in the static state at a speed (rad/s)."""
        frame = self.system.frame
        u = self.system.static_at(speed)
        return self._waves_of(lambda psi: _rows(self.assembly, frame.state(psi, speed, u)[0], rows)[0])

    def position_rows(self) -> Floats:
        """Rows of the position in the mesh cycle by the frame's coordinates, (m, size), cycles."""
        assembly = self.assembly
        gradients = np.zeros((len(self.assembly.elements), self.assembly.size))
        for m, index in enumerate(assembly.meshes.coordinates):
            for at, sign in ((SPIN, 1.0), (FRAME, -1.0)):
                if index[at] >= 0:
                    gradients[m, index[at]] += sign * assembly.meshes.cycles[m]
        return self._waves_of(lambda psi: gradients @ self.system.frame.matrices(psi)[0])

    def positions(self, speed: float) -> Floats:
        """Position in the mesh cycle of each wave's mesh at zero angle of the input, (m,), cycles."""
        moved = self.position_rows() @ self.system.static_at(speed)
        phases = np.array([self.assembly.meshes.phase[wave.first] for wave in self.waves])
        mean = {wave.first: float(moved[n]) for n, wave in enumerate(self.waves) if wave.wave == 0}
        return np.asarray(phases + np.array([mean[wave.first] for wave in self.waves]))

    @cached_property
    def tilting(self) -> Floats:
        """Resistance of meshes (meshes, 3) whose stiffness varies with the carrier to misalignment, 0 for others.

        Stiffness (N m/rad), damping (N m s/rad) and constant moment (N m), as in `MeshArrays.tilt`.
        """
        meshes = self.assembly.meshes
        varying = np.array([bool(self.system.frame.varying_carrier_of(m)) for m in range(len(meshes.tilt))], dtype=bool)
        found = meshes.tilt[:, [TILT_STIFFNESS, TILT_DAMPING, TILT_MOMENT]] * varying[:, None]
        found[:, 1] *= self.system.damper_factor
        return np.asarray(found)

    @property
    def moving(self) -> Booleans:
        """Meshes (meshes,) whose moment over misalignment is not all in the averaged system.

        Their load shuttles over the cycle, or their stiffness varies with the carrier.
        """
        return np.asarray((self.assembly.meshes.way_pieces > 0) | self.tilting.any(axis=1))

    def cycle_coefficients(self, *quantities: CycleQuantity, harmonics: int) -> Complexes:
        """Fourier coefficients (m, harmonics + 1) of the product of quantities over the mesh cycle."""
        found = np.zeros((len(self.waves), harmonics + 1), dtype=complex)
        for own, wave in zip(found, self.waves, strict=True):
            product = np.prod([self._sample_cycle(wave, quantity) for quantity in quantities], axis=0)
            known = fourier_coefficients(product, harmonics)
            own[: len(known)] = known
        return found

    def _sample_cycle(self, wave: MeshWave, quantity: CycleQuantity) -> Floats:
        """Sample a quantity over the cycle of a wave's mesh."""
        meshes = self.assembly.meshes
        mesh = wave.first
        pieces = int(meshes.pieces[mesh])
        curved = meshes.form[mesh] == CURVE_FORM
        powers = np.vander(np.arange(SAMPLES) / SAMPLES, 4, increasing=True).T
        if quantity in ("way", "moment"):
            if meshes.way_pieces[mesh] == 0:
                return np.zeros(pieces * SAMPLES)
            first = 0 if quantity == "way" else MOMENT_BEYOND
            return np.asarray((meshes.way[mesh, :pieces, first : first + 4] @ powers).ravel())
        secant = (meshes.stiffness[mesh, :pieces, :4] @ powers).ravel()
        more = meshes.stiffness[mesh, :pieces, EXPONENT : EXPONENT + 4] if curved else np.zeros((pieces, 4))
        exponent = (more @ powers).ravel()
        if quantity == "secant":
            return np.asarray(secant)
        if quantity == "compliance":
            return np.asarray(1.0 / secant)
        return np.asarray(exponent if quantity == "exponent" else secant * (1.0 + exponent))

    def left_out(self, harmonics: int) -> Floats:
        """Share (m,) of the variation of each wave's compliance over the mesh cycle that is above some harmonics.

        The compliance is what transmission errors are made of; its variation is counted by its root mean square.
        """
        return np.array([self._tails[wave.first][harmonics] for wave in self.waves])

    @property
    def varies(self) -> bool:
        """Whether the compliance of any mesh or its load's place changes over the cycle: else nothing excites."""
        return bool(self.moving.any()) or any(bool(tails[0]) for tails in self._tails.values())

    def needed_harmonics(self) -> int:
        """Count the harmonics of each mesh frequency that the compliance asks for.

        They neglect at most `MAX_NEGLECTED` of its variation: `FEWEST` to half of the positions of its table, above
        which a table says nothing.
        """
        needed = FEWEST
        for mesh, tails in self._tails.items():
            most = max(int(self.assembly.meshes.pieces[mesh]) // 2, FEWEST)
            enough = np.flatnonzero(tails[: most + 1] <= MAX_NEGLECTED)
            needed = max(needed, int(enough[0]) if enough.size else most)
        return needed

    @cached_property
    def _tails(self) -> dict[int, Floats]:
        """Share of the variation of compliance of each mesh that stands for waves, above each number of harmonics."""
        found = {}
        for mesh, wave in {wave.first: wave for wave in self.waves}.items():
            values = self._sample_cycle(wave, "compliance")
            sizes = np.abs(fourier_coefficients(values, len(values) // 2))
            above = np.sqrt(np.cumsum(sizes[:0:-1] ** 2)[::-1])
            varies = above[0] > CONSTANT * sizes[0]
            found[mesh] = np.append(above / above[0], np.zeros(MOST_HARMONICS)) if varies else np.zeros(MOST_HARMONICS)
        return found

    def _waves_of(self, at: Callable[[float], Floats]) -> Floats:
        """Waves (m, ...) of values (meshes, ...), which are a function of the angle of the input, rad.

        Waves are the same at all angles where nothing varies with the carrier. Elsewhere they are a Fourier series
        around it, from values at places around it.
        """
        here = self._projected(at(0.0), 0.0)
        found = here.copy()
        for carrier in self.varying_carriers:
            places = self.system.frame.places_of(carrier)[1:].tolist()  # the first is at zero angle
            mean = np.mean([here, *(self._projected(at(psi), psi) for psi in places)], axis=0)
            own = [getattr(self.planets(wave), "carrier", "") == carrier for wave in self.waves]
            found[own] = mean[own]
        return found

    def _projected(self, values: Floats, psi: float) -> Floats:
        """Waves (m, ...) of values (meshes, ...) at an angle of the input, rad."""
        out: Floats = np.empty((len(self.waves), *values.shape[1:]))
        at = 0
        for meshes, planets in self.groups:
            value = values[list(meshes)]
            if planets is None:
                out[at] = value[0]
                at += 1
                continue
            count = sum(self.planets(wave) is planets and wave.first == meshes[0] for wave in self.waves)
            shapes = planets.values(np.array(planets.ratio * psi), count)
            out[at : at + count] = np.tensordot(shapes / planets.norms(count), value, axes=(0, 0))
            at += count
        return out


def mesh_waves(system: MeanSystem, passing: int = 0) -> MeshWaves:
    """Mesh components of an averaged system; `passing` as in `MeshWaves`."""
    frame = system.frame
    assembly = frame.assembly
    gearbox = assembly.gearbox
    frequencies = gearbox.train.mesh_frequencies(2.0 * math.pi)
    orders: list[float] = []
    names: list[list[str]] = []
    waves: list[MeshWave] = []
    groups = mesh_groups(frame)
    varying = [planets for meshes, planets in groups if frame.varying_carrier_of(meshes[0])]
    displaced = displaced_carriers(assembly, frame.sets)
    for meshes, planets in groups:
        mesh = assembly.elements[meshes[0]].mesh
        turning = frame.speeds.get(mesh.pinion, 0.0) - frame.speeds.get(mesh.frame, 0.0)
        order = frequencies[mesh.name]
        base = next((n for n, known in enumerate(orders) if abs(order - known) < SAME_BASE * known), len(orders))
        if base == len(orders):
            orders.append(order)
            names.append([])
        if mesh.family not in names[base]:
            names[base].append(mesh.family)
        sense = math.copysign(1.0, assembly.meshes.cycles[meshes[0]] * turning)
        own = (meshes[0],)
        if planets is None:
            waves.append(MeshWave(mesh.name, mesh.name, *own, 0, 1.0, base, sense, 0.0))
            continue
        one_by_one = passing or any(planets is own for own in varying) or planets.carrier in displaced
        ahead = phases_ahead(assembly, meshes) or (0.0,) * (len(meshes) if one_by_one else 0)
        count = max(planets.waves if ahead else len(WAVES), frame.waves_around(meshes[0], planets))
        name = mesh.name if planets.is_single else mesh.family
        for number, weight in enumerate(planets.norms(count)):
            label = f"{name} {wave_name(number, planets.waves)}" if number else name
            waves.append(MeshWave(label, mesh.family, *own, number, float(weight), base, sense, planets.ratio, ahead))
    found = MeshWaves(system, tuple(waves), np.array(orders), tuple(", ".join(name) for name in names), passing)
    return replace(found, neighbours=NEIGHBOURS) if found.varying_carriers else found


def mesh_groups(frame: RotatingFrame) -> tuple[tuple[tuple[int, ...], PlanetSet | None], ...]:
    """Meshes of each family of planets in the order of the planets, and single meshes."""
    found: dict[str, tuple[tuple[int, ...], PlanetSet | None]] = {}
    for m, element in enumerate(frame.assembly.elements):
        planets = frame.planets_of(m)
        if planets is None:
            found[element.mesh.name] = ((m,), None)
            continue
        key = f"{element.mesh.family} of {planets.carrier} {planets.names[0]}"
        found[key] = ((*found.get(key, ((), None))[0], m), planets)
    out = []
    for meshes, planets in found.values():
        if planets is not None:
            ends = {m: (frame.assembly.elements[m].mesh.pinion, frame.assembly.elements[m].mesh.gear) for m in meshes}
            meshes = tuple(next(m for m in meshes if name in ends[m]) for name in planets.names)
        out.append((meshes, planets))
    return tuple(out)


def _turns_per_cycle(wave: MeshWave, planets: PlanetSet) -> int | None:
    """Find the carrier's turns that go with a mesh cycle, None where phases are not those of equally spaced planets.

    Planets that are ahead by multiples of p / N of a cycle carry harmonic h into the wave h p; seen from the frame that
    wave turns back with the carrier.
    """
    if planets.is_single:
        return 0
    ahead = np.array(wave.ahead)
    count = planets.waves
    step = round(float(ahead[1]) * count)
    if np.abs((ahead - step * np.arange(count) / count + 0.5) % 1.0 - 0.5).max() > IN_PHASE:
        return None
    return int(-step * wave.sense * math.copysign(1.0, wave.carrier)) % count


def _rows(assembly: Assembly, q: Floats, rows: Floats) -> tuple[Floats, Floats]:
    """Values (meshes,) of rows (meshes, 12), and their gradients (meshes, size) by the coordinates q."""
    meshes = assembly.meshes
    still = np.zeros_like(q)
    x, u = assembly.with_travelling(q, still)
    values = np.empty(len(rows))
    gradients = np.zeros((len(rows), len(x)))
    local = np.empty(ROW_SIZE)
    turning = np.empty(ROW_SIZE)
    for m, row in enumerate(rows):
        index = meshes.coordinates[m]
        values[m] = frame_row(x, index, meshes.axis[m], row, local, turning)
        for at in range(2 * BODY_SIZE + 1):
            if index[at] >= 0:
                gradients[m, index[at]] += local[at]
    if assembly.travelling.first.size:
        gradients = gradients @ travelling_tangent(x, u, np.zeros_like(x), assembly.travelling).place
    return values, gradients
