"""The command `view`: the gearbox in three dimensions, in its modes and in operation."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from exugear.cli.console import BadInputError, FailedError, warn
from exugear.cli.tables import Outcome
from exugear.cli.watched import WatchedProject
from exugear.gearbox.choice import Choice
from exugear.gearbox.units import RPM
from exugear.report.findings.context import METHOD_LABELS, model_label
from exugear.report.findings.headline import Headline
from exugear.report.findings.ranking import Resonance, most_complete_response, ranking_of
from exugear.report.findings.words import Labels, percentages
from exugear.report.pictures.scene import (
    animate_elastic_bodies,
    animate_mode,
    draw_elastic_bodies,
    draw_gearbox,
    draw_mode,
    elastic_scene,
)
from exugear.report.pictures.shapes import bodies_of, mode_scene, motions_of
from exugear.report.web.mode_page import ModeRow, ResonanceRow, write_mode_page
from exugear.report.writer import command_line
from exugear.results.findings import Finding
from exugear.steady.evaluation.deflection_shapes import deflection_shapes
from exugear.steady.steady_file import load_response, settings_of
from exugear.system.modes import Modes
from exugear.system.system import Assembly
from fe_ste.tools.arrays import Complexes, Floats
from fe_ste.tools.drawing import RenderingError
from fe_ste.tools.files import FileError

if TYPE_CHECKING:
    import xarray as xr

SHOWN_ENERGIES = 3
"""Number of listed fractions of the strain energy."""
FIRST = 0
"""Stands for the first resonance of the ranking whose state is found again; a mode if there is none."""
SHOWN_RESONANCES = 10
"""Number of listed resonances of the ranking."""


def view(
    project: WatchedProject,
    near: float | None,
    resonance: int | None,
    quantity: str | None,
    animation: bool,
    as_json: bool,
    whole: bool,
) -> None:
    """Write the page of a project."""
    project.begin()
    project.prepare()
    folder = project.modes_path.parent
    assembly = project.assembly()
    response = _stored_response(assembly, folder)
    if response is None:
        command = command_line(project.gearbox, project.folder, "steady", project.choice)
        if resonance is not None:
            raise BadInputError(f"--resonance {resonance}: no steady-state response; run: {command}")
        modes = project.modes()
        headline = None
        about = f"Vibration at resonances in operation needs a steady-state response: {command}"
    else:
        ranking = ranking_of(response, wanted=quantity or project.gearbox.case.report.quantity)
        count = len(ranking.resonances)
        if resonance is not None and resonance > count:
            raise BadInputError(f"--resonance {resonance}: the ranking has {count} resonances; choose one or omit it")
        modes = project.modes()
        headline = Headline(assembly.choice, "", "", ranking, None, response, modes.to_dataset())
        about = ""
    wanted = project.gearbox.case.report.reference_frequency_Hz if near is None else near
    first = int(modes.overall.argmax()) if wanted is None else modes.nearest(wanted)
    # Without a choice the first resonance in operation is shown, or else a mode.
    leads = FIRST if resonance is None and near is None else resonance
    written, resonance = _draw(modes, headline, about, folder, first, leads, animation)
    shown = {"mode": first + 1} if resonance is None else {"resonance": resonance}
    page, *pictures = written
    Outcome(
        verdict=f"Page of {len(modes.frequency)} modes" + ("" if about else " and the resonances in operation"),
        summary={"case": project.gearbox.source, **shown, "files": [str(file) for file in written]},
        findings=[Finding("note", about)] if about else [],
        path=", ".join([str(page), *(picture.name for picture in pictures)]),
    ).show(as_json, whole)


def _stored_response(assembly: Assembly, folder: Path) -> xr.Dataset | None:
    """Return the stored steady-state response with the most complete method that belongs to the gearbox file."""
    responses = []
    for path in sorted(folder.glob("steady-*.nc")):
        try:
            data = load_response(path)
            if settings_of(data.attrs).hash_with(assembly) == data.attrs["input_hash"]:
                responses.append(data)
        except (FileError, ValueError, KeyError):
            continue
    return most_complete_response(responses, Choice(assembly.variant, assembly.mesh_model, assembly.inertias))


def _draw(
    modes: Modes,
    headline: Headline | None,
    about: str,
    folder: Path,
    first: int,
    resonance: int | None,
    animation: bool,
) -> tuple[list[Path], int | None]:
    """Write page and pictures; return them and the number of the resonance that is shown first, None for a mode."""
    assembly = modes.assembly
    words = Labels(assembly.gearbox)
    ranked: tuple[Resonance, ...] = ()
    resonances: list[ResonanceRow] = []
    if headline is not None and headline.response is not None:
        ranked = headline.ranking.resonances[: max(SHOWN_RESONANCES, resonance or 0)]
        resonances = _resonance_rows(assembly, headline, ranked, words)
        about = f"Steady state at constant speed, {METHOD_LABELS[str(headline.response.attrs['method'])]}."
        if not ranked:
            about += " There is no resonance in the ranking."
        if len(resonances) < len(ranked):
            about += " Resonances whose state is not found again from rest are left out."
    mode_rows = _mode_rows(modes, words, headline, ranked)
    places = [row.number - 1 for row in mode_rows]
    shown = places.index(first) if first in places else 0
    if resonance == FIRST:
        resonance = next((row.number for row in resonances), None)
    if resonance is None:
        title = f"{modes.frequency[places[shown]]:.0f} Hz: {modes.names[places[shown]]}"
        picture = folder / f"mode_{places[shown] + 1}"
        shape: Floats | Complexes = modes.shapes[:, places[shown]]
    else:
        numbers = [row.number for row in resonances]
        if resonance not in numbers:
            raise FailedError(f"--resonance {resonance}: its steady state is not found again from rest; choose another")
        shown = len(mode_rows) + numbers.index(resonance)
        title = resonances[numbers.index(resonance)].title
        picture = folder / f"resonance_{resonance}"
        shape = resonances[numbers.index(resonance)].shape
    page = write_mode_page(
        assembly,
        modes.shapes[:, places],
        mode_rows,
        folder / "modes.html",
        resonances=resonances,
        about_resonances=about,
        heading=f"{assembly.gearbox.name}, {model_label(assembly.choice)}",
        first=shown,
        labels=words.labels,
    )
    return [page, *_draw_pictures(assembly, shape, title, picture, animation)], resonance


def _mode_rows(modes: Modes, words: Labels, headline: Headline | None, ranked: Sequence[Resonance]) -> list[ModeRow]:
    """Return the modes that move a drawn body, with the numbers of the resonances in operation at each."""
    assembly = modes.assembly
    resonances: dict[int, list[str]] = {}
    for number, resonance in enumerate(ranked, start=1):
        mode = headline.mode_of(resonance) if headline else None
        if mode is not None:
            resonances.setdefault(mode.index, []).append(str(number))
    drawn = {body.name for body in bodies_of(assembly.gearbox)}
    data = modes.to_dataset()
    rows = []
    for place, frequency in enumerate(modes.frequency):
        motions = motions_of(assembly.bodies, assembly.coordinates, assembly.rigid_part(modes.shapes[:, place]))
        if frequency > 0.0 and any(motion.any() for body, motion in motions.items() if body in drawn):
            row = ModeRow(
                place + 1,
                float(frequency),
                float(data["damping_ratio"][place]),
                words.moves(data, place),
                percentages(words.strain_energy(data, place), SHOWN_ENERGIES, 0.1),
                ", ".join(resonances.get(place, ())),
            )
            rows.append(row)
    if not rows:
        raise BadInputError(f"{modes.label}: all modes are rigid-body rotations; nothing to show")
    return rows


def _resonance_rows(
    assembly: Assembly, headline: Headline, ranked: Sequence[Resonance], words: Labels
) -> list[ResonanceRow]:
    """Return the resonances with their operating deflection shapes, without those that are not found again."""
    assert headline.response is not None
    shapes = deflection_shapes(
        assembly, headline.response, [(resonance.order, resonance.speed) for resonance in ranked]
    )
    rows = []
    for number, (resonance, shape) in enumerate(zip(ranked, shapes, strict=True), start=1):
        if shape is None:
            continue
        mode = headline.mode_of(resonance)
        row = ResonanceRow(
            number,
            words.line(words.order(resonance.line, resonance.order)),
            abs(resonance.speed) / RPM,
            resonance.frequency,
            resonance.amplitudes["error"].amplitude,
            "" if mode is None else str(mode.index + 1),
            shape,
        )
        rows.append(row)
    return rows


def _draw_pictures(
    assembly: Assembly, shape: Floats | Complexes, title: str, stem: Path, animation: bool
) -> list[Path]:
    """Draw the gearbox and one mode or resonance; return no pictures if this machine cannot render.

    Flexible bodies are drawn by their strain energy in a mode; in operation, all bodies by their displacement.
    """
    bodies = bodies_of(assembly.gearbox)
    gearbox = stem.with_name("gearbox.png")
    still = stem.with_suffix(".png")
    animated = stem.with_suffix(".gif")
    moving = []
    try:
        draw_gearbox(bodies, gearbox, title=assembly.gearbox.name)
        if assembly.elastic_bodies and not np.iscomplexobj(shape):
            deformed = elastic_scene(assembly, np.real(shape), title=title)
            draw_elastic_bodies(deformed, still)
            if animation:
                moving.append(animate_elastic_bodies(deformed, animated))
        else:
            parts = [
                motions_of(assembly.bodies, assembly.coordinates, assembly.rigid_part(part))
                for part in (np.real(shape), np.imag(shape))
            ]
            drawn = {body.name for body in bodies} & set(parts[0])
            scene = mode_scene(bodies, {name: parts[0][name] + 1j * parts[1][name] for name in drawn}, title=title)
            draw_mode(scene, still)
            if animation:
                moving.append(animate_mode(scene, animated))
    except RenderingError as error:
        warn(f"no pictures: {error}")
        return []
    return [*moving, gearbox, still]
