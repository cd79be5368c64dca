"""How the eigenmodes near a frequency move with what had to be assumed: housing, bearings, inertia, damping."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.optimize

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import Body
from exugear.system.bodies.elastic_body import ElasticBody
from exugear.system.build import assemble
from exugear.system.modes import Modes, modes_of, participation
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.contact_state import MeshContactState
from exugear.system.tooth_mesh.element import MeshData
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.display import ReprMixin

FRACTIONS = (0.25, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0)
"""Parts of the default value that a parameter without a natural range takes."""
MATCH_TOLERANCE = 0.01
"""Largest relative distance of a mode from the frequency that an assumption is said to bring it to."""
HOUSING_FACTORS = (0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
"""Values of the housing factor, to which that of the case is added."""


@dataclass(frozen=True)
class Parameter:
    """A model parameter to vary."""

    label: str
    """With its unit."""
    values: tuple[float, ...]
    """Ascending."""
    default: float
    """Value of the case."""
    build: Callable[[float], Assembly]
    """The assembly at a value."""
    logarithmic: bool = True
    """Scale that suits it."""


@dataclass(frozen=True)
class ParameterVariation(ReprMixin):
    """Modes over a parameter; n values, m modes, each followed by its shape."""

    parameter: Parameter
    frequency: Floats
    """(n, m) Hz."""
    share: Floats
    """(n, m) share of the overall transmission error's mobility, 0 to 1."""
    amplification: Floats
    """(n, m) overall transmission error at resonance per transmission error of the mesh that excites it most, m/m."""
    damping_ratio: Floats
    """(n, m)"""

    def _line(self) -> str:
        values, modes = self.frequency.shape
        return f" {self.parameter.label}: {values} values, {modes} modes"

    def near(self, window: tuple[float, float], least_share: float) -> ParameterVariation:
        """Return only modes that lie in a window (Hz) at some value, with a minimum share."""
        inside = (self.frequency >= window[0]) & (self.frequency <= window[1]) & (self.share >= least_share)
        kept = inside.any(axis=0)
        return replace(
            self,
            frequency=self.frequency[:, kept],
            share=self.share[:, kept],
            amplification=self.amplification[:, kept],
            damping_ratio=self.damping_ratio[:, kept],
        )

    def crossings(self, frequency: float, least_share: float) -> tuple[float, ...]:
        """Return parameter values at which a mode of a minimum share passes a frequency (Hz), by interpolation."""
        scale = np.log(self.parameter.values) if self.parameter.logarithmic else np.array(self.parameter.values)
        crossings = []
        for mode in range(self.frequency.shape[1]):
            distance = self.frequency[:, mode] - frequency
            share = self.share[:, mode]
            # A value that meets the frequency to the last bit is passed once.
            passed = ((distance[1:] < 0.0) != (distance[:-1] < 0.0)) & np.isfinite(distance[1:] + distance[:-1])
            for n in np.flatnonzero(passed):
                if max(share[n], share[n + 1]) >= least_share:
                    part = distance[n] / (distance[n] - distance[n + 1])
                    crossing = float(scale[n] + part * (scale[n + 1] - scale[n]))
                    crossings.append(float(np.exp(crossing)) if self.parameter.logarithmic else crossing)
        return tuple(sorted(crossings))


def vary_parameter(parameter: Parameter, progress: Callable[[], None] | None = None) -> ParameterVariation:
    """Compute the modes at each value of a parameter and follow them by their shapes.

    Parameters
    ----------
    progress : called after each value
    """
    modes_of_values = []
    for value in parameter.values:
        modes_of_values.append(modes_of(parameter.build(value)))
        if progress is not None:
            progress()
    figures: list[Floats] = []
    # Elastic bodies have modes up to a frequency, which may pass it on the way: the least number can be followed.
    followed = np.arange(min(len(modes.names) for modes in modes_of_values))
    for n, modes in enumerate(modes_of_values):
        followed = follow_modes(modes_of_values[n - 1], modes, followed) if n else followed
        highest = modes.amplification.max(axis=1, initial=0.0)
        values = np.array([modes.frequency, participation(modes.overall), highest, modes.damping_ratio])
        figures.append(values[:, followed])
    frequency, share, amplification, damping = np.stack(figures, axis=1)
    return ParameterVariation(parameter, frequency, share, amplification, damping)


def follow_modes(before: Modes, after: Modes, followed: Integers) -> Integers:
    """Find each mode followed so far among the modes of the next value.

    Modes are paired so that the sum of their squared overlaps is largest; both have unit modal mass.

    Parameters
    ----------
    followed : (m,) numbers of the followed modes in `before`

    Returns
    -------
    (m,) their numbers in `after`
    """
    roots = [np.linalg.cholesky(modes.assembly.mass_matrix) for modes in (before, after)]
    overlap = ((roots[0].T @ before.shapes[:, followed]).T @ (roots[1].T @ after.shapes)) ** 2
    _, matched = scipy.optimize.linear_sum_assignment(overlap, maximize=True)
    return np.asarray(matched, dtype=np.int64)


def assumed_parameters(
    gearbox: Gearbox,
    choice: Choice,
    stiffness: Mapping[str, MeshData],
    bodies_of: Callable[[Gearbox], Mapping[str, ElasticBody]] | None = None,
) -> tuple[Parameter, ...]:
    """Return the assumed parameters of a gearbox that the variant has.

    Parameters
    ----------
    choice : the model that is varied
    stiffness : mapping of pair name to (n,) array
        Mesh stiffness over the cycle, N/m.
    bodies_of : reduced flexible bodies of a varied gearbox, required by the variant `flexible`

    Returns
    -------
    tuple of Parameter
        Housing factor where it is active, stiffness of the planets' bearings where there are bearings; axial inertia of
        the overall output body; damping time of the meshes where damping is proportional to stiffness. Where they move
        the gears, tooth contact is kept at its default state: 0.2 % in the GRC's frequencies from housing factor 0.2 to
        1.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> stiffness = {"sun_planet": 3.8e9, "ring_planet": 4.9e9, "intermediate": 3.1e9, "high_speed": 1.9e9}
    >>> [parameter.label for parameter in assumed_parameters(gearbox, Choice("rigid"), stiffness)]
    ['axial inertia of hss / kg m²']
    """

    def built(changes: Mapping[str, float], contact: Mapping[str, MeshContactState] | None = None) -> Assembly:
        varied = gearbox.varied(changes)
        return assemble(varied, choice, stiffness, bodies_of(varied) if bodies_of else None, contact=contact)

    inertias = choice.inertia_set(gearbox)
    parameters = []
    base = built({})
    touching = base.contacts.states
    if any(support.factor != 1.0 for support in base.supports):
        default = gearbox.case.housing.factor
        values = tuple(sorted({*HOUSING_FACTORS, default}))
        parameters.append(
            Parameter(
                ("housing stiffness factor"), values, default, lambda x: built({"housing.factor": x}, touching), False
            )
        )
    planets = planet_bearings(gearbox, base)
    first = base.connectors.rolling.first
    if planets and not any(first[number + 1] > first[number] for number in planets):  # rows have no such factor
        parameters.append(
            Parameter(
                "stiffness of planet bearings / default", FRACTIONS, 1.0, lambda x: scaled_bearings(base, planets, x)
            )
        )
    body = gearbox.body(gearbox.case.overall.output, inertias)
    sets = [gearbox.body(body.name, name).axial for name in gearbox.inertia_sets]
    low, high = min(sets), max(sets)
    # Values around the one there is, or over the range of the inertia sets.
    values = tuple(body.axial * part for part in FRACTIONS)
    if high >= 1.2 * low:
        values = tuple(sorted({*np.geomspace(low, high, 12).tolist()[1:-1], low, high, body.axial}))
    label = f"axial inertia of {body.name} / kg m²"
    parameters.append(
        Parameter(label, values, body.axial, lambda x: built(_inertia_changes(gearbox, body, inertias, x), touching))
    )
    time = 1e6 * gearbox.damping_times.mesh
    if time > 0.0:
        values = tuple(time * part for part in FRACTIONS)
        parameters.append(
            Parameter(
                "mesh damping time / µs", values, time, lambda x: built({"damping.mesh_time_s": 1e-6 * x}, touching)
            )
        )
    return tuple(parameters)


def _inertia_changes(gearbox: Gearbox, body: Body, inertias: str, axial: float) -> dict[str, float]:
    """Set a body's axial inertia; the transverse one follows where no rigid body could have both otherwise.

    Inertia that the program computed from the body's shape is replaced as a whole, in all sets.
    """
    place = f"bodies.{body.family}.inertia"
    values = {"axial_kg_m2": axial}
    if not body.spin_only:
        values["transverse_kg_m2"] = max(body.transverse, 0.5 * axial)
    if gearbox.case.bodies[body.family].inertia:
        return {f"{place}.{inertias}.{key}": value for key, value in values.items()}
    values |= {"mass_kg": body.mass, "centre_of_mass_z_mm": 1e3 * body.centre_of_mass_z}
    return {f"{place}.{name}.{key}": value for name in gearbox.inertia_sets for key, value in values.items()}


def planet_bearings(gearbox: Gearbox, assembly: Assembly) -> tuple[int, ...]:
    """Numbers of the bearings between planets and their carrier among an assembly's connectors."""
    carriers = {body.name: body.carrier for body in assembly.bodies}
    names = {bearing.name for bearing in gearbox.bearings if carriers.get(bearing.body) == bearing.on}
    return tuple(number for number, name in enumerate(assembly.connector_names) if name in names)


def scaled_bearings(assembly: Assembly, numbers: Sequence[int], factor: float) -> Assembly:
    """Multiply stiffness and damping of some bearings by a factor."""
    scale = np.ones(len(assembly.connector_names))
    scale[list(numbers)] = factor
    connectors = assembly.connectors._replace(
        stiffness=assembly.connectors.stiffness * scale[:, None, None],
        damping=assembly.connectors.damping * scale[:, None, None],
    )
    return replace(assembly, connectors=connectors)


@dataclass(frozen=True)
class FrequencyMatch(ReprMixin, line=" {parameter.label} = {value:.3g}: {frequency:.5g} Hz"):
    """An assumption that brings a mode to a frequency."""

    parameter: Parameter
    value: float
    """Of the parameter."""
    modes: Modes
    """Of the model with that value."""
    index: int
    """The mode among them, from 0."""

    @property
    def frequency(self) -> float:
        """Frequency of the mode, Hz."""
        return float(self.modes.frequency[self.index])

    @property
    def share(self) -> float:
        """Share of the mode in the mobility of the overall transmission error, 0 to 1."""
        return float(participation(self.modes.overall)[self.index])


def frequency_matches(
    variations: Iterable[ParameterVariation], frequency: float, least_share: float
) -> Iterator[FrequencyMatch]:
    """Yield the assumptions under which a mode of a minimum share lies at a frequency.

    Parameters
    ----------
    variations : where they cross the frequency, the modes are recomputed
    frequency : Hz
    least_share : of the overall transmission error's mobility, 0 to 1
    """
    for variation in variations:
        for value in variation.crossings(frequency, least_share):
            modes = modes_of(variation.parameter.build(value))
            visible = np.flatnonzero(participation(modes.overall) >= least_share)
            # Between two values modes may exchange their shapes: then none is there that was looked for.
            if not visible.size:
                continue
            index = int(visible[np.argmin(np.abs(modes.frequency[visible] - frequency))])
            if abs(modes.frequency[index] - frequency) <= MATCH_TOLERANCE * frequency:
                yield FrequencyMatch(variation.parameter, value, modes, index)
