"""Contact ends where flanks end: at undercut, at chamfers, at relieved roots, and at the ends of the common face."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from fe_ste.elasticity.hexmesh import MeshSettings
from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.transmission_error.transmission_error import static_transmission_error

MESH = MeshSettings(layers=4)
POSITIONS = 12


def wheel(teeth: int, **changes: object) -> Gear:
    given = {"name": f"z{teeth}", "teeth": teeth, "held_diameter": 2e-3 * teeth, "normal_module": 4e-3}
    return Gear(**{**given, "face_width": 20e-3, "tooth_thinning": 5e-5, **changes})  # type: ignore[arg-type]


def pair_of(pinion: Gear, gear: Gear) -> GearPair:
    return GearPair(name="pair", pinion=pinion, gear=gear, centre_distance=2e-3 * (pinion.teeth + gear.teeth))


def transmission_error(pair: GearPair, torque: float = 100.0):
    data = static_transmission_error(pair, torque=(torque,), positions=POSITIONS, mesh=MESH)
    assert bool(data["converged"].all())
    return data


def check_sharing(pair: GearPair) -> None:
    """Two pairs carry over a part of the cycle that is the contact ratio less one.

    Positions are 1/12 apart, and deflection brings teeth into contact earlier and later: by 0.06 of a pitch each under
    this torque, as the gap of teeth outside the path of contact grows with the square of the distance.
    """
    data = transmission_error(pair, 10.0)
    carrying = (data["load_share"] > 1e-6).sum("tooth").to_numpy().ravel()
    doubled = np.count_nonzero(carrying > 1) / POSITIONS
    assert -1 / 12 <= doubled - (pair.transverse_contact_ratio - 1.0) <= 0.2, (doubled, pair.transverse_contact_ratio)


@pytest.mark.sample
@pytest.mark.parametrize("teeth", [12, 17])
def test_every_position_of_an_undercut_pinion_is_solved(teeth: int) -> None:
    pair = pair_of(wheel(teeth), wheel(60))
    assert pair.pinion.is_undercut
    check_sharing(pair)


@pytest.mark.validation
def test_a_chamfered_tip_is_as_a_tip_of_its_form_diameter() -> None:
    """What stands above the flank carries nothing: the tooth is only a little stiffer for it."""
    gear = wheel(60)
    sharp = wheel(25, tip_diameter=106.5e-3)
    chamfered = wheel(25, tip_form_diameter=106.5e-3)
    whole = wheel(25)
    errors = [
        transmission_error(pair_of(pinion, gear))["ste"].to_numpy().ravel() for pinion in (sharp, chamfered, whole)
    ]
    assert errors[1] == pytest.approx(errors[0], rel=0.02)
    assert np.abs(errors[2] / errors[0] - 1.0).max() > 0.05


def test_a_relieved_root_takes_no_load() -> None:
    pinion, gear = wheel(25), wheel(60)
    pair = pair_of(pinion, gear)
    start = pair.path_start + 0.25 * pair.transverse_base_pitch
    relieved = dataclasses.replace(pinion, root_form_diameter=2.0 * math.hypot(pinion.base_radius, start))
    shortened = pair_of(relieved, gear)
    assert shortened.transverse_contact_ratio == pytest.approx(pair.transverse_contact_ratio - 0.25)
    check_sharing(pair)
    check_sharing(shortened)


def test_a_narrow_common_face_yields_more() -> None:
    """Teeth beside a load help to carry it: half the face has more than half of the stiffness."""
    pair = pair_of(wheel(25), wheel(60))
    half = dataclasses.replace(pair, common_face_width=10e-3)
    whole, narrow = (transmission_error(each)["ste"].to_numpy() for each in (pair, half))
    assert np.all((narrow / whole > 1.2) & (narrow / whole < 2.0))
