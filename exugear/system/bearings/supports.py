"""What holds the bodies of a variant: which supports are at work."""

from __future__ import annotations

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import Bearing
from exugear.gearbox.variant import Variant


def unsupported(gearbox: Gearbox, variant: str) -> str:
    """Say what a variant lacks that its bodies are held by; empty if nothing.

    Off bearings every body needs its joint: without one it would not turn on a fixed axis.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> unsupported(gearbox, "bushing"), unsupported(gearbox.varied({"bearings": {}}), "bushing")
    ('', 'the gearbox file has no [bearings]')
    """
    chosen = Variant.of(variant)
    elastic = elastic_names(gearbox)
    if not chosen.on_bearings:
        held = {joint.body for joint in gearbox.joints}
        missing = [b.name for b in gearbox.bodies() if not (b.fixed or b.spin_only or b.name in held)]
        if missing:
            return f"no joint holds {', '.join(missing)}; add one under [joints]"
        sprung = list(gearbox.held_by_torsion)
        if sprung:
            return (
                f"{', '.join(sprung)}: held against turning by the torsion of a bearing, which this variant does not "
                f"have; take the variant bushing, or let the body stand (bodies.{sprung[0]}.fixed = true)"
            )
        return ""
    if gearbox.unknown_bearings:
        names = ", ".join(f"bearings.{name} ({text})" for name, text in gearbox.unknown_bearings.items())
        return f"only the designation is known of {names}; give each a [.catalogue] or a [.stiffness] table"
    if not gearbox.bearings:
        return "the gearbox file has no [bearings]"
    if chosen.is_elastic and not elastic:
        return 'no body is elastic; give one a shape and flexibility = "elastic"'
    mounted = {mount.body for mount in mounts_at_work(gearbox)}
    for body in gearbox.bodies():
        if chosen.is_elastic and body.fixed and body.name in elastic and body.name not in mounted:
            return f"body {body.name} is elastic, but nothing holds it; add [mounts] on the ground"
    return ""


def elastic_names(gearbox: Gearbox) -> tuple[str, ...]:
    """Names of the bodies that are elastic in variants that have such."""
    return tuple(body.name for body in gearbox.bodies() if gearbox.case.bodies[body.family].flexibility != "none")


def mounts_at_work(gearbox: Gearbox) -> tuple[Bearing, ...]:
    """Mounts that hold the gearbox in the variant `flexible`: none where no fixed body is elastic.

    A fixed body that is rigid is the ground itself, and so needs no mount.
    """
    elastic = elastic_names(gearbox)
    bodies = {body.name: body for body in gearbox.bodies()}
    if not any(bodies[name].fixed for name in elastic):
        return ()
    return tuple(mount for mount in gearbox.mounts if mount.body in elastic or not bodies[mount.body].fixed)
