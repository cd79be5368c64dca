"""All figures that a study file can name; a study in Python may bring its own."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from exugear.studies.figures import of_life, of_modes, of_runs, of_statics, of_steady, of_tables
from exugear.studies.figures.figure import Figure, FigureError, Values
from exugear.studies.figures.of_runs import OVERALL
from exugear.studies.figures.point_results import PointResults
from exugear.system.signals import SIGNALS

AS_SIGNAL = "as the signal"
"""Unit of figures that an option `signal` names."""
FIGURES: dict[str, Figure] = {
    "ste_peak_to_peak": Figure(of_tables.ste_peak_to_peak, "m"),
    "ste_harmonic": Figure(of_tables.ste_harmonic, "m"),
    "mesh_stiffness": Figure(of_tables.mesh_stiffness, "N/m"),
    "contact_pressure": Figure(of_tables.contact_pressure, "Pa"),
    "worst_ripple": Figure(of_tables.worst_ripple, "m"),
    "mean_ripple": Figure(of_tables.mean_ripple, "m"),
    "worst_pressure": Figure(of_tables.worst_pressure, "Pa"),
    "mesh_forces": Figure(of_statics.mesh_forces, "N", "mesh"),
    "misalignments": Figure(of_statics.misalignments, "rad", "mesh"),
    "load_sharing": Figure(of_statics.load_sharing, "1"),
    "frequencies": Figure(of_modes.frequencies, "Hz", "mode"),
    "nearest_frequency": Figure(of_modes.nearest_frequency, "Hz"),
    "nearest_damping": Figure(of_modes.nearest_damping, "1"),
    "nearest_amplification": Figure(of_modes.nearest_amplification, "m/m"),
    "nearest_strain": Figure(of_modes.nearest_strain, "1"),
    "loudest_frequency": Figure(of_modes.loudest_frequency, "Hz"),
    "largest_line": Figure(of_steady.largest_line, AS_SIGNAL, needs="steady"),
    "loudest_peak": Figure(of_steady.loudest_peak, AS_SIGNAL, needs="steady"),
    "loudest_speed": Figure(of_steady.loudest_speed, "rad/s", needs="steady"),
    "harmonics": Figure(of_steady.harmonics, AS_SIGNAL, "harmonic", "steady"),
    "rms": Figure(of_runs.rms, AS_SIGNAL, needs="run"),
    "peak_to_peak": Figure(of_runs.peak_to_peak, AS_SIGNAL, needs="run"),
    "final_speed": Figure(of_runs.final_speed, "rad/s", needs="run"),
    "dynamic_load_sharing": Figure(of_runs.dynamic_load_sharing, "1", needs="run"),
    "run_harmonics": Figure(of_runs.run_harmonics, AS_SIGNAL, "harmonic", "run"),
    "order_amplitudes": Figure(of_runs.order_amplitudes, AS_SIGNAL, "sideband", "run"),
    "contact_safeties": Figure(of_life.contact_safeties, "1", "flank", "life"),
    "root_safeties": Figure(of_life.root_safeties, "1", "flank", "life"),
    "contact_damages": Figure(of_life.contact_damages, "1", "flank", "life"),
    "root_damages": Figure(of_life.root_damages, "1", "flank", "life"),
    "worst_planets": Figure(of_life.worst_planets, "1", "flank", "life"),
    "contact_safety": Figure(of_life.contact_safety, "1", needs="life"),
    "root_safety": Figure(of_life.root_safety, "1", needs="life"),
    "contact_damage": Figure(of_life.contact_damage, "1", needs="life"),
    "root_damage": Figure(of_life.root_damage, "1", needs="life"),
    "bearing_lives": Figure(of_life.bearing_lives, "h", "bearing", "bearings"),
    "bearing_damages": Figure(of_life.bearing_damages, "1", "bearing", "bearings"),
    "static_safeties": Figure(of_life.static_safeties, "1", "bearing", "bearings"),
    "bearing_life": Figure(of_life.bearing_life, "h", needs="bearings"),
    "bearing_damage": Figure(of_life.bearing_damage, "1", needs="bearings"),
    "static_safety": Figure(of_life.static_safety, "1", needs="bearings"),
    "life_hours": Figure(of_life.life_hours, "h", needs="life"),
    "shortfalls": Figure(of_life.shortfalls, "1", needs="life"),
}
"""By the name in a study file."""


@dataclass(frozen=True)
class KeptFigure:
    """A figure with its options, as a study keeps it."""

    figure: Figure
    options: Mapping[str, Any]

    @property
    def units(self) -> str:
        """Unit of its numbers; of a signal that one's."""
        if self.figure.units != AS_SIGNAL:
            return self.figure.units
        named = str(self.options.get("signal", OVERALL)).split(" ")[0]
        return next((signal.units for signal in SIGNALS if signal.name == named), "")

    def of(self, results: PointResults) -> Values:
        """Compute it for a point."""
        return self.figure.of(results, self.options)


def kept_figures(sections: Mapping[str, Mapping[str, Any]], known: Mapping[str, Figure]) -> dict[str, KeptFigure]:
    """Figures of the sections of a study file, checked.

    Parameters
    ----------
    sections : by the name in the dataset: ``figure`` and its options
    known : figures that may be named

    Raises
    ------
    FigureError
        An unknown figure or wrong options.

    Examples
    --------
    >>> kept_figures({"ringing": {"figure": "nearest_frequncy", "near_Hz": 800.0}}, FIGURES)
    Traceback (most recent call last):
    ...
    exugear.studies.figures.figure.FigureError: figures.ringing.figure = 'nearest_frequncy': no such figure; did you
    mean 'nearest_frequency'?
    """
    kept = {}
    for name, section in sections.items():
        options = dict(section)
        wanted = str(options.pop("figure", ""))
        if wanted not in known:
            near = difflib.get_close_matches(wanted[:100], known, n=1)
            hint = f"did you mean {near[0]!r}?" if near else f"figures are {', '.join(known)}"
            raise FigureError(f"figures.{name}.figure = {wanted!r}: no such figure; {hint}")
        known[wanted].check(name, options)
        kept[name] = KeptFigure(known[wanted], options)
    return kept
