"""Transmission error tables of a gearbox: required and existing tables, and their main results.

An axis extends to three times the static state, for larger loads and oscillating gears, and at least to 20 um: over the
common face for the misalignment, for the centre distance where the backlash permits it. Limits are round numbers, so
that the tables remain valid for a slightly changed gearbox.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.units import UM
from fe_ste.geometry.checks import GeometryError
from fe_ste.geometry.gears import GearPair
from fe_ste.standards.pitting import nominal_contact_stress
from fe_ste.tools.arrays import Floats
from fe_ste.transmission_error.contact_stress import face_load_factor, largest_contact_stress
from fe_ste.transmission_error.cycle import HARMONICS, harmonics_of, peak_to_peak_error
from fe_ste.transmission_error.states import CUT_OFF
from fe_ste.transmission_error.surface import DOUBTFUL_CUT_OFF, MOST_MISSING, GapError, complete_cycle
from fe_ste.transmission_error.table import MeshTable, TableError, TableInput

if TYPE_CHECKING:
    import xarray as xr

# Axes of a table over misalignment and centre distance that follow from how the gears stand at rest

REACH = 3.0
"""Times the static state that an axis reaches."""
NEEDED = 0.5
"""Part of the required range that an axis of an existing table must cover."""
LEAST = 20e-6
"""Minimum limit of an axis, m."""
STEP = 40e-6
"""Longest step of openings, m: half of it is interpolated within half a per cent of what usual teeth yield."""
MOST_STEPS = 4
"""Steps to either side at most."""
ROUND_NUMBERS = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)

RECOMPUTE = "; recompute it"
"""Advice at the end of the reasons why a table is not usable."""


@dataclass(frozen=True)
class GridAxes:
    """Values along the axes of a pair's table."""

    openings: tuple[float, ...]
    """Openings at the +z end over the common face width, m."""
    offsets: tuple[float, ...]
    """Centre distances less that of the pair, m."""


def reaches(table: MeshTable, wanted: TableInput) -> bool:
    """Whether a table reaches far enough to serve in place of the one with axes that were laid for it."""
    for axis, nominal in (("misalignment", 0.0), ("centre_distance", wanted.pair.centre_distance)):
        have = table.dataset[axis].to_numpy() - nominal
        want = np.array(getattr(wanted, axis)) - nominal
        if have.max() < NEEDED * want.max() or have.min() > NEEDED * want.min():
            return False
    return True


def axes_reaching(pair: GearPair, opening: float = 20e-6, change: float = 33e-6) -> GridAxes:
    """Return axes for a pair with static misalignment `opening` (m over the face), and `change` (m) from nominal.

    Examples
    --------
    >>> from fe_ste.geometry.gears import Gear
    >>> gear = Gear(name="g", teeth=30, normal_module=3e-3, face_width=20e-3, held_diameter=5e-2, tooth_thinning=1e-4)
    >>> axes = axes_reaching(GearPair(name="pair", pinion=gear, gear=gear, centre_distance=90e-3), 12e-6, 4e-6)
    >>> [round(1e6 * value) for value in axes.openings], [round(1e6 * value) for value in axes.offsets]
    ([-40, -20, 0, 20, 40], [-20, -10, 0, 10, 20])
    """
    end = rounded_up(max(LEAST, REACH * abs(opening)))
    steps = min(MOST_STEPS, max(2, math.ceil(end / STEP)))
    openings = tuple(float(f"{end * step / steps:.6g}") for step in range(1, steps + 1))
    farther = rounded_up(max(LEAST, REACH * abs(change)))
    offsets = [0.0]
    for sense in (-1.0, 1.0):
        side = _possible(pair, sense, farther)
        offsets += [0.5 * sense * side, sense * side] if side else []
    return GridAxes((*(-value for value in openings[::-1]), 0.0, *openings), tuple(sorted(offsets)))


def rounded_up(value: float) -> float:
    """Return the next round number, by `ROUND_NUMBERS`.

    Examples
    --------
    >>> [float(f"{rounded_up(value):g}") for value in (2e-5, 2.1e-5, 9e-5, 1.2e-4)]
    [2e-05, 3e-05, 0.0001, 0.00015]
    """
    power = 10.0 ** math.floor(math.log10(value) + 1e-9)
    number = next(number for number in ROUND_NUMBERS if number * power >= value * (1.0 - 1e-9))
    return float(f"{number * power:.3g}")


def _possible(pair: GearPair, sense: float, most: float) -> float:
    """Maximum change of the centre distance to one side, m, up to `most`, at which the gears run; 0 if none."""
    change = most
    while change > 0.05 * LEAST:
        try:
            pair.with_centre_distance(pair.centre_distance + sense * change)
        except GeometryError:
            change = float(f"{0.8 * change:.2g}")
        else:
            return change
    return 0.0


# The transmission error tables of a gearbox: which are wanted, which are there, and what they say in figures

TABLE_FOLDER = "tables"


FINITE_ELEMENTS = 500
"""States whose solution takes as long as the finite elements of two gears."""


@dataclass(frozen=True)
class TableRequest:
    """The table of one pair: its input, its file and, where the file fits the input, its content."""

    name: str
    """Name of the pair in the gearbox file."""
    wanted: TableInput
    """All that the numbers depend on."""
    path: Path
    """The table's file."""
    stored: MeshTable | None
    """The table in the file, if it was computed from exactly this input."""
    replaces: str = ""
    """Reason why an existing file is not usable; empty if there is none or it is usable."""

    @property
    def announcement(self) -> str:
        """Sentence that the table is computed now, with the reason; the advice of the reason is for other callers."""
        if not self.replaces:
            return f"{self.name}: no table in {self.path.parent.parent}; computing it first"
        return f"{self.replaces.removesuffix(RECOMPUTE)}; computing it again"

    @property
    def states(self) -> int:
        """Number of states of the table."""
        wanted = self.wanted
        return wanted.positions * len(wanted.torque) * max(len(wanted.centre_distance), 1) * len(wanted.misalignment)

    @property
    def work(self) -> int:
        """Work of the table, in states: the finite elements of both gears count as `FINITE_ELEMENTS`."""
        return FINITE_ELEMENTS + self.states

    def compute(self, progress: Callable[[int, int], None] | None = None) -> MeshTable:
        """Compute the table and write its file; what a stopped computation had finished is taken up.

        Parameters
        ----------
        progress : called with the number of finished positions and of all positions
        """
        partial = self.path.with_suffix(".partial.nc")
        table = MeshTable.compute(self.wanted, progress, partial=partial)
        table.save(self.path)
        partial.unlink(missing_ok=True)
        return table


def requested_tables(
    gearbox: Gearbox,
    out: Path,
    names: Iterable[str] = (),
    positions: int | None = None,
    grid: bool = False,
    axes: Mapping[str, GridAxes] | None = None,
) -> list[TableRequest]:
    """List the tables of a gearbox and find existing ones; computes and writes nothing.

    Parameters
    ----------
    gearbox : the gearbox
    out : results folder; the tables lie in its folder ``tables``
    names : pairs to list; without any, the pairs with tables required by the file
    positions : positions of the mesh cycle; by default from the gearbox file
    grid : ask for the axes of the file even if its section ``ste`` does not
    axes : by pair name, axes where the file gives none; usual ones by default

    Raises
    ------
    GearboxFileError
        A pair that is not in the file, or that carries no load in its static state.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> [request.name for request in requested_tables(gearbox, Path("nowhere"))]
    ['sun_planet', 'ring_planet', 'intermediate', 'high_speed']
    """
    chosen = list(names) or [name for name, spec in gearbox.pairs.items() if spec.table]
    for name in chosen:
        if name not in gearbox.pairs:
            known = ", ".join(gearbox.pairs)
            raise GearboxFileError(f"{gearbox.source}: no gear pair {name!r}; the pairs are {known}")
        if not gearbox.pairs[name].static_torque > 0.0 or name in gearbox.stated_stiffness:
            raise gearbox.error(without_table(gearbox, [name]))
    grid = grid or gearbox.ste.grid
    own = axes or {}
    count = positions or gearbox.ste.positions
    wanted = {name: wanted_table(gearbox, name, count, grid, own.get(name)) for name in chosen}
    return [_request(gearbox, name, out, table, grid, own.get(name)) for name, table in wanted.items()]


def without_table(gearbox: Gearbox, names: Iterable[str]) -> str:
    """Say why the first of these pairs without a table has none, and what would be right; empty if all have one."""
    law = "use a mesh model that requires only a stiffness (line_of_action, constant, tangential, iso6336)"
    for name in names:
        if gearbox.case.pairs[name].stiffness is not None:
            return f"pairs.{name}.stiffness: is specified, so the pair has no table; remove it to compute one, or {law}"
        if not gearbox.pairs[name].static_torque > 0.0:
            return (
                f"pairs.{name}: no torque in [static_load]; a table requires one, since it is for one loaded flank; "
                f"set a torque on the driven body, or {law}"
            )
    return ""


def table_path(out: Path, name: str) -> Path:
    """Place of a pair's table: ``tables/<pair>.nc`` in the results folder."""
    return out / TABLE_FOLDER / f"{name}.nc"


def wanted_table(
    gearbox: Gearbox, name: str, positions: int, grid: bool = False, axes: GridAxes | None = None
) -> TableInput:
    """All that the numbers of a pair's table depend on.

    Parameters
    ----------
    name : pair
    grid : over the axes of the file's section ``ste``, else the static state alone
    axes : axes where the file names none; usual ones by default

    Raises
    ------
    GearboxFileError
        If the gears cannot run at a centre distance of the axes.
    """
    spec = gearbox.pairs[name]
    # Statics leave rounding in the torque; another machine's must not make another hash of it.
    torque = _rounded(spec.static_torque)
    pinion, gear = (given if spec.flank > 0 else given.mirrored() for given in spec.modifications)
    static = TableInput(
        pair=spec.pair,
        torque=(torque,),
        positions=positions,
        pinion_modification=pinion,
        gear_modification=gear,
        static_torque=torque,
    )
    if not grid:
        return static
    ste = gearbox.ste
    pair = spec.pair
    usual = axes or axes_reaching(pair)
    openings = usual.openings if ste.misalignment_um is None else tuple(UM * um for um in ste.misalignment_um)
    return replace(
        static,
        torque=tuple(torque if factor == 1.0 else _rounded(torque * factor) for factor in ste.torque_factors),
        centre_distance=gearbox.table_distances(name)
        or tuple(pair.centre_distance + offset for offset in usual.offsets),
        misalignment=tuple(opening / pair.face_width for opening in openings),
    )


def _rounded(value: float) -> float:
    return float(f"{value:.12g}")


def fitting_table(
    gearbox: Gearbox, name: str, out: Path, grid: bool = False, axes: GridAxes | None = None
) -> MeshTable:
    """Read the table of a pair, however many positions it has, if all else is the case's.

    Parameters
    ----------
    name : pair
    out : results folder
    grid
        Whether it must have exactly the axes that the file's section ``ste`` names, and the others at all; else any
        axes with the static state serve.
    axes : what axes must reach that the file does not name

    Raises
    ------
    fe_ste.transmission_error.table.TableError
        The file is missing, unreadable, or was computed from another input.
    """
    path = table_path(out, name)
    table = _opened(path)
    wanted = wanted_table(gearbox, name, table.dataset.sizes["pmc"], grid)
    fits = _with_named_axes(gearbox, table, wanted) if grid else _holds(table, wanted)
    if not (table.input_hash == wanted.hash or fits):
        static = wanted_table(gearbox, name, wanted.positions)
        if grid and (table.input_hash == static.hash or _holds(table, static)):
            raise TableError(f"{path}: does not vary load, centre distance and misalignment as required{RECOMPUTE}")
        raise TableError(f"{path}: was computed from another input{RECOMPUTE}")
    if grid and axes is not None and not reaches(table, wanted_table(gearbox, name, wanted.positions, grid, axes)):
        raise TableError(f"{path}: its axes end too close to the static state{RECOMPUTE}")
    return table


def _opened(path: Path) -> MeshTable:
    """Read a table, or return the one read from the same file before: a command reads each several times."""
    try:
        status = path.stat()
    except OSError:
        return MeshTable.open(path)  # says what is wrong
    return _read(path, (status.st_ino, status.st_size, status.st_mtime_ns))


@lru_cache(maxsize=16)
def _read(path: Path, version: tuple[int, ...]) -> MeshTable:
    return MeshTable.open(path)


def _holds(table: MeshTable, static: TableInput) -> bool:
    """Whether a table over more states was computed from the input `static`, axes aside, and holds its state."""
    try:
        torque = float(table.static_state["torque"])
    except TableError:
        return False
    torques, distances, misalignments = (_values(table, name) for name in ("torque", "centre_distance", "misalignment"))
    wider = replace(static, torque=torques, centre_distance=distances, misalignment=misalignments)
    return torque == static.torque[0] and table.input_hash == wider.hash


def _with_named_axes(gearbox: Gearbox, table: MeshTable, wanted: TableInput) -> bool:
    """Whether a table has the axes that the file names, and any values along those that it does not."""
    ste = gearbox.ste
    named = wanted
    follow = []
    if ste.centre_distance_offsets_um is None:
        follow.append(_values(table, "centre_distance"))
        named = replace(named, centre_distance=follow[-1])
    if ste.misalignment_um is None:
        follow.append(_values(table, "misalignment"))
        named = replace(named, misalignment=follow[-1])
    return table.input_hash == named.hash and all(len(values) > 1 for values in follow)


def _values(table: MeshTable, axis: str) -> tuple[float, ...]:
    return tuple(table.dataset[axis].to_numpy().tolist())


def missing_tables(
    gearbox: Gearbox, out: Path, grid: bool = False, axes: Mapping[str, GridAxes] | None = None
) -> list[TableRequest]:
    """List the tables required for dynamics that are missing or belong to another input.

    Parameters
    ----------
    out : results folder
    grid : whether the mesh model interpolates over load, centre distance and misalignment
    axes : by pair name, the required range of axes not given in the file
    """
    work = tables_at_work(gearbox, out, grid, axes)
    requests = []
    for name in _with_tables(gearbox, grid):
        if name not in work:
            requests += requested_tables(gearbox, out, [name], grid=grid, axes=axes)
    return requests


def tables_at_work(
    gearbox: Gearbox, out: Path, grid: bool = False, axes: Mapping[str, GridAxes] | None = None
) -> dict[str, MeshTable]:
    """Existing valid tables of the active pairs; parameters as of `missing_tables`."""
    found = {}
    for name in _with_tables(gearbox, grid):
        with suppress(TableError):
            found[name] = fitting_table(gearbox, name, out, grid, (axes or {}).get(name))
    return found


def _with_tables(gearbox: Gearbox, grid: bool) -> list[str]:
    """Active pairs whose tables dynamics read; of pairs with a stated stiffness only for a model with axes."""
    names = dict.fromkeys(mesh.pair.name for mesh in gearbox.meshes)
    return [name for name in names if grid or name not in gearbox.stated_stiffness]


def _request(
    gearbox: Gearbox, name: str, out: Path, wanted: TableInput, grid: bool, axes: GridAxes | None
) -> TableRequest:
    path = table_path(out, name)
    if not path.exists():
        return TableRequest(name, wanted, path, None)
    try:
        stored = fitting_table(gearbox, name, out, grid, axes)
    except TableError as error:
        return TableRequest(name, wanted, path, None, str(error))
    if stored.dataset.sizes["pmc"] != wanted.positions:
        return TableRequest(name, wanted, path, None, f"{path}: was computed from another input, with other positions")
    return TableRequest(name, wanted, path, stored)


def figure(values: xr.DataArray | float) -> float | None:
    """Return a main result as a number, None if it is not one."""
    value = float(values)
    return None if math.isnan(value) else value


def summarise(request: TableRequest, table: MeshTable) -> dict[str, Any]:
    """Return the main results of a table; the unit is part of the key.

    Results refer to the static state, except for the numbers of states. Results without a converged position are None.
    """
    data = table.static_state
    pair = request.wanted.pair

    return {
        "pair": request.name,
        "table": str(request.path),
        "torque_gear_1_N_m": float(data["torque"]),
        "positions": request.wanted.positions,
        "states": table.dataset["ste"].size,
        "not_converged": int((~table.dataset["converged"]).sum()),
        "cut_off": int((table.dataset[CUT_OFF] > 0.0).sum()),
        "largest_share_cut_off": figure(table.dataset[CUT_OFF].max()),
        "static_share_cut_off": figure(data[CUT_OFF].max()),
        "ste_mean_um": figure(1e6 * data["ste"].mean()),
        "ste_peak_to_peak_um": figure(1e6 * (data["ste"].max() - data["ste"].min())),
        "mesh_stiffness_mean_N_per_m": figure(data["mesh_stiffness"].mean()),
        "ste_peak_to_peak_error_um": figure(1e6 * peak_to_peak_error(data["ste"].to_numpy())),
        "ste_harmonics_um": [figure(1e6 * value) for value in harmonics_of(data["ste"].to_numpy(), HARMONICS)],
        "sigma_H0_MPa": 1e-6 * nominal_contact_stress(pair, float(data["torque"]) / pair.pinion.reference_radius),
        "K_Hbeta_aligned": figure(face_load_factor(data)),
        "sigma_H_aligned_MPa": figure(1e-6 * largest_contact_stress(pair, data)),
        "input_hash": table.input_hash,
    }


def stored_tables(gearbox: Gearbox, out: Path, positions: int | None = None) -> dict[str, MeshTable]:
    """Return the tables of a results folder that fit the gearbox, by the name of the pair."""
    requests = requested_tables(gearbox, out, positions=positions)
    return {request.name: request.stored for request in requests if request.stored}


# What there is to say of tables: states that are not solved, and contact that is cut off at form circles


def table_notes(name: str, table: MeshTable) -> Iterator[str]:
    """Say what is missing or cut off in the table of a pair, and what becomes of it; a line each."""
    missing, states = _missing(table)
    if missing:
        first = f", first {table.failures[0]}" if table.failures else ""
        yield (
            f"{name}: {missing} of {states} states not converged{first}; they are marked in the table and "
            "interpolated from converged neighbours; results near them are marked"
        )
    shares = table.dataset[CUT_OFF].to_numpy()
    cut = int(np.count_nonzero(shares > 0.0))
    largest = float(np.nanmax(shares, initial=0.0))
    if cut:
        yield (
            f"{name}: in {cut} of {states} states contact extends beyond a form diameter and is truncated there; up "
            f"to {_percent(largest)} of the load is truncated, {_percent(static_cut_off(table))} in the static state"
        )


def table_warnings(name: str, table: MeshTable) -> Iterator[str]:
    """Return why the table of a pair is invalid; one line each, none if valid."""
    missing, states = _missing(table)
    if missing > MOST_MISSING * states:
        yield f"{name}: {missing} of {states} states not converged, more than {_percent(MOST_MISSING)}"
        yield from (f"{name}: {line}" for line in table.failures)
        return
    static = table.static_state
    lost = int(np.count_nonzero(~static["converged"].to_numpy().astype(bool)))
    positions = static.sizes["pmc"]
    if lost > MOST_MISSING * positions:
        yield f"{name}: {lost} of {positions} positions of the static state not converged"
    share = static_cut_off(table)
    if share > DOUBTFUL_CUT_OFF:
        yield (
            f"{name}: in the static state {_percent(share)} of the load is beyond a form diameter, where a tip would "
            f"press on a fillet (limit {_percent(DOUBTFUL_CUT_OFF)}); reduce the tip diameter of the mating gear, or "
            "the tip radius of the tool"
        )


def static_cut_off(table: MeshTable) -> float:
    """Largest share of the load that is cut off in the static state."""
    return float(np.nanmax(table.static_state[CUT_OFF].to_numpy(), initial=0.0))


def _missing(table: MeshTable) -> tuple[int, int]:
    """Count the states that have not converged, and all states."""
    solved = table.dataset["converged"].to_numpy().astype(bool)
    return int(np.count_nonzero(~solved)), solved.size


def _percent(share: float) -> str:
    return f"{100.0 * share:.2g} %"


# How far the load moves along the face over a mesh cycle, which the law `tangential` leaves out, and how much that is

LEAST_PUSH = 1e-6
"""Push of a transmission error over the load below which it is round-off."""


@dataclass(frozen=True)
class Shuttling:
    """Shuttling amplitude of the load along the face, one harmonic.

    Examples
    --------
    >>> Shuttling("helical", 1.8e-3, 4.3).description
    'helical: load centroid shuttles by ±1.8 mm along the face width in each mesh cycle'
    """

    pair: str
    amplitude: float
    """Of the load centre, m."""
    over_error: float
    """Its moment as forces at the ends of the face, over the force that the same harmonic of the transmission error
    makes of the mean stiffness."""

    @property
    def description(self) -> str:
        """Say how far."""
        return (
            f"{self.pair}: load centroid shuttles by ±{1e3 * self.amplitude:.2g} mm along the face width in each mesh "
            "cycle"
        )


def shuttling_pairs(gearbox: Gearbox, folder: Path, harmonic: int = 1) -> tuple[Shuttling, ...]:
    """Return the shuttling of each pair with a table, at the static load, largest effect first.

    Parameters
    ----------
    folder : results folder
    harmonic : of the mesh frequency
    """
    loads = []
    for name, pair in {mesh.pair.name: mesh.pair for mesh in gearbox.meshes}.items():
        if name in gearbox.stated_stiffness:
            continue
        with suppress(TableError, GapError):  # no law along a row takes such a table
            point = complete_cycle(fitting_table(gearbox, name, folder).static_state)
            centre, error, stiffness = (
                np.asarray(point[key].to_numpy(), dtype=np.float64).reshape(-1)
                for key in ("load_centroid", "ste", "mesh_stiffness")
            )
            force = float(point["line_of_action_force"].mean())
            amplitude = _harmonic(centre, harmonic)
            pushed = max(stiffness.mean() * _harmonic(error, harmonic), LEAST_PUSH * force)
            loads.append(Shuttling(name, amplitude, float(force * amplitude / (0.5 * pair.face_width) / pushed)))
    return tuple(sorted(loads, key=lambda own: -own.over_error))


def _harmonic(values: Floats, number: int) -> float:
    """Amplitude of a harmonic of a cycle; zero for one that its positions do not resolve."""
    if len(values) > 2 * number:
        return float(2.0 * np.abs(np.fft.rfft(values)[number]) / len(values))
    return 0.0
