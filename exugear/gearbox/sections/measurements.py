"""Sections on measurements: recordings of run-ups on a test rig, and what their channels measured."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from exugear.gearbox.sections import entries as q
from exugear.gearbox.sections.entries import Entries, FileName, Name, Section, Text
from exugear.gearbox.sections.loads import ChannelName

MeasuredQuantity = Literal["acceleration", "velocity", "displacement", "force", "transmission_error", "torque"]
_UnitText = Annotated[str, Field(pattern=r"^[^\x00-\x1f\x7f]+$", max_length=40)]
_Vector = Annotated[tuple[q.DirectionComponent, q.DirectionComponent, q.DirectionComponent], Field(strict=False)]


class TachoSection(Section):
    """Channel of the pulses of a shaft."""

    channel: ChannelName
    """Name of the channel in the file."""
    shaft: Name
    """Body whose revolutions it counts."""
    pulses_per_revolution: q.PulsesPerRevolution = 1
    """Number of pulses per revolution; marks that are off their places are learned."""


class SpeedChannelSection(Section):
    """Channel of the speed of a shaft; a tacho is preferable, as small errors of the speed blur high orders."""

    channel: ChannelName
    """Name of the channel in the file."""
    shaft: Name
    """Body whose speed it is."""
    unit: _UnitText | None = None
    """Unit of its values; by default that of the file."""


class MeasuredChannelSection(Section):
    """A measured channel: quantity, unit, place and direction."""

    channel: ChannelName | None = None
    """Name of the channel in the file; by default the name of this table."""
    quantity: MeasuredQuantity
    """Measured quantity. Displacement, velocity and acceleration are those of the seat of a bearing or mount, force is
    the dynamic force there, and the transmission error is the overall one as a length. The torque of a shaft sets the
    load of the computed side over the speed; only one channel may have it.
    """
    unit: _UnitText | None = None
    """Unit of its values, such as `g`; by default that of the file."""
    encoders: Annotated[tuple[TachoSection, TachoSection], Field(strict=False)] | None = None
    """Encoders of the overall input and the overall output, whose pulses give the transmission error; their lines are
    `pulses_per_revolution`. The channel then has no other keys.
    """
    full_scale: q.FullScale | None = None
    """Value at full scale in `unit`, for WAV files."""
    place: Name | None = None
    """Bearing or mount; not for the transmission error and the torque."""
    direction: Literal["x", "y", "z"] | _Vector | None = None
    """Direction in the axes of the gearbox, as an axis or a vector."""
    body: Name | None = None
    """Body whose torque it is, one that `[static_load]` loads or locks; only for the torque."""

    @model_validator(mode="after")
    def _place(self) -> MeasuredChannelSection:
        if self.encoders is not None:
            stated = [key for key in ("channel", "unit", "full_scale") if getattr(self, key) is not None]
            if self.quantity != "transmission_error":
                raise ValueError('encoders apply to the transmission error only; set quantity = "transmission_error"')
            if stated:
                raise ValueError(f"{stated[0]} does not apply to a transmission error by encoders; remove the key")
        at_place = self.quantity not in ("transmission_error", "torque")
        for key in ("place", "direction"):
            if not at_place and getattr(self, key) is not None:
                what = "torque of a body" if self.quantity == "torque" else "overall transmission error"
                raise ValueError(f"{key} does not apply to the {what}; remove the key")
            if at_place and getattr(self, key) is None:
                raise ValueError(f'{key} is required for {self.quantity}; set place = "BEARING" and direction = "y"')
        if (self.body is None) == (self.quantity == "torque"):
            what = (
                'is required for torque; set body = "BODY"'
                if self.body is None
                else "applies to torque only; remove it"
            )
            raise ValueError(f"body {what}")
        if isinstance(self.direction, tuple) and not any(self.direction):
            raise ValueError("direction = [0, 0, 0]: has no length; set a vector such as [0, 1, 0]")
        if self.full_scale is not None and self.unit is None:
            raise ValueError('full_scale requires unit; set unit = "g" or another one')
        return self


class MeasurementSection(Section):
    """A recorded run-up, which `exugear measured` compares with the steady-state response."""

    file: FileName
    """Recording (UNV data set 58, CSV, WAV, HDF5, netCDF or MDF), in the folder of the gearbox file."""
    description: Text = ""
    """Description for the user."""
    tacho: TachoSection | None = None
    """Pulses of a shaft; or the next key."""
    speed: SpeedChannelSection | None = None
    """Speed of a shaft."""
    window_revolutions: q.WindowRevolutions = 8.0
    """Revolutions of the shaft of the tacho or the speed within the Hann window of an order cut; more of them separate
    closer orders and average more over resonances.
    """
    harmonics: q.MeasuredHarmonics = 3
    """Harmonics of each mesh frequency that are compared."""
    load_case: Name | None = None
    """Load case whose torques at its start the test had; by default those of `[static_load]`."""
    channels: Annotated[Entries[MeasuredChannelSection], Field(min_length=1)]
    """Measured channels by name."""

    @model_validator(mode="after")
    def _one_speed(self) -> MeasurementSection:
        if (self.tacho is None) == (self.speed is None):
            raise ValueError(
                'set either tacho = { channel = "...", shaft = "..." } or speed = { channel = "...", shaft = "..." }'
            )
        torques = [name for name, channel in self.channels.items() if channel.quantity == "torque"]
        if len(torques) > 1:
            raise ValueError(f"channels {', '.join(torques)} are torques; keep the one that sets the load")
        if len(torques) == len(self.channels):
            raise ValueError("no channel is compared; add one of another quantity than torque")
        return self
