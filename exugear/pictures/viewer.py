"""Modes of a gearbox as a self-contained web page: turn, zoom, animate in any browser with WebGL 2, offline.

The page carries the bodies once and a motion per body and mode; everything else happens in its shaders. Its elements
and style stand in ``viewer.html``, its script in ``viewer.js``.
"""

from __future__ import annotations

import base64
import html
import json
import re
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from exugear.pictures.motions import ModeScene, displacement_of
from exugear.pictures.scene import DISPLACEMENT_COLOURS, body_colours, channels
from fe_ste.tools.files import write_file

PAGE_FILES = ("viewer.html", "viewer.js")
"""The page, with marks for heading, data and script, and its script."""


def write_mode_page(
    scenes: Sequence[ModeScene], path: str | Path, *, heading: str = "Mode shapes", first: int = 0
) -> Path:
    """Write a web page that shows modes of one gearbox.

    Parameters
    ----------
    scenes : sequence of ModeScene
        Modes to choose from, all of the same bodies; their titles are the choices.
    path : path-like
        Where to write the page.
    heading : str
        Gearbox, variant, mesh law and inertia set.
    first : int
        Mode that is shown when the page opens.

    Returns
    -------
    pathlib.Path

    Raises
    ------
    ValueError
        If there is no mode or the modes differ in their bodies.
    """
    if not scenes:
        raise ValueError("mode page: no mode given")
    bodies = scenes[0].bodies
    if any([body.name for body in scene.bodies] != [body.name for body in bodies] for scene in scenes):
        raise ValueError("mode page: all modes must be of the same bodies")
    points = np.concatenate([body.surface.points for body in bodies])
    colours = body_colours(bodies)
    data = {
        "heading": heading,
        "first": first,
        "centre": np.round(0.5 * (points.min(axis=0) + points.max(axis=0)), 6).tolist(),
        "radius": round(0.5 * float(np.linalg.norm(np.ptp(points, axis=0))), 6),
        "colours": [_rounded(channels(colour)) for colour in DISPLACEMENT_COLOURS],
        "bodies": [
            {
                "name": body.name,
                "fixed": body.fixed,
                "colour": _rounded(colours[body.family]),
                "reference": body.reference.tolist(),
                "points": _encoded(body.surface.points.astype("<f4")),
                "triangles": _encoded(body.surface.triangles.astype("<u4")),
            }
            for body in bodies
        ],
        "modes": [_mode(scene) for scene in scenes],
    }
    target = Path(path)
    write_file(target, _page(heading, data).encode("utf-8", errors="replace"))
    return target


def _page(heading: str, data: Mapping[str, object]) -> str:
    """Fill ``viewer.html`` with a heading, the data and ``viewer.js``."""
    template, script = (files("exugear.pictures").joinpath(name).read_text("utf-8") for name in PAGE_FILES)
    # Names are free: as escapes of JSON, none of them ends the script element or begins another.
    text = json.dumps(data, separators=(",", ":")).translate({ord(sign): f"\\u{ord(sign):04x}" for sign in "<>&"})
    pieces = {"@HEADING@": html.escape(heading), "@DATA@": text, "@SCRIPT@": script}
    # In one pass, so that nothing in a name is taken for a mark to be replaced.
    return re.sub("|".join(pieces), lambda mark: pieces[mark[0]], template)


def _mode(scene: ModeScene) -> dict[str, object]:
    largest = max(
        float(np.linalg.norm(displacement_of(body, motion), axis=1).max())
        for body, motion in zip(scene.bodies, scene.motions, strict=True)
    )
    motions = [[float(f"{value:.6g}") for value in motion] for motion in scene.motions]
    return {"title": scene.title, "largest": largest, "motions": motions}


def _rounded(colour: Sequence[float]) -> list[float]:
    return [round(channel, 4) for channel in colour]


def _encoded(values: NDArray[np.generic]) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii")
