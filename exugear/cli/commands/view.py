"""The command `view`: the gearbox and its mode shapes in three dimensions."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from exugear.cli.case import (
    USUAL_LAW,
    CaseArgument,
    FilesBelowOption,
    InertiasOption,
    JsonOption,
    LawOption,
    OutOption,
    ScriptsOption,
    VariantOption,
    open_project,
)
from exugear.cli.console import BadInputError, exit_codes, note, print_json, say
from exugear.gearbox.variant import Variant

if TYPE_CHECKING:
    import xarray as xr

    from exugear.system.modes import Modes
    from exugear.system.system import Assembly

SHOWN_ENERGIES = 3
"""Number of listed fractions of the strain energy."""
SHOWN_RESONANCES = 10
"""Number of listed resonances of the ranking."""


def view(
    case: CaseArgument,
    variant: VariantOption = Variant.bushing,
    mesh_model: LawOption = USUAL_LAW,
    inertias: InertiasOption = None,
    near: Annotated[
        float | None,
        typer.Option(
            min=0.0, metavar="HZ", help="Show the mode nearest to this frequency first. (default: gearbox file)"
        ),
    ] = None,
    animation: Annotated[bool, typer.Option("--gif", help="Also write an animated GIF of that mode.")] = False,
    out: OutOption = None,
    allow_dir: FilesBelowOption = None,
    scripts: ScriptsOption = False,
    as_json: JsonOption = False,
) -> None:
    """Write a web page of the gearbox and its mode shapes. It is self-contained and three-dimensional."""
    with exit_codes():
        from exugear.gearbox.choice import Choice

        project = open_project(case, Choice(variant.value, mesh_model.value, inertias), out, allow_dir, scripts)
        project.begin()
        project.prepare()
        modes = project.modes()
        wanted = project.gearbox.case.report.reference_frequency_Hz if near is None else near
        first = int(modes.overall.argmax()) if wanted is None else modes.nearest(wanted)
        written = _draw_modes(modes, project.modes_path.parent, first, animation)
        if as_json:
            print_json({"case": str(case), "mode": first + 1, "files": [str(file) for file in written]})
            return
        for file in written:
            say(str(file))


def _draw_modes(found: Modes, folder: Path, first: int, animation: bool) -> list[Path]:
    """Write the page of all elastic modes, and pictures of the gearbox and one mode if this machine can render."""
    from exugear.report.findings.context import model_label
    from exugear.report.findings.words import Labels, percentages
    from exugear.report.pictures.shapes import bodies_of, motions_of
    from exugear.report.web.stage import ModeRow, write_mode_page

    assembly = found.assembly
    drawn = {body.name for body in bodies_of(assembly.gearbox)}
    places = []
    for place, frequency in enumerate(found.frequency):
        motions = motions_of(assembly.bodies, assembly.coordinates, assembly.rigid_part(found.shapes[:, place]))
        if frequency > 0.0 and any(motion.any() for body, motion in motions.items() if body in drawn):
            places.append(place)
    if not places:
        raise BadInputError(f"{found.label}: all modes are rigid-body rotations; nothing to show")
    shown = places.index(first) if first in places else 0
    words = Labels(assembly.gearbox)
    modes = found.to_dataset()
    resonances = _resonances(assembly, modes, folder)
    rows = [
        ModeRow(
            place + 1,
            float(found.frequency[place]),
            float(modes["damping_ratio"][place]),
            words.moves(modes, place),
            percentages(words.strain_energy(modes, place), SHOWN_ENERGIES, 0.1),
            "; ".join(resonances.get(place, ())),
        )
        for place in places
    ]
    page = write_mode_page(
        assembly,
        found.shapes[:, places],
        rows,
        folder / "modes.html",
        heading=f"{assembly.gearbox.name}, {model_label(assembly.choice)}",
        first=shown,
        labels=words.labels,
    )
    return [page, *_draw_pictures(found, folder, places[shown], animation)]


def _resonances(assembly: Assembly, modes: xr.Dataset, folder: Path) -> dict[int, list[str]]:
    """Return the highest resonances in the operating range at each mode, from a stored steady-state response."""
    from exugear.gearbox.units import RPM
    from exugear.report.findings.headline import Headline
    from exugear.report.findings.ranking import ranking_of
    from exugear.steady.steady_file import load_response, settings_of
    from fe_ste.tools.files import FileError

    found: dict[int, list[str]] = {}
    for path in sorted(folder.glob("steady-*.nc")):
        try:
            data = load_response(path)
            fits = settings_of(data.attrs).hash_with(assembly) == data.attrs["input_hash"]
        except (FileError, ValueError, KeyError):
            continue
        if not fits:
            continue
        headline = Headline(assembly.choice, "", "", ranking_of(data), None, data, modes)
        for number, resonance in enumerate(headline.ranking.resonances[:SHOWN_RESONANCES], start=1):
            mode = headline.mode_of(resonance)
            if mode is not None:
                speed = abs(resonance.speed) / RPM
                found.setdefault(mode.index, []).append(f"{number}: {resonance.line}, {speed:.4g} rpm")
        break
    return found


def _draw_pictures(modes: Modes, folder: Path, place: int, animation: bool) -> list[Path]:
    """Draw the gearbox and one mode; return no pictures if this machine cannot render."""
    from exugear.report.pictures.scene import (
        animate_elastic_bodies,
        animate_mode,
        draw_elastic_bodies,
        draw_gearbox,
        draw_mode,
        elastic_scene,
    )
    from exugear.report.pictures.shapes import bodies_of, mode_scene, motions_of
    from fe_ste.tools.drawing import RenderingError

    assembly = modes.assembly
    bodies = bodies_of(assembly.gearbox)
    shape = modes.shapes[:, place]
    title = f"{modes.frequency[place]:.0f} Hz: {modes.names[place]}"
    stem = folder / f"mode_{place + 1}"
    still = stem.with_suffix(".png")
    animated = stem.with_suffix(".gif")
    try:
        draw_gearbox(bodies, folder / "gearbox.png", title=assembly.gearbox.name)
        if assembly.elastic_bodies:
            deformed = elastic_scene(assembly, shape, title=title)
            draw_elastic_bodies(deformed, still)
            moving = [animate_elastic_bodies(deformed, animated)] if animation else []
        else:
            motions = motions_of(assembly.bodies, assembly.coordinates, assembly.rigid_part(shape))
            drawn = {body.name for body in bodies}
            scene = mode_scene(bodies, {name: m for name, m in motions.items() if name in drawn}, title=title)
            draw_mode(scene, still)
            moving = [animate_mode(scene, animated)] if animation else []
    except RenderingError as error:
        note(f"Warning: no pictures: {error}", style="yellow")
        return []
    return [*moving, folder / "gearbox.png", still]
