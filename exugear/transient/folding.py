"""Harmonics of the meshes that a time step folds into the stored band, and the step that keeps them low.

Mesh stiffness varies over the mesh cycle and excites at all multiples of the mesh frequency. A solver that evaluates
forces once in a step takes a frequency f for f less any multiple of the rate of its steps: harmonics far above the
stored band then act within it, as lines that do not exist.

The height of such a line is estimated by the linear response at constant speed: each harmonic of the force at constant
deflection excites, and the deflection of the mesh and the overall transmission error respond at the frequency that the
harmonic is folded to. A line counts relative to the highest true line of the same mesh at the speeds of the load case.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import takewhile

import numpy as np
import scipy.linalg

from exugear.gearbox.load_cases import LoadSummary, summarise_loads
from exugear.gearbox.parts import LoadCase
from exugear.results.findings import percent_text
from exugear.system.kernels.cubics import periodic_cubic
from exugear.system.kernels.meshes import RATE
from exugear.system.modes import overall_row
from exugear.system.statics import linearise
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.element import MeshElement
from exugear.transient.compiled.integrator import LIGHTEST_DAMPING, Integration, choose_integration
from exugear.transient.plan import HIGHEST_BAND, MOST_STEPS_PER_SAMPLE, rate_for
from fe_ste.tools.arrays import Floats

HIGHEST_FOLDED = 0.02
"""Height of a folded line, over the highest true line of the same mesh, up to which a step is kept: 34 dB. The estimate
is that of constant speed. In a run-up a folded line passes resonances as many times faster as its harmonic has the mesh
frequency, and stays lower: 0.4 % where 1.3 % are estimated for the run-ups of the GRC."""
MOST_REDUCTION = 4
"""A step is at most so many times shorter than one that is stable and accurate: so much longer takes the run."""
SPEED_TOLERANCE = 1e-3
"""Relative difference of speeds from those of the kinematic gear train under the loads."""
POINTS_PER_PIECE = 16
"""Samples between two positions in the mesh cycle, which cubics connect: harmonics go on beyond those of positions."""
LEAST_VARIATION = 1e-9
"""Harmonics over the mean, and over the largest harmonic, that are round-off."""
FREQUENCIES = 2000
"""Frequencies of a response, apart from its resonances."""
LOWEST = 1.0
"""Lowest frequency of a response, Hz: what is slower is no line of a spectrum."""
WIDER = (2.0, 4.0, 8.0, 16.0)
"""Multiples of the band that are tried where no step is short enough: a wider band has shorter steps by itself."""


def force_harmonics(element: MeshElement) -> Floats:
    """Amplitudes of the harmonics 1, 2, ... of the force of a mesh at constant deflection, over its mean force.

    The deflection is the mean one under the static load. The functions over the mesh cycle are those of the solver.
    """
    if element.table is not None and element.load:
        surface = element.table.surface
        count = len(surface.coefficients)
        load = min(element.load, float(surface.root_force[-1]) ** 2)
        distance = element.mesh.centre_distance
        stiffness = np.array([load / surface.ste(load, n / count, distance) for n in range(count)])
        force = _between_positions(stiffness)
    else:
        stiffness = _between_positions(element.stiffness)
        force = (stiffness / np.mean(stiffness)) ** _between_positions(element.tangent / element.stiffness)
    return np.asarray(2.0 * np.abs(np.fft.rfft(force))[1 : max(2, force.size // 2)] / np.sum(force))


def _between_positions(values: Floats) -> Floats:
    """Values (n,) of a periodic cubic through samples over the mesh cycle."""
    places = np.arange(POINTS_PER_PIECE) / POINTS_PER_PIECE
    return np.asarray((periodic_cubic(values) @ places ** np.arange(4)[:, None]).ravel())


def speed_range(assembly: Assembly, case: LoadCase, loads: LoadSummary) -> tuple[float, float]:
    """Lowest and highest speed of a load case over its fastest speed.

    The lowest is only known of a train with one degree of freedom under constant torques, and else taken as zero.
    """
    slowest = min(abs(loads.start_speed), abs(loads.end_speed)) if loads.start_speed * loads.end_speed > 0.0 else 0.0
    if case.torque_series is not None or assembly.gearbox.train.degrees_of_freedom > 1 or not loads.fastest_speed:
        slowest = 0.0
    return slowest / (loads.fastest_speed or 1.0) * (1.0 - SPEED_TOLERANCE), 1.0 + SPEED_TOLERANCE


@dataclass(frozen=True)
class FoldedLine:
    """The highest line that a step folds into the stored band.

    Examples
    --------
    >>> FoldedLine(0.13, "stage_1", 15, 75000.0, (4925.0, 5075.0)).words
    'harmonic 15 of the mesh frequency of stage_1, 75000 Hz at the highest speed, acts at 4925 to 5075 Hz, with up ...
    """

    height: float
    """Over the highest true line of the same mesh."""
    mesh: str = ""
    harmonic: int = 0
    frequency: float = 0.0
    """Of that harmonic at the highest speed, Hz."""
    folded_to: tuple[float, float] = (0.0, 0.0)
    """Lowest and highest frequency at which it acts, Hz."""

    @property
    def is_low(self) -> bool:
        """Whether it is low enough."""
        return self.height <= HIGHEST_FOLDED

    @property
    def words(self) -> str:
        """Description as text."""
        return (
            f"harmonic {self.harmonic} of the mesh frequency of {self.mesh}, {self.frequency:.0f} Hz at the highest "
            f"speed, acts at {self.folded_to[0]:.0f} to {self.folded_to[1]:.0f} Hz, with up to "
            f"{percent_text(self.height, 2)} of the highest line of this mesh"
        )


@dataclass(frozen=True, eq=False)
class MeshLines:
    """Harmonics of one mesh, and the response to them."""

    name: str
    slowest: float
    fastest: float
    """Lowest and highest mesh frequency, Hz."""
    harmonics: Floats
    """(n,) amplitudes of the harmonics 1, 2, ... of the force, over its mean."""
    frequencies: Floats
    responses: Floats
    """(k,) Hz, and (2, k) deflection of the mesh and overall transmission error over its force at each, m/N."""

    def highest_responses(self, low: Floats, high: Floats) -> Floats:
        """Highest of both responses between frequencies (m,) and (m,), Hz, as (2, m)."""
        ends = np.clip([low, high], self.frequencies[0], self.frequencies[-1])
        at_ends = np.array([np.interp(ends, self.frequencies, response).max(axis=0) for response in self.responses])
        first, last = np.searchsorted(self.frequencies, ends)
        # A zero behind the responses lets an interval end with them.
        padded = np.pad(self.responses, ((0, 0), (0, 1)))
        inside = np.maximum.reduceat(padded, np.stack([first, last], axis=1).ravel(), axis=1)[:, ::2]
        return np.asarray(np.maximum(np.where(first < last, inside, 0.0), at_ends))

    @cached_property
    def highest_true_lines(self) -> Floats:
        """(2,) highest lines, of both responses, at frequencies that harmonics have."""
        count = min(len(self.harmonics), int(self.frequencies[-1] / max(self.slowest, LOWEST)))
        n = np.arange(1.0, max(1, count) + 1.0)
        lines = self.harmonics[: len(n)] * self.highest_responses(n * self.slowest, n * self.fastest)
        # A mesh that does not move the output has no lines there, true or folded.
        return np.asarray(np.maximum(lines.max(axis=1), np.finfo(np.float64).tiny))

    def highest_folded_line(self, rate: float, band: float) -> FoldedLine:
        """Highest line up to the end of the band (Hz) that so many steps in a second (Hz) fold to other frequencies."""
        n = np.flatnonzero(self.harmonics > LEAST_VARIATION * self.harmonics.max()) + 1
        first = np.maximum(1, np.ceil((n * self.slowest - band) / rate))
        last = np.floor((n * self.fastest + band) / rate)
        # Between the first and the last multiple of the rate, speeds pass through the whole band.
        times = np.stack([first, np.minimum(first + 1, last), last], axis=1)[first <= last]
        n = n[first <= last]
        if not n.size:
            return FoldedLine(0.0)
        below = np.maximum((n * self.slowest)[:, None] - times * rate, -band)
        above = np.minimum((n * self.fastest)[:, None] - times * rate, band)
        lowest, highest = np.sort([np.abs(below), np.abs(above)], axis=0)
        lowest[(below < 0.0) & (above > 0.0)] = 0.0
        responses = self.highest_responses(lowest.ravel(), highest.ravel()) / self.highest_true_lines[:, None]
        heights = self.harmonics[n - 1, None] * responses.max(axis=0).reshape(times.shape)
        place = np.unravel_index(heights.argmax(), heights.shape)
        harmonic = int(n[place[0]])
        frequency = harmonic * self.fastest / (1.0 + SPEED_TOLERANCE)
        folded_to = float(lowest[place]), float(highest[place])
        return FoldedLine(float(heights[place]), self.name, harmonic, frequency, folded_to)


def mesh_lines(assembly: Assembly, case: LoadCase, loads: LoadSummary, band: float) -> tuple[MeshLines, ...]:
    """Lines of all meshes whose stiffness varies over the mesh cycle, for a stored band (Hz)."""
    low, high = speed_range(assembly, case, loads)
    varying = {}
    for n, element in enumerate(assembly.elements):
        harmonics = force_harmonics(element)
        if loads.mesh_frequencies[element.mesh.name] > 0.0 and harmonics.max() > LEAST_VARIATION:
            varying[n] = harmonics
    if not varying:
        return ()
    fastest = max(loads.mesh_frequencies.values())
    frequencies, responses = _mesh_responses(assembly, max(band, high * fastest))
    found = []
    for n, harmonics in varying.items():
        name = assembly.mesh_names[n]
        frequency = loads.mesh_frequencies[name]
        found.append(MeshLines(name, low * frequency, high * frequency, harmonics, frequencies, responses[n]))
    return tuple(found)


def _mesh_responses(assembly: Assembly, highest: float) -> tuple[Floats, Floats]:
    """Frequencies (k,) up to the highest, Hz, and responses (meshes, 2, k) to a force on the teeth of each mesh, m/N.

    The responses, of its deflection and of the overall transmission error, are sums over the undamped modes, each with
    its own damping.
    """
    meshes = assembly.linear_meshes()
    linear = linearise(assembly.unloaded.with_linear_supports(), np.zeros(assembly.size), meshes)
    free = scipy.linalg.orth(assembly.motions)
    mass, stiffness = (free.T @ (matrix + matrix.T) @ free / 2.0 for matrix in (linear.mass, linear.total_stiffness))
    squares, shapes = scipy.linalg.eigh(stiffness, mass)
    shapes = free @ shapes
    rates = np.sqrt(np.maximum(squares, 0.0))
    damping = np.einsum("im,ij,jm->m", shapes, linear.total_damping, shapes, optimize=True)
    damping = np.maximum(damping, 2.0 * LIGHTEST_DAMPING * rates)
    at_rest = np.zeros(assembly.size)
    rows = np.array([assembly.mesh_states(at_rest, v, meshes)[:, RATE] for v in np.eye(assembly.size)]).T
    by_mode = rows @ shapes
    shares = np.stack([by_mode**2, by_mode * (overall_row(assembly) @ shapes)], axis=1)
    resonances = rates / (2.0 * np.pi)
    resonances = resonances[(resonances > LOWEST) & (resonances < highest)]
    frequencies = np.union1d(np.linspace(LOWEST, highest, FREQUENCIES), resonances)
    turning = 2.0 * np.pi * frequencies
    return frequencies, np.abs(shares @ (1.0 / (squares[:, None] - turning**2 + 1j * damping[:, None] * turning)))


def highest_folded_line(lines: tuple[MeshLines, ...], rate: float, band: float) -> FoldedLine:
    """Highest line that so many steps in a second (Hz) fold into the band (Hz); of height zero if there is none."""
    found = (mesh.highest_folded_line(rate, band) for mesh in lines)
    return max(found, key=lambda line: line.height, default=FoldedLine(0.0))


# Choice of the step


def shorter_step(
    lines: tuple[MeshLines, ...], step: float, sample_rate: float, band: float
) -> tuple[float, FoldedLine]:
    """Longest step (s) that folds low lines only into the band (Hz), not longer than a step that divides a sample.

    It divides a sample as well. Where none within the reduction that is permitted does, it is the one with the lowest
    of these lines.
    """
    divisions = round(1.0 / (step * sample_rate))
    most = min(MOST_REDUCTION * divisions, MOST_STEPS_PER_SAMPLE)
    best = step, highest_folded_line(lines, 1.0 / step, band)
    while not best[1].is_low:
        divisions += max(1, divisions // 20)
        if divisions > most:
            break
        line = highest_folded_line(lines, divisions * sample_rate, band)
        if line.height < best[1].height:
            best = 1.0 / sample_rate / divisions, line
    return best


def choose_against_folding(
    assembly: Assembly, case: LoadCase, total: float, sample_rate: float, band: float, integrator: str | None = None
) -> tuple[Integration, FoldedLine]:
    """Choose method and step by `choose_integration`, with a shorter step where harmonics of the meshes require one.

    The step depends on the duration of the load case, not on the simulated time (s), so that a run which is resumed for
    longer keeps its step. The folded line is that at the speeds of both.
    """
    chosen = choose_integration(assembly, sample_rate, band, integrator=integrator)
    planned = summarise_loads(assembly.gearbox, case, assembly.inertias, case.duration)
    step, line = shorter_step(mesh_lines(assembly, case, planned, band), chosen.step, sample_rate, band)
    if step < chosen.step:
        chosen = choose_integration(assembly, sample_rate, band, step=step, integrator=integrator)
    if total > case.duration:
        loads = summarise_loads(assembly.gearbox, case, assembly.inertias, total)
        line = highest_folded_line(mesh_lines(assembly, case, loads, band), 1.0 / step, band)
    return chosen, line


def folding_warning(
    line: FoldedLine,
    assembly: Assembly,
    case: LoadCase,
    total: float,
    band: float,
    integrator: str | None = None,
) -> str:
    """Return a warning about a line that the chosen step folds into the band (Hz), with what helps; empty if none."""
    if line.is_low:
        return ""
    for wider in takewhile(lambda wider: wider <= HIGHEST_BAND, (factor * band for factor in WIDER)):
        _, left = choose_against_folding(assembly, case, total, rate_for(wider), wider, integrator)
        if left.is_low:
            return f"folded harmonics: {line.words}; use exugear run --band {wider:g}, which has shorter steps"
    return f"folded harmonics: {line.words}; check the stiffness over the mesh cycle for jumps"
