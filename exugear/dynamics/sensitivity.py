"""How the eigenmodes near a frequency move with what had to be assumed: housing, bearings, inertia, damping."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from exugear.dynamics.assemble import assemble
from exugear.dynamics.assembly import Assembly
from exugear.dynamics.modes import Modes, modes_of
from exugear.model.gearbox import Gearbox
from exugear.model.parts import Body
from exugear.tooth_mesh.law import MeshData
from fe_ste.tools.arrays import Floats

FRACTIONS = (0.25, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0)
"""Parts of the default value that a parameter without a natural range takes."""
FOUND = 0.01
"""Largest relative distance of a mode from the frequency that an assumption is said to bring it to."""
HOUSING = (0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)


@dataclass(frozen=True)
class Parameter:
    """A model parameter to vary.

    Attributes
    ----------
    label : str
        With its unit.
    values : tuple of float
        Ascending.
    default : float
        Value of the case.
    build : callable
        The assembly at a value.
    logarithmic : bool
        Scale that suits it.
    """

    label: str
    values: tuple[float, ...]
    default: float
    build: Callable[[float], Assembly]
    logarithmic: bool = True


@dataclass(frozen=True)
class Sweep:
    """Modes over a parameter; n values, m modes, each followed by its shape.

    Attributes
    ----------
    parameter : Parameter
    frequency : (n, m) array
        Hz.
    share : (n, m) array
        Share of the overall transmission error's mobility, 0 to 1.
    amplification : (n, m) array
        Overall transmission error at resonance per transmission error of the mesh that excites it most, m/m.
    damping_ratio : (n, m) array
    """

    parameter: Parameter
    frequency: Floats
    share: Floats
    amplification: Floats
    damping_ratio: Floats

    def near(self, window: tuple[float, float], least_share: float) -> Sweep:
        """Keep modes that somewhere lie in a window (Hz) while they have a least share."""
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
        """Parameter values at which a mode that is seen passes a frequency (Hz), interpolated."""
        scale = np.log(self.parameter.values) if self.parameter.logarithmic else np.array(self.parameter.values)
        found = []
        for mode in range(self.frequency.shape[1]):
            off, share = self.frequency[:, mode] - frequency, self.share[:, mode]
            for n in np.flatnonzero(off[1:] * off[:-1] < 0.0):
                if max(share[n], share[n + 1]) >= least_share:
                    part = off[n] / (off[n] - off[n + 1])
                    place = float(scale[n] + part * (scale[n + 1] - scale[n]))
                    found.append(float(np.exp(place)) if self.parameter.logarithmic else place)
        return tuple(sorted(found))


def sweep_modes(parameter: Parameter, progress: Callable[[], None] | None = None) -> Sweep:
    """Compute the modes at each value of a parameter and follow them by their shapes.

    Parameters
    ----------
    parameter : Parameter
    progress : callable, optional
        Called after each value.
    """
    found = []
    for value in parameter.values:
        found.append(modes_of(parameter.build(value)))
        if progress is not None:
            progress()
    followed: list[Floats] = []
    # Elastic bodies have modes up to a frequency, which may pass it on the way: the least number can be followed.
    order = np.arange(min(len(modes.names) for modes in found))
    for n, modes in enumerate(found):
        order = followers(found[n - 1], modes, order) if n else order
        total = max(float(np.sum(modes.overall**2)), 1e-300)
        loudest = modes.amplification.max(axis=1, initial=0.0)
        figures = np.array([modes.frequency, modes.overall**2 / total, loudest, modes.damping_ratio])
        followed.append(figures[:, order])
    frequency, share, amplification, damping = np.stack(followed, axis=1)
    return Sweep(parameter, frequency, share, amplification, damping)


def followers(before: Modes, after: Modes, order: NDArray[np.int64]) -> NDArray[np.int64]:
    """Find for each mode followed so far its place among the modes of the next value.

    Modes are paired so that the sum of their squared overlaps is largest; both have unit modal mass.

    Parameters
    ----------
    before, after : Modes
    order : (m,) array of int
        Places of the followed modes in `before`.
    """
    roots = [np.linalg.cholesky(modes.assembly.mass_matrix) for modes in (before, after)]
    overlap = ((roots[0].T @ before.shapes[:, order]).T @ (roots[1].T @ after.shapes)) ** 2
    _, place = scipy.optimize.linear_sum_assignment(overlap, maximize=True)
    return np.asarray(place, dtype=np.int64)


def parameters_of(
    gearbox: Gearbox,
    variant: str,
    stiffness: Mapping[str, MeshData],
    law: str,
    inertias: str,
    folder: Path | None = None,
) -> tuple[Parameter, ...]:
    """Parameters of a gearbox that were assumed: those that the variant has.

    Parameters
    ----------
    gearbox : Gearbox
    variant, law, inertias : str
        The model that is varied.
    stiffness : mapping of pair name to (n,) array
        Mesh stiffness over the cycle, N/m.
    folder : Path, optional
        Where reductions of elastic bodies are kept and found again.

    Returns
    -------
    tuple of Parameter
        Housing factor where it is at work, stiffness of the planets' bearings where there are bearings; axial inertia
        of the overall output body; damping time of the meshes.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> stiffness = {"sun_planet": 3.8e9, "ring_planet": 4.9e9, "intermediate": 3.1e9, "high_speed": 1.9e9}
    >>> [parameter.label for parameter in parameters_of(gearbox, "rigid", stiffness, "line_of_action", "gears")]
    ['axial inertia of hss / kg m²', 'mesh damping time / µs']
    """

    def built(changes: Mapping[str, float]) -> Assembly:
        return assemble(gearbox.varied(changes), variant, stiffness, law, inertias, folder=folder)

    found = []
    base = assemble(gearbox, variant, stiffness, law, inertias, folder=folder)
    if any(support.factor != 1.0 for support in base.supports):
        default = gearbox.case.housing.factor
        values = tuple(sorted({*HOUSING, default}))
        found.append(Parameter("housing factor", values, default, lambda x: built({"housing.factor": x}), False))
    planets = planet_bearings(gearbox, base)
    if planets:
        found.append(
            Parameter("planet bearings / default", FRACTIONS, 1.0, lambda x: scaled_bearings(base, planets, x))
        )
    body = gearbox.body(gearbox.case.overall.output, inertias)
    sets = [gearbox.body(body.name, name).axial for name in gearbox.inertia_sets]
    values = _spanning(min(sets), max(sets), body.axial)
    label = f"axial inertia of {body.name} / kg m²"
    found.append(Parameter(label, values, body.axial, lambda x: built(_inertia_changes(body, inertias, x))))
    time = 1e6 * gearbox.case.damping.mesh_time_s
    if time > 0.0:
        values = tuple(time * part for part in FRACTIONS)
        found.append(
            Parameter("mesh damping time / µs", values, time, lambda x: built({"damping.mesh_time_s": 1e-6 * x}))
        )
    return tuple(found)


def _inertia_changes(body: Body, inertias: str, axial: float) -> dict[str, float]:
    """Set a body's axial inertia; the transverse one follows where no rigid body could have both otherwise."""
    key = f"bodies.{body.family}.inertia.{inertias}"
    changes = {f"{key}.axial_kg_m2": axial}
    if not body.spin_only:
        changes[f"{key}.transverse_kg_m2"] = max(body.transverse, 0.5 * axial)
    return changes


def _spanning(low: float, high: float, default: float) -> tuple[float, ...]:
    """Values over the range of the inertia sets, or around the one there is."""
    if high < 1.2 * low:
        return tuple(default * part for part in FRACTIONS)
    return tuple(sorted({*np.geomspace(low, high, 12).tolist()[1:-1], low, high, default}))


def planet_bearings(gearbox: Gearbox, assembly: Assembly) -> tuple[int, ...]:
    """Places of the bearings between planets and their carrier among an assembly's connectors."""
    carriers = {body.name: body.carrier for body in assembly.bodies}
    names = {bearing.name for bearing in gearbox.bearings if carriers.get(bearing.body) == bearing.on}
    return tuple(place for place, name in enumerate(assembly.connector_names) if name in names)


def scaled_bearings(assembly: Assembly, places: Sequence[int], factor: float) -> Assembly:
    """Multiply stiffness and damping of some bearings by a factor."""
    scale = np.ones(len(assembly.connector_names))
    scale[list(places)] = factor
    connectors = assembly.connectors._replace(
        stiffness=assembly.connectors.stiffness * scale[:, None, None],
        damping=assembly.connectors.damping * scale[:, None, None],
    )
    return replace(assembly, connectors=connectors)


@dataclass(frozen=True)
class Remedy:
    """An assumption that brings a mode to a frequency.

    Attributes
    ----------
    parameter : Parameter
    value : float
        Of the parameter.
    modes : Modes
        Of the model with that value.
    place : int
        The mode among them.
    """

    parameter: Parameter
    value: float
    modes: Modes
    place: int


def remedies(sweeps: Sequence[Sweep], frequency: float, least_share: float) -> Iterator[Remedy]:
    """Yield the assumptions under which a mode that is seen lies at a frequency (Hz), from crossings of the sweeps."""
    for sweep in sweeps:
        for value in sweep.crossings(frequency, least_share):
            modes = modes_of(sweep.parameter.build(value))
            total = max(float(np.sum(modes.overall**2)), 1e-300)
            seen = np.flatnonzero(modes.overall**2 >= least_share * total)
            place = int(seen[np.argmin(np.abs(modes.frequency[seen] - frequency))]) if seen.size else 0
            # Between two values modes may exchange their shapes: then none is there that was looked for.
            if seen.size and abs(modes.frequency[place] - frequency) <= FOUND * frequency:
                yield Remedy(sweep.parameter, value, modes, place)
