"""Section on the oil of a gearbox: what flanks and bearings are rated with."""

from __future__ import annotations

from typing import Literal

from pydantic import model_validator

from exugear.gearbox.sections import quantities as q
from exugear.gearbox.sections.entries import Section

Cleanliness = Literal["extreme", "high", "normal", "slight", "typical", "severe", "very_severe"]


class LubricantSection(Section):
    """The oil of the gearbox."""

    viscosity_40_mm2_per_s: q.Viscosity
    """Kinematic viscosity at 40 degrees Celsius."""
    viscosity_100_mm2_per_s: q.Viscosity | None = None
    """Kinematic viscosity at 100 degrees Celsius; modified lives of bearings need it."""
    temperature_C: q.OilTemperature | None = None
    """Of the oil in service; modified lives of bearings need it."""
    cleanliness: Cleanliness | None = None
    """How clean it is by ISO 281:2007, table 13, where `slight` to `severe` are degrees of contamination; modified
    lives of bearings need it."""

    @model_validator(mode="after")
    def _viscosities(self) -> LubricantSection:
        hot = self.viscosity_100_mm2_per_s
        if hot is not None and hot >= self.viscosity_40_mm2_per_s:
            raise ValueError(
                f"viscosity_100_mm2_per_s = {hot:g} must be below viscosity_40_mm2_per_s = "
                f"{self.viscosity_40_mm2_per_s:g}: oil gets thinner when it gets hot"
            )
        return self
