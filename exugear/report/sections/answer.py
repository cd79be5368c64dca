"""Part "Answer": the first resonance with its amplitudes, cause and remedies, and what could change it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from exugear.gearbox.load_cases import static_load_in_words
from exugear.gearbox.units import RPM
from exugear.gearbox.variant import Variant
from exugear.report.findings.context import excitations
from exugear.report.findings.facts import MOST_WORDS, facts_of_response, short
from exugear.report.findings.headline import Headline, MatchedMode, causes_of, contributions_of
from exugear.report.findings.margins import shortfalls_of
from exugear.report.findings.parameter_variations import default_place, track_mode, variations_of
from exugear.report.findings.ranking import Envelope, Resonance, envelopes
from exugear.report.findings.words import QUANTITIES, capitalised, percentages, rounded_text
from exugear.report.pictures.png import png_address
from exugear.report.pictures.speed_diagrams import Strips, strips_of
from exugear.report.pictures.still import mode_picture
from exugear.report.sections.changes import CHANGES_NAME, best_changes, levers_command, study_of
from exugear.report.sections.material import Part, ReportData
from exugear.report.sections.resonances import SHOWN, note_of, sorted_quantities
from exugear.report.sections.sound import loudest
from exugear.report.web.html import render
from exugear.report.web.stage import drawn_bodies, drawn_mode
from exugear.results.sound.over_speed import sound_over_speed
from exugear.steady.crossings import Contributions
from exugear.steady.findings import NOTICED_SHUTTLING
from exugear.system.modal_damping import damping_in_words
from exugear.system.tooth_mesh.laws.registry import LAWS
from exugear.system.tooth_mesh.tables import shuttling_pairs

AT_RATED = 0.005
"""Relative speed difference from the rated speed that counts as none."""
SHOWN_FRACTIONS = 2
"""Number of listed fractions of an energy."""
SHOWN_CHANGES = 3
"""Number of listed design changes."""
LEAST_SHARE = 0.01
"""Minimum share of an excitation of the file that is listed."""
SHOWN_SHORTFALLS = 2
"""Number of listed parts whose life falls short."""
STRIPS = ((690.0, 312.0), (352.0, 440.0))
"""Sizes of the diagrams of amplitude for windows of desktops and phones."""


@dataclass(frozen=True)
class Box:
    """Box of the first screen: mode, cause or remedy."""

    text: str
    facts: Sequence[tuple[str, str]] = ()
    """Terms with their values."""
    changes: Sequence[tuple[str, str]] = ()
    """Reduction in dB, and the change that causes it."""
    picture: str = ""
    """Address that contains the picture of the mode."""
    link: str = ""
    """Section with more."""

    @property
    def line(self) -> str:
        """Content as one line."""
        parts = [self.text.rstrip("."), *(f"{term}: {value}" for term, value in self.facts)]
        return ". ".join([*parts, *(f"{change}: {gain}" for gain, change in self.changes)]) + "."


def answer_section(material: ReportData) -> Part:
    """Show the first resonance of the ranking: amplitudes, mode, cause, remedies, and what could change it."""
    headline = material.headline
    notes = material.context.notes.statements
    if headline is None:
        # Continuation results and responses at few speeds are not ranked.
        lines = [fact.line for data in material.results.steady for fact in facts_of_response(material.words, data)]
        notes.extend(lines)
        return Part(render("answer", answer=None, lines=lines), title="Answer", name="answer")
    gearbox = material.context.gearbox
    load = material.words.labelled(headline.load or f"static load, {static_load_in_words(gearbox)}")
    scope = (
        f"{Variant.of(headline.choice.variant).label}, {headline.source}. Load: {load}. Inertia set: "
        f"{headline.choice.inertias}. Damping: {damping_in_words(gearbox.case.damping)}. Speeds: of the "
        f"{material.input_words}."
    )
    notes.append(f"Results: {scope}")
    top = headline.top
    assert top is not None
    mode = headline.mode_of(top)
    known = contributions_of(material.context, headline)
    found = headline.envelopes(material.lines)
    curves = {name: found[name] for name in sorted_quantities(headline.ranking, top) if name in found}
    drawn = curves
    caption = "largest single order"
    if headline.response is not None:
        dynamic = envelopes(headline.response, headline.ranking.speeds)
        drawn = {name: dynamic[name] for name in curves}
        caption = "largest order, quasi-static ones omitted"
    group = headline.group
    listed = () if group is None else material.lists[group.name, headline.choice.variant]
    answer: dict[str, Any] = {
        "scope": scope,
        "kicker": _kicker(headline),
        "frequency": f"{rounded_text(top.frequency)} Hz",
        "speed": speed_text(top),
        "off_rated": _off_rated(material, top),
        "sentence": _sentence(material, headline, top, mode),
        "quantities": [_quantity(material, headline, top, name) for name in sorted_quantities(headline.ranking, top)],
        "note": note_of(material, headline),
        "caveats": [material.words.labelled(text) for first in listed[:1] for text in first.caveats],
        "choice": "" if group is None else f"resonance:{group.name}:{headline.choice.variant}:",
        "strips": [_strips(material, headline, drawn, size) for size in STRIPS if drawn],
        "drawn": caption,
        "resonance": _resonance_box(material, headline, mode),
        "cause": _cause_box(material, headline, top, known),
        "remedy": _remedy_box(material, headline),
        "further": list(_further(material, headline, top, curves)),
    }
    quantities = ". ".join(
        f"{one['title']} {one['value']} {one['unit']} (rank {one['rank']})" for one in answer["quantities"]
    )
    where = f"{answer['frequency']} at {answer['speed']}{answer['off_rated']}"
    notes.append(f"Highest resonance: {where}. {answer['sentence']} {quantities}.")
    boxes = (("Mode", "resonance"), ("Cause", "cause"), ("Reduction", "remedy"))
    notes.extend(f"{title}: {answer[name].line}" for title, name in boxes)
    notes.extend(f"{title}: {line}" for title, lines in answer["further"] for line in lines)
    html = render("answer", answer=answer, speed_label=f"{material.input_words} speed / rpm")
    readout = [
        {
            "label": QUANTITIES[name].short,
            "unit": QUANTITIES[name].unit,
            "speeds": material.arrays.add((curve.speed / RPM).astype("f4")),
            "values": material.arrays.add((QUANTITIES[name].factor * curve.amplitude).astype("f4")),
        }
        for name, curve in drawn.items()
    ]
    return Part(html, {"curves": readout}, "Answer", "answer")


def amplitude_text(name: str, amplitude: float) -> str:
    """Return an amplitude of one of the quantities (SI units) as text."""
    label = QUANTITIES[name]
    return f"{label.column} ±{rounded_text(label.factor * amplitude)} {label.unit}"


def speed_text(resonance: Resonance) -> str:
    """Return the speed of a resonance as text."""
    return f"{rounded_text(abs(resonance.speed) / RPM)} rpm"


def _kicker(headline: Headline) -> str:
    where = "at all computed speeds" if headline.ranking.whole else "within the operating range"
    highest = f"Highest peak of the {QUANTITIES[headline.ranking.quantity].column}"
    if headline.ranking.without is not None:
        low, high = (rounded_text(speed / RPM) for speed in headline.ranking.without)
        return f"No resonance within the operating range, {low} to {high} rpm. {highest} at all computed speeds"
    return f"{highest} {where}"


def _off_rated(material: ReportData, resonance: Resonance) -> str:
    rated = material.rated_rpm
    if rated is None:
        return ""
    off = abs(resonance.speed) / RPM / rated - 1.0
    if abs(off) < AT_RATED:
        return ", at rated speed"
    return f", {100.0 * abs(off):.0f} % {'above' if off > 0.0 else 'below'} rated"


def _sentence(material: ReportData, headline: Headline, top: Resonance, mode: MatchedMode | None) -> str:
    line = capitalised(material.words.line_sentence(material.words.order(top.line, top.order)))
    if mode is None or headline.modes is None:
        name = material.words.labelled(headline.mode_name(top))
        sentences = [f"{line} excites the mode {name}."] if name else []
    else:
        moves = material.words.moves(headline.modes, mode.index)
        sentences = [f"{line} excites a mode in which {moves}.", f"{line} excites mode {mode.index + 1}."]
    return next((own for own in sentences if len(own.split()) <= MOST_WORDS), f"{line} excites it.")


def _quantity(material: ReportData, headline: Headline, top: Resonance, name: str) -> dict[str, Any]:
    label = QUANTITIES[name]
    own = top.amplitudes[name]
    band = ""
    if own.limits is not None:
        band = " to ".join(rounded_text(label.factor * limit.amplitude) for limit in reversed(own.limits))
    place = material.words.of(own.at) if own.at else "input to output"
    if name == "force" and own.at and headline.is_axial(top, own.at):
        place += ", mostly axial"
    return {
        "name": name,
        "title": label.title,
        "value": f"±{rounded_text(label.factor * own.amplitude)}",
        "unit": label.unit,
        "band": band,
        "rank": own.place or "–",
        "place": place,
    }


def _strips(
    material: ReportData, headline: Headline, curves: Mapping[str, Envelope], size: tuple[float, float]
) -> Strips:
    titles = {name: (f"{label.title}, ± {label.unit}", label.factor) for name, label in QUANTITIES.items()}
    peaks = "; ".join(
        f"{number}: {rounded_text(own.frequency)} Hz at {speed_text(own)}"
        for number, own in enumerate(headline.ranking.resonances[:SHOWN], start=1)
    )
    words = f"Largest order over speed. {peaks}."
    return strips_of(headline.ranking, curves, titles, material.rated_rpm, size, words)


def _resonance_box(material: ReportData, headline: Headline, mode: MatchedMode | None) -> Box:
    modes = headline.modes
    if mode is None or modes is None:
        return Box("No modes computed; run exugear modes." if modes is None else "No mode near its frequency.")
    words = material.words
    moving = {f"{body} {motion}": share for (body, motion), share in words.kinetic_energy(modes, mode.index).items()}
    assembly = material.context.assembled(headline.choice)
    bodies = drawn_bodies(assembly)
    drawn = drawn_mode(assembly, bodies, modes["shape"].to_numpy()[:, mode.index], True)
    picture = ""
    if bodies:
        fields = {place: field.real for place, field in drawn.fields.items()}
        shapes = [(body.shape, drawn.motions[n].real, fields.get(n)) for n, body in enumerate(bodies)]
        picture = png_address(mode_picture(shapes))
    return Box(
        f"Mode {mode.index + 1} at {rounded_text(mode.frequency)} Hz, damping {rounded_text(100.0 * mode.damping)} %.",
        [
            ("Kinetic energy", percentages(moving, SHOWN_FRACTIONS, 0.1)),
            ("Strain energy", percentages(words.strain_energy(modes, mode.index), SHOWN_FRACTIONS, 0.1)),
        ],
        picture=picture,
        link="ranking",
    )


def _cause_box(material: ReportData, headline: Headline, top: Resonance, known: Contributions | None) -> Box:
    found = excitations(material.context, material.results)
    causes = causes_of(material.context, material.words, top, found, known)
    line = material.words.order(top.line, top.order)
    sources = {} if known is None else known.meshes
    excitations_of_file = material.context.gearbox.case.excitations
    shares = [(name, sources[name]) for name in excitations_of_file if abs(sources.get(name, 0.0)) >= LEAST_SHARE]
    if not causes:
        return Box(f"Excited by {material.words.line_sentence(line)}.", _share_facts(material, shares), link="gears")
    first = causes[0]
    text = short(
        f"Excited by {material.words.line_sentence(line)}.",
        f"Its part of the static transmission error ({rounded_text(1e6 * first.swing)} µm peak-to-peak): "
        f"±{rounded_text(1e6 * first.amplitude)} µm.",
    )
    of_pairs = [(cause.pair, cause.share) for cause in causes if cause.share is not None]
    facts = _share_facts(material, [*of_pairs, *shares])
    if LAWS[headline.choice.mesh_model].moves_load and not headline.choice.variant.spins_only:
        context = material.context
        moved = {own.pair: own for own in shuttling_pairs(context.gearbox, context.folder, first.harmonic)}
        own = moved.get(first.pair)
        if own is not None and own.over_error > NOTICED_SHUTTLING:
            size = rounded_text(1e3 * own.amplitude)
            moving = f"load moves by ±{size} mm along the face; its moment excites tilting gears, "
            moving += f"{rounded_text(own.over_error)} times as strongly as the transmission error"
            families = {mesh.family for mesh in context.gearbox.meshes if mesh.pair.name == first.pair}
            parts = [known.shuttling[name] for name in families if name in known.shuttling] if known else []
            if parts:
                moving += f"; its part of the amplitude: {100.0 * sum(parts):.0f} %".replace("-", "−")
            facts.append(("Shuttling", moving))
    overlap = rounded_text(first.overlap)
    if first.overlap == 0.0:
        overlap += " (spur gears)"
    elif abs(first.overlap - round(first.overlap)) > 0.1:
        overlap += "; with a whole number the total contact length is constant"
    facts.append(("Overlap ratio", overlap))
    return Box(text, facts, link="gears")


def _share_facts(material: ReportData, shares: Sequence[tuple[str, float]]) -> list[tuple[str, str]]:
    """Return the shares of pairs and excitations in the transmission error as a fact; none without shares."""
    text = ", ".join(f"{material.words.of(name)} {100.0 * share:.0f} %" for name, share in shares)
    return [("TE contribution", text)] if text else []


def _remedy_box(material: ReportData, headline: Headline) -> Box:
    """Show the best computed changes, or the command that computes them: estimates are no advice."""
    study = study_of(material.design_study, headline)
    if study is None and material.design_study is not None:
        return Box("The computed design changes are for another resonance, quantity or model.", link=CHANGES_NAME)
    if study is None:
        return Box(f"No design changes are computed. Run: {levers_command(material)}")
    label = QUANTITIES[study.quantity]
    changes = [(gain, material.words.labelled(words)) for gain, words in best_changes(study, SHOWN_CHANGES)]
    if not changes:
        count = sum(not result.refusal for result in study.results)
        text = f"None of {count} computed changes lowers the highest {label.column} in the range without "
        return Box(f"{text}raising another quantity by 1 dB or failing a requirement.", link=CHANGES_NAME)
    text = f"Effect on the highest {label.column} in the range."
    return Box(text, changes=changes, link=CHANGES_NAME)


def _further(
    material: ReportData, headline: Headline, top: Resonance, curves: Mapping[str, Envelope]
) -> Iterator[tuple[str, list[str]]]:
    """Yield title and lines of the row of small cards."""
    if lines := list(_shortfalls(material)):
        yield "Requirements not met", lines
    if leaders := list(_leaders(material, headline, top)):
        yield "Highest in other quantities", leaders
    rated = material.rated_rpm
    if rated is not None and curves:
        yield f"At rated speed, {rounded_text(rated)} rpm", _rated_lines(headline, curves, rated)
    if headline.response is not None and (sound := sound_over_speed(headline.response)) is not None:
        sound = sound.inside(headline.ranking.speeds)
        if sound.speed.size and (found := sound.summary())["orders"]:
            yield "Sound power of the housing", [loudest(found, material)]
    outside = headline.outside()
    lines = []
    if outside is not None:
        peaks = ", ".join(amplitude_text(name, own.amplitude) for name, own in outside.amplitudes.items())
        lines.append(f"{rounded_text(outside.frequency)} Hz at {speed_text(outside)}: {peaks}.")
    if (ends := headline.computed_up_to()) is not None:
        lines.append(f"Nothing is computed above {rounded_text(ends / RPM)} rpm.")
    if lines:
        yield "Just outside the range", lines
    if doubts := list(_doubts(material, headline, top)):
        yield "What could change this answer", [short(*doubts)]


def _shortfalls(material: ReportData) -> Iterator[str]:
    """Yield parts that fail or fall short of a requirement, at most `SHOWN_SHORTFALLS`.

    They are those of stored ratings, or else of the unchanged gearbox of the design changes, which also have remedies.
    """
    rated = [shortfalls_of(life) for life in material.ratings.lives]
    if not rated and material.design_study is not None:
        rated = [list(material.design_study.requirements)]
    for lines in rated:
        for line in lines[:SHOWN_SHORTFALLS]:
            yield f"{material.words.labelled(line)}."
        if len(lines) > SHOWN_SHORTFALLS:
            yield f"{len(lines) - SHOWN_SHORTFALLS} more."
    if rated and material.design_study is not None:
        for result in material.design_study.results:
            if result.remedy:
                side = f", but it {result.objection}" if result.objection.startswith("raises") else ""
                yield f"{material.words.labelled(result.change.words)}: {result.remedy}{side}."


def _leaders(material: ReportData, headline: Headline, top: Resonance) -> Iterator[str]:
    """Yield the highest resonance in each other quantity."""
    for name in top.amplitudes:
        leader = headline.ranking.leader(name)
        if name == headline.ranking.quantity or leader is None:
            continue
        label = QUANTITIES[name]
        if leader is top:
            yield f"{label.title}: this resonance."
            continue
        own = leader.amplitudes[name]
        order = material.words.line(material.words.order(leader.line, leader.order))
        place = f" ({material.words.of(own.at)})" if own.at else ""
        yield (
            f"{label.title}: ±{rounded_text(label.factor * own.amplitude)} {label.unit}{place}, "
            f"{rounded_text(leader.frequency)} Hz at {speed_text(leader)}, {order}."
        )


def _rated_lines(headline: Headline, curves: Mapping[str, Envelope], rated: float) -> list[str]:
    """Return the amplitudes at rated speed, and which of them exceed all resonances."""
    values = {
        name: float(np.interp(rated * RPM, curve.speed, curve.amplitude))
        for name, curve in curves.items()
        if curve.speed[0] <= rated * RPM <= curve.speed[-1]
    }
    if not values:
        return ["Not computed."]
    near = [
        number
        for number, own in enumerate(headline.ranking.resonances[:SHOWN], start=1)
        if abs(abs(own.speed) / RPM / rated - 1.0) < 2.0 * AT_RATED
    ]
    text = ", ".join(amplitude_text(name, value) for name, value in values.items())
    at = f" Resonance {near[0]} of the ranking." if near else ""
    lines = [f"{capitalised(text)}.{at}"]
    for name, value in values.items():
        leader = headline.ranking.leader(name)
        if leader is not None and value > leader.amplitudes[name].amplitude:
            lines.append(f"The {QUANTITIES[name].column} there is higher than at any resonance in the range.")
    if headline.response is not None:  # the curves over speed omit them
        lines.append("Quasi-static orders are included.")
    return lines


def _doubts(material: ReportData, headline: Headline, top: Resonance) -> Iterator[str]:
    """Yield what could make another resonance the first: inertia sets, assumed parameters, damping."""
    group = headline.group
    for other in material.groups:
        same = group is not None and other.source == group.source and other.inertias != group.inertias
        first = next(iter(other.in_operation.resonances), None) if same else None
        if first is not None:
            quantity = other.in_operation.quantity
            yield (
                f"Inertia set {other.inertias}: {rounded_text(first.frequency)} Hz at {speed_text(first)}, "
                f"{amplitude_text(quantity, first.amplitudes[quantity].amplitude)}."
            )
    mode = headline.mode_of(top)
    for variation in variations_of(material.variations, headline.choice):
        label = material.words.parameter(variation.parameter.label).partition(" / ")[0]
        if mode is None or not label.startswith("housing"):
            continue
        seen = track_mode(variation, mode.frequency).frequency
        values = variation.parameter.values
        place = default_place(variation)
        low, high = (rounded_text(float(seen[n])) for n in (0, -1))
        moves = f"{low} to {high} Hz" if low != high else "the same frequency"
        yield f"{capitalised(label)} {values[0]:g} to {values[-1]:g} instead of {values[place]:g}: {moves}."
    places = top.amplitudes[headline.ranking.quantity].places
    if places is not None:
        yield "Damping does not change the first rank." if places[1] == 1 else f"Damping: rank 1 to {places[1]}."
