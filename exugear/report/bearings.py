"""Section of the report on rolling bearings: law, load, stiffness, pressure and life at the static load."""

from __future__ import annotations

import math

from exugear.bearings.duty import BearingDuty
from exugear.bearings.rolling.rows import BearingError
from exugear.bearings.supports import ON_BEARINGS
from exugear.dynamics.assembly import Assembly
from exugear.dynamics.bearing_duties import bearing_duties
from exugear.dynamics.statics import BalanceError
from exugear.report import page
from exugear.report.context import Context, words_of
from exugear.report.stored import StoredResults


def bearings_section(context: Context, results: StoredResults) -> str:
    """List what the catalogue bearings of each model bear; nothing where no model has any."""
    parts = [_of_model(context, assembly) for assembly in context.assemblies.values() if _has_catalogued(assembly)]
    if not any(parts):
        return ""
    words = (
        "Rows of rolling elements by ISO/TS 16281 between rigid rings, under the static load of the case. L10 by "
        "ISO 281 and L10r by ISO/TS 16281 in million revolutions, basic: lubricant and cleanliness are left out, and "
        "so are ribs. A rating with a star is estimated from the rows. Linear bearings have the tangent at this load."
    )
    return page.section("Bearings", page.paragraph(words), *parts)


def _has_catalogued(assembly: Assembly) -> bool:
    return assembly.variant in ON_BEARINGS and any(support.catalogue for support in assembly.supports)


def _of_model(context: Context, assembly: Assembly) -> str:
    name = words_of(assembly.choice)
    try:
        duties = bearing_duties(assembly)
    except (BalanceError, BearingError) as error:
        context.notes.left_out.append(f"bearings of {name}: {error}")
        return ""
    remarks = [f"{duty.name}: {remark}." for duty in duties for remark in duty.remarks]
    table = page.table([_row(duty) for duty in duties])
    return page.section(name, table, page.bullets(remarks) if remarks else "", level=3)


def _row(duty: BearingDuty) -> dict[str, object]:
    sign = "*" if duty.ratings.estimated else ""
    tilt = 0.5e-6 * float(duty.stiffness[3, 3] + duty.stiffness[4, 4])
    return {
        "bearing": duty.name,
        "law": duty.law,
        "radial load / kN": f"{1e-3 * duty.radial_load:.4g}",
        "axial load / kN": f"{round(1e-3 * duty.axial_load, 3) + 0.0:.4g}",
        "radial / (GN/m)": f"{1e-9 * duty.radial_stiffness:.3g}",
        "axial / (GN/m)": f"{1e-9 * duty.stiffness[2, 2]:.3g}",
        "tilt / (MN m/rad)": f"{tilt:.3g}",
        "misaligned / mrad": f"{1e3 * duty.misalignment:.3f}",
        "pressure / MPa": f"{1e-6 * duty.pressure:.0f}",
        "C_r / kN": f"{1e-3 * duty.ratings.dynamic:.4g}{sign}",
        "L10 / Mrev": _life(duty.basic_life),
        "L10r / Mrev": _life(duty.reference_life),
    }


def _life(value: float) -> str:
    return f"{value:.3g}" if math.isfinite(value) else "no load"
