"""Eigenmodes of a gearbox variant: frequencies, damping, where the energy sits, and what moves in words.

Linearised about the static equilibrium under the file's static load, PMC frozen and mesh stiffness averaged
over the cycle. The tangent of the law at that load is used: k'(PMC) times the deflection would give the free
rotation a false stiffness.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy.optimize
import xarray as xr
from numpy.typing import NDArray

from exugear.bodies.of_gearbox import ElasticBody
from exugear.bodies.reduced_body import ReducedBody
from exugear.dynamics.assemble import assemble
from exugear.dynamics.assembly import Assembly
from exugear.dynamics.fingerprint import input_hash
from exugear.dynamics.linearised import RIGID_BODY_LIMIT, Linearised, growth_rate, linearise, undamped_modes
from exugear.dynamics.statics import static_state
from exugear.model.choice import Choice
from exugear.model.gearbox import Gearbox
from exugear.model.versions import MODES
from exugear.tooth_mesh.element import Angles, MeshData
from fe_ste.tools.arrays import Floats
from fe_ste.tools.notebook import html_table, value_range
from fe_ste.tools.sealed import Layout, load_dataset, write_dataset

RIGID_COORDINATES = ("x", "y", "z", "tilt_x", "tilt_y", "spin")
FREE_ROTATION = "free rotation of the train"
MOTIONS = ("spin", "radial", "axial", "tilt", "bending", "twist", "stretch", "deformation")
"""What a body does: four motions as a rigid body, three deformations of an elastic shaft, the last of other bodies."""


@dataclass(frozen=True)
class Modes:
    """Eigenmodes in order of frequency; n modes, in the variant `flexible` those in the band of its elastic bodies.

    Attributes
    ----------
    assembly : what was linearised
    frequency : (n,) undamped, Hz
    damping_ratio : (n,) share of critical damping, from the damping matrix in the mode
    shapes : (size, n) real, unit modal mass
    strain : (n, elements) share of strain energy by mesh, bearing, coupling and elastic body
    kinetic : (n, bodies, 8) share of kinetic energy by body and motion, see `MOTIONS`
    overall : (n,) overall DTE of the mode at unit modal mass, m / sqrt(kg)
    amplification : (n, meshes) overall DTE at resonance per amplitude of STE in one mesh, m/m
    names : what moves, in words
    growth_rate : fastest growth of any disturbance, 1/s; above 0 only where the law `seed` makes a mode flutter
    """

    assembly: Assembly
    frequency: Floats
    damping_ratio: Floats
    shapes: Floats
    element_names: tuple[str, ...]
    strain: Floats
    kinetic: Floats
    overall: Floats
    amplification: Floats
    names: tuple[str, ...]
    growth_rate: float

    def __repr__(self) -> str:
        """One line."""
        assembly = self.assembly
        chosen = f"{assembly.variant}, {assembly.law}, {assembly.inertias}"
        return f"Modes({chosen}: {self.frequency.size}, {value_range(self.frequency, 'Hz')})"

    def _repr_html_(self) -> str:
        assembly = self.assembly
        rows = {
            "variant": assembly.variant,
            "mesh law": assembly.law,
            "inertia set": assembly.inertias,
            "modes": str(self.frequency.size),
            "frequency": value_range(self.frequency, "Hz"),
            "fastest growth": f"{self.growth_rate:.3g} 1/s",
        }
        return html_table(f"Modes of {assembly.gearbox.name}", rows)

    def nearest(self, frequency: float) -> int:
        """Find the number of the mode nearest to a frequency (Hz)."""
        return int(np.argmin(np.abs(self.frequency - frequency)))

    def to_dataset(self) -> xr.Dataset:
        """Labelled arrays with units, what `save` writes."""
        assembly = self.assembly
        coordinate_names = coordinate_labels(assembly)
        variables: dict[str, tuple[tuple[str, ...], Any, dict[str, str]]] = {
            "frequency": (("mode",), self.frequency, {"units": "Hz"}),
            "damping_ratio": (("mode",), self.damping_ratio, {"units": "1"}),
            "shape": (("coordinate", "mode"), self.shapes, {"units": "1/sqrt(kg) or 1/(m sqrt(kg))"}),
            "strain_energy_share": (("mode", "element"), self.strain, {"units": "1"}),
            "kinetic_energy_share": (("mode", "body", "motion"), self.kinetic, {"units": "1"}),
            "overall_dte": (("mode",), self.overall, {"units": "m/sqrt(kg)"}),
            "amplification": (("mode", "mesh"), self.amplification, {"units": "m/m"}),
            "name": (("mode",), np.array(self.names, dtype=object), {}),
        }
        coordinates: dict[str, Any] = {
            "mode": np.arange(1, len(self.names) + 1),
            "coordinate": np.array(coordinate_names, dtype=object),
            "element": np.array(self.element_names, dtype=object),
            "body": np.array([body.name for body in assembly.bodies], dtype=object),
            "motion": np.array(MOTIONS, dtype=object),
            "mesh": np.array(assembly.mesh_names, dtype=object),
        }
        attributes = {
            "gearbox": assembly.gearbox.name,
            "variant": assembly.variant,
            "mesh_law": assembly.law,
            "inertias": assembly.inertias,
            "input_hash": input_hash(assembly),
            "method_version": MODES,
            "housing_factor": assembly.housing_factor,
            "growth_rate": self.growth_rate,
        }
        return xr.Dataset(variables, coordinates, attributes)

    def save(self, path: str | Path) -> Path:
        """Write to netCDF (atomically) and return the path."""
        path = Path(path)
        write_dataset(path, self.to_dataset())
        return path


_LAYOUT = Layout(
    "eigenmodes",
    MODES,
    {
        "frequency": ("mode",),
        "damping_ratio": ("mode",),
        "shape": ("coordinate", "mode"),
        "strain_energy_share": ("mode", "element"),
        "kinetic_energy_share": ("mode", "body", "motion"),
        "overall_dte": ("mode",),
        "amplification": ("mode", "mesh"),
        "name": ("mode",),
    }
    | {name: (name,) for name in ("mode", "coordinate", "element", "body", "motion", "mesh")},
    ("gearbox", "variant", "mesh_law", "inertias", "input_hash", "housing_factor", "growth_rate"),
)


def load_modes(path: str | Path) -> xr.Dataset:
    """Read what `Modes.save` wrote.

    Raises
    ------
    FileError
        The file is missing, damaged, or of another version.

    Examples
    --------
    >>> load_modes("nowhere/modes.nc")
    Traceback (most recent call last):
    fe_ste.tools.files.FileError: nowhere/modes.nc: no such file
    """
    return load_dataset(Path(path), _LAYOUT)


def coordinate_labels(assembly: Assembly) -> list[str]:
    """Name of each coordinate, such as `hss.spin`, or `hss.hs_pinion.spin` at a seat of an elastic body."""
    labels = [""] * assembly.size
    for body in assembly.bodies:
        for motion, index in zip(RIGID_COORDINATES, assembly.coordinates[body.name], strict=True):
            if index >= 0:
                labels[index] = f"{body.name}.{motion}"
    for name, place in assembly.elastic_slices.items():
        reduced = assembly.elastic_bodies[name].reduced
        own = [f"{seat.name}.{motion}" for seat in reduced.seats for motion in RIGID_COORDINATES]
        own += [f"{group.replace(' ', '_')}_{n}" for n, group in enumerate(reduced.groups, start=1)]
        labels[place] = [f"{name}.{label}" for label in own]
    return labels


def eigenmodes(
    gearbox: Gearbox,
    choice: Choice,
    stiffness: Mapping[str, MeshData],
    bodies: Mapping[str, ElasticBody] | None = None,
    *,
    angles: Angles = "reference",
) -> Modes:
    """Eigenmodes of a gearbox variant at its static load.

    Parameters
    ----------
    gearbox : Gearbox
    choice : Choice
        Variant, mesh law and inertia set.
    stiffness : mapping of pair name to (n,) array
        Mesh stiffness F_bt / STE over the cycle, N/m, for example from the STE tables.
    bodies : mapping of body name to ElasticBody, optional
        Reduced elastic bodies, which the variant `flexible` needs.
    angles : {"reference", "operating"}
        Angles of the law `seed`.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> stiffness = {"sun_planet": 3.8e9, "ring_planet": 4.9e9, "intermediate": 3.1e9, "high_speed": 1.9e9}
    >>> modes = eigenmodes(gearbox, Choice("rigid"), stiffness)
    >>> len(modes.frequency), modes.names[0]
    (8, 'free rotation of the train')
    """
    return modes_of(assemble(gearbox, choice, stiffness, bodies, angles=angles))


def modes_of(assembly: Assembly, preload: bool = True) -> Modes:
    """Eigenmodes of an assembly, at its static load or (preload False) unloaded."""
    q = static_state(assembly).q if preload else np.zeros(assembly.size)
    linear = linearise(assembly, q)
    frequency, shapes = undamped_modes(linear.mass, linear.total_stiffness, assembly.motions)
    if assembly.elastic_bodies:  # beyond the band the shafts' own vibrations are only what keeps their statics right
        inside = frequency <= assembly.gearbox.case.elasticity.band_Hz
        frequency, shapes = frequency[inside], shapes[:, inside]
    masses = np.einsum("im,ij,jm->m", shapes, linear.mass, shapes)
    shapes = shapes / np.sqrt(masses)
    omega = 2.0 * np.pi * frequency
    modal_damping = np.einsum("im,ij,jm->m", shapes, linear.total_damping, shapes)
    elastic = frequency > RIGID_BODY_LIMIT
    with np.errstate(over="ignore"):  # a static load beyond anything: its modes are damped infinitely
        ratio = np.divide(modal_damping, 2.0 * omega, out=np.zeros_like(omega), where=elastic)
    strain = np.array([np.einsum("im,ij,jm->m", shapes, k, shapes) for k in linear.stiffness.values()]).T
    strain = np.where(elastic[:, None], strain / np.maximum(strain.sum(axis=1, keepdims=True), 1e-300), 0.0)
    kinetic = _kinetic_shares(assembly, shapes, q)
    overall = overall_row(assembly) @ shapes
    element_names = tuple(linear.stiffness)
    return Modes(
        assembly=assembly,
        frequency=np.where(elastic, frequency, 0.0),
        damping_ratio=ratio,
        shapes=shapes,
        element_names=element_names,
        strain=strain,
        kinetic=kinetic,
        overall=np.abs(overall),
        amplification=_amplification(assembly, linear, shapes, overall, omega, ratio, elastic),
        names=tuple(
            mode_name(assembly, element_names, kinetic[m], strain[m]) if elastic[m] else "free rotation of the train"
            for m in range(frequency.size)
        ),
        growth_rate=growth_rate(linear) if assembly.law != "rigid" else 0.0,
    )


def overall_row(assembly: Assembly) -> Floats:
    """Build the row (size,) of the overall DTE as a length: (output - ratio input) times base radius, m."""
    overall = assembly.gearbox.case.overall
    radius = assembly.gearbox.gears[overall.output_gear].base_radius
    row = np.zeros(assembly.size)
    row[assembly.spin[overall.output]] += radius
    row[assembly.spin[overall.input]] -= radius * assembly.gearbox.train.ratio
    return row


def _kinetic_shares(assembly: Assembly, shapes: Floats, q: Floats) -> Floats:
    """Share of kinetic energy (n, bodies, motions) of modes about coordinates q."""
    energy = np.diag(assembly.mass_matrix)[:, None] * shapes**2
    shares = np.zeros((shapes.shape[1], len(assembly.bodies), len(MOTIONS)))
    for n, body in enumerate(assembly.bodies):
        if body.name in assembly.elastic_bodies:
            place = assembly.elastic_slices[body.name]
            own = shapes[place]
            if body.name in assembly.turning:
                turning = assembly.turning[body.name]
                own = turning.turned(own, -turning.angle(q[place]))
            shares[:, n] = _elastic_energies(assembly.elastic_bodies[body.name].reduced, own)
            continue
        index = assembly.coordinates[body.name]
        for motion, members in enumerate(((5,), (0, 1), (2,), (3, 4))):
            for member in members:
                if index[member] >= 0:
                    shares[:, n, motion] += energy[index[member]]
    whole: Floats = shares.sum(axis=(1, 2), keepdims=True)
    return shares / whole


def _elastic_energies(body: ReducedBody, shapes: Floats) -> Floats:
    """Twice the kinetic energy (n, motions) of an elastic body: of its rigid part, and of each deformation.

    The rigid part is what the momentum of the whole tells; the rest is orthogonal to it. Turns about all three axes
    share their energy in the proportion that each has alone: a housing's products of inertia couple them.
    """
    rigid = body.rigid_motions(body.rigid_inertia.centre)
    inertia = rigid.T @ body.mass @ rigid
    amount = np.linalg.solve(inertia, rigid.T @ body.mass @ shapes)
    moved = np.diag(inertia)[:, None] * amount**2
    turning = np.einsum("im,ij,jm->m", amount[3:], inertia[3:, 3:], amount[3:])
    moved[3:] *= turning / np.maximum(moved[3:].sum(axis=0), 1e-300)
    energies = np.zeros((shapes.shape[1], len(MOTIONS)))
    energies[:, :4] = np.stack([moved[5], moved[0] + moved[1], moved[2], moved[3] + moved[4]], axis=1)
    deformed = shapes - rigid @ amount
    for block in body.blocks:
        motion = 5 if body.spin[block].any() else 6 if rigid[block, 2].any() else 4
        if len(body.blocks) == 1:  # a solid, which falls into no planes
            motion = 7
        own = body.mass[np.ix_(block, block)]
        energies[:, motion] += np.einsum("im,ij,jm->m", deformed[block], own, deformed[block])
    return energies


def _amplification(
    assembly: Assembly,
    linear: Linearised,
    shapes: Floats,
    overall: Floats,
    omega: Floats,
    ratio: Floats,
    elastic: NDArray[np.bool_],
) -> Floats:
    """Overall DTE at resonance per unit STE of each mesh: |overall| |k w phi| / (2 zeta omega^2)."""
    found = np.zeros((omega.size, len(assembly.mesh_names)))
    resonance = np.where(elastic, 2.0 * ratio * omega**2, np.inf)
    resonance = np.where(resonance > 0.0, resonance, np.inf)
    for n, (name, element) in enumerate(zip(assembly.mesh_names, assembly.elements, strict=True)):
        mean = float(np.mean(element.stiffness))
        strain = np.einsum("im,ij,jm->m", shapes, linear.stiffness[name], shapes)
        closing = np.sqrt(np.maximum(strain, 0.0) / mean)
        found[:, n] = np.abs(overall) * mean * closing / resonance
    return found


def mode_name(assembly: Assembly, element_names: tuple[str, ...], kinetic: Floats, strain: Floats) -> str:
    """Describe a mode: who moves how, until 80 % of the kinetic energy is told, and what is strained most.

    Parameters
    ----------
    kinetic : (bodies, motions) share by body and motion
    strain : (elements,) share by mesh, bearing, coupling and elastic body
    """
    moving: dict[str, float] = {}
    for body, shares in zip(assembly.bodies, kinetic, strict=True):
        for motion, share in zip(MOTIONS, shares, strict=True):
            family = "planets" if body.carrier else body.name
            moving[f"{family} {motion}"] = moving.get(f"{family} {motion}", 0.0) + float(share)
    strained: dict[str, float] = {}
    for name, share in zip(element_names, strain, strict=True):
        family = name.rstrip("0123456789").rstrip("_")
        strained[family] = strained.get(family, 0.0) + float(share)
    words, told = [], 0.0
    for what, share in sorted(moving.items(), key=lambda item: -item[1]):
        if told >= 0.8 or share < 0.05:
            break
        words.append(f"{what} {100 * share:.0f} %")
        told += share
    most = max(strained, key=lambda name: strained[name])
    itself = most.removesuffix("_body")
    what = f"{itself} itself" if itself != most and itself in assembly.elastic_bodies else most
    return f"{', '.join(words)}; strained: {what} {100 * strained[most]:.0f} %"


def counterparts(before: Modes, after: Modes) -> tuple[NDArray[np.int64], Floats]:
    """Find for each mode the one that it becomes when bodies become elastic or others are added.

    Parameters
    ----------
    before, after : Modes
        Such as those of the variants `bushing` and `flexible` of one gearbox. The second has all bodies of the first;
        one that is elastic in both has one shape.

    Returns
    -------
    place : (n,) array of int
        Its place among the modes of `after`, each used once; the sum of the shares is largest.
    share : (n,) array
        Squared overlap, 1 for the same motion: the kinetic energy that both shapes share.
    """
    one, other = before.assembly, after.assembly
    carried = np.zeros((other.size, one.size))
    for body in one.bodies:
        if body.name in one.elastic_bodies:
            own = one.elastic_slices[body.name]
            carried[other.elastic_slices[body.name], own] = np.eye(own.stop - own.start)
            continue
        index = [i for i in one.coordinates[body.name] if i >= 0]
        if body.name in other.elastic_bodies:
            rigid = other.elastic_bodies[body.name].reduced.rigid_motions((*body.axis, body.centre_of_mass_z))
            carried[other.elastic_slices[body.name], index[0] : index[-1] + 1] = rigid
        else:
            carried[[i for i in other.coordinates[body.name] if i >= 0], index] = 1.0
    share = (after.shapes.T @ other.mass_matrix @ carried @ before.shapes) ** 2
    _, place = scipy.optimize.linear_sum_assignment(share.T, maximize=True)
    return np.asarray(place, dtype=np.int64), share[place, np.arange(len(place))]
