"""An elastic body as the equations of motion take it: reduced, with its seats and its rigid inertia. Data alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from exugear.system.bodies.floating_body import FloatingBody
from exugear.system.bodies.reduced_body import ReducedBody, RigidInertia
from fe_ste.tools.display import Displayed


@dataclass(frozen=True)
class ElasticBody(Displayed):
    """A reduced body of a gearbox."""

    reduced: ReducedBody
    """With the rigid inertia of the body's inertia set."""
    shape_inertia: RigidInertia
    """Rigid inertia of shape and blanks by themselves."""
    main_seat: str
    """Seat whose spin stands for the body: where torques act, else the first gear."""
    sectors: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Seats on equal sectors by internal gear, an odd number, the first about +x, then on towards +y."""
    shared_seats: Mapping[str, str] = field(default_factory=dict)
    """Seat that a second bearing sits on, by the bearing."""
    floating: FloatingBody | None = None
    """Its modes in a frame that floats with it, for a body that moves so in Exudyn."""
    file_digest: str | None = None
    """SHA-256 of the file of a solid."""

    def _line(self) -> str:
        more = f", {len(self.sectors)} gears on sectors" if self.sectors else ""
        frame = ", floating frame" if self.floating is not None else ""
        return f" of {self.reduced!r}: main seat {self.main_seat}{more}{frame}"
