"""What all sections are made of, and what each of them gives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from exugear.gearbox.choice import Choice
from exugear.report.findings.context import Context, StoredResults
from exugear.report.findings.groups import RunGroup
from exugear.report.findings.verdicts import ModelVariations
from exugear.report.findings.words import Labels
from exugear.report.web import html as pieces
from exugear.report.web.document import ArrayStore
from exugear.report.web.html import element
from exugear.results.spectra.waterfall import OrderLine, order_lines


@dataclass(frozen=True)
class ReportData:
    """What all sections are made of."""

    context: Context
    results: StoredResults
    words: Labels
    groups: Sequence[RunGroup]
    """Those of run-ups first, then those of steady responses; of each the default inertia set first."""
    variations: Sequence[ModelVariations]
    lines: Sequence[OrderLine]
    """Orders that are drawn."""
    arrays: ArrayStore
    """Takes the arrays of the page."""
    run_data: Mapping[str, Any] = field(default_factory=dict)
    """Run-ups and steady responses as data of the page, as `exugear.report.run_data.run_data` makes them."""

    @property
    def input_words(self) -> str:
        """Words for the overall input, whose speed all figures are over."""
        return self.words.of(self.context.gearbox.case.overall.input)

    @property
    def file_words(self) -> str:
        """Gearbox file with its folder; the page goes to others, and where that lies is nobody's business."""
        return "/".join(Path(self.context.gearbox.source).parts[-2:])


def lines_of(context: Context) -> tuple[OrderLine, ...]:
    """Orders that the page draws."""
    return order_lines(context.gearbox)


@dataclass(frozen=True)
class Part:
    """What a section gives."""

    html: str
    """Empty where it has nothing to show."""
    data: Mapping[str, Any] = field(default_factory=dict)
    """For the scripts, by keys of its own."""
    title: str = ""
    name: str = ""
    """Its entry in the table of contents; empty for none."""


def only_for(content: str, group: str, variant: str = "") -> str:
    """Mark content as that of a group of results, or of one variant: scripts show what was chosen, paper shows all."""
    if content:
        return element("div", content, data_group=group, data_variant=variant or None)
    return ""


def group_words(groups: Sequence[RunGroup], own: RunGroup) -> str:
    """Tell one group from the others in few words: its source, and law and inertia set where these differ."""
    parts = [own.source]
    if len({group.mesh_model for group in groups}) > 1:
        parts.append(f"law {own.mesh_model}")
    if len({group.inertias for group in groups}) > 1:
        parts.append(f"inertias {own.inertias}")
    words = ", ".join(parts)
    return words[0].upper() + words[1:]


def told_groups(groups: Sequence[RunGroup]) -> list[RunGroup]:
    """List the groups that the command line tells of: run-ups, or else steady responses."""
    return [group for group in groups if not group.responses] or list(groups)


def model_name(choice: Choice) -> str:
    """Name of a model for links and data: variant, law, inertia set."""
    return f"{choice.variant}-{choice.mesh_model}-{choice.inertias}"


# Line figures as data: curves with axes and marks, which one script draws


@dataclass(frozen=True)
class Curve:
    """A curve of a line figure."""

    label: str
    x: ArrayLike
    y: ArrayLike
    """(n,)"""
    style: str = "line"
    """{"line", "dashed", "thin", "points"}"""
    right: bool = False
    """Whether the axis on the right is its."""


@dataclass(frozen=True)
class Axis:
    """An axis of a line figure."""

    label: str
    """With its unit."""
    logarithmic: bool = False


def chart(
    name: str,
    title: str,
    hint: str,
    words: str,
    curves: Sequence[Curve],
    axes: Sequence[Axis],
    arrays: ArrayStore,
    marks: Sequence[tuple[float, str]] = (),
) -> tuple[str, dict[str, Any]]:
    """Make a line figure.

    Parameters
    ----------
    name : identity in the page
    title, hint, words : what it shows; what can be done; what it says in words
    axes : below, on the left, and on the right if curves are there
    arrays : takes the curves
    marks : upright lines at values of x, with words

    Returns
    -------
    html
    data : under the key ``charts`` of the page's data, by name
    """
    spec = {
        "title": title,
        "axes": [{"label": axis.label, "logarithmic": axis.logarithmic} for axis in axes],
        "curves": [
            {
                "label": curve.label,
                "style": curve.style,
                "right": curve.right,
                "x": arrays.add(np.asarray(curve.x, dtype="f4")),
                "y": arrays.add(np.asarray(curve.y, dtype="f4")),
            }
            for curve in curves
        ],
        "marks": [{"x": value, "label": label} for value, label in marks],
    }
    return pieces.figure(name, title, hint, words, "chart"), {name: spec}
