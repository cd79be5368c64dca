"""Excitations over the angle of a body as the gearbox file states them: torques, forces and moments, unbalance."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from exugear.gearbox.sections import entries as q
from exugear.gearbox.sections.entries import FileName, Name, Section, Text

MOST_ORDERS = 200
"""Maximum number of orders of an excitation."""
_Force = Annotated[tuple[q.ForceN, q.ForceN, q.ForceN], Field(strict=False)]
_Moment = Annotated[tuple[q.TorqueNm, q.TorqueNm], Field(strict=False)]


AMPLITUDES = ("torque_N_m", "torque_percent", "force_N", "moment_N_m")
"""Keys with one amplitude per order."""


class ExcitationSection(Section):
    """Load on a rotating body that varies with its angle: an electric machine, an engine, a propeller, an unbalance.

    A torque, force or moment is the sum of A cos(order x angle + phase) over the orders, in addition to constant loads.
    It acts in runs and in steady-state responses. In the variant `rigid` ideal joints react forces and moments. On a
    flexible shaft a seat is added at `z_mm`.
    """

    body: Name
    """Body on which it acts and whose angle counts."""
    z_mm: q.PlaceMm | None = None
    """Position along the axis of the body, required by an unbalance, a force and a moment."""
    orders: Annotated[tuple[q.ShaftOrder, ...], Field(strict=False, max_length=MOST_ORDERS)] = ()
    """Periods per revolution of the body, whole numbers and halves; with `pole_pairs`, per electrical revolution."""
    torque_N_m: Annotated[tuple[q.RippleNm, ...], Field(strict=False, max_length=MOST_ORDERS)] = ()
    """Amplitude of the torque about z of each order, zero to peak."""
    torque_percent: Annotated[tuple[q.RipplePercent, ...], Field(strict=False, max_length=MOST_ORDERS)] = ()
    """Instead: amplitude of each order in percent of the torque of `[static_load]` on the body, applied or reacted."""
    table: FileName | None = None
    """Instead of orders: CSV file of torque over speed, torque and order, in the folder of the gearbox file, with the
    columns `speed_rpm`, `order`, `amplitude_N_m` and optionally `torque_N_m` (static torque on the body, without sign)
    and `phase_deg`. Speeds without sign are those of the body. Linear between rows.
    """
    force_N: Annotated[tuple[_Force, ...], Field(strict=False, max_length=MOST_ORDERS)] = ()
    """Amplitudes of the force along x, y and z of each order, zero to peak."""
    moment_N_m: Annotated[tuple[_Moment, ...], Field(strict=False, max_length=MOST_ORDERS)] = ()
    """Amplitudes of the moment about x and y of each order, zero to peak."""
    direction: Literal["fixed", "rotating", "counter_rotating"] = "fixed"
    """Directions of `force_N` and `moment_N_m`: `fixed` in the axes of the gearbox, or of constant size and turned
    about z by the angle order x angle + phase or its opposite; order 1 then turns with the body. Axial forces are
    always `fixed`.
    """
    unbalance_g_mm: q.UnbalanceGMm | None = None
    """Mass times its distance from the axis, instead of orders; its force grows with the square of the speed."""
    phase_deg: Annotated[tuple[q.AngleDeg, ...], Field(strict=False, max_length=MOST_ORDERS)] = ()
    """Phase of each order at zero angle of the body, or angle of an unbalance from the x axis; zero by default."""
    pole_pairs: q.PolePairs = 1
    """Factor on the orders: pole pairs of an electric machine."""
    speed_exponent: q.SpeedExponent = 0.0
    """Power of the speed with which all amplitudes grow; 2 for a propeller."""
    reference_speed_rpm: Annotated[q.SpeedRpm, Field(gt=0.0)] | None = None
    """Speed of the body at which the amplitudes are as stated; required with `speed_exponent`."""
    reaction_on: Name | None = None
    """Body on which the opposite acts, such as the housing with the stator; a rigid fixed body takes it to the ground.
    A flexible housing takes it at the seat that has the name of the excitation, otherwise at its seat of torques.
    """
    enabled: bool = True
    """Whether it acts."""
    description: Text = ""
    """Description for the user."""

    @model_validator(mode="after")
    def _kind(self) -> ExcitationSection:
        """Raise an error unless there is one kind of load: an unbalance, a table, or orders with amplitudes."""
        given = [key for key in AMPLITUDES if getattr(self, key)]
        for kind, value, why in (
            ("unbalance_g_mm", self.unbalance_g_mm, "an unbalance has order 1 and grows with the square of the speed"),
            ("table", self.table, "the table has orders, amplitudes and phases"),
        ):
            others = ("orders", *given, "table", "speed_exponent", *(("phase_deg",) if kind == "table" else ()))
            for key in others if value is not None else ():
                if key != kind and getattr(self, key):
                    raise ValueError(f"{key}: {why}; remove it, or set another excitation")
        if self.unbalance_g_mm is None and self.table is None and not (self.orders and given):
            raise ValueError(
                "set orders with torque_N_m, torque_percent, force_N = [[x, y, z], ...] or moment_N_m = [[x, y], ...]; "
                "or set unbalance_g_mm, or table"
            )
        if self.torque_N_m and self.torque_percent:
            raise ValueError("torque_N_m and torque_percent state the same; remove one")
        return self

    @model_validator(mode="after")
    def _counts(self) -> ExcitationSection:
        count = len(self.orders) or 1
        for key in (*AMPLITUDES, "phase_deg"):
            values = getattr(self, key)
            if values and len(values) != count:
                of = "orders" if self.orders else "unbalance_g_mm"
                raise ValueError(f"set as many {key} as {of}: {len(values)} for {count} {of}")
        for order in self.orders:
            if 2.0 * order != round(2.0 * order):
                raise ValueError(f"orders: {order:g} is neither a whole number nor a half")
        return self

    @model_validator(mode="after")
    def _settings(self) -> ExcitationSection:
        """Raise an error for keys that lack others, or have no effect."""
        across = bool(self.force_N or self.moment_N_m)
        if self.z_mm is None and (self.unbalance_g_mm is not None or across):
            raise ValueError("set z_mm, the position of the force, moment or unbalance along the axis of the body")
        if self.direction != "fixed" and not across:
            raise ValueError(f"direction = {self.direction!r} has an effect on force_N and moment_N_m only; remove it")
        if (self.speed_exponent != 0.0) != (self.reference_speed_rpm is not None):
            raise ValueError("set both speed_exponent and reference_speed_rpm, or neither of them")
        if self.reaction_on is not None and self.unbalance_g_mm is not None:
            raise ValueError("reaction_on: an unbalance has no reaction on another body; remove it")
        return self
