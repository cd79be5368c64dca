"""Frame of the stage of a page, where a mode moves, with its controls."""

from __future__ import annotations

from exugear.report.web import pieces

HINT = "Drag turns, right drag or two fingers move, wheel or pinch zooms; arrow keys turn."


def stage_figure() -> str:
    """Make the frame; the scripts ``stage`` and ``mode_view`` fill it."""
    element = pieces.element
    canvas = element("canvas", "", id="view-3d", tabindex=0, role="img", aria_label="Mode in motion")
    still = element("img", id="still", alt="Mode at its largest deflection")
    missing = element("p", "This browser has no WebGL 2: the mode cannot be drawn.", id="no-gl", hidden=True)
    stage = element("div", canvas + still + missing, class_="stage")
    slider = element("input", type="range", id="amplitude", min=0, max=3, step=0.05, value=1)
    amplitude = element("label", f"Amplitude {slider}")
    play = element("button", "Pause", type="button", id="play", aria_pressed="true")
    by_body = element("label", element("input", type="checkbox", id="by-body") + " body colours")
    ends = element("span", "rests <i></i> moves most", class_="ends")
    controls = element("div", play + amplitude + by_body + ends, class_="controls")
    chips = element("div", "", class_="chips", id="bodies", role="group", aria_label="Bodies shown")
    title = element("strong", "Mode", id="mode-title")
    caption = element("figcaption", title + element("span", HINT, class_="hint"))
    tools = element("div", "", class_="tools", id="mode-tools")
    return element("figure", caption + tools + stage + controls + chips, class_="panel", id="mode")
