"""Sound power of a flexible housing, in the part "Resonances": level over speed, loudest orders, third octaves."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from exugear.gearbox.units import RPM
from exugear.report.findings.words import rounded_text
from exugear.report.sections.material import ChartAxis, Curve, ReportData
from exugear.report.web.html import Table
from exugear.results.causes import shares, strongest
from exugear.results.sound.levels import power_level
from exugear.results.sound.over_speed import sound_over_speed

if TYPE_CHECKING:
    import xarray as xr


def loudest(found: Mapping[str, Any], material: ReportData) -> str:
    """Return loudest speed and order of a summary of `SoundOverSpeed` in one sentence, as the terminal has them."""
    first = found["orders"][0]
    at = f"{rounded_text(found['speed_rpm'])} rpm"
    order = f"{rounded_text(first['frequency_Hz'])} Hz, {material.words.labelled(first['line'])}"
    return (
        f"Highest sound power {found['level_dBA']:.1f} dB(A), upper estimate, at {at}: "
        f"{first['level_dBA']:.1f} dB(A) of it at {order}."
    )


def sound_power(material: ReportData, data: xr.Dataset, name: str) -> dict[str, Any] | None:
    """Draw and tabulate the sound power of a response in the ranked speeds; None if there is none."""
    sound = sound_over_speed(data)
    if sound is None:
        return None
    if material.headline is not None:
        sound = sound.inside(material.headline.ranking.speeds)
    if not sound.speed.size:
        return None
    found = sound.summary()
    if not found["orders"]:
        return None
    labelled = material.words.labelled
    order = np.argsort(sound.speed)
    curves = [
        Curve(label, sound.speed[order] / RPM, np.maximum(power_level(np.nansum(power, axis=1))[order], 0.0), style)
        for label, power, style in (("dB(A)", sound.weighted, "line"), ("dB", sound.power, "thin"))
    ]
    words = "Sound power level of the outer surface over speed (equivalent radiated power, an upper estimate)."
    axes = [ChartAxis(f"{material.input_words} speed / rpm"), ChartAxis("sound power level / dB re 1 pW")]
    at = f"at {rounded_text(found['speed_rpm'])} rpm"
    return {
        "line": loudest(found, material),
        "surface": f"Outer surface {found['outer_surface_m2']:.3g} of {found['whole_surface_m2']:.3g} m².",
        "chart": material.chart(name, "Sound power over speed", "Sum of all orders.", words, curves, axes),
        "orders": Table(
            [
                {"order": labelled(own["line"]), "frequency / Hz": rounded_text(own["frequency_Hz"])} | _levels(own)
                for own in found["orders"]
            ],
            ("order",),
            caption=f"Sound power by order {at}",
            name=f"{name}-orders",
        ),
        "bands": Table(
            [{"third octave / Hz": f"{own['centre_Hz']:g}"} | _levels(own) for own in found["third_octaves"]],
            caption=f"Sound power in third octaves {at}",
            name=f"{name}-bands",
        ),
        "causes": Table(
            [
                {
                    "order": labelled(own["line"]),
                    "frequency / Hz": rounded_text(own["frequency_Hz"]),
                    "excited by": labelled(shares(own["meshes"].items())),
                    "responding modes": shares((f"{value:.1f} Hz", share) for value, share in own["modes"]),
                    "sensitivity to stiffness of": labelled(strongest(own["supports"])),
                }
                for own in found["contributions"]
            ],
            ("order", "excited by", "responding modes", "sensitivity to stiffness of"),
            caption=f"Contributions to the sound power of the loudest orders {at}",
            name=f"{name}-causes",
        ),
    }


def _levels(own: Mapping[str, float]) -> dict[str, object]:
    return {"dB": f"{own['level_dB']:.1f}", "dB(A)": f"{own['level_dBA']:.1f}"}
