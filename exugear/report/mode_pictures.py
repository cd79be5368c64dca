"""Pictures of mode shapes in the report: the mode near the target frequency, of a stored model or a changed one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import xarray as xr

from exugear.dynamics.assembly import Assembly
from exugear.model.choice import Choice
from exugear.pictures.elastic_scene import draw_elastic_bodies, elastic_scene
from exugear.pictures.motions import mode_scene, motions_of
from exugear.pictures.scene import draw_mode
from exugear.pictures.shapes import bodies_of
from exugear.report import page
from exugear.report.context import REFERENCE_VARIANT, VISIBLE_SHARE, Context, file_part, words_of
from exugear.report.sensitivity import ModelMatch
from exugear.spectra.mode_report import ModeReport, nearest_mode
from fe_ste.tools.arrays import Floats
from fe_ste.tools.rendering import RenderingError


def target_mode_pictures(
    context: Context, modes: Mapping[Choice, xr.Dataset], matches: Sequence[ModelMatch], target: float
) -> str:
    """Show the visible mode nearest to the target (Hz), after one that an assumption brings nearer where it must."""
    candidates = [(model, mode) for model, data in modes.items() if (mode := nearest_mode(data, target, VISIBLE_SHARE))]
    if not candidates:
        return ""

    def is_poor(model: Choice, mode: ModeReport) -> bool:
        return model.variant == REFERENCE_VARIANT or not mode.is_near(target)

    model, mode = min(candidates, key=lambda pair: (is_poor(*pair), abs(pair[1].frequency - target)))
    title = f"{mode.frequency:.0f} Hz: {words_of(model)}\n{mode.name}"
    shape = modes[model]["shape"].isel(mode=mode.index).to_numpy()
    stored = _mode_picture(context, context.assembled(model), shape, title, f"mode-{file_part(model)}")
    if not (matches and is_poor(model, mode)):
        return stored
    strongest = max(matches, key=lambda found: found.match.share)
    return _changed_mode_picture(context, strongest, f"mode-{target:.0f}-Hz") + stored


def _changed_mode_picture(context: Context, found: ModelMatch, name: str) -> str:
    """Show a mode that an assumption brings to the target; the title names the assumption."""
    match = found.match
    title = (
        f"{match.frequency:.0f} Hz: {words_of(found.model)}, "
        f"{found.assumption} instead of {match.parameter.default:g}\n"
        f"{match.modes.names[match.index]}"
    )
    return _mode_picture(context, match.modes.assembly, match.modes.shapes[:, match.index], title, name)


def _mode_picture(context: Context, assembly: Assembly, shape: Floats, title: str, name: str) -> str:
    context.tell("picture of a mode")
    path = context.picture_path(name)
    try:
        if assembly.elastic_bodies:
            draw_elastic_bodies(elastic_scene(assembly, shape, title=title), path)
        else:
            draw_mode(mode_scene(bodies_of(assembly.gearbox), _motions(assembly, shape), title=title), path)
    except RenderingError as error:
        context.notes.pictures.remove(path)
        context.notes.left_out.append(f"picture of a mode: {error}")
        return page.paragraph(f"No picture of the mode: {error}", "warning")
    return page.picture(path, f"Mode shape, {title}.".replace("\n", "; "))


def _motions(assembly: Assembly, shape: Floats) -> dict[str, Floats]:
    """Motions of the bodies that have a shape to draw."""
    drawn = {body.name for body in bodies_of(assembly.gearbox)}
    motions = motions_of(assembly.bodies, assembly.coordinates, assembly.rigid_part(shape))
    return {name: motion for name, motion in motions.items() if name in drawn}
