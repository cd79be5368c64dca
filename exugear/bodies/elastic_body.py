"""An elastic body as the equations of motion take it: reduced, with its seats and its rigid inertia. Data alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from exugear.bodies.floating_body import FloatingBody
from exugear.bodies.reduced_body import ReducedBody, RigidInertia
from fe_ste.tools.display import Displayed


@dataclass(frozen=True)
class ElasticBody(Displayed):
    """A reduced body of a gearbox.

    Attributes
    ----------
    reduced : with the rigid inertia of the body's inertia set
    shape_inertia : rigid inertia of shape and blanks by themselves
    main_seat : seat whose spin stands for the body: where torques act, else the first gear
    sectors : seats on equal sectors by internal gear, an odd number, the first about +x, then on towards +y
    shared_seats : seat that a second bearing sits on, by the bearing
    floating : its modes in a frame that floats with it, for a body that moves so in Exudyn
    file_digest : SHA-256 of the file of a solid
    """

    reduced: ReducedBody
    shape_inertia: RigidInertia
    main_seat: str
    sectors: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    shared_seats: Mapping[str, str] = field(default_factory=dict)
    floating: FloatingBody | None = None
    file_digest: str | None = None

    def _line(self) -> str:
        more = f", {len(self.sectors)} gears on sectors" if self.sectors else ""
        frame = ", floating frame" if self.floating is not None else ""
        return f" of {self.reduced!r}: main seat {self.main_seat}{more}{frame}"
