"""Common input of all report sections (`ReportData`) and their output (`Part`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup
from numpy.typing import ArrayLike

from exugear.gearbox.choice import Choice
from exugear.report.findings.context import MESH_MODEL_LABELS, Context, StoredResults
from exugear.report.findings.design_changes import DesignStudy
from exugear.report.findings.groups import RunGroup
from exugear.report.findings.headline import Headline
from exugear.report.findings.other_design import OtherDesign
from exugear.report.findings.parameter_variations import ModelVariations
from exugear.report.findings.ratings import Ratings
from exugear.report.findings.resonance_list import ListedResonance
from exugear.report.findings.words import Labels, capitalised
from exugear.report.web.document import ArrayStore
from exugear.report.web.html import Figure
from exugear.results.spectra.waterfall import OrderLine

# Line charts as data: curves with axes and marks, drawn by one script


@dataclass(frozen=True)
class Curve:
    """Curve of a line chart."""

    label: str
    x: ArrayLike
    y: ArrayLike
    """(n,)"""
    style: str = "line"
    """{"line", "dashed", "thin", "points"}"""
    right: bool = False
    """Whether it belongs to the axis on the right."""


@dataclass(frozen=True)
class ChartAxis:
    """Axis of a line chart."""

    label: str
    """Label with unit."""
    logarithmic: bool = False


@dataclass(frozen=True)
class ReportData:
    """Data from which all sections are made."""

    context: Context
    results: StoredResults
    words: Labels
    groups: Sequence[RunGroup]
    """Groups of run-ups first, then of steady-state responses; in each, the default inertia set comes first."""
    variations: Sequence[ModelVariations]
    lines: Sequence[OrderLine]
    """Orders drawn on the page."""
    headline: Headline | None
    """Ranking that the report leads with; None if nothing is ranked."""
    arrays: ArrayStore
    """Store for the arrays of the page."""
    lists: Mapping[tuple[str, str], tuple[ListedResonance, ...]]
    """List of resonances by result group and variant."""
    ratings: Ratings = field(default_factory=Ratings)
    design_study: DesignStudy | None = None
    other_design: OtherDesign | None = None
    missing: tuple[str, ...] = ()
    """Results that the folder lacks, with their commands."""
    run_data: Mapping[str, Any] = field(default_factory=dict)
    """Run-ups and steady-state responses as data of the page, from `exugear.report.sections.run_data.run_data`."""
    charts: dict[str, Any] = field(default_factory=dict)
    """Data of all line charts by name, from `chart`."""

    @property
    def input_words(self) -> str:
        """Label of the overall input, whose speed is the abscissa of all diagrams."""
        return self.words.of(self.context.gearbox.case.overall.input)

    @property
    def rated_rpm(self) -> float | None:
        """Rated speed of the overall input, rpm; None if the file has none."""
        return self.context.gearbox.case.operation.rated_speed_rpm

    @property
    def file_words(self) -> str:
        """Gearbox file with its folder only, as the page may be passed on and should not show local paths."""
        return "/".join(Path(self.context.gearbox.source).parts[-2:])

    def chart(
        self,
        name: str,
        title: str,
        hint: str,
        words: str,
        curves: Sequence[Curve],
        axes: Sequence[ChartAxis],
        marks: Sequence[tuple[float, str]] = (),
    ) -> Figure:
        """Add the data of a line chart to the page and return its frame.

        Parameters
        ----------
        name : identifier in the page
        title, hint, words : heading, note on the use of the chart, and its content as text
        axes : below, on the left, and on the right if any curve needs it
        marks : vertical lines at values of x, with labels
        """
        self.charts[name] = {
            "title": title,
            "axes": [{"label": axis.label, "logarithmic": axis.logarithmic} for axis in axes],
            "curves": [
                {
                    "label": curve.label,
                    "style": curve.style,
                    "right": curve.right,
                    "x": self.arrays.add(np.asarray(curve.x, dtype="f4")),
                    "y": self.arrays.add(np.asarray(curve.y, dtype="f4")),
                }
                for curve in curves
            ],
            "marks": [{"x": value, "label": label} for value, label in marks],
        }
        return Figure(name, title, hint, words, "chart")


@dataclass(frozen=True)
class Part:
    """Output of a section."""

    html: Markup = Markup()
    """HTML of the section; empty if it has nothing to show."""
    data: Mapping[str, Any] = field(default_factory=dict)
    """Data for the scripts, under keys of this section."""
    title: str = ""
    name: str = ""
    """Title and anchor of the entry in the table of contents; empty for none."""


def source_words(material: ReportData, own: RunGroup) -> str:
    """Return a label of the source and the load of a group, with the mesh model where it differs."""
    parts = [own.source]
    if own.responses:
        parts.append("static load")
    if len({group.mesh_model for group in material.groups}) > 1:
        parts.append(MESH_MODEL_LABELS[own.mesh_model])
    return capitalised(", ".join(parts))


def group_words(groups: Sequence[RunGroup], own: RunGroup) -> str:
    """Return a short label that identifies a group: source, and mesh model and inertia set where these differ."""
    parts = [own.source]
    if len({group.mesh_model for group in groups}) > 1:
        parts.append(MESH_MODEL_LABELS[own.mesh_model])
    if len({group.inertias for group in groups}) > 1:
        parts.append(f"inertia set {own.inertias}")
    return capitalised(", ".join(parts))


def model_name(choice: Choice) -> str:
    """Return the name of a model for links and data: variant, mesh model, inertia set."""
    return f"{choice.variant}-{choice.mesh_model}-{choice.inertias}"
