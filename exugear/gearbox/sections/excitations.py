"""Excitations over the angle of a body as the gearbox file states them: torques, forces and moments, unbalance."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from exugear.gearbox.sections import entries as q
from exugear.gearbox.sections.entries import Name, Section, Text

MOST_ORDERS = 200
"""Maximum number of orders of an excitation."""
_Force = Annotated[tuple[q.ForceN, q.ForceN, q.ForceN], Field(strict=False)]
_Moment = Annotated[tuple[q.TorqueNm, q.TorqueNm], Field(strict=False)]


class ExcitationSection(Section):
    """Load on a rotating body that varies with its angle: an electric machine, an engine, a propeller, an unbalance.

    A torque, force or moment is the sum of A cos(order x angle + phase) over the orders, in addition to constant loads.
    It acts in runs, and in steady-state responses with the methods `linear` and `parametric`. In the variant `rigid`
    ideal joints react forces and moments. On a flexible shaft a seat is added at `z_mm`.
    """

    body: Name
    """Body on which it acts and whose angle counts."""
    z_mm: q.PlaceMm | None = None
    """Position along the axis of the body, required by an unbalance, a force and a moment."""
    orders: Annotated[tuple[q.ShaftOrder, ...], Field(strict=False, max_length=MOST_ORDERS)] = ()
    """Periods per revolution of the body; with `pole_pairs`, per electrical revolution."""
    torque_N_m: Annotated[tuple[q.RippleNm, ...], Field(strict=False, max_length=MOST_ORDERS)] = ()
    """Amplitude of the torque about z of each order, zero to peak."""
    force_N: Annotated[tuple[_Force, ...], Field(strict=False, max_length=MOST_ORDERS)] = ()
    """Amplitudes of the force along x, y and z of each order, zero to peak."""
    moment_N_m: Annotated[tuple[_Moment, ...], Field(strict=False, max_length=MOST_ORDERS)] = ()
    """Amplitudes of the moment about x and y of each order, zero to peak."""
    direction: Literal["fixed", "rotating", "counter_rotating"] = "fixed"
    """Directions of `force_N` and `moment_N_m`: `fixed` in the axes of the gearbox, or of constant size and turned about
    z by the angle order x angle + phase or its opposite; order 1 then turns with the body. Axial forces are `fixed`.
    """
    unbalance_g_mm: q.UnbalanceGMm | None = None
    """Mass times its distance from the axis, instead of orders; its force grows with the square of the speed."""
    phase_deg: Annotated[tuple[q.AngleDeg, ...], Field(strict=False, max_length=MOST_ORDERS)] = ()
    """Phase of each order at zero angle of the body, or angle of an unbalance from the x axis; zero by default."""
    pole_pairs: q.PolePairs = 1
    """Factor on the orders: pole pairs of an electric machine."""
    enabled: bool = True
    """Whether it acts."""
    description: Text = ""
    """Description for the user."""

    @model_validator(mode="after")
    def _amplitudes(self) -> ExcitationSection:
        amplitudes = {key: getattr(self, key) for key in ("torque_N_m", "force_N", "moment_N_m")}
        given = {key: values for key, values in amplitudes.items() if values}
        if self.unbalance_g_mm is not None:
            for key in ("orders", *given):
                if getattr(self, key):
                    raise ValueError(f"{key}: an unbalance has order 1 and no other load; set another excitation")
        elif not self.orders or not given:
            raise ValueError(
                "set orders with torque_N_m, force_N = [[x, y, z], ...] or moment_N_m = [[x, y], ...], or set "
                "unbalance_g_mm"
            )
        count = len(self.orders) or 1
        for key, values in {**given, "phase_deg": self.phase_deg}.items():
            if values and len(values) != count:
                of = "orders" if self.orders else "unbalance_g_mm"
                raise ValueError(f"set as many {key} as {of}: {len(values)} for {count} {of}")
        if self.z_mm is None and (self.unbalance_g_mm is not None or self.force_N or self.moment_N_m):
            raise ValueError("set z_mm, the position of the force, moment or unbalance along the axis of the body")
        if self.direction != "fixed" and not (self.force_N or self.moment_N_m):
            raise ValueError(f"direction = {self.direction!r} has an effect on force_N and moment_N_m only; remove it")
        return self
