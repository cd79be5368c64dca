"""A gear train: its spins, what ties them, how it rolls from input to output, and what it carries at rest."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from exugear.gearbox.train.kinematics import (
    CoupledBodies,
    MeshedBodies,
    coupling_row,
    kinematic_modes,
    mesh_row,
    turn_together,
)
from exugear.gearbox.train.statics import holding_forces, without_round_off
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import Displayed, TitledRows


@dataclass(frozen=True, eq=False)
class Train(
    Displayed, line=" from {input!r} to {output!r}: {spins!n} spins, {meshes!n} meshes, {couplings!n} couplings"
):
    """Bodies that turn about fixed or orbiting axes, tied by rigid meshes and couplings.

    It knows no gearbox: what it cannot do it tells through `fault`, which names the file.

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
    """Bodies that can turn, in the order of the spin vector."""
    meshes: tuple[MeshedBodies, ...]
    couplings: tuple[CoupledBodies, ...]
    input: str
    output: str
    """Bodies at the ends of the train."""
    torques: Mapping[str, float]
    """By body name, static torques, N m."""
    locked: tuple[str, ...]
    """Bodies that hold them."""
    fault: Callable[[str], Exception]
    """Makes the error to raise from what is wrong."""

    def _table(self) -> TitledRows:
        return f"train from {self.input} to {self.output}", {
            "ratio": f"{self.ratio:.6g}",
            "degrees of freedom": str(self.degrees_of_freedom),
            "spins": ", ".join(self.spins),
            "static load": ", ".join(f"{torque:g} N m on {body}" for body, torque in self.torques.items()),
            "held by": ", ".join(self.locked) or "nothing",
        }

    @cached_property
    def spin_rows(self) -> Floats:
        """How meshes close and couplings twist per unit spins, (meshes and couplings, spins); m/rad, and 1."""
        rows = [mesh_row(self.spins, mesh) for mesh in self.meshes]
        rows += [coupling_row(self.spins, coupling) for coupling in self.couplings]
        return np.array(rows).reshape(-1, len(self.spins))

    @cached_property
    def kinematic_modes(self) -> Floats:
        """Basis of rolling motions, (spins, degrees of freedom): no mesh closes, no coupling twists."""
        return kinematic_modes(self.spin_rows)

    @property
    def degrees_of_freedom(self) -> int:
        """Degrees of freedom in which the train rolls."""
        return int(self.kinematic_modes.shape[1])

    @cached_property
    def ratio(self) -> float:
        """Spin of the output per spin of the input."""
        return self.rolling_speeds(self.input, 1.0)[self.output]

    @cached_property
    def independent(self) -> tuple[str, ...]:
        """Bodies whose speeds tell all others: the input, and those that stand while it alone turns."""
        return self._prescribed({self.input: 1.0})

    @cached_property
    def shares(self) -> dict[str, float]:
        """Spin of the output per spin of each of the `independent` bodies; of the input it is the ratio."""
        return {body: self.rolling({self.input: 0.0, body: 1.0})[self.output] for body in self.independent}

    def rolling_speeds(self, body: str, speed: float) -> dict[str, float]:
        """Spins of all bodies (rad/s) in rolling motion when `body` turns at `speed`: see `rolling`."""
        return self.rolling({body: speed})

    def rolling(self, speeds: Mapping[str, float]) -> dict[str, float]:
        """Spins of all bodies (rad/s) in rolling motion when some turn at given speeds.

        In a train of several degrees of freedom, locked bodies stand: not those that turn with the first one given,
        with input or output, nor such as cannot stand beside those given.

        Parameters
        ----------
        speeds : by body name, rad/s

        Raises
        ------
        Exception
            As `fault` makes it: the train is not fixed by that, the bodies do not turn so, or one does not turn.

        Examples
        --------
        >>> from exugear.gearbox.gearbox import Gearbox
        >>> train = Gearbox.from_toml("cases/grc750/gearbox.toml").train
        >>> round(train.rolling({"carrier": 1.0})["hss"], 6)
        81.490683
        """
        for body in speeds:
            if body not in self.spins:
                raise self.fault(f"body {body!r} does not turn; bodies are {', '.join(self.spins)}")
        if not self.degrees_of_freedom:
            raise self.fault("meshes: the gear train cannot turn, its meshes and couplings lock each other")
        prescribed = self._prescribed(speeds)
        rows = self._modes_of(prescribed)
        given = np.array([speeds.get(name, 0.0) for name in prescribed])
        weights, _, rank, _ = np.linalg.lstsq(rows, given, rcond=1e-9)
        if rank < self.degrees_of_freedom:
            raise self.fault(
                f"the gear train has {self.degrees_of_freedom} degrees of freedom; turning {', '.join(prescribed)} "
                "does not fix it: name the bodies that are held in static_load.locked"
            )
        if np.abs(rows @ weights - given).max() > 1e-9 * np.abs(given).max():
            raise self.fault(
                f"the speeds of {', '.join(speeds)} contradict each other: the gear train has "
                f"{self.degrees_of_freedom} degree{'s' if self.degrees_of_freedom > 1 else ''} of freedom"
            )
        return dict(zip(self.spins, (self.kinematic_modes @ weights).tolist(), strict=True))

    def _prescribed(self, speeds: Mapping[str, float]) -> tuple[str, ...]:
        """Bodies with given speeds, and of those that stand the ones that these leave free."""
        chosen = list(speeds)
        for name in self._standing(chosen[0]):
            rank = np.linalg.matrix_rank(self._modes_of(tuple(chosen)))
            if np.linalg.matrix_rank(self._modes_of((*chosen, name))) > rank:
                chosen.append(name)
        return tuple(chosen)

    def mesh_frequencies(self, speed: float) -> dict[str, float]:
        """Mesh frequency (Hz) of each mesh when the input turns at `speed` rad/s; a frame that is no spin stands."""
        spins = self.rolling_speeds(self.input, speed)
        return {
            mesh.name: abs(spins.get(mesh.pinion, 0.0) - spins.get(mesh.frame, 0.0))
            * mesh.pair.pinion.teeth
            / (2.0 * math.pi)
            for mesh in self.meshes
        }

    def static_mesh_forces(self, torques: Mapping[str, float] | None = None) -> dict[str, float]:
        """Line-of-action force F_bt of each mesh (N) in the static state, least-norm where planets share.

        The sign says which flank of gear 1 carries: positive = the one that faces the sense of +z rotation.

        Parameters
        ----------
        torques : by body name, N m, those of the static load by default; the same bodies are locked

        Raises
        ------
        Exception
            As `fault` makes it: a body is no spin, too many bodies are locked, or they do not hold the torques.
        """
        torques = self.torques if torques is None else torques
        self._check_load(torques)
        applied = np.array([torques.get(name, 0.0) for name in self.spins])
        locks = np.array([[float(name == lock) for name in self.spins] for lock in self.locked])
        forces = holding_forces(np.vstack([self.spin_rows, locks.reshape(-1, len(self.spins))]), applied)
        if forces is None:
            raise self.fault(
                f"static_load: the torques {dict(torques)} are not held by locking "
                f"{', '.join(self.locked) or 'nothing'}"
            )
        smallest_radius = min((mesh.pair.pinion.base_radius for mesh in self.meshes), default=1.0)
        loaded = without_round_off(forces[: len(self.meshes)], np.abs(applied).max(), smallest_radius)
        return {mesh.name: float(force) for mesh, force in zip(self.meshes, loaded, strict=True)}

    def dragging_forces(self) -> dict[str, float]:
        """Line-of-action force of each mesh (N) where a drag of 1 N m holds each body back, at the static locks.

        It says by its sign which flank touches where the static load leaves none pressed. The train rolls as the static
        torques drive it, or against them where the input is locked and they are the load; nothing where that leaves
        open how it rolls.
        """
        speeds = self.rolling_speeds(self.input, 1.0)
        power = sum(torque * speeds[name] for name, torque in self.torques.items())
        sense = math.copysign(1.0, power) * (-1.0 if self.input in self.locked else 1.0)
        drag = -sense * np.sign(without_round_off(np.array([speeds[name] for name in self.spins]), 1.0, 1.0))
        locks = np.array([[float(name == lock) for name in self.spins] for lock in self.locked])
        forces = holding_forces(np.vstack([self.spin_rows, locks.reshape(-1, len(self.spins))]), drag)
        if forces is None:
            return {}
        return dict(zip((mesh.name for mesh in self.meshes), forces.tolist(), strict=False))

    def _check_load(self, torques: Mapping[str, float]) -> None:
        """Refuse loads and locks on bodies that do not turn, and more locks than degrees of freedom."""
        for key, names in (("torques_N_m", tuple(torques)), ("locked", self.locked)):
            for name in names:
                if name not in self.spins:
                    raise self.fault(
                        f"static_load.{key} = {name!r}: no such turning body; bodies are {', '.join(self.spins)}"
                    )
        if np.linalg.matrix_rank(self._modes_of(self.locked)) < len(self.locked):
            raise self.fault(
                f"static_load.locked = {list(self.locked)}: more bodies than the train has freedoms, "
                f"{self.degrees_of_freedom}; leave one out, for nothing says how they share the load"
            )

    def _standing(self, body: str) -> tuple[str, ...]:
        """Bodies that stand while `body` turns in a train of several degrees of freedom: the locked ones.

        Not those that turn with it, with the input or with the output, such as a brake behind the output.
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
        """Rows of the rolling motions that belong to bodies, (bodies, degrees of freedom)."""
        return self.kinematic_modes[[self.spins.index(name) for name in bodies]]
