"""Errors that return once a revolution: pitch of single teeth and run-out of a wheel, position of a planet's pin.

Each wheel's error in a mesh is a function of its own angle seen from the mesh's frame, a length on the transverse line
of action by which its loaded flank stands back. A tooth's pitch deviation acts with the part of the contact lines that
this tooth has, which is the first order of what a table of the same teeth would show; run-out acts along the line of
action. Both repeat with the wheel, not with the mesh, and so give sidebands at its shaft's order.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import Mesh, WheelDeviation
from exugear.system.tooth_mesh.placement import MeshGeometry, ToothContact
from fe_ste.geometry.gears import GearPair
from fe_ste.tools.arrays import Floats, Integers

SAMPLES_PER_TOOTH = 32
"""Samples of an error over a pitch: ten harmonics of the mesh, to a per cent."""
_PLANES = 101
"""Planes across the face in which contact is looked for."""


def contact_line_shares(pair: GearPair, pmc: Floats) -> tuple[Integers, Floats]:
    """Part of all contact lines that each tooth pair has.

    Parameters
    ----------
    pmc : (n,) positions in the mesh cycle, 0 to 1

    Returns
    -------
    teeth : (t,) tooth pairs, counted ahead of the one that touches at the pitch point at pmc 0
    shares : (n, t) adds up to one in each position

    Examples
    --------
    >>> from fe_ste.geometry.gears import Gear
    >>> gear = Gear(name="gear", teeth=30, normal_module=3e-3, face_width=20e-3, held_diameter=50e-3)
    >>> pair = GearPair(name="pair", pinion=gear, gear=gear, centre_distance=90e-3)
    >>> teeth, shares = contact_line_shares(pair, np.array([0.0, 0.5]))
    >>> teeth.tolist(), shares.tolist()
    ([-1, 0], [[0.0, 1.0], [0.5, 0.5]])
    """
    reach = math.ceil(pair.total_contact_ratio / 2.0) + 1
    teeth = np.arange(-reach, reach + 1)
    planes = (np.arange(_PLANES) + 0.5) / _PLANES - 0.5
    across = math.tan(pair.pinion.base_helix_angle) * pair.face_width * planes
    at = pair.path_pitch_point + across + pair.transverse_base_pitch * (pmc[:, None] + teeth)[..., None]
    length = np.mean((at > pair.path_start) & (at < pair.path_end), axis=2)
    carried = length.any(axis=0)
    return teeth[carried], length[:, carried] / length.sum(axis=1, keepdims=True)


def wheel_errors(
    gearbox: Gearbox, mesh: Mesh, flank: int, phase: float, orientation: Mapping[tuple[str, str], float]
) -> tuple[Floats, Floats]:
    """Errors of both wheels of a mesh over a revolution each, (n,) samples from angle zero, m; empty for none.

    Parameters
    ----------
    flank : +1 or -1, the loaded flank of gear 1
    phase : PMC at zero angles
    orientation : mapping of (body, gear) to the polar angle of a tooth's middle at zero body angle
    """
    return (
        _wheel_error(gearbox, (mesh.pinion, mesh.pair.pinion.name), ToothContact(mesh, flank, 1), orientation, phase),
        _wheel_error(gearbox, (mesh.gear, mesh.pair.gear.name), ToothContact(mesh, flank, 2), orientation, phase),
    )


def _wheel_error(
    gearbox: Gearbox,
    wheel: tuple[str, str],
    contact: ToothContact,
    orientation: Mapping[tuple[str, str], float],
    phase: float,
) -> Floats:
    """Error of one wheel over its revolution; empty for none."""
    deviation = gearbox.deviations.get(wheel)
    if deviation is None:
        return np.zeros(0)
    error = _run_out_error(deviation, contact)
    if deviation.pitch.size:
        error = error + _pitch_error(deviation, contact, orientation[wheel], phase)
    return error


def _angles(deviation: WheelDeviation) -> Floats:
    count = deviation.teeth * SAMPLES_PER_TOOTH
    return 2.0 * np.pi * np.arange(count) / count


def _pitch_error(deviation: WheelDeviation, contact: ToothContact, orientation: float, phase: float) -> Floats:
    """Sum of the teeth's deviations, each by its part of the contact lines."""
    teeth = deviation.teeth
    tooth_0 = orientation % (2.0 * math.pi / teeth)  # the first at a positive polar angle
    stated = math.remainder(phase - contact.pmc(orientation), 1.0)  # where the file gives the phase
    error = np.zeros(teeth * SAMPLES_PER_TOOTH)
    for tooth, gap in enumerate(deviation.pitch):
        if gap == 0.0:
            continue
        # Unwrapped position in the mesh cycle of this tooth, zero where it stands at the pitch point.
        pmc = contact.pmc(tooth_0 + 2.0 * math.pi * tooth / teeth + _angles(deviation)) + stated
        pmc = pmc - teeth * np.round(pmc / teeth)
        pairs, shares = contact_line_shares(contact.mesh.pair, pmc % 1.0)
        ahead = np.floor(pmc).astype(np.int64) - pairs[0]
        inside = (ahead >= 0) & (ahead < len(pairs))
        error[inside] += gap * shares[inside, ahead[inside]]
    return error


def _run_out_error(deviation: WheelDeviation, contact: ToothContact) -> Floats:
    """Way of the teeth's axis along the line of action, away from the other wheel."""
    x, y, _ = MeshGeometry.of(contact.mesh).plane_of_action(contact.flank)
    away = -1.0 if contact.number == 1 else 1.0
    angle = deviation.eccentricity_angle + _angles(deviation)
    return np.asarray(away * deviation.eccentricity * (x * np.cos(angle) + y * np.sin(angle)))
