"""Sections on measurements: recordings of run-ups on a test rig, and what their channels measured."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from exugear.gearbox.sections import entries as q
from exugear.gearbox.sections.entries import Entries, FileName, Name, Section, Text
from exugear.gearbox.sections.loads import ChannelName

MeasuredQuantity = Literal["acceleration", "velocity", "displacement", "force", "transmission_error"]
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
    the dynamic force there, and the transmission error is the overall one as a length.
    """
    unit: _UnitText | None = None
    """Unit of its values, such as `g`; by default that of the file."""
    full_scale: q.FullScale | None = None
    """Value at full scale in `unit`, for WAV files."""
    place: Name | None = None
    """Bearing or mount; not for the transmission error."""
    direction: Literal["x", "y", "z"] | _Vector | None = None
    """Direction in the axes of the gearbox, as an axis or a vector."""

    @model_validator(mode="after")
    def _place(self) -> MeasuredChannelSection:
        is_error = self.quantity == "transmission_error"
        for key in ("place", "direction"):
            if is_error and getattr(self, key) is not None:
                raise ValueError(f"{key} does not apply to the overall transmission error; remove the key")
            if not is_error and getattr(self, key) is None:
                raise ValueError(f'{key} is required for {self.quantity}; set place = "BEARING" and direction = "y"')
        if isinstance(self.direction, tuple) and not any(self.direction):
            raise ValueError("direction = [0, 0, 0]: has no length; set a vector such as [0, 1, 0]")
        if self.full_scale is not None and self.unit is None:
            raise ValueError('full_scale requires unit; set unit = "g" or another one')
        return self


class MeasurementSection(Section):
    """A recorded run-up, which `exugear measured` compares with the steady-state response."""

    file: FileName
    """Recording (UNV data set 58, CSV, WAV, HDF5 or netCDF), in the folder of the gearbox file."""
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
        return self
