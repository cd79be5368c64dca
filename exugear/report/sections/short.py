"""Section "In short": three facts in plain words, checks that were passed, and things to mind."""

from __future__ import annotations

from collections.abc import Sequence

from exugear.report.findings.facts import Fact, facts_of, facts_of_response
from exugear.report.findings.groups import RunGroup
from exugear.report.findings.verdicts import Verdict, verdicts_of
from exugear.report.parts.material import Material, Part, group_words, only_for, told_groups
from exugear.report.web import pieces


def short_section(material: Material) -> Part:
    """Tell the facts of each group of results as cards; the command line prints the same sentences.

    Those of steady responses are printed where there is no run-up, which else tells of both.
    """
    context = material.context
    groups = told_groups(material.groups)
    content = []
    for group in material.groups:
        facts = facts_of(context, material.words, group, material.variations)
        verdicts = verdicts_of(context, group)
        if group in groups:
            several = f"{group_words(groups, group)}: " if len(groups) > 1 else ""
            context.notes.statements.extend(f"{several}{fact.line}" for fact in facts)
            context.notes.statements.extend(f"{several}{verdict.line}." for verdict in verdicts)
        content.append(only_for(_group(material, group, facts, verdicts), group.name))
    if not content:
        content = [_without_groups(material)]
    elif not any(not group.responses for group in material.groups):
        content.append(pieces.paragraph("No run-up of this case is here: `exugear run` makes one.", "note"))
    return Part(pieces.section("In short", *content, name="short"), {}, "In short", "short")


def _group(material: Material, group: RunGroup, facts: Sequence[Fact], verdicts: Sequence[Verdict]) -> str:
    scope = (
        f"{group.title[0].upper()}{group.title[1:]}. Speeds are those of the {material.input_words}, levels those of "
        "the overall transmission error, 0 dB = 1 µm."
    )
    return (
        pieces.paragraph(scope, "note")
        + pieces.element("div", "".join(map(_card, facts)), class_="cards")
        + verdict_list(verdicts)
    )


def _without_groups(material: Material) -> str:
    """Tell what branches and responses at few speeds know, and what tells more."""
    facts = [fact for data in material.results.steady for fact in facts_of_response(material.words, data)]
    material.context.notes.statements.extend(fact.line for fact in facts)
    cards = pieces.element("div", "".join(map(_card, facts)), class_="cards") if facts else ""
    return cards + pieces.paragraph(
        "No run-up of this case is here: `exugear run` makes one, and the page tells more.", "note" if facts else ""
    )


def _card(fact: Fact) -> str:
    large = pieces.element(
        "p", pieces.text(fact.figure) + pieces.element("small", pieces.text(f" {fact.beside}")), class_="large"
    )
    more = pieces.element("a", "See more", href=f"#{fact.link}", aria_label=f"See more: {fact.kind}")
    return pieces.element(
        "article", f"<h3>{pieces.text(fact.kind)}</h3>{large}{pieces.paragraph(fact.sentence)}{more}", class_="card"
    )


def verdict_list(verdicts: Sequence[Verdict]) -> str:
    """List what was passed and what to mind; words say which is which beside colours."""
    entries = []
    for verdict in verdicts:
        sign = pieces.element("b", "✓" if verdict.passed else "!", aria_hidden="true")
        element = pieces.element("span", "Passed: " if verdict.passed else "Mind: ", class_="unseen")
        entries.append(
            pieces.element(
                "li", sign + element + pieces.text(verdict.words), class_="good" if verdict.passed else "mind"
            )
        )
    return pieces.element("ul", "".join(entries), class_="verdicts", aria_label="Can this be trusted?")
