"""What holds the bodies of a variant: which supports are at work, and their stiffness and damping as matrices."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from exugear.bearings import matrices
from exugear.bearings.catalogue import catalogue_rows
from exugear.bearings.contact import pitch_averaged_tangent
from exugear.bearings.rows import BearingError, BearingOfRows
from exugear.model.gearbox import Gearbox
from exugear.model.parts import Bearing, stiffness_matrix
from exugear.model.sections.connections import CatalogueSection
from fe_ste.tools.arrays import Floats

ON_BEARINGS = ("bushing", "flexible")
"""Variants whose bodies sit on bearings."""


def unsupported(gearbox: Gearbox, variant: str) -> str:
    """Say what a variant lacks that its bodies are held by; empty if nothing.

    Every body of the variant `rigid` needs its joint: without one it would not turn on a fixed axis.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> unsupported(gearbox, "bushing"), unsupported(gearbox.varied({"bearings": {}}), "bushing")
    ('', 'the gearbox file has no [bearings]')
    """
    elastic = elastic_names(gearbox)
    if variant not in ON_BEARINGS:
        held = {joint.body for joint in gearbox.joints}
        missing = [b.name for b in gearbox.bodies() if not (b.fixed or b.spin_only or b.name in held)]
        return f"no joint holds {', '.join(missing)}; add one under [joints]" if missing else ""
    if not gearbox.bearings:
        return "the gearbox file has no [bearings]"
    if variant == "flexible" and not elastic:
        return 'no body is elastic; give one a shape and flexibility = "elastic"'
    mounted = {mount.body for mount in mounts_at_work(gearbox)}
    for body in gearbox.bodies():
        if variant == "flexible" and body.fixed and body.name in elastic and body.name not in mounted:
            return f"body {body.name} is elastic, but nothing holds it; add [mounts] on the ground"
    return ""


def elastic_names(gearbox: Gearbox) -> tuple[str, ...]:
    """Names of the bodies that the variant `flexible` takes as elastic."""
    return tuple(body.name for body in gearbox.bodies() if gearbox.case.bodies[body.family].flexibility != "none")


def mounts_at_work(gearbox: Gearbox) -> tuple[Bearing, ...]:
    """Mounts that hold the gearbox in the variant `flexible`: none where no fixed body is elastic.

    A fixed body that is rigid is the ground itself, and so needs no mount.
    """
    elastic, bodies = elastic_names(gearbox), {body.name: body for body in gearbox.bodies()}
    if not any(bodies[name].fixed for name in elastic):
        return ()
    return tuple(mount for mount in gearbox.mounts if mount.body in elastic or not bodies[mount.body].fixed)


def bearing_matrices(bearing: Bearing, damping_time: float) -> tuple[Floats, Floats]:
    """Stiffness and damping (6, 6) of a bearing, housing factor included, in the axes of what it sits on.

    Catalogue bearings: tangent of ISO/TS 16281 at the stated load, averaged over cage positions and
    directions, raised to the stated floor. Given ones: as given. Damping as given, else time times stiffness.

    Raises
    ------
    exugear.bearings.rows.BearingError
        The catalogue dimensions or the load are impossible.
    """
    given = stiffness_matrix(bearing.stiffness)
    if bearing.catalogue is not None:
        given = matrices.regularised(catalogue_stiffness(bearing.catalogue), np.diag(given))
    stiffness = bearing.factor * given
    if bearing.damping is not None:
        return stiffness, stiffness_matrix(bearing.damping)
    return stiffness, matrices.proportional_damping(stiffness, damping_time)


@lru_cache(maxsize=64)
def catalogue_stiffness(section: CatalogueSection) -> Floats:
    """Stiffness (6, 6) that a catalogue gives, the same in all directions across the axis.

    Raises
    ------
    exugear.bearings.rows.BearingError
        The catalogue dimensions or the load are impossible.
    """
    if section.radial_load_kN is None:
        raise BearingError("radial_load_kN is missing: the load under which its stiffness is taken")
    force = (1e3 * section.radial_load_kN, 0.0, 1e3 * (section.axial_load_kN or 0.0))
    return matrices.axially_symmetric(pitch_averaged_tangent(BearingOfRows(catalogue_rows(section)), force))
