"""Settings of a steady-state response: speeds, method, orders."""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import asdict, dataclass
from typing import Literal, get_args

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.load_cases import (
    BURSTING_RIM_SPEED,
    operating_range,
    rim_radii,
    speeds_beyond_tables,
    summarise_loads,
)
from exugear.gearbox.units import RPM
from exugear.gearbox.versions import STEADY
from exugear.steady.mean_system.planet_sets import SteadyError, unlike_families
from exugear.system.system import Assembly, input_hash
from exugear.system.tooth_mesh.laws.registry import LAWS
from fe_ste.tools.arrays import Floats

Method = Literal["linear", "parametric", "nonlinear"]
METHODS: tuple[Method, ...] = get_args(Method)
USUAL_COUNT = 400
OPERATING_COUNT = 180
MOST_COUNT = 20000
MOST_HARMONICS = 100
SLOWEST = 1e-6
"""Share of the maximum speed below which the input is at standstill, without excitation in time."""


@dataclass(frozen=True)
class SpeedRange:
    """Even speeds of the overall input."""

    first: float
    last: float
    """rad/s, positive about +z."""
    count: int
    """How many, both ends included."""

    def __post_init__(self) -> None:
        """Refuse what is no range."""
        if not (math.isfinite(self.first) and math.isfinite(self.last)):
            raise SteadyError(f"speeds {self.text}: must be finite")
        if not 1 <= self.count <= MOST_COUNT:
            raise SteadyError(f"speeds {self.text}: the count must be from 1 to {MOST_COUNT}")
        if self.first * self.last < 0.0:
            raise SteadyError(f"speeds {self.text}: change sign; compute each sense of rotation separately")
        if self.first == self.last == 0.0:
            raise SteadyError(f"speeds {self.text}: no excitation at standstill; set a speed above 0")
        if self.first == 0.0 and self.count == 1:
            raise SteadyError(
                f"speeds {self.text}: the only speed is the first one, standstill, which has no excitation; set 2 or "
                "more speeds, or a first one above 0"
            )

    @property
    def text(self) -> str:
        """The range as it is written, rpm."""
        return f"{self.first / RPM:g}:{self.last / RPM:g}:{self.count}"

    @property
    def values(self) -> Floats:
        """Speeds without standstill, rad/s, ascending."""
        speeds = np.sort(np.linspace(self.first, self.last, self.count))
        return np.asarray(speeds[np.abs(speeds) > SLOWEST * np.abs(speeds).max()])

    @classmethod
    def from_text(cls, text: str) -> SpeedRange:
        """Read ``FIRST:LAST:COUNT``, rpm of the overall input.

        Examples
        --------
        >>> SpeedRange.from_text("0:60:3").values.round(6)
        array([3.141593, 6.283185])
        """
        parts = text.split(":")
        try:
            first = float(parts[0])
            last = float(parts[1])
            count = int(parts[2])
            if len(parts) != 3:
                raise ValueError
        except (ValueError, IndexError):
            raise SteadyError(
                f"speeds {text!r}: must be FIRST:LAST:COUNT in rpm of the input, such as 0:215:400"
            ) from None
        return cls(first * RPM, last * RPM, count)


def usual_speeds(gearbox: Gearbox) -> SpeedRange:
    """Return the speeds of the first load case, from standstill on, and the operating speeds.

    Raises
    ------
    SteadyError
        No load case rotates the gear train, and the file gives no operating speed.

    Examples
    --------
    >>> usual_speeds(Gearbox.from_toml("cases/grc750/gearbox.toml")).text
    '0:-214.5...:400'
    """
    fastest = (operating_range(gearbox) or (0.0, 0.0))[1]
    sense = 1.0
    for case in gearbox.load_cases.values():
        loads = summarise_loads(gearbox, case)
        if loads.fastest_speed > 0.0:
            fastest = max(fastest, loads.fastest_speed)
            sense = loads.end_speed
            break
    if fastest == 0.0:
        raise SteadyError(
            "speeds: no load case rotates the train, and [operation] has no speed; use --speeds, such as 0:215 "
            "in rpm of the input"
        )
    return SpeedRange(0.0, math.copysign(fastest, sense), USUAL_COUNT)


def operating_speeds(gearbox: Gearbox) -> SpeedRange:
    """Return the speeds of the operating range, in the sense of the first load case; all of its speeds without a range.

    Examples
    --------
    >>> operating_speeds(Gearbox.from_toml("cases/grc750/gearbox.toml")).text
    '-11.05:-27.625:180'
    """
    usual = usual_speeds(gearbox)
    stated = operating_range(gearbox)
    if stated is None:
        return usual
    low, high = (math.copysign(speed, usual.last) for speed in stated)
    return SpeedRange(low, high, OPERATING_COUNT)


def check_speeds(gearbox: Gearbox, speeds: SpeedRange) -> None:
    """Refuse implausibly high speeds, and those beyond the table of an excitation.

    Raises
    ------
    SteadyError
        A tip speed exceeds the limit for steel gears, or a table of torque ripple does not cover the speeds.
    """
    evaluated = np.abs(speeds.values)
    if beyond := speeds_beyond_tables(gearbox, float(evaluated.min()), float(evaluated.max())):
        raise SteadyError(f"speeds {speeds.text}: {beyond}")
    fastest = max(abs(speeds.first), abs(speeds.last))
    turns = gearbox.train.rolling_speeds(gearbox.case.overall.input, 1.0)
    rims = {name: abs(turns[name]) * radius for name, radius in rim_radii(gearbox).items()}
    body, rim = max(rims.items(), key=lambda pair: pair[1], default=("", 0.0))
    if rim * fastest > BURSTING_RIM_SPEED:
        raise SteadyError(
            f"speeds {speeds.text}: the tip speed on {body} reaches {rim * fastest:.4g} m/s, and steel gears burst at "
            f"about {BURSTING_RIM_SPEED:g} m/s; use at most {BURSTING_RIM_SPEED / rim / RPM:.4g} rpm"
        )


def check_law(name: str, method: Method) -> None:
    """Refuse a mesh model that a method does not support.

    Raises
    ------
    SteadyError
        The mesh model is a kinematic constraint, or it includes contact loss and the method is linear in the
        deflections.
    """
    law = LAWS[name]
    if not law.has_force:
        raise SteadyError(f"mesh model {name}: kinematic constraint without vibration; use another mesh model")
    if law.loses_contact and method != "nonlinear":
        raise SteadyError(
            f"mesh model {name}: includes contact loss, which the method {method} cannot treat; use --method "
            "nonlinear, or --mesh-model line_of_action"
        )


def check_nonlinear(gearbox: Gearbox, method: Method) -> None:
    """Refuse the method ``nonlinear`` for trains without meshes.

    Raises
    ------
    SteadyError
        The gearbox file has no meshes, and the method is ``nonlinear``.
    """
    if method == "nonlinear" and not gearbox.meshes:
        raise SteadyError(
            "meshes: the train has none whose forces the method nonlinear could evaluate; use --method parametric, or "
            "exugear run"
        )


def check_planets(gearbox: Gearbox, method: Method) -> None:
    """Refuse the method that does not include planets which are not alike.

    Raises
    ------
    SteadyError
        Planets are fewer than three or unequally spaced, and the method is ``linear``.
    """
    families = unlike_families(gearbox.bodies())
    if families and method == "linear":
        raise SteadyError(
            f"bodies.{next(iter(families.values()))}: planets that are fewer than three or unequally spaced; the "
            "stiffness varies with the carrier angle, which the method linear does not include; use --method "
            "parametric with --mesh-model line_of_action, --method nonlinear, or exugear run"
        )


def check_varying(assembly: Assembly, method: Method) -> None:
    """Refuse the method that does not include stiffness that varies as the carrier turns.

    Raises
    ------
    SteadyError
        The ring gear is flexible, or planets are not alike, and the method is ``linear``.
    """
    check_planets(assembly.gearbox, method)
    if assembly.travelling.first.size and method == "linear":
        raise SteadyError(
            "the ring gear is flexible, and its stiffness under the passing planets varies: the method linear does not "
            "include that; use --method parametric with --mesh-model line_of_action, --method nonlinear or exugear run"
        )


@dataclass(frozen=True)
class SteadySettings:
    """What is asked for."""

    speeds: SpeedRange
    method: Method = "parametric"
    """{"linear", "parametric", "nonlinear"}: the static transmission error as excitation, stiffness that varies with
    the mesh cycle, or laws evaluated in time, the position in the cycle moving with the vibration."""
    harmonics: int | None = None
    """Harmonics of each mesh frequency; by default as many as the mesh stiffness asks for."""
    combinations: int = 3
    """Largest sum of multiples of several mesh frequencies."""
    at_resonances: bool = True
    """Whether speeds are added where lines cross modes."""
    branches: bool = False
    """Whether the states are followed by arc length from the first speed to the last, through folds, with the
    stability of each; the count of speeds and `at_resonances` then play no part."""

    def __post_init__(self) -> None:
        """Refuse unknown methods, too many harmonics, and branches where there are none."""
        if self.method not in METHODS:
            raise SteadyError(f"method {self.method!r} is unknown; choose one of: {', '.join(METHODS)}")
        if self.harmonics is not None and not 1 <= self.harmonics <= MOST_HARMONICS:
            raise SteadyError(f"harmonics {self.harmonics}: must be from 1 to {MOST_HARMONICS}")
        if self.branches and self.method != "nonlinear":
            raise SteadyError(
                f"continuation: the method {self.method} has one solution at each speed; use --method nonlinear"
            )

    def hash_with(self, assembly: Assembly) -> str:
        """SHA-256 of all that a response depends on."""
        content = {
            "method_version": STEADY,
            "input": input_hash(assembly),
            "settings": asdict(self),
            "operation": operating_range(assembly.gearbox),
        }
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
