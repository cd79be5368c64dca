"""A measured run-up of a gearbox file: signals in SI units, the angle of the input, and what each channel measured."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

import numpy as np

from exugear.exchange.recordings.reading import read_recording
from exugear.exchange.recordings.recording import RecordedChannel, Recording, RecordingError
from exugear.exchange.series_files import LARGEST_SERIES
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import known_names
from exugear.gearbox.sections.measurements import MeasuredChannelSection, MeasurementSection, TachoSection
from exugear.gearbox.units import MEASURED_UNITS, RPM, Unit, unit_of
from exugear.results.order_tracking.angle_cuts import AngleWindow
from exugear.results.order_tracking.encoders import check_lines, encoder_angle, error_of_angles
from exugear.results.order_tracking.shaft_angle import ShaftAngle, SpeedSignalError, angle_of_speed, angle_of_tacho
from exugear.steady.mean_system.planet_sets import SteadyError
from exugear.steady.settings import USUAL_COUNT, Method, SpeedRange, SteadySettings, check_speeds, usual_speeds
from fe_ste.tools.arrays import Complexes, Floats
from fe_ste.tools.display import ReprMixin
from fe_ste.tools.files import file_digest

LOAD_PARTS = 50
"""Number of equal parts of a run-up, and of its range of speeds, within which the torque is averaged."""
SAME_LOAD = 0.01
"""Relative difference from the static load up to which the mean torque is not applied: 0.09 dB of a level."""
SAME_TURNS = 0.005
"""Relative difference up to which revolutions by an encoder and by the tacho are the same."""
LEAST_RANGE = 1.1
"""Lowest ratio of the highest to the lowest speed of a run-up."""
BEYOND = 0.02
"""Fraction by which the speeds of the response exceed those of the run-up on both sides."""
AXES = ("x", "y", "z")
SIGNALS = {"force": "support_force", "transmission_error": "overall_dte"}
"""Signal of the steady-state response by measured quantity; motions follow from the acceleration of the seat."""
SEAT = "seat_acceleration"
INTEGRATIONS = {"acceleration": 0, "velocity": 1, "displacement": 2}
"""Number of integrations over time from the acceleration."""
SI_UNITS = {
    "acceleration": "m/s2",
    "velocity": "m/s",
    "displacement": "m",
    "transmission_error": "m",
    "force": "N",
}


@dataclass(frozen=True)
class MeasuredChannel:
    """What a channel measured."""

    name: str
    quantity: str
    place: str
    """Bearing or mount; empty for the transmission error."""
    direction: tuple[float, float, float]
    """Unit vector in the axes of the gearbox; zero for the transmission error."""

    @property
    def unit(self) -> str:
        """SI unit."""
        return SI_UNITS[self.quantity]

    @property
    def where(self) -> str:
        """Place and direction as text, such as ``middle_right y``."""
        if not self.place:
            return "overall"
        axis = next((name for name, part in zip(AXES, self.direction, strict=True) if part == 1.0), None)
        vector = "(" + ", ".join(f"{part:.3g}" for part in self.direction) + ")"
        return f"{self.place} {axis or vector}"

    def computed(self, names: Sequence[str], amplitude: Complexes, frequency: Floats) -> Complexes | None:
        """Complex amplitude (...) of the quantity from those of all signals (..., signals) at frequencies (...), Hz.

        None if the response has no such signal. Velocity and displacement are the acceleration over i w and (i w)^2.

        Examples
        --------
        >>> channel = MeasuredChannel("left", "velocity", "left", (1.0, 0.0, 0.0))
        >>> names = [f"seat_acceleration left {axis}" for axis in AXES]
        >>> channel.computed(names, np.array([[2.0 * np.pi, 0.0, 0.0]]), np.array([1.0])).round(6)
        array([0.-1.j])
        """
        if not self.place:
            signal = SIGNALS[self.quantity]
            return amplitude[..., names.index(signal)] if signal in names else None
        kind = SIGNALS.get(self.quantity, SEAT)
        wanted = [f"{kind} {self.place} {axis}" for axis in AXES]
        if not set(wanted) <= set(names):
            return None
        vector = amplitude[..., [names.index(name) for name in wanted]] @ np.array(self.direction)
        turns = INTEGRATIONS.get(self.quantity, 0)
        return np.asarray(vector / (2j * np.pi * frequency) ** turns)


@dataclass(frozen=True, eq=False)
class MeasuredTorque(ReprMixin, line=" of {body!r}: mean {mean:g} N m, {ends[0]:g} to {ends[1]:g} N m"):
    """Torque on a body during a run-up, N m, in the sense of the sensor."""

    body: str
    mean: float
    ends: tuple[float, float]
    """Lowest and highest mean of the parts of the run-up."""
    speed: Floats
    over_speed: Floats
    """(k,) speeds of the input, rad/s, ascending, and mean torques over the ranges of speed around them."""

    @classmethod
    def of(cls, body: str, values: Floats, speed: Floats) -> MeasuredTorque:
        """Return the torque of a signal (n,), N m, whose vibration is averaged within `LOAD_PARTS` parts.

        Parts are of equal time for `ends`, and of equal ranges of the speed (n,), rad/s, for `over_speed`.

        Examples
        --------
        >>> MeasuredTorque.of("input", np.linspace(99.0, 101.0, 5000), np.linspace(50.0, 100.0, 5000))
        <MeasuredTorque of 'input': mean 100 N m, 99.0198 to 100.98 N m>
        """
        means = [float(part.mean()) for part in np.array_split(values, LOAD_PARTS)]
        edges = np.linspace(speed.min(), speed.max(), LOAD_PARTS + 1)
        part = np.clip(np.searchsorted(edges, speed, side="right") - 1, 0, LOAD_PARTS - 1)
        count = np.bincount(part, minlength=LOAD_PARTS)
        sums = [np.bincount(part, own, LOAD_PARTS)[count > 0] for own in (speed, values)]
        own_speed, torque = (total / count[count > 0] for total in sums)
        return cls(body, float(values.mean()), (min(means), max(means)), own_speed, torque)


@dataclass(frozen=True, eq=False)
class MeasuredRunUp(ReprMixin, line=" {name!r}: {values.shape[0]} channels, {shaft!r}"):
    """A recorded run-up in SI units."""

    name: str
    """Name of its table in the gearbox file."""
    section: MeasurementSection
    path: Path
    digest: str
    """SHA-256 of the file."""
    shaft: ShaftAngle
    """Angle of the overall input."""
    per: float
    """Speed of the shaft with the tacho or the speed signal over that of the input, without sign."""
    speed_shaft: str
    channels: tuple[MeasuredChannel, ...]
    values: Floats
    """(channels, n) signals without their means, SI, at the samples of `shaft`."""
    clipped: dict[str, float]
    """Fraction of samples at the limits, by channel."""
    torque: MeasuredTorque | None = None
    """None without a channel of the torque."""

    @property
    def window(self) -> AngleWindow:
        """Window of order cuts, over revolutions of the shaft with the tacho or the speed signal."""
        return AngleWindow(self.section.window_revolutions)


def measurement_of(gearbox: Gearbox, name: str | None) -> tuple[str, MeasurementSection]:
    """Look up a measurement of a gearbox file; the only one without a name.

    Raises
    ------
    GearboxFileError
        There is no such measurement, or several and no name.
    """
    known = gearbox.case.measurements
    if name is None and len(known) == 1:
        name = next(iter(known))
    if name is None or name not in known:
        if not known:
            raise gearbox.error("measurements: the file has none; add [measurements.NAME] with the file of a recording")
        wanted = "specify one of them" if name is None else f"no measurement {name!r}"
        raise gearbox.error(f"measurements: {wanted}; {known_names('measurements', known, 'measurements.NAME')}")
    return name, known[name]


def recording_path(gearbox: Gearbox, name: str) -> Path:
    """Path of the recording of a measurement.

    Raises
    ------
    GearboxFileError
        It does not exist or may not be read.
    """
    return gearbox.file(f"measurements.{name}.file", gearbox.case.measurements[name].file, LARGEST_SERIES)


def read_run_up(gearbox: Gearbox, name: str | None = None) -> MeasuredRunUp:
    """Read a measured run-up that a gearbox file names.

    Parameters
    ----------
    name : name of its table; not needed if there is only one

    Raises
    ------
    GearboxFileError
        There is no such measurement, the recording cannot be used, a channel has no known unit, or no angle follows
        from the tacho or the speed signal.
    """
    name, section = measurement_of(gearbox, name)
    key = f"measurements.{name}"
    path = recording_path(gearbox, name)
    source = section.tacho or section.speed
    assert source is not None  # checked with the section
    # Names in the file of a channel: its own, or those of its two encoders.
    files = {
        own: tuple(encoder.channel for encoder in channel.encoders) if channel.encoders else (channel.channel or own,)
        for own, channel in section.channels.items()
    }
    try:
        recording = read_recording(path, list(dict.fromkeys([source.channel, *chain(*files.values())])))
    except RecordingError as error:
        raise gearbox.error(f"{key}.file = {section.file!r}: {error}") from None
    turning, per = _shaft_angle(gearbox, key, section, recording)
    shaft = turning.of_shaft(1.0 / per)
    slowest, fastest = float(shaft.speed.min()), float(shaft.speed.max())
    if fastest < LEAST_RANGE * slowest:
        raise gearbox.error(
            f"{key}: the speed of the input is {slowest / RPM:.4g} to {fastest / RPM:.4g} rpm; a run-up or run-down "
            f"over at least {100.0 * (LEAST_RANGE - 1.0):.0f} % is required"
        )
    part = slice(shaft.first, shaft.first + shaft.angle.size)
    values, torque = [], None
    for own, channel in section.channels.items():
        if channel.encoders is not None:
            values.append(
                _error_by_encoders(
                    gearbox, f"{key}.channels.{own}.encoders", section, channel.encoders, recording, shaft
                )
            )
            continue
        recorded = recording.channel(files[own][0])
        factor = _unit(gearbox, f"{key}.channels.{own}", channel.unit, recorded, channel.quantity).factor
        factor *= 1.0 if channel.full_scale is None else channel.full_scale
        if channel.body is not None:
            torque = MeasuredTorque.of(channel.body, factor * recorded.values[part], shaft.speed)
            continue
        if not np.ptp(recorded.values[part]) > 0.0:
            raise gearbox.error(
                f"{key}.channels.{own}: channel {recorded.name!r} is constant ({recorded.values[part][0]:g}); connect "
                "its sensor, or remove the channel"
            )
        values.append(factor * (recorded.values[part] - recorded.values[part].mean()))
    return MeasuredRunUp(
        name=name,
        section=section,
        path=path,
        digest=file_digest(path),
        shaft=shaft,
        per=per,
        speed_shaft=source.shaft,
        channels=tuple(
            _measured(own, channel) for own, channel in section.channels.items() if channel.quantity != "torque"
        ),
        values=np.array(values),
        clipped={own: recording.channel(names[0]).clipped for own, names in files.items() if len(names) == 1},
        torque=torque,
    )


def gearbox_at_torque(gearbox: Gearbox, run_up: MeasuredRunUp, share: float = 1.0) -> Gearbox:
    """Return the gearbox with its static load scaled to the mean torque of a run-up, or itself if they agree to 1 %.

    The sense of the static load stays, because that of a torque sensor is a convention of the test rig.

    Parameters
    ----------
    share : torque over the mean torque to which the static load is scaled; other shares than 1 are always applied

    Raises
    ------
    GearboxFileError
        The static load has no torque on the body, or the mean torque is zero.
    """
    if run_up.torque is None:
        return gearbox
    own = next(own for own, section in run_up.section.channels.items() if section.body is not None)
    key, body, static = f"measurements.{run_up.name}.channels.{own}", run_up.torque.body, gearbox.train.static_torques
    if not static.get(body):
        known = ", ".join(name for name, torque in static.items() if torque)
        raise gearbox.error(f"{key}.body = {body!r}: the static load has no torque on it; name one of {known}")
    factor = share * abs(run_up.torque.mean / static[body])
    if not factor > 0.0:
        raise gearbox.error(f"{key}: the mean torque is zero; connect its sensor, or remove the channel")
    if share == 1.0 and abs(factor - 1.0) <= SAME_LOAD:
        return gearbox
    torques = gearbox.case.static_load.torques_N_m
    return gearbox.varied({"static_load.torques_N_m": {name: factor * own for name, own in torques.items()}})


def response_settings(gearbox: Gearbox, run_up: MeasuredRunUp, method: Method = "parametric") -> SteadySettings:
    """Return the settings of the response to compare with: its speeds cover those of the run-up.

    Raises
    ------
    GearboxFileError
        A speed is implausibly high, most often because of a wrong shaft or unit.
    """
    sense = math.copysign(1.0, usual_speeds(gearbox).last)
    first, last = float(run_up.shaft.speed.min()), float(run_up.shaft.speed.max())
    speeds = SpeedRange(sense * (1.0 - BEYOND) * first, sense * (1.0 + BEYOND) * last, USUAL_COUNT)
    try:
        check_speeds(gearbox, speeds)
    except SteadyError as error:
        kind = "speed" if run_up.section.tacho is None else "tacho"
        raise gearbox.error(f"measurements.{run_up.name}.{kind}: {error}; check shaft, unit and pulses") from None
    return SteadySettings(speeds, method)


def _shaft_angle(
    gearbox: Gearbox, key: str, section: MeasurementSection, recording: Recording
) -> tuple[ShaftAngle, float]:
    """Angle of the shaft with the tacho or speed signal, and its speed over that of the input."""
    source = section.tacho or section.speed
    assert source is not None  # checked with the section
    kind = "speed" if section.tacho is None else "tacho"
    per = abs(gearbox.train.rolling_speeds(gearbox.case.overall.input, 1.0).get(source.shaft, 0.0))
    if not per > 0.0:
        raise gearbox.error(
            f"{key}.{kind}.shaft = {source.shaft!r}: does not turn with the overall input "
            f"{gearbox.case.overall.input!r}; name a shaft whose speed is in a fixed ratio to it"
        )
    recorded = recording.channel(source.channel)
    try:
        if isinstance(source, TachoSection):
            return angle_of_tacho(recorded.values, recording.rate, source.pulses_per_revolution), per
        unit = _unit(gearbox, f"{key}.speed", source.unit, recorded, "speed")
        return angle_of_speed(unit.factor * recorded.values, recording.rate), per
    except SpeedSignalError as error:
        raise gearbox.error(f"{key}.{kind}.channel = {source.channel!r}: {error}") from None


def _error_by_encoders(
    gearbox: Gearbox,
    key: str,
    section: MeasurementSection,
    encoders: Sequence[TachoSection],
    recording: Recording,
    shaft: ShaftAngle,
) -> Floats:
    """Overall transmission error, m, by the encoders of input and output at the samples of the angle of the input."""
    turns = gearbox.train.rolling_speeds(gearbox.case.overall.input, 1.0)
    name, order = max(gearbox.mesh_orders(section.harmonics).items(), key=lambda own: own[1])
    angles = []
    for encoder in encoders:
        lines, per = encoder.pulses_per_revolution, abs(turns[encoder.shaft])
        try:
            check_lines(lines, order / per, name)
            angle = encoder_angle(recording.channel(encoder.channel).values, recording.rate, lines, shaft.time)
        except SpeedSignalError as error:
            raise gearbox.error(f"{key}: channel {encoder.channel!r} {error}") from None
        counted, expected = (float(own[-1] - own[0]) / (2.0 * np.pi) for own in (angle, per * shaft.angle))
        if abs(counted / expected - 1.0) > SAME_TURNS:
            raise gearbox.error(
                f"{key}: channel {encoder.channel!r} counts {counted:.5g} revolutions of {encoder.shaft} with {lines} "
                f"pulses_per_revolution, and the run-up has {expected:.5g}; check its lines, its channel and its shaft"
            )
        angles.append(angle)
    return gearbox.output_radius * error_of_angles(angles[0], angles[1], gearbox.train.ratio)


def _unit(gearbox: Gearbox, key: str, stated: str | None, recorded: RecordedChannel, quantity: str) -> Unit:
    """Return the unit of a channel: that of the gearbox file, or else that of the recording."""
    unit = recorded.known_unit if stated is None else unit_of(stated, any_case=True)
    kind, examples = MEASURED_UNITS[quantity]
    if unit is None or unit.quantity != kind:
        written = f"the unit {recorded.unit!r} in the file" if recorded.unit else "no unit in the file"
        raise gearbox.error(
            f"{key}: channel {recorded.name!r} has {written}, which is not one of {quantity}; set unit = ... such as "
            f"{examples}"
        )
    return unit


def _measured(name: str, section: MeasuredChannelSection) -> MeasuredChannel:
    direction = section.direction
    if isinstance(direction, str):
        x, y, z = (float(axis == direction) for axis in AXES)
    else:
        x, y, z = direction or (0.0, 0.0, 0.0)
    length = math.hypot(x, y, z) or 1.0
    return MeasuredChannel(name, section.quantity, section.place or "", (x / length, y / length, z / length))
