"""Section "Where it rings": waterfall, order cuts, the chosen resonance in words, and its mode in motion."""

from __future__ import annotations

from collections.abc import Sequence

from exugear.gearbox.parts import RPM
from exugear.gearbox.variant import Variant
from exugear.report.findings.groups import RunGroup
from exugear.report.findings.words import figure_text
from exugear.report.parts.material import Material, Part
from exugear.report.web import pieces
from exugear.report.web.stage_figure import stage_figure

NO_MODES = "No modes are here: `exugear modes` computes them, and the page shows them move."


def rings_section(material: Material) -> Part:
    """Draw the waterfalls of all run-ups and steady responses; the sentences stand in the ranking, too."""
    if not material.groups:
        return Part("")
    return Part(_html(material), material.run_data, "Where it rings", "rings")


def _html(material: Material) -> str:
    words = _in_words(material.groups)
    channel = pieces.element("label", "Signal " + pieces.element("select", "", id="channel"))
    views = pieces.element("div", "", class_="choices", id="view", role="group", aria_label="Model shown")
    waterfall = pieces.figure("waterfall", "Waterfall", f"Read from: {material.groups[0].source}.", words)
    scale = pieces.element("div", "", class_="scale", id="waterfall-scale") + pieces.element(
        "p", "", class_="readout", id="readout"
    )
    cuts = pieces.figure("cuts", "Level along the orders", "Same speeds as above. Choose the orders below.", words)
    orders = pieces.element("div", "", class_="chips", id="orders", role="group", aria_label="Orders shown")
    detail = pieces.element("article", "", class_="panel", id="detail", aria_live="polite")
    left = pieces.element(
        "div", waterfall.replace("</figure>", f"{scale}</figure>") + cuts.replace("</figure>", f"{orders}</figure>")
    )
    # Without modes nothing moves.
    stage = stage_figure() if material.results.modes else pieces.paragraph(NO_MODES, "note")
    right = pieces.element("div", detail + stage)
    controls = pieces.element("div", channel + views, class_="controls scripts-only")
    split = pieces.element("div", left + right, class_="split scripts-only")
    return pieces.section("Where it rings", controls, split, _without_scripts(words), name="rings")


def _without_scripts(words: str) -> str:
    said = f"Diagrams need scripts, which are switched off here; nothing is loaded from any network. {words}"
    return f"<noscript>{pieces.paragraph(said, 'warning')}</noscript>"


def _in_words(groups: Sequence[RunGroup]) -> str:
    group = groups[0]
    loudest = [own for own in group.ranked[group.main] if own.steady][:3]
    told = [f"{own.frequency:.0f} Hz at {own.speed / RPM:.1f} rpm, {figure_text(own.loudness)} dB" for own in loudest]
    return f"Loudest, {Variant.of(group.main).label}, {group.source}: {'; '.join(told) or 'nothing stands out'}."
