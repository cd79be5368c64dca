"""Signals of a run: one table of all signals, and the column of each in a sample.

`SIGNALS` has a row for each signal, under the name that it has in the file of a run. All code that fills, checks,
writes or reads signals uses these names: `SignalLayout` gives the columns of a sample for each.

The load of a joint is the load of the meshes of its body and, for orbiting planets, the force that keeps them on their
orbit. Both follow from stored signals, so that runs of the variant `rigid` need not store moments.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.system.kernels.coordinates import BODY_SIZE, TILT
from exugear.system.kernels.table_law import GUESSED, LEFT_TABLE
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.laws.registry import LAWS
from fe_ste.tools.arrays import Booleans, Floats

if TYPE_CHECKING:
    import xarray as xr

AXES = ("x", "y", "z")
"""Entries along the dimension `axis`: the global axes."""
LEAST_TENSION = 1e-9
"""Tensile deflection of a mesh (m) up to which it counts as unloaded. Loaded meshes deflect by micrometres; in a mesh
without load, round-off of 1e-15 m and inertia forces of hundredths of a newton have either sign."""


@dataclass(frozen=True)
class Variable:
    """A variable in the file of a run."""

    name: str
    dimensions: tuple[str, ...]
    units: str
    long_name: str = ""
    """What it is, where the name does not say it."""
    sign_convention: str = ""
    """Meaning of a positive value, for signals of either sign."""
    kind: str = "f8"
    """Type in the file, as NumPy writes it."""

    @property
    def attributes(self) -> dict[str, str]:
        """Attributes of the variable in the file."""
        words = {"units": self.units, "long_name": self.long_name, "sign_convention": self.sign_convention}
        return {key: value for key, value in words.items() if value}


@dataclass(frozen=True)
class Signal(Variable):
    """A row of `SIGNALS`.

    The first dimension gives the kind of signal: ``time``, a value of each stored sample; ``mesh``, a time accumulated
    for each mesh; ``balance_time``, a term of the energy balance.
    """

    filled_by: tuple[str, ...] = ()
    """Functions of `exugear.transient.compiled.sampling`, or methods of `exugear.transient.compiled.solver`, that fill
    its columns or its part of the energy balance. Empty if `formula` computes it, or if it is a time itself."""
    formula: Callable[[SignalLayout, Floats], Floats | Booleans] | None = None
    """Function that computes it from the columns of samples: (layout, rows) to an array of rows and its further
    dimensions. For an accumulated time: whether it elapses in each sample."""
    laws: Literal["all", "table", "bilateral"] = "all"
    """Mesh models with this signal: all, the model `table`, or all others. A time missing in a model is zero."""
    on_bearings: bool = False
    """Whether only variants with bearings have it; for ideal joints it is derived in this module."""
    stored: bool = True
    """Whether the signal is stored in the file; other signals are used only in the formulas."""
    is_power: bool = False
    """For a term of the energy balance: whether the observer gives its power (W), which the run integrates."""

    @property
    def is_sampled(self) -> bool:
        """Whether it has a value in each sample."""
        return self.dimensions[0] == "time"

    @property
    def is_mesh_time(self) -> bool:
        """Whether it is a time that is added up for each mesh."""
        return self.dimensions == ("mesh",)


def _work_taken(name: str, long_name: str, *filled_by: str) -> Signal:
    """Work that a part of the model takes from the system, as a term of the energy balance."""
    convention = "positive: taken from the system"
    return Signal(name, ("balance_time",), "J", long_name, convention, filled_by=filled_by, is_power=True)


_ELEMENT_OBSERVERS = ("observe_meshes", "observe_connectors", "observe_springs", "observe_elastic_bodies")
SIGNALS = (
    Signal("time", ("time",), "s", "time from the start of the run"),
    Signal(
        "input_speed",
        ("time",),
        "rad/s",
        "speed of the overall input",
        sign_convention="rotation about +z",
        filled_by=("Observer.complete",),
    ),
    Signal(
        "overall_dte_angle",
        ("time",),
        "rad",
        "overall transmission error as an angle of the output",
        sign_convention="positive if the output leads the ideal ratio, about +z",
        filled_by=("Observer.complete",),
    ),
    Signal(
        "overall_dte",
        ("time",),
        "m",
        "overall transmission error as a length",
        sign_convention="as overall_dte_angle, at the base radius of the output gear",
        formula=lambda layout, rows: layout.values("overall_dte_angle", rows) * layout.radius,
    ),
    Signal(
        "mesh_dte",
        ("time", "mesh"),
        "m",
        "deflection of the mesh along the transverse line of action",
        sign_convention="positive: the loaded flanks approach",
        kind="f4",
        filled_by=("observe_meshes",),
    ),
    Signal(
        "mesh_force",
        ("time", "mesh"),
        "N",
        "transverse force of gear 2 on gear 1; `mesh_bodies` lists their bodies in this order",
        sign_convention="positive: compression of the loaded flank",
        kind="f4",
        filled_by=("observe_meshes",),
    ),
    Signal(
        "support_force",
        ("time", "support", "axis"),
        "N",
        "force of the support on its body, the first in `support_bodies`, from the second",
        sign_convention="on the body, along the global axis",
        kind="f4",
        filled_by=("observe_supports", "observe_joints"),
    ),
    Signal(
        "support_moment",
        ("time", "support", "axis"),
        "N m",
        "moment of the support on the same body, about its seat there",
        sign_convention="on the body, about the global axis",
        kind="f4",
        filled_by=("observe_supports",),
        on_bearings=True,
    ),
    Signal(
        "coupling_torque",
        ("time", "coupling"),
        "N m",
        "torque of the coupling by its spring and damper",
        sign_convention="positive: accelerates the first body about +z",
        filled_by=("Observer.complete",),
    ),
    Signal(
        "body_speed",
        ("time", "body"),
        "rad/s",
        "speed of the body, of a flexible one at its main seat",
        sign_convention="rotation about +z",
        filled_by=("Observer.complete",),
    ),
    Signal(
        "tensile_time",
        ("mesh",),
        "s",
        "time with tensile mesh force (bilateral mesh models), of more than 1 nm of deflection",
        formula=lambda layout, rows: layout.values("mesh_dte", rows) < -LEAST_TENSION,
        laws="bilateral",
    ),
    Signal(
        "contact_loss_time",
        ("mesh",),
        "s",
        "time of contact loss (mesh model table)",
        formula=lambda layout, rows: layout.values("mesh_force", rows) == 0.0,
        laws="table",
    ),
    Signal(
        "extrapolation_time",
        ("mesh",),
        "s",
        "time with load, centre distance or misalignment outside the table (extrapolated linearly)",
        formula=lambda layout, rows: layout.values("outside_table", rows) == LEFT_TABLE,
        laws="table",
    ),
    Signal(
        "interpolation_time",
        ("mesh",),
        "s",
        "time with table values next to non-converged states (interpolated from neighbouring states)",
        formula=lambda layout, rows: layout.values("outside_table", rows) == GUESSED,
        laws="table",
    ),
    Signal(
        "centre_distance_change",
        ("time", "mesh"),
        "m",
        "change of the centre distance of the gears",
        sign_convention="positive: centre distance above nominal",
        kind="f4",
        filled_by=("observe_meshes",),
        laws="table",
    ),
    Signal(
        "misalignment",
        ("time", "mesh"),
        "rad",
        "misalignment of the flanks in the plane of action",
        sign_convention="positive: gap at the +z end",
        kind="f4",
        filled_by=("observe_meshes",),
        laws="table",
    ),
    Signal(
        "outside_table",
        ("time", "mesh"),
        "1",
        "1 if load, centre distance or misalignment is outside the table, 2 if next to non-converged states, else 0",
        filled_by=("observe_meshes",),
        laws="table",
        stored=False,
    ),
    Signal("balance_time", ("balance_time",), "s", "times of the energy balance"),
    Signal(
        "work_of_loads",
        ("balance_time",),
        "J",
        "work of torques, drive and weight since the start",
        sign_convention="positive: supplied to the system",
        filled_by=("observe_loads", "observe_elastic_bodies"),
        is_power=True,
    ),
    Signal(
        "kinetic_energy",
        ("balance_time",),
        "J",
        "kinetic energy of all bodies",
        filled_by=("observe_bodies", "observe_elastic_bodies"),
    ),
    Signal(
        "elastic_energy",
        ("balance_time",),
        "J",
        "elastic energy of meshes, supports, couplings and bodies",
        filled_by=_ELEMENT_OBSERVERS,
    ),
    _work_taken("dissipated_energy", "work of all dampers since the start", *_ELEMENT_OBSERVERS),
    _work_taken(
        "work_of_varying_stiffness",
        "work of the time-varying stiffness over the mesh cycle, since the start",
        "observe_meshes",
    ),
    _work_taken(
        "non_conservative_work", "non-conservative work of the mesh model seed, since the start", "observe_meshes"
    ),
    _work_taken("tooth_friction_work", "work of the friction of the teeth since the start", "observe_meshes"),
    _work_taken(
        "bearing_rate_work", "work of bearings with rotating rolling elements, since the start", "observe_connectors"
    ),
)
"""All signals, in the order of the file.

The energy balance: the loads' work = change of kinetic and elastic energy + the other five. Of these, the work of the
model `tangential` is that of a force with components not conjugate to its deflection, and the last one is the work of
bearings whose rate is not the derivative of their displacement (see `exugear.system.kernels.connectors`).
"""
MESH_TIMES = tuple(signal.name for signal in SIGNALS if signal.is_mesh_time)
"""Times (s) that a run adds up for each mesh."""
BALANCE_TERMS = tuple(signal.name for signal in SIGNALS if signal.dimensions == ("balance_time",) and signal.filled_by)
"""Terms of the energy balance."""
POWERS = tuple(signal.name for signal in SIGNALS if signal.is_power)
"""Terms of the account whose power is observed."""
ENERGIES = tuple(name for name in BALANCE_TERMS if name not in POWERS)
"""Terms of the account that are observed as they are."""


def signals_of(tabled: bool, jointed: bool = False, coupled: bool = True) -> tuple[Signal, ...]:
    """Rows of `SIGNALS` that a run with the law `table`, or with another, has on bearings, or on ideal joints.

    Runs without couplings have no torques of these.

    Examples
    --------
    >>> {signal.name for signal in signals_of(True)} - {signal.name for signal in signals_of(False)} >= {"misalignment"}
    True
    """
    laws = ("all", "table" if tabled else "bilateral")
    return tuple(
        signal
        for signal in SIGNALS
        if signal.laws in laws
        and not (jointed and signal.on_bearings)
        and (coupled or "coupling" not in signal.dimensions)
    )


def turning_bodies(gearbox: Gearbox, names: Iterable[str]) -> tuple[str, ...]:
    """Those of some bodies whose speed is a signal: all that turn in the gear train, but for planets in a carrier.

    The speed of a planet is that of the mesh cycles of its gears, and has no place among shafts.
    """
    speeds = gearbox.train.rolling_speeds(gearbox.case.overall.input, 1.0)
    return tuple(name for name in names if speeds.get(name) and gearbox.body(name).carrier is None)


@dataclass(frozen=True, eq=False)
class SignalLayout:
    """Which columns of a sample belong to which signal; ``layout[name]`` is their slice.

    Examples
    --------
    >>> names = {"mesh": ("first", "second"), "support": ("pin",), "axis": AXES, "coupling": (), "body": ("shaft",)}
    >>> layout = SignalLayout(SIGNALS, names, radius=0.1)
    >>> layout["mesh_force"], layout["support_force"]
    (slice(4, 6, None), slice(6, 9, None))
    >>> samples = np.arange(2.0 * layout.count).reshape(2, layout.count)
    >>> layout.values("support_force", samples)
    array([[[ 6.,  7.,  8.]],
    <BLANKLINE>
           [[25., 26., 27.]]])
    """

    signals: tuple[Signal, ...]
    """What a run holds of `SIGNALS`."""
    names: Mapping[str, tuple[str, ...]]
    """Names along the dimensions ``mesh``, ``support``, ``coupling`` and ``body``."""
    radius: float
    """Base radius of the overall output gear, m."""

    @cached_property
    def _slices(self) -> dict[str, slice]:
        slices = {}
        end = 0
        for signal in self.signals:
            if signal.is_sampled and signal.filled_by:
                start = end
                end = end + math.prod(self.shape(signal))
                slices[signal.name] = slice(start, end)
        return slices

    @cached_property
    def count(self) -> int:
        """Columns of a sample."""
        return int(max(columns.stop for columns in self._slices.values()))

    def __contains__(self, name: str) -> bool:
        """Return whether a signal has columns."""
        return name in self._slices

    def __getitem__(self, name: str) -> slice:
        """Columns of a signal."""
        return self._slices[name]

    def shape(self, signal: Variable) -> tuple[int, ...]:
        """Sizes of a signal's dimensions after the first."""
        return tuple(len(self.names[dimension]) for dimension in signal.dimensions[1:])

    @property
    def sample_bytes(self) -> int:
        """Size of a stored sample in the file.

        Examples
        --------
        >>> names = {"mesh": tuple("abcdefgh"), "support": tuple("abcdefghijkl"), "axis": AXES, "body": ("shaft",)}
        >>> SignalLayout(signals_of(False, coupled=False), names, radius=0.1).sample_bytes
        392
        """
        stored = (signal for signal in self.signals if signal.is_sampled and signal.stored)
        return sum(np.dtype(signal.kind).itemsize * math.prod(self.shape(signal)) for signal in stored)

    def values(self, name: str, rows: Floats) -> Floats:
        """Values (samples, ...) of a signal in samples (samples, columns), with its dimensions after time."""
        signal = next(signal for signal in self.signals if signal.name == name)
        return rows[:, self[name]].reshape(len(rows), *self.shape(signal))

    def stored_values(self, times: Floats, rows: Floats) -> dict[str, Floats]:
        """Variables of the file by name, of samples (samples, columns) at times (s)."""
        values: dict[str, Floats] = {"time": times}
        for signal in self.signals:
            if signal.is_sampled and signal.stored and signal.name not in values:
                made = self.values(signal.name, rows) if signal.formula is None else signal.formula(self, rows)
                values[signal.name] = np.asarray(made, dtype=np.float64)
        return values

    def mesh_times(self, rows: Floats) -> Floats:
        """Count the samples (samples, columns) in which each of `MESH_TIMES` passes, (times, meshes)."""
        counts = np.zeros((len(MESH_TIMES), len(self.names["mesh"])))
        for signal in self.signals:
            if signal.is_mesh_time and signal.formula is not None:
                # Along columns as they lie counting takes four times as long.
                passing = np.ascontiguousarray(signal.formula(self, rows).T)
                counts[MESH_TIMES.index(signal.name)] = [np.count_nonzero(mesh) for mesh in passing]
        return counts


def signal_layout(assembly: Assembly) -> SignalLayout:
    """Lay out the signals of an assembly.

    Supports are bearings, or the ideal joints of the variant `rigid`.
    """
    gearbox = assembly.gearbox
    joints = tuple(joint.name for joint in gearbox.joints) if assembly.variant.spins_only else ()
    couplings = assembly.spring_names
    names = {"mesh": assembly.mesh_names, "support": assembly.connector_names or joints, "axis": AXES}
    names |= ({"coupling": couplings} if couplings else {}) | {"body": turning_bodies(gearbox, assembly.spin)}
    signals = signals_of(LAWS[assembly.mesh_model].signals_positions, assembly.variant.spins_only, bool(couplings))
    return SignalLayout(signals, names, gearbox.output_radius)


def coupling_rows(assembly: Assembly) -> tuple[Floats, Floats]:
    """Rows (couplings, size) of the torque of each coupling by the coordinates and by the velocities."""
    ends = np.eye(assembly.size)[assembly.springs.coordinates]
    twist = ends[:, 1] - ends[:, 0]
    return assembly.springs.stiffness[:, None] * twist, assembly.springs.damping[:, None] * twist


def bodies_of_forces(assembly: Assembly) -> dict[str, str]:
    """Bodies connected by meshes and supports, as text, for attributes of a file.

    For a mesh the bodies of gear 1 and gear 2; for a support its body and the supporting body.
    """
    meshes = [f"{element.mesh.name}: {element.mesh.pinion}, {element.mesh.gear}" for element in assembly.elements]
    joints = assembly.gearbox.joints if assembly.variant.spins_only else ()
    supports = [f"{support.name}: {support.body}, {support.on}" for support in assembly.supports or joints]
    return {"mesh_bodies": "; ".join(meshes), "support_bodies": "; ".join(supports)}


LEAST_ENERGY = 1e-9
"""Energy that counts as none, J: a train at rest has nothing but round-off to account for."""
_WORK_OF_LOADS, KINETIC, ELASTIC = map(BALANCE_TERMS.index, ("work_of_loads", "kinetic_energy", "elastic_energy"))
"""Terms of the account that say how much energy there is; what varying stiffness pumps in shows up in them."""
_EXPLAINING = [number for number, term in enumerate(BALANCE_TERMS) if term != "work_of_loads"]
"""Terms of the account that explain where the work of the loads went."""


def energy_left_over(lines: Floats, start: float, scale: float) -> tuple[Floats, Floats]:
    """Energy that lines of the account (n, terms), J, do not explain, as a part of the largest energy so far.

    Parameters
    ----------
    start : kinetic and elastic energy at the start, J
    scale : largest of work done, kinetic and elastic energy before these lines, J

    Returns
    -------
    share, scales : (n,) without sign; and the largest energy up to each line, J, at least `LEAST_ENERGY`

    Examples
    --------
    >>> lines = np.zeros((3, len(BALANCE_TERMS)))
    >>> lines[:, :3] = [[0.0, 0.0, 1.0], [9.0, 9.0, 1.0], [10.0, 9.0, 1.0]]
    >>> energy_left_over(lines, start=1.0, scale=0.0)[0]
    array([0. , 0. , 0.1])
    """
    # A run that diverges passes through numbers whose sums overflow.
    with np.errstate(over="ignore", invalid="ignore"):
        largest = np.abs(lines[:, [_WORK_OF_LOADS, KINETIC, ELASTIC]]).max(axis=1)
        scales = np.maximum.accumulate(np.maximum(largest, max(scale, LEAST_ENERGY)))
        explained = lines[:, _EXPLAINING].sum(axis=1) - start
        return np.abs(lines[:, _WORK_OF_LOADS] - explained) / scales, scales


def energy_residual(data: xr.Dataset | Mapping[str, Floats]) -> float:
    """Return the largest share of the energy in a run that its account does not explain, as `energy_left_over`."""
    lines = np.column_stack([np.asarray(data[term]) for term in BALANCE_TERMS])
    shares, _ = energy_left_over(lines, float(lines[0, [KINETIC, ELASTIC]].sum()), 0.0)
    return float(shares.max())


# Loads of supports in a run: stored for bearings, derived for ideal joints

NEEDED = ("time", "input_speed", "mesh_force", "support_force")
"""Signals of a run that loads of ideal joints are derived from."""


class LoadsUnknownError(ValueError):
    """Loads of supports that do not follow from the stored signals."""


def support_loads(assembly: Assembly, run: Mapping[str, Floats]) -> Floats:
    """Force and moment of each support on its body, (samples, supports, 6), global axes, N and N m.

    Moments are about the support's seat on its body. Ideal joints have none about z.

    Parameters
    ----------
    assembly : variant of the run
    run : signals of a whole run by name: `support_force` and `support_moment`; of the variant `rigid` those of `NEEDED`

    Raises
    ------
    LoadsUnknownError
        Joints under the law `table`, whose teeth press unevenly along the face by an amount that no file holds.
    """
    force = np.asarray(run["support_force"], dtype=np.float64)
    if not assembly.variant.spins_only:
        return np.concatenate([force, np.asarray(run["support_moment"], dtype=np.float64)], axis=2)
    if LAWS[assembly.mesh_model].needs_axes:
        raise LoadsUnknownError(
            f"moments of ideal joints with the mesh model {assembly.mesh_model}: uneven load distribution along the "
            "face width adds moments that the run does not store; use the variant bushing"
        )
    return np.concatenate([force, _joint_moments(assembly, run)], axis=2)


@dataclass(frozen=True)
class _Places:
    """Where bodies of ideal joints are over time."""

    assembly: Assembly
    turned: Floats
    """Angle of the overall input, (samples,), rad."""

    def rotated(self, frame: str | None, vector: Floats) -> Floats:
        """Vector (3,) fixed to a body that turns in its place, in global axes (samples, 3)."""
        gearbox = self.assembly.gearbox
        angle = gearbox.train.rolling_speeds(gearbox.case.overall.input, 1.0).get(frame or "", 0.0) * self.turned
        cosine = np.cos(angle)
        sine = np.sin(angle)
        x, y, z = vector
        return np.stack([cosine * x - sine * y, sine * x + cosine * y, np.full_like(angle, z)], axis=-1)

    def of(self, name: str, height: float | None = None) -> Floats:
        """Points (samples, 3) on the axis of a body, at a height, m, or at its node."""
        bodies = {body.name: body for body in self.assembly.bodies}
        body = bodies[name]
        centre = np.array(body.axis if body.carrier is None else bodies[body.carrier].axis)
        from_centre = np.append(np.array(body.axis) - centre, body.centre_of_mass_z if height is None else height)
        return np.append(centre, 0.0) + self.rotated(body.carrier, from_centre)


def _joint_moments(assembly: Assembly, run: Mapping[str, Floats]) -> Floats:
    """Moments (samples, joints, 3) of ideal joints about their own places.

    Summed up about the origin of the global axes: a planet hands its load on to the joint of its carrier.
    """
    joints = assembly.gearbox.joints
    force = np.asarray(run["support_force"], dtype=np.float64).swapaxes(0, 1)
    number = {joint.body: n for n, joint in enumerate(joints)}
    speed = np.asarray(run["input_speed"], dtype=np.float64)
    steps = 0.5 * (speed[1:] + speed[:-1]) * np.diff(run["time"])
    places = _Places(assembly, np.append(0.0, np.cumsum(steps)))
    # What a joint takes of its own body: the file's force less what planets hand on; it acts at the node but for the
    # moments of meshes about that.
    loads = force.copy()
    moments = np.zeros_like(force)
    for joint in joints:
        if joint.on in number:
            loads[number[joint.on]] -= force[number[joint.body]]
    for n, joint in enumerate(joints):
        moments[n] = np.cross(places.of(joint.body), loads[n])
    for element, scalar in zip(assembly.elements, np.asarray(run["mesh_force"], dtype=np.float64).T, strict=True):
        rows = element.force.reshape(2, BODY_SIZE)[:, TILT:] / element.line_of_action
        for body, row in zip((element.mesh.pinion, element.mesh.gear), rows, strict=True):
            if body in number:
                moments[number[body]] += scalar[:, None] * places.rotated(element.mesh.frame, row)
    about_origin = moments.copy()
    for n, joint in enumerate(joints):
        host = joint.on
        while host in number:
            about_origin[number[host]] += moments[n]
            host = joints[number[host]].on
    for n, joint in enumerate(joints):
        about_origin[n] -= np.cross(places.of(joint.body, joint.position[2]), force[n])
    about_origin[..., 2] = 0.0
    return about_origin.swapaxes(0, 1)
