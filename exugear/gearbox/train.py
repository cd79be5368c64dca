"""A gear train: its rotations, kinematic constraints, rigid kinematics from input to output, and static mesh forces."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from fe_ste.geometry.gears import GearPair
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import ReprMixin, TitledRows, torque_text

# Kinematics of a gear train: rows for mesh closure and coupling twist, and the motions for which both are zero

RANK_TOLERANCE = 1e-9
"""Threshold relative to the largest singular value below which others count as zero; rows are scaled to 1, round-off is
1e-16.
"""


class MeshedBodies(Protocol):
    """Bodies of a mesh: those with gear 1 and gear 2, and the body with which the line of centres rotates."""

    @property
    def name(self) -> str:
        """Name of the mesh."""

    @property
    def pair(self) -> GearPair:
        """Gear 1 and gear 2."""

    @property
    def pinion(self) -> str:
        """Body with gear 1."""

    @property
    def gear(self) -> str:
        """Body with gear 2."""

    @property
    def frame(self) -> str:
        """Body with which the line of centres rotates; the frame is stationary if this body cannot rotate."""


class CoupledBodies(Protocol):
    """Two coupled bodies, which rotate at one speed."""

    @property
    def first(self) -> str:
        """One body."""

    @property
    def second(self) -> str:
        """The other body."""


@dataclass(frozen=True)
class SpinConstraint:
    """Two bodies constrained to one speed; a name that is not among the rotating bodies has zero speed."""

    first: str
    second: str


def mesh_row(spins: Sequence[str], mesh: MeshedBodies, pinion_share: float = 1.0, gear_share: float = 1.0) -> Floats:
    """Return the mesh closure (spins,), m/rad, per unit rotation: r_b1 (t1 - tf) +- r_b2 (t2 - tf), flank s = +1.

    Plus for an external pair, minus for an internal one; tf is the rotation of the frame. It is also the torque on each
    body per unit mesh force, of which friction leaves a share on the driven gear.

    Parameters
    ----------
    spins : names of the bodies that can rotate; all others are stationary
    pinion_share, gear_share : shares of the torque on gear 1 and on gear 2
    """
    row = np.zeros(len(spins))
    pinion_radius = pinion_share * mesh.pair.pinion.base_radius
    gear_radius = gear_share * mesh.pair.gear.base_radius * (-1.0 if mesh.pair.gear.internal else 1.0)
    levers = ((mesh.pinion, pinion_radius), (mesh.gear, gear_radius), (mesh.frame, -(pinion_radius + gear_radius)))
    for name, lever in levers:
        if name in spins:
            row[spins.index(name)] += lever
    return row


def _rank(rows: Floats) -> int:
    """Rank of a matrix that may be empty, which NumPy refuses before 2.4."""
    return int(np.linalg.matrix_rank(rows)) if rows.size else 0


def coupling_row(spins: Sequence[str], coupling: CoupledBodies) -> Floats:
    """Return the coupling twist per unit rotation, (spins,): 1 for its first body, -1 for its second."""
    return np.array([float(name == coupling.first) - float(name == coupling.second) for name in spins])


def kinematic_modes(rows: Floats) -> Floats:
    """Orthonormal basis (spins, degrees of freedom) of the rotations that satisfy all constraint rows (null space).

    Parameters
    ----------
    rows : (constraints, spins) of any units; each row is scaled by its largest entry

    Examples
    --------
    For two meshing gears of 1 m and 2 m, the larger one rotates at half the speed in the opposite sense:

    >>> kinematic_modes(np.array([[1.0, 2.0]])).T * np.sqrt(5.0)
    array([[-2.,  1.]])
    """
    rows = np.vstack([rows, np.zeros((1, rows.shape[1]))])
    scale = np.abs(rows).max(axis=1, keepdims=True)
    _, singular, basis = np.linalg.svd(rows / np.where(scale > 0, scale, 1.0))
    rank = int(np.sum(singular > RANK_TOLERANCE * singular[0]))
    return np.asarray(basis[rank:].T)


def turn_together(motions: Floats, other_motions: Floats) -> bool:
    """Return whether the kinematic motions of two bodies are proportional, so that each speed determines the other."""
    lengths = np.linalg.norm(motions) * np.linalg.norm(other_motions)
    return bool(abs(motions @ other_motions) > (1.0 - RANK_TOLERANCE) * lengths)


# Static forces of a gear train: forces of meshes and torques of couplings in equilibrium with external torques

UNLOADED = 1e-9
"""Fraction of the largest load below which a mesh counts as unloaded; it covers round-off of the equilibrium."""
BALANCE_TOLERANCE = 1e-9
"""Residual torque as a fraction of the largest torque below which torques count as balanced."""


def holding_forces(rows: Floats, torques: Floats) -> Floats | None:
    """Return constraint forces (constraints,) that balance torques, those of minimum norm; None if no forces do.

    Parameters
    ----------
    rows : (constraints, spins) torques on the spins per unit force of each constraint
    torques : (spins,) N m

    Examples
    --------
    Two meshing gears of 1 m and 2 m, with torques in equilibrium and not in equilibrium:

    >>> holding_forces(np.array([[1.0, 2.0]]), np.array([10.0, 20.0]))
    array([10.])
    >>> holding_forces(np.array([[1.0, 2.0]]), np.array([10.0, -20.0])) is None
    True
    """
    balance = rows.T
    forces = np.linalg.lstsq(balance, torques, rcond=1e-12)[0]
    if np.abs(balance @ forces - torques).max() > BALANCE_TOLERANCE * np.abs(torques).max():
        return None
    return np.asarray(forces)


def without_round_off(forces: Floats, largest_torque: float, smallest_radius: float) -> Floats:
    """Mesh forces in which round-off of the equilibrium is set to zero.

    Parameters
    ----------
    forces : (meshes,) N
    largest_torque : largest of the balanced torques, N m
    smallest_radius : smallest base radius, m
    """
    return np.where(np.abs(forces) > UNLOADED * largest_torque / smallest_radius, forces, 0.0)


@dataclass(frozen=True, eq=False)
class Train(
    ReprMixin, line=" from {input!r} to {output!r}: {spins!n} spins, {meshes!n} meshes, {couplings!n} couplings"
):
    """Bodies that rotate about fixed or orbiting axes and are connected by rigid meshes and couplings.

    The class is independent of the gearbox file; it raises errors through `error`, which adds the name of the file.

    Examples
    --------
    >>> from exugear.gearbox.gearbox import Gearbox
    >>> train = Gearbox.from_toml("cases/grc750/gearbox.toml").train
    >>> round(train.ratio, 6)
    81.490683
    >>> round(train.mesh_frequencies(1.0)["high_speed"], 3)
    285.332
    >>> round(train.static_mesh_forces()["high_speed"])
    -55492
    """

    spins: tuple[str, ...]
    """Bodies that can rotate, in the order of the vector of rotations."""
    meshes: tuple[MeshedBodies, ...]
    couplings: tuple[CoupledBodies, ...]
    input: str
    output: str
    """Bodies at the two ends of the train."""
    torques: Mapping[str, float]
    """Static torques by body name, N m."""
    locked: tuple[str, ...]
    """Bodies that react the static torques."""
    error: Callable[[str], Exception]
    """Function that returns the exception for an error text."""

    def _table(self) -> TitledRows:
        return f"train from {self.input} to {self.output}", {
            "ratio": f"{self.ratio:.6g}",
            "degrees of freedom": str(self.degrees_of_freedom),
            "spins": ", ".join(self.spins),
            "static load": ", ".join(f"{torque_text(torque)} on {body}" for body, torque in self.torques.items()),
            "held by": ", ".join(self.locked) or "nothing",
        }

    @cached_property
    def spin_rows(self) -> Floats:
        """Mesh closure and coupling twist per unit rotation, (meshes and couplings, spins); m/rad, and 1."""
        rows = [mesh_row(self.spins, mesh) for mesh in self.meshes]
        rows += [coupling_row(self.spins, coupling) for coupling in self.couplings]
        return np.array(rows).reshape(-1, len(self.spins))

    @property
    def _rows_with_locks(self) -> Floats:
        """The `spin_rows` and, below them, a row of torque 1 on each locked body."""
        locks = np.array([[float(name == lock) for name in self.spins] for lock in self.locked])
        return np.vstack([self.spin_rows, locks.reshape(-1, len(self.spins))])

    @cached_property
    def kinematic_modes(self) -> Floats:
        """Basis of the kinematic motions, (spins, degrees of freedom), without mesh closure and coupling twist."""
        return kinematic_modes(self.spin_rows)

    @property
    def degrees_of_freedom(self) -> int:
        """Number of kinematic degrees of freedom."""
        return int(self.kinematic_modes.shape[1])

    @cached_property
    def ratio(self) -> float:
        """Speed ratio output / input."""
        return self.rolling_speeds(self.input, 1.0)[self.output]

    @property
    def ratio_text(self) -> str:
        """Transmission ratio as text, the faster end over the slower one.

        Examples
        --------
        >>> from exugear import Gearbox
        >>> Gearbox.from_toml("cases/grc750/gearbox.toml").train.ratio_text
        '81.5 : 1, speed-increasing'
        """
        ratio = abs(self.ratio)
        if not ratio:
            return "output locked"
        faster = max(ratio, 1.0 / ratio)
        text = f"{faster:.{1 if 10.0 <= faster < 1000.0 else 2 if faster < 10.0 else 0}f} : 1"
        if faster > 1.0:
            text += ", speed-increasing" if ratio > 1.0 else ", speed-reducing"
        return text + (", opposite rotation" if self.ratio < 0.0 else "")

    @cached_property
    def independent(self) -> tuple[str, ...]:
        """Bodies whose speeds determine all others: the input, and those that are stationary if only it rotates."""
        return self._prescribed({self.input: 1.0})

    @cached_property
    def shares(self) -> dict[str, float]:
        """Speed of the output per unit speed of each `independent` body; for the input it is the speed ratio."""
        return {body: self.rolling({self.input: 0.0, body: 1.0})[self.output] for body in self.independent}

    def rolling_speeds(self, body: str, speed: float) -> dict[str, float]:
        """Speeds of all bodies (rad/s) of the kinematic gear train if `body` rotates at `speed`: see `rolling`."""
        return self.rolling({body: speed})

    def rolling(self, speeds: Mapping[str, float]) -> dict[str, float]:
        """Speeds of all bodies (rad/s) of the kinematic gear train for given speeds (rad/s) of some bodies by name.

        In a train of several degrees of freedom, locked bodies are stationary. Exceptions are bodies that rotate with
        the first one given, with the input or with the output, and bodies that cannot be stationary at the given
        speeds.

        Raises
        ------
        Exception
            Made by `error`: the speeds are undetermined or contradict each other, or a body cannot rotate.

        Examples
        --------
        >>> from exugear.gearbox.gearbox import Gearbox
        >>> train = Gearbox.from_toml("cases/grc750/gearbox.toml").train
        >>> round(train.rolling({"carrier": 1.0})["hss"], 6)
        81.490683
        """
        for body in speeds:
            if body not in self.spins:
                raise self.error(f"body {body!r} does not rotate; bodies are {', '.join(self.spins)}")
        if not self.degrees_of_freedom:
            raise self.error("meshes: the gear train is locked by its meshes and couplings; check them")
        prescribed = self._prescribed(speeds)
        rows = self._modes_of(prescribed)
        given = np.array([speeds.get(name, 0.0) for name in prescribed])
        weights, _, rank, _ = np.linalg.lstsq(rows, given, rcond=1e-9)
        if rank < self.degrees_of_freedom:
            raise self.error(
                f"the gear train has {self.degrees_of_freedom} degrees of freedom; the rotation of "
                f"{', '.join(prescribed)} does not determine all speeds; set the locked bodies in static_load.locked"
            )
        if np.abs(rows @ weights - given).max() > 1e-9 * np.abs(given).max():
            raise self.error(
                f"the speeds of {', '.join(speeds)} contradict each other: the gear train has "
                f"{self.degrees_of_freedom} degree{'s' if self.degrees_of_freedom > 1 else ''} of freedom"
            )
        return dict(zip(self.spins, (self.kinematic_modes @ weights).tolist(), strict=True))

    def _prescribed(self, speeds: Mapping[str, float]) -> tuple[str, ...]:
        """Bodies with given speeds, and those stationary bodies whose speed the given ones leave undetermined."""
        chosen = list(speeds)
        for name in self._standing(chosen[0]):
            rank = _rank(self._modes_of(tuple(chosen)))
            if _rank(self._modes_of((*chosen, name))) > rank:
                chosen.append(name)
        return tuple(chosen)

    def mesh_frequencies(self, speed: float) -> dict[str, float]:
        """Mesh frequency (Hz) of each mesh if the input rotates at `speed` rad/s.

        A frame that cannot rotate is stationary.
        """
        spins = self.rolling_speeds(self.input, speed)
        return {
            mesh.name: abs(spins.get(mesh.pinion, 0.0) - spins.get(mesh.frame, 0.0))
            * mesh.pair.pinion.teeth
            / (2.0 * math.pi)
            for mesh in self.meshes
        }

    def static_mesh_forces(self, torques: Mapping[str, float] | None = None) -> dict[str, float]:
        """Line-of-action force F_bt of each mesh (N) in the static state, of minimum norm if planets share the load.

        The sign indicates the loaded flank of gear 1: positive is the flank that faces the sense of +z rotation.

        Parameters
        ----------
        torques : by body name, N m; default: those of the static load. The same bodies are locked.

        Raises
        ------
        Exception
            Made by `error`: a body cannot rotate, too many bodies are locked, or they do not balance the torques.
        """
        torques = self.torques if torques is None else torques
        forces = self._holding(torques)
        applied = list(torques.values())
        smallest_radius = min((mesh.pair.pinion.base_radius for mesh in self.meshes), default=1.0)
        loaded = without_round_off(forces[: len(self.meshes)], np.abs(applied).max(initial=0.0), smallest_radius)
        return {mesh.name: float(force) for mesh, force in zip(self.meshes, loaded, strict=True)}

    @cached_property
    def static_torques(self) -> dict[str, float]:
        """Torque on each body in the static load by name, applied or by being locked, N m; without its sign if locked.

        Raises
        ------
        Exception
            As `static_mesh_forces`.
        """
        found = {name: self.torques.get(name, 0.0) for name in self.spins}
        reactions = self._holding(self.torques)[len(self.spin_rows) :]
        return found | {name: abs(float(force)) for name, force in zip(self.locked, reactions, strict=True)}

    def _holding(self, torques: Mapping[str, float]) -> Floats:
        """Find forces of constraints and torques of locks in equilibrium with torques, (spin rows + locks,).

        Loads and locks on bodies that cannot rotate, and more locks than degrees of freedom, are errors.
        """
        for key, names in (("torques_N_m", tuple(torques)), ("locked", self.locked)):
            for name in names:
                if name not in self.spins:
                    raise self.error(
                        f"static_load.{key} = {name!r}: no such rotating body; bodies are {', '.join(self.spins)}"
                    )
        if _rank(self._modes_of(self.locked)) < len(self.locked):
            raise self.error(
                f"static_load.locked = {list(self.locked)}: more bodies than the degrees of freedom of the train ("
                f"{self.degrees_of_freedom}), load sharing is undetermined; remove one"
            )
        applied = np.array([torques.get(name, 0.0) for name in self.spins])
        forces = holding_forces(self._rows_with_locks, applied)
        if forces is None:
            raise self.error(
                f"static_load: locking {', '.join(self.locked) or 'nothing'} does not balance the torques "
                f"{dict(torques)}; check static_load.locked"
            )
        return forces

    def dragging_forces(self) -> dict[str, float]:
        """Line-of-action force of each mesh (N) for a drag torque of 1 N m on each body, at the static locks.

        Its sign indicates the contacting flank of meshes that the static load leaves unloaded. The sense of rotation is
        that in which the static torques drive the train, or the opposite one if the input is locked and they are the
        load. The result is empty if the locks do not determine the forces.
        """
        speeds = self.rolling_speeds(self.input, 1.0)
        power = sum(torque * speeds[name] for name, torque in self.torques.items())
        sense = math.copysign(1.0, power) * (-1.0 if self.input in self.locked else 1.0)
        drag = -sense * np.sign(without_round_off(np.array([speeds[name] for name in self.spins]), 1.0, 1.0))
        forces = holding_forces(self._rows_with_locks, drag)
        if forces is None:
            return {}
        return dict(zip((mesh.name for mesh in self.meshes), forces.tolist(), strict=False))

    def _standing(self, body: str) -> tuple[str, ...]:
        """Bodies that are stationary while `body` rotates in a train of several degrees of freedom: the locked ones.

        Bodies that rotate with it, with the input or with the output are excluded, such as a brake behind the output.
        """
        if self.degrees_of_freedom == 1:
            return ()
        turning = self._modes_of((body, self.input, self.output))
        return tuple(
            name
            for name, motions in zip(self.locked, self._modes_of(self.locked), strict=True)
            if not any(turn_together(motions, row) for row in turning)
        )

    def _modes_of(self, bodies: tuple[str, ...]) -> Floats:
        """Rows of the kinematic modes that belong to bodies, (bodies, degrees of freedom)."""
        return self.kinematic_modes[[self.spins.index(name) for name in bodies]]
