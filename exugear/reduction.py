"""Elastic bodies reduced to a few coordinates: six at each seat, and a few amplitudes inside.

A seat is where a gear or a bearing sits. Its six coordinates are the rigid motion nearest to that of its surface, so
that a seat looks to a mesh or a bearing like a rigid body. Between the seats the body takes the shape of least
energy. Added to these static shapes are the sag of the body under rigid accelerations, so that every static deflection
is exact, and as many free vibrations as the band asks for, which are then exact as well.

A shaft that turns is described in a frame that does not (`frame` "nonrotating"): as it is axially symmetric, its
matrices are constant there, M q'' + Omega G q' + K q = f. No coordinate is needed for its spin: the common part of
the seats' turning about z is the spin, with Omega = r' M q' / (r' M r) for the rigid spin r.
"""

from __future__ import annotations

import hashlib
import io
import json
import logging
import time
import zipfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np
import scipy.linalg
import scipy.sparse
import scipy.sparse.csgraph
from numpy.typing import NDArray

from exugear.meridian import STANDARD_SIZE, Harmonic, MeshSize, Motion, SeatBand, Shaft, ShaftSection
from exugear.versions import REDUCTION
from fe_ste.files import FileError, read_sealed, write_sealed
from fe_ste.gears import Material
from fe_ste.sparse import Backend, Factorisation, factorise

Floats: TypeAlias = NDArray[np.float64]
SparseMatrix: TypeAlias = Any
Frame = Literal["nonrotating", "carrier", "ground"]
MOTIONS: tuple[Motion, ...] = ("bending", "torsion", "stretching")

MOST_STEPS = 150
"""Lanczos steps after which the search for free vibrations is given up."""
CONVERGED = 1e-9
"""Relative residual of a free vibration; its frequency is then exact to the square of it."""
_log = logging.getLogger(__name__)
NEGLIGIBLE = 1e-8
"""Share of a free vibration that the static shapes must leave over for it to count as a shape of its own."""


class ReductionError(ValueError):
    """A body that cannot be reduced as asked."""


@dataclass(frozen=True)
class Seat:
    """A place on a body that other things are fixed to.

    Attributes
    ----------
    name : str
    place : (3,) centre in the gearbox's coordinates at zero angles, m
    """

    name: str
    place: tuple[float, float, float]


@dataclass(frozen=True)
class Blank:
    """A rigid ring on a seat, such as a gear blank: kg, and kg m2 about its centre."""

    mass: float
    transverse: float
    axial: float


@dataclass(frozen=True)
class Surface:
    """The surface of a reduced body for pictures.

    Attributes
    ----------
    points : (p, 3) at zero angles, m
    quads : (f, 4) corners of each face; a triangle repeats its last
    displacement : (p, 3, n) per coordinate
    strain : (f, 6, n) per coordinate, in orthogonal axes (those of each face, or x y z), engineering shear strains
    elasticity : (6, 6) stress by strain, Pa
    """

    points: Floats
    quads: NDArray[np.int64]
    displacement: NDArray[np.float32]
    strain: NDArray[np.float32]
    elasticity: Floats

    def energy_density(self, coordinates: Floats) -> Floats:
        """Strain energy per volume on each face, (f,), J/m3, at coordinates (n,)."""
        strain = self.strain @ coordinates
        density: Floats = 0.5 * np.einsum("fs,st,ft->f", strain, self.elasticity, strain)
        return density


@dataclass(frozen=True)
class Figures:
    """What a reduction took and found.

    Attributes
    ----------
    unknowns : number of unknowns by harmonic, or "whole" for a solid mesh
    seconds : wall time
    free_frequencies : by harmonic, elastic free vibrations of the whole model that are kept, and the next one, Hz
    lowered : by harmonic, frequencies of the reduced body above the limit that were lowered to it, Hz
    """

    unknowns: Mapping[str, int]
    seconds: float
    free_frequencies: Mapping[str, tuple[float, ...]]
    lowered: Mapping[str, tuple[float, ...]]


@dataclass(frozen=True)
class ReducedBody:
    """A reduced elastic body; n coordinates.

    Coordinates are six per seat (ux uy uz, tilts thx thy, and thz unwrapped; m and rad), then the inner amplitudes.

    Attributes
    ----------
    name, seats : what it is, and its seats in the order of the coordinates
    mass, stiffness : (n, n)
    gyroscopic : (n, n) antisymmetric G of M q'' + Omega G q' + K q = f
    spin : (n,) rigid spin about the axis: 1 on every seat's thz, and how it displaces seats off the axis, m; 0 for a
        body on the ground, which does not turn
    frame : where the coordinates are seen from: a frame that does not turn, the carrier's, or the ground
    groups : names of the inner amplitudes: bending x, bending y, torsion or stretching; of a solid mesh, inner
    surface : for pictures
    figures : what the reduction took and found
    """

    name: str
    seats: tuple[Seat, ...]
    mass: Floats
    stiffness: Floats
    gyroscopic: Floats
    spin: Floats
    frame: Frame
    groups: tuple[str, ...]
    surface: Surface
    figures: Figures

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self.spin)

    def seat(self, name: str) -> int:
        """Find the first coordinate of a seat.

        Raises
        ------
        ReductionError
            No seat of that name.
        """
        for n, seat in enumerate(self.seats):
            if seat.name == name:
                return 6 * n
        raise ReductionError(f"body {self.name}: no seat {name!r}; seats are {', '.join(s.name for s in self.seats)}")

    @cached_property
    def blocks(self) -> tuple[NDArray[np.int64], ...]:
        """Coordinates that neither mass nor stiffness couples to others: both bending planes, torsion, stretching."""
        joined = scipy.sparse.csr_array((self.mass != 0.0) | (self.stiffness != 0.0))
        count, label = scipy.sparse.csgraph.connected_components(joined, directed=False)
        return tuple(np.flatnonzero(label == n) for n in range(count))

    def rigid_motions(self, centre: Sequence[float] | Floats) -> Floats:
        """Rigid motions (n, 6): translations, and turns about a centre (3,) in the gearbox's coordinates."""
        motions = np.zeros((self.size, 6))
        for n, seat in enumerate(self.seats):
            x, y, z = np.asarray(seat.place) - np.asarray(centre)
            motions[6 * n : 6 * n + 6] = np.eye(6)
            motions[6 * n : 6 * n + 3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
        return motions

    @cached_property
    def rigid_inertia(self) -> RigidInertia:
        """Mass, centre of mass and inertias of the rigid body that this is."""
        origin = np.array(self.seats[0].place)
        about = self.rigid_motions(origin)
        moments = about.T @ self.mass @ about
        mass = float(moments[0, 0])
        x, y, z = (float(moments[i, j]) / mass for i, j in ((1, 5), (2, 3), (0, 4)))
        about = self.rigid_motions(origin + (x, y, z))
        inertia = np.diag(about.T @ self.mass @ about)
        transverse = float(inertia[3] + inertia[4]) / 2.0
        place = tuple((origin + (x, y, z)).tolist())
        return RigidInertia(mass, (place[0], place[1], place[2]), transverse, float(inertia[5]))

    @cached_property
    def free_frequencies(self) -> Floats:
        """Frequencies of the reduced body, free and at rest, elastic ones only, Hz."""
        values = scipy.linalg.eigh(self.stiffness, self.mass, eigvals_only=True)
        return np.sqrt(np.maximum(values[6:], 0.0)) / (2.0 * np.pi)


@dataclass(frozen=True)
class RigidInertia:
    """Mass properties of a rigid body: kg, centre (3,) m, kg m2 about the centre across z (mean) and about z."""

    mass: float
    centre: tuple[float, float, float]
    transverse: float
    axial: float


@dataclass(frozen=True)
class ReducedPart:
    """One set of unknowns reduced: (s + a) coordinates, seats' first, then amplitudes.

    Attributes
    ----------
    mass, stiffness : (s + a, s + a)
    shapes : (unknowns, s + a) displacement per coordinate
    frequencies : elastic free vibrations kept, and the next one, Hz
    """

    mass: Floats
    stiffness: Floats
    shapes: Floats
    frequencies: tuple[float, ...]


def reduce_part(
    mass: SparseMatrix,
    stiffness: SparseMatrix,
    seats: Floats,
    rigid: Floats,
    blanks: Floats,
    band: float,
    backend: Backend | None = "superlu",
) -> ReducedPart:
    """Reduce a free elastic structure to its seats' coordinates and amplitudes of free vibrations.

    Parameters
    ----------
    mass, stiffness : (n, n) sparse
    seats : (s, n) seat coordinates as averages of the unknowns
    rigid : (n, k) all rigid motions
    blanks : (s, s) rigid masses on the seats
    band : float
        All free vibrations up to this frequency (Hz) become exact; those on bearings come out to 1e-4 up to two
        thirds of it.
    backend : {"superlu", "pardiso"}, optional
        SuperLU gives the same digits in every run, PARDISO's threads do not; None is the fastest installed.

    Raises
    ------
    ReductionError
        The seats leave a rigid motion free.
    """
    moved = seats @ rigid
    if np.linalg.matrix_rank(moved) < rigid.shape[1]:
        raise ReductionError("the seats do not hold all rigid motions; give at least one more seat")
    static, relief = static_shapes(mass, stiffness, seats, rigid, backend)
    rows = scipy.sparse.csr_array(seats)
    whole = scipy.sparse.csr_array(mass + rows.T @ scipy.sparse.csr_array(blanks) @ rows)
    vibrations, frequencies = free_vibrations(whole, stiffness, rigid, (np.pi * band) ** 2, band, backend)
    inner = np.hstack([vibrations - static @ (seats @ vibrations), relief])
    basis = np.hstack([static, _amplitude_shapes(mass, stiffness, inner)])
    count = len(seats)
    reduced_mass = basis.T @ (mass @ basis)
    reduced_mass[:count, :count] += blanks
    elastic = np.eye(
        basis.shape[1]
    )  # leaves out of the seats' motion what is rigid, so that it stores no energy at all
    elastic[:count, :count] -= moved @ np.linalg.lstsq(moved, np.eye(count))[0]
    reduced_stiffness = elastic.T @ (basis.T @ (stiffness @ basis)) @ elastic
    return ReducedPart(_symmetric(reduced_mass), _symmetric(reduced_stiffness), basis, frequencies)


def static_shapes(
    mass: SparseMatrix, stiffness: SparseMatrix, seats: Floats, rigid: Floats, backend: Backend | None = "superlu"
) -> tuple[Floats, Floats]:
    """Shapes (n, s) of least strain energy, each with one seat coordinate at 1, and (n, k) sag between fixed seats.

    Loads at the seats and rigid accelerations that balance each other act on the body held by springs at as many
    unknowns as it has rigid motions, F the inverse: these springs then carry nothing. The forces at the seats follow
    from the motion of the seats, B (F B^T l + R a) = d with R^T B^T l = 0. The sag is what each rigid acceleration
    does, B u = 0; without it the shapes know only loads in balance among the seats.
    """
    held_at = scipy.linalg.qr(rigid.T, mode="r", pivoting=True)[1][: rigid.shape[1]]
    springs = np.zeros(len(rigid))
    springs[held_at] = stiffness.diagonal().mean()
    with factorise(scipy.sparse.csr_array(stiffness + scipy.sparse.diags_array(springs)), backend) as held:
        pulled = held.solve(np.hstack([seats.T, mass @ rigid]))
    pulled, sag = pulled[:, : len(seats)], pulled[:, len(seats) :]
    moved = seats @ rigid
    count, modes = moved.shape
    # Compliances and rigid motions differ by ten powers of ten: both unknowns are scaled to one.
    scale = np.sqrt(np.diag(seats @ pulled))
    saddle = np.zeros((count + modes, count + modes))
    saddle[:count, :count] = (seats @ pulled) / np.outer(scale, scale)
    saddle[:count, count:] = moved / scale[:, None]
    saddle[count:, :count] = saddle[:count, count:].T
    wanted = np.zeros((count + modes, count + modes))
    wanted[:count, :count] = np.diag(1.0 / scale)
    wanted[:count, count:] = -(seats @ sag) / scale[:, None]
    wanted[count:, count:] = -(rigid.T @ (mass @ rigid))
    found = np.linalg.solve(saddle, wanted)
    shapes = pulled @ (found[:count] / scale[:, None]) + rigid @ found[count:]
    relief = sag + shapes[:, count:]
    shapes = shapes[:, :count]
    shapes += (rigid - shapes @ moved) @ np.linalg.lstsq(moved, np.eye(count))[0]
    return shapes, relief - shapes @ (seats @ relief)


def free_vibrations(
    mass: SparseMatrix,
    stiffness: SparseMatrix,
    rigid: Floats,
    shift: float,
    band: float,
    backend: Backend | None = "superlu",
) -> tuple[Floats, tuple[float, ...]]:
    """Shapes (n, a) of the elastic free vibrations up to `band` (Hz), and their frequencies and the next one.

    Lanczos steps with (K + shift M)^-1, every vector held orthogonal to the rigid motions and to all before it. They
    find one vibration of each frequency; equal ones come in further sweeps, until one finds none in the band.

    Raises
    ------
    ReductionError
        More vibrations in the band than `MOST_STEPS` can find.
    """
    known = rigid @ np.linalg.inv(np.linalg.cholesky(rigid.T @ (mass @ rigid))).T
    frequencies: list[float] = []
    random = np.random.default_rng(1)
    with factorise(scipy.sparse.csr_array(stiffness + shift * mass), backend) as shifted:
        while True:
            start = random.standard_normal(len(rigid))
            found, shapes = _lanczos_sweep(mass, shifted, known, start, shift, band)
            kept = found < band
            frequencies += found[kept].tolist()
            known = np.hstack([known, shapes[:, kept]])
            if not kept.any():
                order = np.argsort(frequencies)
                return known[:, rigid.shape[1] :][:, order], (*sorted(frequencies), float(found[0]))


def _lanczos_sweep(
    mass: SparseMatrix, shifted: Factorisation, known: Floats, start: Floats, shift: float, band: float
) -> tuple[Floats, Floats]:
    """Frequencies (Hz) up to the first beyond the band, and shapes, of what is orthogonal to the known ones."""
    basis, images = [*known.T], [*(mass @ known).T]
    count = len(basis)
    diagonal: list[float] = []
    beside: list[float] = []
    vector = start
    while len(diagonal) < MOST_STEPS:
        before, image = np.array(basis), np.array(images)
        for _ in range(2):  # once leaves round-off of the first pass
            vector = vector - before.T @ (image @ vector)
        own = mass @ vector
        length = float(np.sqrt(vector @ own))
        if diagonal:
            beside.append(length)
            found = _converged(diagonal, beside, shift, band)
            if found is not None:
                frequencies, turned = found
                return frequencies, np.array(basis[count:]).T @ turned
        basis.append(vector / length)
        images.append(own / length)
        vector = shifted.solve(images[-1])
        diagonal.append(float(images[-1] @ vector))
    raise ReductionError(f"more vibrations below {band:g} Hz than {MOST_STEPS} steps find; lower the band")


def _converged(diagonal: list[float], beside: list[float], shift: float, band: float) -> tuple[Floats, Floats] | None:
    """Frequencies (Hz) up to the first beyond the band, and their weights (steps, f), once all are at round-off."""
    matrix = np.diag(diagonal) + np.diag(beside[:-1], 1) + np.diag(beside[:-1], -1)
    values, turned = np.linalg.eigh(matrix)
    values, turned = values[::-1], turned[:, ::-1]
    frequencies = np.sqrt(np.maximum(1.0 / np.maximum(values, 1e-300) - shift, 0.0)) / (2.0 * np.pi)
    needed = int(np.count_nonzero(frequencies < band)) + 1
    if needed > len(values):
        return None
    residual = beside[-1] * np.abs(turned[-1, :needed]) / values[:needed]
    return (frequencies[:needed], turned[:, :needed]) if residual.max() < CONVERGED else None


def _amplitude_shapes(mass: SparseMatrix, stiffness: SparseMatrix, inner: Floats) -> Floats:
    """Shapes that span `inner` (n, a), uncoupled from each other, of unit modal mass; what is nothing left out."""
    inner = inner / np.sqrt(np.einsum("im,im->m", inner, mass @ inner))
    share, turned = np.linalg.eigh(inner.T @ (mass @ inner))
    inner = inner @ (turned[:, share > NEGLIGIBLE] / np.sqrt(share[share > NEGLIGIBLE]))
    _, turned = np.linalg.eigh(inner.T @ (stiffness @ inner))
    return np.asarray(inner @ turned)


def _symmetric(matrix: Floats) -> Floats:
    return 0.5 * (matrix + matrix.T)


def lowered(mass: Floats, stiffness: Floats, limit: float) -> tuple[Floats, tuple[float, ...]]:
    """Mass matrix whose vibrations above `limit` (Hz) are slowed down to it, and the frequencies they had.

    Mass is added in these vibrations alone, phi: M + sum (w^2 / w_limit^2 - 1) M phi (M phi)'. The other vibrations
    and all static deflections stay as they are.

    Examples
    --------
    >>> mass, found = lowered(np.eye(2), np.diag([4.0, 9.0]) * np.pi**2, 1.2)
    >>> found, np.diag(mass)
    ((1.5,), array([1.    , 1.5625]))
    """
    values, shapes = scipy.linalg.eigh(stiffness, mass)
    ratio = values / (2.0 * np.pi * limit) ** 2
    high = ratio > 1.0
    carried = mass @ shapes[:, high]
    added = (carried * (ratio[high] - 1.0)) @ carried.T
    return mass + added, tuple(float(f) for f in limit * np.sqrt(ratio[high]))


@dataclass(frozen=True)
class ShaftModel:
    """All that a reduced shaft depends on.

    Attributes
    ----------
    name : str
    sections : from the beginning at `origin` on
    material : Material
    origin : (3,) beginning of the shaft in the gearbox's coordinates, m
    seats : bands, z from the beginning of the shaft
    blanks : seat name -> rigid ring on it
    band : vibrations up to here are exact, Hz
    limit : vibrations of the reduced shaft above this are slowed down to it, Hz
    size : element sizes
    """

    name: str
    sections: tuple[ShaftSection, ...]
    material: Material
    origin: tuple[float, float, float]
    seats: tuple[SeatBand, ...]
    blanks: Mapping[str, Blank]
    band: float
    limit: float
    size: MeshSize = STANDARD_SIZE

    @property
    def key(self) -> str:
        """SHA-256 of these inputs and of the version of the method that reduces them."""
        text = json.dumps({"method_version": REDUCTION, **asdict(self)}, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()


def reduce_shaft(model: ShaftModel) -> ReducedBody:
    """Reduce a shaft.

    Raises
    ------
    exugear.meridian.ShaftError
        A shaft that cannot be, or a seat that does not lie on it.
    ReductionError
        A blank without its seat, or too few seats.
    """
    began = time.perf_counter()
    names = [seat.name for seat in model.seats]
    for name in model.blanks:
        if name not in names:
            raise ReductionError(f"shaft {model.name}: blank on {name!r}, but the seats are {', '.join(names)}")
    shaft = Shaft(model.sections, model.material, model.seats, model.size)
    harmonics = {motion: shaft.harmonic(motion) for motion in MOTIONS}
    parts: dict[Motion, ReducedPart] = {}
    slowed: dict[str, tuple[float, ...]] = {}
    for motion, h in harmonics.items():
        part = reduce_part(h.mass, h.stiffness, h.seats, h.rigid, _blank_masses(model, motion), model.band)
        mass, slowed[motion] = lowered(part.mass, part.stiffness, model.limit)
        parts[motion] = replace(part, mass=mass)
    layout = _Layout(len(names), {motion: part.shapes.shape[1] for motion, part in parts.items()})
    gyroscopic = _gyroscopic(model, harmonics["bending"], parts["bending"])
    spin = np.zeros(layout.size)
    spin[5 : 6 * len(names) : 6] = 1.0
    x, y, z = model.origin
    return ReducedBody(
        name=model.name,
        seats=tuple(Seat(seat.name, (x, y, z + seat.z)) for seat in model.seats),
        mass=layout.gather({motion: part.mass for motion, part in parts.items()}),
        stiffness=layout.gather({motion: part.stiffness for motion, part in parts.items()}),
        gyroscopic=layout.across(gyroscopic),
        spin=spin,
        frame="nonrotating",
        groups=layout.groups,
        surface=_surface(shaft, model.origin, parts, layout),
        figures=Figures(
            unknowns={motion: h.mass.shape[0] for motion, h in harmonics.items()},
            seconds=time.perf_counter() - began,
            free_frequencies={motion: part.frequencies for motion, part in parts.items()},
            lowered=slowed,
        ),
    )


def load_or_reduce(model: ShaftModel, folder: Path) -> ReducedBody:
    """Reduced shaft from a folder if it is there for exactly these inputs, else reduced and kept there."""
    return kept(folder / f"{model.name}-{model.key[:16]}.npz", model.key, lambda: reduce_shaft(model))


def kept(path: Path, key: str, reduce: Callable[[], ReducedBody]) -> ReducedBody:
    """Body from a file, or reduced and kept there if the file is missing, damaged or of another key."""
    arrays = kept_arrays(path, key)
    if arrays is not None:
        return _from_arrays(arrays)
    body = reduce()
    keep_arrays(path, key, _arrays_of(body))
    return body


def keep_arrays(path: Path, key: str, arrays: Mapping[str, Any]) -> None:
    """Write arrays into a sealed file of a key."""
    content = io.BytesIO()
    np.savez_compressed(content, key=np.array(key), **arrays)
    write_sealed(path, content.getvalue())


def kept_arrays(path: Path, key: str) -> dict[str, NDArray[Any]] | None:
    """Read what `keep_arrays` wrote; nothing if the file is missing, damaged or of another key."""
    if not path.exists():
        return None
    try:
        with np.load(io.BytesIO(read_sealed(path)), allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
    except (FileError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        _log.warning("%s; the body is reduced again", error)
        return None
    return arrays if str(arrays.pop("key", "")) == key else None


_MATRICES = ("mass", "stiffness", "gyroscopic", "spin")
_SURFACE = ("points", "quads", "displacement", "strain", "elasticity")


def _arrays_of(body: ReducedBody) -> dict[str, NDArray[Any]]:
    words = {
        "name": body.name,
        "seats": [[seat.name, seat.place] for seat in body.seats],
        "frame": body.frame,
        "groups": body.groups,
        "figures": asdict(body.figures),
    }
    arrays = {name: getattr(body, name) for name in _MATRICES}
    arrays |= {name: getattr(body.surface, name) for name in _SURFACE}
    return {"words": np.array(json.dumps(words)), **arrays}


def _from_arrays(arrays: Mapping[str, NDArray[Any]]) -> ReducedBody:
    words = json.loads(str(arrays["words"]))
    figures = words["figures"]
    for key in ("free_frequencies", "lowered"):
        figures[key] = {motion: tuple(values) for motion, values in figures[key].items()}
    return ReducedBody(
        name=words["name"],
        seats=tuple(Seat(name, (place[0], place[1], place[2])) for name, place in words["seats"]),
        **{name: arrays[name] for name in _MATRICES},
        frame=words["frame"],
        groups=tuple(words["groups"]),
        surface=Surface(**{name: arrays[name] for name in _SURFACE}),
        figures=Figures(**figures),
    )


def _blank_masses(model: ShaftModel, motion: Motion) -> Floats:
    """Rigid masses of the blanks on the seat coordinates of one harmonic."""
    nothing = Blank(0.0, 0.0, 0.0)
    values: list[float] = []
    for seat in model.seats:
        blank = model.blanks.get(seat.name, nothing)
        values += {
            "bending": [blank.mass, blank.transverse],
            "torsion": [blank.axial],
            "stretching": [blank.mass],
        }[motion]
    return np.diag(values)


def _gyroscopic(model: ShaftModel, bending: Harmonic, part: ReducedPart) -> Floats:
    """Polar inertia 2 g of one bending plane, blanks included; half of it is what a rigid tilt has of 2 g."""
    gyroscopic: SparseMatrix = bending.gyroscopic
    doubled: Floats = 2.0 * part.shapes.T @ (gyroscopic @ part.shapes)
    for n, seat in enumerate(model.seats):
        if seat.name in model.blanks:
            doubled[2 * n + 1, 2 * n + 1] += model.blanks[seat.name].axial
    return _symmetric(doubled)


class _Layout:
    """Where the coordinates of each harmonic stand among those of the body."""

    def __init__(self, seats: int, sizes: Mapping[Motion, int]) -> None:
        first = 6 * np.arange(seats)
        inner = 6 * seats
        amplitudes = sizes["bending"] - 2 * seats

        def following(count: int) -> NDArray[np.int64]:
            nonlocal inner
            inner += count
            return np.arange(inner - count, inner)

        pairs = np.stack([first, first + 4], axis=1).ravel(), np.stack([first + 1, first + 3], axis=1).ravel()
        self.x = np.concatenate([pairs[0], following(amplitudes)])
        self.y = np.concatenate([pairs[1], following(amplitudes)])
        self.torsion = np.concatenate([first + 5, following(sizes["torsion"] - seats)])
        self.stretching = np.concatenate([first + 2, following(sizes["stretching"] - seats)])
        self.size = inner
        # A tilt about +x moves what lies at +z towards -y: in the y plane the tilt counts negative.
        self.sign_y = np.where(np.isin(self.y, first + 3), -1.0, 1.0)
        self.groups = (
            *["bending x"] * amplitudes,
            *["bending y"] * amplitudes,
            *["torsion"] * (sizes["torsion"] - seats),
            *["stretching"] * (sizes["stretching"] - seats),
        )

    def planes(self, motion: Motion) -> list[tuple[NDArray[np.int64], Floats]]:
        """Coordinates of a harmonic and their signs; two planes for bending."""
        if motion == "bending":
            return [(self.x, np.ones(len(self.x))), (self.y, self.sign_y)]
        index = self.torsion if motion == "torsion" else self.stretching
        return [(index, np.ones(len(index)))]

    def gather(self, parts: Mapping[Motion, Floats]) -> Floats:
        """Matrix of the body from those of the harmonics."""
        matrix = np.zeros((self.size, self.size))
        for motion, part in parts.items():
            for index, sign in self.planes(motion):
                matrix[np.ix_(index, index)] = part * np.outer(sign, sign)
        return matrix

    def across(self, doubled: Floats) -> Floats:
        """Gyroscopic matrix from 2 g of one plane: M qx'' + 2 Omega g qy' and M qy'' - 2 Omega g qx'."""
        matrix = np.zeros((self.size, self.size))
        matrix[np.ix_(self.x, self.y)] = doubled * self.sign_y
        matrix[np.ix_(self.y, self.x)] = -(doubled * self.sign_y).T
        return matrix


ANGLES = 24
"""Faces around a shaft in pictures."""


def _surface(
    shaft: Shaft, origin: tuple[float, float, float], parts: Mapping[Motion, ReducedPart], layout: _Layout
) -> Surface:
    """Turn the outline of the half-section into a surface with displacement and strain per coordinate."""
    outline = shaft.outline()
    angle = 2.0 * np.pi * np.arange(ANGLES) / ANGLES
    points = np.stack(
        [np.outer(np.cos(angle), outline.r), np.outer(np.sin(angle), outline.r), np.outer(angle * 0 + 1, outline.z)], 2
    )
    count, edges = len(outline.r), len(outline.edges)
    around = (np.arange(ANGLES)[:, None] + np.array([0, 1])) % ANGLES * count
    corners = [around[:, :1] + outline.edges[:, 0], around[:, :1] + outline.edges[:, 1]]
    corners += [around[:, 1:] + outline.edges[:, 1], around[:, 1:] + outline.edges[:, 0]]
    displacement = np.zeros((ANGLES, count, 3, layout.size), dtype=np.float32)
    strain = np.zeros((ANGLES, edges, 6, layout.size), dtype=np.float32)
    for motion, part in parts.items():
        moved = shaft.displacement(motion, outline.nodes, part.shapes)
        strained = shaft.strain_at_edges(motion, outline.elements, part.shapes)
        for plane, (index, sign) in enumerate(layout.planes(motion)):
            turned = angle - plane * np.pi / 2.0
            face = turned + np.pi / ANGLES
            if motion == "bending":
                c, s, cf, sf = np.cos(turned), np.sin(turned), np.cos(face), np.sin(face)
                weights, face_weights = np.stack([c, s, c], 1), np.stack([cf, cf, cf, cf, sf, sf], 1)
            else:
                weights, face_weights = np.ones((ANGLES, 3)), np.ones((ANGLES, 6))
            u_r, u_phi, u_z = np.moveaxis(weights[:, None, :, None] * moved * sign, 2, 0)
            c, s = np.cos(angle)[:, None, None], np.sin(angle)[:, None, None]
            displacement[..., index] = np.stack([u_r * c - u_phi * s, u_r * s + u_phi * c, u_z], axis=2)
            strain[..., index] = face_weights[:, None, :, None] * strained * sign
    return Surface(
        points=points.reshape(-1, 3) + np.array(origin),
        quads=np.stack(corners, axis=2).reshape(-1, 4).astype(np.int64),
        displacement=displacement.reshape(-1, 3, layout.size),
        strain=strain.reshape(-1, 6, layout.size),
        elasticity=shaft.elasticity,
    )


def rigid_gyroscopics(inertia: RigidInertia, frame: Frame) -> Floats:
    """Matrix G (6, 6) of a rigid body's translations and tilts about its centre of mass, seen from a frame.

    In a frame that does not turn a tilt has the axial inertia. In its own, 2 int rho phi_i . (e_z x phi_j): a
    translation has twice the mass, a tilt -(Ix + Iy - Iz).
    """
    matrix = np.zeros((6, 6))
    if frame == "nonrotating":
        matrix[3, 4] = inertia.axial
    elif frame == "carrier":
        matrix[0, 1], matrix[3, 4] = -2.0 * inertia.mass, inertia.axial - 2.0 * inertia.transverse
    return matrix - matrix.T


def with_rigid_inertia(body: ReducedBody, wanted: RigidInertia) -> ReducedBody:
    """Give a body the rigid inertia of another model of it; its free elastic vibrations stay as they are.

    The difference rides on the rigid part of the motion, M + M R A R' M with R the rigid motions about the wanted
    centre and A so that R' M R becomes the wanted inertia; elastic vibrations are orthogonal to R. Gyroscopic forces
    become those of the wanted inertia likewise, in the frame of the body.
    """
    motions = body.rigid_motions(wanted.centre)
    carried = body.mass @ motions
    present = np.linalg.inv(motions.T @ carried)
    target = np.diag([wanted.mass] * 3 + [wanted.transverse] * 2 + [wanted.axial])
    mass = body.mass + carried @ (present @ target @ present - present) @ carried.T
    turning = rigid_gyroscopics(wanted, body.frame)
    missing = turning - motions.T @ body.gyroscopic @ motions
    gyroscopic = body.gyroscopic + carried @ (present @ missing @ present) @ carried.T
    return replace(body, mass=_symmetric(mass), gyroscopic=0.5 * (gyroscopic - gyroscopic.T))


def stiffened(body: ReducedBody, factor: float) -> ReducedBody:
    """Return the same body with its stiffness times a factor."""
    return replace(body, stiffness=factor * body.stiffness)
