"""Eigenmodes of a gearbox variant: frequencies, damping, distribution of energy, and mode shapes as text.

Linearised about the static equilibrium under the file's static load, PMC frozen and mesh stiffness averaged over the
cycle. The tangent of the mesh model at that load is used: a stiffness k'(PMC) times the deflection would give the free
rotation a spurious stiffness.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import scipy
from numpy.typing import NDArray

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.load_cases import operating_range
from exugear.gearbox.versions import MODES
from exugear.system.bodies.elastic_body import ElasticBody
from exugear.system.bodies.reduction import TILT_X, TILT_Y, UX, UY, UZ, ReducedBody
from exugear.system.build import assemble
from exugear.system.diagrams import draw_campbell, draw_energies
from exugear.system.kernels.coordinates import SPIN
from exugear.system.kernels.meshes import STIFFNESS, TILT_COLUMNS, TILT_STIFFNESS
from exugear.system.modal_damping import unit_mass_motions
from exugear.system.statics import RIGID_BODY_LIMIT, Linearised, linearise, meshes_near_unconverged, static_state
from exugear.system.system import Assembly, input_hash
from exugear.system.tooth_mesh.element import Angles, MeshData
from exugear.system.tooth_mesh.laws.registry import LAWS
from fe_ste.tools.arrays import Booleans, Complexes, Floats
from fe_ste.tools.display import ReprMixin, TitledRows
from fe_ste.tools.drawing import COLUMN_WIDTHS, axes_or_new, label_curves
from fe_ste.tools.stores import Layout, Store, load_dataset, write_dataset

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

BODY_MOTIONS = ("spin", "radial", "axial", "tilt", "bending", "twist", "stretch", "deformation")
"""What a body does: four motions as a rigid body, three deformations of an elastic shaft, the last of other bodies."""
RIGID_MOTIONS = slice(0, 4)
BENDING, TWIST, STRETCH, DEFORMATION = range(4, 8)
"""Their places in `BODY_MOTIONS`."""
COORDINATES_OF_MOTIONS = ((SPIN,), (UX, UY), (UZ,), (TILT_X, TILT_Y))
"""Coordinates of a rigid body that belong to each of its four motions."""


def kinetic_shares(assembly: Assembly, shapes: Floats, q: Floats) -> Floats:
    """Share of kinetic energy (n, bodies, 8) by body and motion of modes (size, n) about coordinates q (size,)."""
    energy = np.diag(assembly.mass_matrix)[:, None] * shapes**2
    shares = np.zeros((shapes.shape[1], len(assembly.bodies), len(BODY_MOTIONS)))
    for n, body in enumerate(assembly.bodies):
        if body.name in assembly.elastic_bodies:
            of_body = assembly.elastic_slices[body.name]
            body_shapes = shapes[of_body]
            if body.name in assembly.turning:  # its matrices are those of its own frame
                turning = assembly.turning[body.name]
                body_shapes = turning.rotated(body_shapes, -turning.angle(q[of_body]))
            shares[:, n] = _elastic_energies(assembly.elastic_bodies[body.name].reduced, body_shapes)
            continue
        index = assembly.coordinates[body.name]
        for motion, coordinates in enumerate(COORDINATES_OF_MOTIONS):
            for coordinate in coordinates:
                if index[coordinate] >= 0:
                    shares[:, n, motion] += energy[index[coordinate]]
    total: Floats = shares.sum(axis=(1, 2), keepdims=True)
    return shares / total


def _elastic_energies(body: ReducedBody, shapes: Floats) -> Floats:
    """Return twice the kinetic energy (n, motions) of a flexible body: of its rigid part, and of each deformation.

    The rigid part follows from the total momentum; the remainder is orthogonal to it. The energy of rotations about the
    three axes is divided in proportion to the energy of each alone, because a housing's products of inertia couple
    them.
    """
    rigid = body.rigid_motions(body.rigid_inertia.centre)
    inertia = rigid.T @ body.mass @ rigid
    # Rigid motions that have the momentum of the whole.
    velocities = np.linalg.solve(inertia, rigid.T @ body.mass @ shapes)
    rigid_energies = np.diag(inertia)[:, None] * velocities**2
    turning = np.einsum("im,ij,jm->m", velocities[3:], inertia[3:, 3:], velocities[3:])
    rigid_energies[3:] *= turning / np.maximum(rigid_energies[3:].sum(axis=0), 1e-300)
    ux, uy, uz, tilt_x, tilt_y, spin = rigid_energies
    energies = np.zeros((shapes.shape[1], len(BODY_MOTIONS)))
    energies[:, RIGID_MOTIONS] = np.stack([spin, ux + uy, uz, tilt_x + tilt_y], axis=1)
    deformed = shapes - rigid @ velocities
    for block in body.blocks:
        if body.spin[block].any():
            motion = TWIST
        elif rigid[block, UZ].any():
            motion = STRETCH
        else:
            motion = BENDING
        if len(body.blocks) == 1:  # a solid, which falls into no planes
            motion = DEFORMATION
        mass = body.mass[np.ix_(block, block)]
        energies[:, motion] += np.einsum("im,ij,jm->m", deformed[block], mass, deformed[block])
    return energies


def mode_name(assembly: Assembly, element_names: tuple[str, ...], kinetic: Floats, strain: Floats) -> str:
    """Describe a mode: motions by body up to 80 % of the kinetic energy, and the elements with most strain energy.

    Parameters
    ----------
    kinetic : (bodies, motions) share by body and motion
    strain : (elements,) share by mesh, bearing, coupling and flexible body
    """
    moving: dict[str, float] = {}
    for body, shares in zip(assembly.bodies, kinetic, strict=True):
        for motion, share in zip(BODY_MOTIONS, shares, strict=True):
            family = "planets" if body.carrier else body.name
            text = f"{family} {'torsion' if motion == 'spin' else motion}"
            moving[text] = moving.get(text, 0.0) + float(share)
    strained: dict[str, float] = {}
    families = _families(assembly)
    for name, share in zip(element_names, strain, strict=True):
        family = families.get(name, name)
        strained[family] = strained.get(family, 0.0) + float(share)
    words = []
    described = 0.0
    for what, share in sorted(moving.items(), key=lambda pair: -pair[1]):
        if described >= 0.8 or share < 0.05:
            break
        words.append(f"{what} {100 * share:.0f} %")
        described += share
    most = max(strained, key=lambda name: strained[name])
    itself = most.removesuffix("_body")
    what = f"{itself} itself" if itself != most and itself in assembly.elastic_bodies else most
    return f"{', '.join(words)}; strain energy: {what} {100 * strained[most]:.0f} %"


def _families(assembly: Assembly) -> dict[str, str]:
    """Names of meshes and supports that those of all planets share; other names keep their digits."""
    families = {mesh.name: mesh.family for mesh in assembly.gearbox.meshes}
    return families | {support.name: support.family for support in assembly.supports}


def participation(overall: Floats) -> Floats:
    """Participation (n,) of each mode in the overall transmission error (TE); the sum is one.

    The participation is the square of the overall TE of a mode with unit modal mass, divided by the sum of these
    squares over all modes. This sum is r M^-1 r^T, independent of the stiffness, so that the participation is
    dimensionless.

    Parameters
    ----------
    overall : (n,) overall TE of modes with unit modal mass
    """
    squares = overall**2
    return np.asarray(squares / max(float(squares.sum()), 1e-300))


RIGID_COORDINATES = ("x", "y", "z", "tilt_x", "tilt_y", "spin")
FREE_ROTATION = "rigid-body rotation"
"""Name of the modes without any deflection."""
VISIBLE = 1e-3
"""Participation in the overall transmission error from which a Campbell diagram has a mode."""
SHOWN_MODES = 12
"""Modes in the table that a notebook shows."""


@dataclass(frozen=True)
class CampbellDiagram:
    """Modes and mesh orders of a Campbell diagram, and the ends of its axes; m modes."""

    seen: NDArray[np.int64]
    """(m,) numbers of the modes that participate in the overall transmission error, from 0."""
    weights: Floats
    """(m,) size of the marks at the crossings of each mode, 0 to 1."""
    orders: Mapping[str, float]
    """Periods per revolution of the input, by name."""
    fastest: float
    """Highest speed of the input, rad/s."""
    top: float
    """Highest frequency, Hz."""


@dataclass(frozen=True)
class Modes(ReprMixin):
    """Eigenmodes in order of frequency; n modes, in the variant `flexible` those in the band of its elastic bodies."""

    assembly: Assembly
    """What was linearised."""
    frequency: Floats
    """(n,) undamped, Hz."""
    damping_ratio: Floats
    """(n,) share of critical damping, from the damping matrix in the mode."""
    shapes: Floats
    """(size, n) real, unit modal mass."""
    element_names: tuple[str, ...]
    strain: Floats
    """(n, elements) share of strain energy by mesh, bearing, coupling and elastic body."""
    kinetic: Floats
    """(n, bodies, 8) share of kinetic energy by body and motion, see `BODY_MOTIONS`."""
    overall: Floats
    """(n,) overall DTE of the mode at unit modal mass, m / sqrt(kg)."""
    amplification: Floats
    """(n, meshes) overall DTE at resonance per amplitude of STE in one mesh, m/m."""
    names: tuple[str, ...]
    """Kinetic energy by body, as text."""
    growth_rate: float
    """Fastest growth of any disturbance, 1/s; above 0 only where the law `tangential` makes a mode flutter."""

    def _line(self) -> str:
        assembly = self.assembly
        return (
            f" of {assembly.gearbox.name[:60]!r}, {assembly.variant}, {assembly.mesh_model}: "
            f"{len(self.frequency)} modes up to {self.frequency.max(initial=0.0):.5g} Hz"
        )

    def _table(self) -> TitledRows:
        rows = {
            f"{number}: {frequency:.1f} Hz, damping {100.0 * ratio:.2f} %": name
            for number, (frequency, ratio, name) in enumerate(
                zip(self.frequency[:SHOWN_MODES], self.damping_ratio[:SHOWN_MODES], self.names, strict=False), start=1
            )
        }
        return repr(self).strip("<>"), rows

    @property
    def label(self) -> str:
        """Model of the modes: variant, mesh model, inertia set and housing factor."""
        assembly = self.assembly
        model = f"mesh model {assembly.mesh_model}, inertia set {assembly.inertias}"
        return f"{assembly.variant}, {model}, housing stiffness factor {assembly.housing_factor:g}"

    def nearest(self, frequency: float) -> int:
        """Find the number of the mode nearest to a frequency (Hz)."""
        return int(np.argmin(np.abs(self.frequency - frequency)))

    def energies(self) -> dict[str, Floats]:
        """Shares (n,) of each mode's energy, kinetic by body, then of strain by element; those of planets together."""
        families = _families(self.assembly)
        shares: dict[str, Floats] = {}
        for body, share in zip(self.assembly.bodies, self.kinetic.sum(axis=2).T, strict=True):
            name = f"{'planets' if body.carrier else body.name}, kinetic"
            shares[name] = shares.get(name, 0.0) + share
        for element, share in zip(self.element_names, self.strain.T, strict=True):
            name = f"{families.get(element, element).removesuffix('_body')}, strain"
            shares[name] = shares.get(name, 0.0) + share
        return shares

    def plot(self, kind: Literal["campbell", "energies"] = "campbell", ax: Axes | None = None) -> Axes:
        """Draw the Campbell diagram, or the energy of all modes.

        Parameters
        ----------
        kind
            ``campbell``: modes with more than 0.1 % participation in the overall transmission error, and mesh
            orders up to the end of the operating range; size of a mark: participation. ``energies``:
            share of the kinetic energy by body and of the strain energy by element.
        ax : matplotlib axes; by default new ones, whose ``ax.figure`` can be shown and saved

        Raises
        ------
        ValueError
            There is no such kind.

        Examples
        --------
        >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
        >>> stiffness = {"sun_planet": 3.8e9, "ring_planet": 4.9e9, "intermediate": 3.1e9, "high_speed": 1.9e9}
        >>> modes = eigenmodes(gearbox, Choice("rigid"), stiffness)
        >>> ax = modes.plot()
        >>> ax.get_xlabel(), ax.get_ylabel()
        ('Input speed / rpm', 'Frequency / kHz')
        """
        if kind == "energies":
            return draw_energies(self.energies(), ax)
        if kind != "campbell":
            raise ValueError(f"kind = {kind!r}: must be one of campbell, energies")
        diagram = self.campbell()
        with axes_or_new(ax, COLUMN_WIDTHS[2], 5.0) as panel:
            draw_campbell(
                panel, self.frequency[diagram.seen], diagram.orders, diagram.fastest, diagram.top, diagram.weights
            )
            label_curves(panel)
            return panel

    def campbell(self) -> CampbellDiagram:
        """Return what the Campbell diagram shows, up to the end of the operating range or the highest mode."""
        gearbox = self.assembly.gearbox
        shares = participation(self.overall)
        seen = (self.frequency > 0.0) & (shares >= VISIBLE)
        orders = gearbox.mesh_orders()
        highest = max(orders.values(), default=0.0) / (2.0 * np.pi)
        top = 1.1 * float(max(self.frequency[seen], default=1.0))
        fastest = top / highest if highest else 1.0
        if (operation := operating_range(gearbox)) is not None:
            fastest = operation[1]
            top = min(top, 1.05 * highest * fastest) if highest else top
        weights = (shares[seen] / max(float(shares.max(initial=0.0)), 1e-300)) ** 0.5
        return CampbellDiagram(np.flatnonzero(seen), weights, orders, fastest, top)

    def to_dataset(self) -> xr.Dataset:
        """Labelled arrays with units, what `save` writes."""
        import xarray as xr

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
            "motion": np.array(BODY_MOTIONS, dtype=object),
            "mesh": np.array(assembly.mesh_names, dtype=object),
        }
        attributes = {
            "gearbox": assembly.gearbox.name,
            "variant": str(assembly.variant),
            "mesh_model": assembly.mesh_model,
            "inertias": assembly.inertias,
            "input_hash": input_hash(assembly),
            "method_version": MODES,
            "housing_factor": assembly.housing_factor,
            "bearing_laws": assembly.bearing_laws,
            "mesh_contact": assembly.contacts.description,
            "growth_rate": self.growth_rate,
            "near_unconverged_states": ", ".join(meshes_near_unconverged(assembly)),
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
    ("gearbox", "variant", "mesh_model", "inertias", "input_hash", "housing_factor", "growth_rate"),
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


def kept_modes(path: Path, assembly: Assembly) -> Modes | None:
    """Read modes of exactly this assembly that `Modes.save` wrote, the same to the bit; None where there are none."""
    data = Store(path, input_hash(assembly)).read_dataset(_LAYOUT)
    if data is None:
        return None
    frequency: Floats = data["frequency"].to_numpy()
    element_names = tuple(data["element"].to_numpy().tolist())
    strain: Floats = data["strain_energy_share"].to_numpy()
    kinetic: Floats = data["kinetic_energy_share"].to_numpy()
    return Modes(
        assembly=assembly,
        frequency=frequency,
        damping_ratio=data["damping_ratio"].to_numpy(),
        shapes=data["shape"].to_numpy(),
        element_names=element_names,
        strain=strain,
        kinetic=kinetic,
        overall=data["overall_dte"].to_numpy(),
        amplification=data["amplification"].to_numpy(),
        names=_mode_names(assembly, element_names, kinetic, strain, frequency > 0.0),
        growth_rate=float(data.attrs["growth_rate"]),
    )


def coordinate_labels(assembly: Assembly) -> list[str]:
    """Name of each coordinate, such as `hss.spin`, or `hss.hs_pinion.spin` at a seat of an elastic body."""
    labels = [""] * assembly.size
    for body in assembly.bodies:
        for motion, index in zip(RIGID_COORDINATES, assembly.coordinates[body.name], strict=True):
            if index >= 0:
                labels[index] = f"{body.name}.{motion}"
    for name, of_body in assembly.elastic_slices.items():
        reduced = assembly.elastic_bodies[name].reduced
        body_labels = [f"{seat.name}.{motion}" for seat in reduced.seats for motion in RIGID_COORDINATES]
        body_labels += [f"{group.replace(' ', '_')}_{n}" for n, group in enumerate(reduced.modal_groups, start=1)]
        labels[of_body] = [f"{name}.{label}" for label in body_labels]
    return labels


def eigenmodes(
    gearbox: Gearbox,
    choice: Choice,
    stiffness: Mapping[str, MeshData],
    bodies: Mapping[str, ElasticBody] | None = None,
    *,
    angles: Angles = "reference",
) -> Modes:
    """Compute the eigenmodes of a gearbox variant at its static load.

    Parameters
    ----------
    choice : variant, mesh model and inertia set
    stiffness : mapping of pair name to (n,) array
        Mesh stiffness F_bt / STE over the cycle, N/m, for example from the STE tables.
    bodies : by body name, reduced flexible bodies, required by the variant `flexible`
    angles : {"reference", "operating"}
        Angles of the mesh model `tangential`.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> stiffness = {"sun_planet": 3.8e9, "ring_planet": 4.9e9, "intermediate": 3.1e9, "high_speed": 1.9e9}
    >>> modes = eigenmodes(gearbox, Choice("rigid"), stiffness)
    >>> len(modes.frequency), modes.names[0]
    (8, 'rigid-body rotation')
    """
    return modes_of(assemble(gearbox, choice, stiffness, bodies, angles=angles))


def modes_of(assembly: Assembly, preload: bool = True) -> Modes:
    """Eigenmodes of an assembly, at its static load or (preload False) unloaded."""
    assembly = assembly if preload else assembly.unloaded
    q = static_state(assembly).q if preload else np.zeros(assembly.size)
    linear = linearise(assembly, q)
    # A preloaded connector or the law `tangential` makes the stiffness unsymmetric. Equal frequencies may then come out
    # as a complex pair that differs from real by round-off; its real and imaginary parts span the same plane.
    free = unit_mass_motions(linear.mass, assembly.motions)
    values, vectors = scipy.linalg.eig(free.T @ linear.total_stiffness @ free)
    shapes = free @ np.where(values.imag < 0.0, vectors.imag, vectors.real)
    order = np.argsort(values.real)
    frequency = np.sqrt(np.maximum(values.real[order], 0.0)) / (2.0 * np.pi)
    shapes = shapes[:, order]
    if assembly.elastic_bodies:  # beyond the band the bodies' normal modes are only what keeps their statics right
        inside = frequency <= assembly.gearbox.case.elasticity.band_Hz
        frequency = frequency[inside]
        shapes = shapes[:, inside]
    masses = np.einsum("im,ij,jm->m", shapes, linear.mass, shapes)
    shapes = shapes / np.sqrt(masses)
    omega = 2.0 * np.pi * frequency
    modal_damping = np.einsum("im,ij,jm->m", shapes, linear.total_damping, shapes)
    elastic = frequency > RIGID_BODY_LIMIT
    with np.errstate(over="ignore"):  # a static load beyond anything: its modes are damped infinitely
        ratio = np.divide(modal_damping, 2.0 * omega, out=np.zeros_like(omega), where=elastic)
    strain = np.array([np.einsum("im,ij,jm->m", shapes, k, shapes) for k in linear.stiffness.values()])
    strain = strain.reshape(len(linear.stiffness), len(frequency)).T  # gears that only roll have no element
    strain = np.where(elastic[:, None], strain / np.maximum(strain.sum(axis=1, keepdims=True), 1e-300), 0.0)
    kinetic = kinetic_shares(assembly, shapes, q)
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
        amplification=_amplification(assembly, q, linear, shapes, overall, omega, ratio, elastic),
        names=_mode_names(assembly, element_names, kinetic, strain, elastic),
        growth_rate=growth_rate(linear) if LAWS[assembly.mesh_model].has_force else 0.0,
    )


USUAL_DAMPING = (0.003, 0.1)
"""Share of critical damping below and above which a mode is unusual; measured gearboxes have 1 to 4 %."""
JUDGED_BELOW = 2000.0
"""Frequency (Hz) up to which damping is judged: above it little is measured."""


def unusual_damping(modes: Modes) -> str:
    """Say which modes below 2 kHz have unusually low or high damping, and the remedy; empty if none has.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> stiffness = {"sun_planet": 3.8e9, "ring_planet": 4.9e9, "intermediate": 3.1e9, "high_speed": 1.9e9}
    >>> unusual_damping(eigenmodes(gearbox, Choice("bushing"), stiffness))
    ''
    >>> print(unusual_damping(eigenmodes(gearbox.varied({"damping": {}}), Choice("bushing"), stiffness)))
    damping of ... modes below 2 kHz is unusual (0.079 % at 62.94 Hz); measured gearboxes have 1 to 4 % of critical: ...
    """
    judged = (modes.frequency > 0.0) & (modes.frequency < JUDGED_BELOW)
    ratio = modes.damping_ratio
    low = judged & (ratio < USUAL_DAMPING[0])
    high = judged & (ratio > USUAL_DAMPING[1])
    ends = []
    if low.any():
        ends.append(int(np.argmin(np.where(low, ratio, np.inf))))
    if high.any():
        ends.append(int(np.argmax(np.where(high, ratio, -np.inf))))
    if not ends:
        return ""
    examples = ", ".join(f"{100.0 * ratio[n]:.2g} % at {modes.frequency[n]:.4g} Hz" for n in ends)
    remedy = "set modal_percent = 2.0 in [damping]"
    for body in modes.assembly.turning:
        remedy = (
            f"the flexible body {body} turns with planets, so that damping times apply; for modal_percent set "
            f"bodies.{body}.flexibility = 'none'"
        )
    return (
        f"damping of {int((low | high).sum())} of {int(judged.sum())} modes below {1e-3 * JUDGED_BELOW:g} kHz is "
        f"unusual ({examples}); measured gearboxes have 1 to 4 % of critical: {remedy}"
    )


def _mode_names(
    assembly: Assembly, element_names: tuple[str, ...], kinetic: Floats, strain: Floats, elastic: Booleans
) -> tuple[str, ...]:
    """Describe all modes by `mode_name`; those without any deflection are `FREE_ROTATION`."""
    return tuple(
        mode_name(assembly, element_names, kinetic[m], strain[m]) if elastic[m] else FREE_ROTATION
        for m in range(elastic.size)
    )


def overall_row(assembly: Assembly) -> Floats:
    """Build the row (size,) of the overall DTE as a length: (output - ratio input) times base radius, m.

    In a train of several degrees of freedom the shares of the further bodies that fix the output are taken off, too.
    """
    overall = assembly.gearbox.case.overall
    radius = assembly.gearbox.output_radius
    row = np.zeros(assembly.size)
    row[assembly.spin[overall.output]] += radius
    for body, share in assembly.gearbox.train.shares.items():
        row[assembly.spin[body]] -= radius * share
    return row


def _amplification(
    assembly: Assembly,
    q: Floats,
    linear: Linearised,
    shapes: Floats,
    overall: Floats,
    omega: Floats,
    ratio: Floats,
    elastic: NDArray[np.bool_],
) -> Floats:
    """Overall DTE at resonance per unit STE of each mesh: |overall| |k w phi| / (2 zeta omega^2), k tangent at q."""
    amplification = np.zeros((omega.size, len(assembly.mesh_names)))
    resonance = np.where(elastic, 2.0 * ratio * omega**2, np.inf)
    resonance = np.where(resonance > 0.0, resonance, np.inf)
    tangents = assembly.mesh_states(q, np.zeros_like(q), assembly.mean_meshes)[:, STIFFNESS]
    for n, name in enumerate(assembly.mesh_names):
        mean = float(tangents[n])
        # What tilts against the resistance of the teeth does not close them.
        closed = linear.stiffness[name] - _tilt_stiffness(assembly, q, n)
        strain = np.einsum("im,ij,jm->m", shapes, closed, shapes)
        closing = np.sqrt(np.maximum(strain, 0.0) / mean)
        amplification[:, n] = np.abs(overall) * mean * closing / resonance
    return amplification


def _tilt_stiffness(assembly: Assembly, q: Floats, n: int) -> Floats:
    """Stiffness (size, size) that a mesh with a law along a row has against misalignment: zero without any."""
    mesh = assembly.mean_meshes.one(n)
    rest = np.zeros(assembly.size)
    if not mesh.tilt[0, TILT_STIFFNESS] > 0.0:
        return np.zeros((assembly.size,) * 2)
    twice = mesh._replace(tilt=mesh.tilt * (1.0 + (np.arange(TILT_COLUMNS) == TILT_STIFFNESS)))
    return assembly.mesh_jacobians(q, rest, mesh)[0] - assembly.mesh_jacobians(q, rest, twice)[0]


def counterparts(before: Modes, after: Modes) -> tuple[NDArray[np.int64], Floats]:
    """Find for each mode the one that it becomes when bodies become elastic or others are added.

    Parameters
    ----------
    before, after
        Such as those of the variants `bushing` and `flexible` of one gearbox. The second has all bodies of the first;
        one that is elastic in both has one shape.

    Returns
    -------
    place : (n,) array of int
        Its place among the modes of `after`, each used once; the sum of the shares is largest.
    share : (n,) squared overlap, 1 for the same motion: the kinetic energy that both shapes share
    """
    source = before.assembly
    target = after.assembly
    carried = np.zeros((target.size, source.size))  # coordinates of `after` that the shapes of `before` have
    for body in source.bodies:
        if body.name in source.elastic_bodies:
            of_body = source.elastic_slices[body.name]
            carried[target.elastic_slices[body.name], of_body] = np.eye(of_body.stop - of_body.start)
            continue
        index = [i for i in source.coordinates[body.name] if i >= 0]
        if body.name in target.elastic_bodies:
            rigid = target.elastic_bodies[body.name].reduced.rigid_motions((*body.axis, body.centre_of_mass_z))
            carried[target.elastic_slices[body.name], index[0] : index[-1] + 1] = rigid
        else:
            carried[[i for i in target.coordinates[body.name] if i >= 0], index] = 1.0
    share = (after.shapes.T @ target.mass_matrix @ carried @ before.shapes) ** 2
    import scipy.optimize  # a quarter of a second that a run need not wait

    _, place = scipy.optimize.linear_sum_assignment(share.T, maximize=True)
    return np.asarray(place, dtype=np.int64), share[place, np.arange(len(place))]


def growth_rate(linear: Linearised) -> float:
    """Largest real part of the eigenvalues of M x'' + D x' + K x = 0, 1/s, the free rotation left out."""
    matrix = state_matrix(linear.mass, linear.total_damping, linear.total_stiffness)
    return fastest_growth(np.asarray(scipy.linalg.eigvals(matrix), dtype=np.complex128))


def state_matrix(mass: Floats, damping: Floats, stiffness: Floats) -> Floats:
    """Matrix A (2 size, 2 size) of M x'' + D x' + K x = 0 as y' = A y with y = (x, x')."""
    size = len(mass)
    lower = np.linalg.solve(mass, np.hstack([-stiffness, -damping]))
    return np.vstack([np.eye(size, 2 * size, size), lower])


def fastest_growth(eigenvalues: Complexes) -> float:
    """Largest real part of eigenvalues (1/s) without the free rotation; minus infinity if there are no others."""
    elastic = np.abs(eigenvalues.imag) > 2.0 * np.pi * RIGID_BODY_LIMIT
    return float(eigenvalues.real[elastic].max(initial=-np.inf))
