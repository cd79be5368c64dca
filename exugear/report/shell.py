"""What stands around the sections of the report: head, table of contents, controls of the whole page, foot."""

from __future__ import annotations

from collections.abc import Sequence

from exugear.report.parts.material import Material, Part
from exugear.report.web import pieces


def page_body(material: Material, parts: Sequence[Part]) -> str:
    """Put the sections together: warnings first, then what was found, then what is left out."""
    notes = material.context.notes
    warning = "Runs that are not to be trusted; what follows shows them all the same"
    head = pieces.element(
        "header",
        _brand(material) + _tools() + _contents(parts),
        class_="top",
    )
    above = pieces.alert(warning, notes.distrusted) if notes.distrusted else ""
    left_out = pieces.section("Left out", pieces.bullets(notes.left_out), name="left-out") if notes.left_out else ""
    main = pieces.element(
        "main", above + _sets(material) + "".join(part.html for part in parts) + left_out, id="content"
    )
    told = f"Made by exugear from {material.file_words}. This page asks nothing of any network."
    foot = pieces.element("footer", pieces.paragraph(told))
    skip = pieces.element("a", "Skip to the content", class_="skip", href="#content")
    live = pieces.element("p", "", id="said", class_="toast", role="status", aria_live="polite")
    tip = pieces.element("p", "", id="tip", class_="tip", hidden=True)
    return skip + head + main + foot + live + tip


def _brand(material: Material) -> str:
    gearbox = material.context.gearbox
    shown = ", ".join(dict.fromkeys(run.variant for run in material.results.runs))
    line = f"Where it rings, how loud, and why. Ratio {gearbox.train.ratio:.6f}"
    steady = ", ".join(dict.fromkeys(str(data.attrs["variant"]) for data in material.results.steady))
    line += f"; run-ups {shown}" if shown else ""
    line += f"; constant speeds {steady}." if steady else "."
    return pieces.element("div", f"<h1>{pieces.text(gearbox.name)}</h1>{pieces.paragraph(line)}", class_="brand")


def _tools() -> str:
    def button(name: str, shown: str, label: str) -> str:
        return pieces.element("button", shown, type="button", id=name, aria_label=label)

    buttons = [
        button("share", "Copy view", "Copy a link to exactly this view"),
        button("save-data", "Data (JSON)", "Save the data of this page as JSON"),
        button("print", "Print", "Print this page"),
        button("theme", "◐", "Dark or light colours"),
    ]
    return pieces.element("div", "".join(buttons), class_="page-tools scripts-only")


def _contents(parts: Sequence[Part]) -> str:
    links = "".join(
        pieces.element("a", pieces.text(part.title), href=f"#{part.name}") for part in parts if part.title and part.html
    )
    return pieces.element("nav", links, aria_label="Sections")


def _sets(material: Material) -> str:
    """Choice of the group of results, where there are several: which source the figures are read from."""
    if len(material.groups) < 2:
        return ""
    choices = pieces.element("div", "", class_="choices", id="group", role="group", aria_label="Results shown")
    return pieces.element("div", f"Figures of: {choices}", class_="controls scripts-only")
