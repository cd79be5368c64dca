"""Transmission error of the GRC 750 kW pairs at the default mesh: refinement, smoothness, ISO 6336, slices.

`make validate` takes the high-speed pair, with its elements doubled too; `make validate-long` takes the other three,
and halves the elements of all four. The figures stand in docs/validation/te_accuracy.md.
"""

from __future__ import annotations

import dataclasses
import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import PairSpec
from fe_ste.contact.kinematics import ContactSettings
from fe_ste.elasticity.flank import FlankCompliance, flank_compliance
from fe_ste.elasticity.hexmesh import MeshSettings
from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.standards.iso6336 import mesh_stiffness
from fe_ste.transmission_error.compliance import PairCompliance
from fe_ste.transmission_error.transmission_error import static_transmission_error

pytestmark = pytest.mark.validation

CASE = Path(__file__).parents[3] / "cases" / "grc750" / "gearbox.toml"
TWICE_AS_LARGE = MeshSettings(layers=6, flank=10, thickness=6, fillet=4, root=2, rim=7)
PAIRS = ("high_speed", "sun_planet", "ring_planet", "intermediate")


@cache
def flank(gear: Gear, side: int, mesh: MeshSettings) -> FlankCompliance:
    return flank_compliance(gear, side, mesh)


@cache
def grc(name: str) -> PairSpec:
    return Gearbox.from_toml(CASE).pairs[name]


@cache
def curve_um(name: str, mesh: MeshSettings) -> tuple[float, ...]:
    pair = grc(name).pair
    flanks = (flank(pair.pinion, 1, mesh), flank(pair.gear, -1 if pair.gear.internal else 1, mesh))
    prepared = PairCompliance.from_flanks(pair, flanks)
    ste = static_transmission_error(prepared, grc(name).static_torque, 50).ste
    return tuple(1e6 * ste.values.ravel())


@pytest.mark.long
@pytest.mark.parametrize("name", PAIRS)
def test_halving_all_elements_changes_the_curve_little(name: str) -> None:
    default, fine = (np.array(curve_um(name, mesh)) for mesh in (MeshSettings(), MeshSettings().refined(2)))
    print(f"{name}: mean {default.mean():.3f} -> {fine.mean():.3f} um, p2p {np.ptp(default):.3f} -> {np.ptp(fine):.3f}")
    # Asked: mean within 0.5 %, peak-to-peak within the larger of 2 % of itself and 0.1 % of the mean.
    assert default.mean() == pytest.approx(fine.mean(), rel=5e-3)
    assert np.ptp(default) == pytest.approx(np.ptp(fine), abs=max(0.02 * np.ptp(fine), 1e-3 * fine.mean()))


def test_doubling_all_elements_changes_the_curve_by_four_times_what_halving_may() -> None:
    """The same claim at an eighth of the elements: with errors of second order, halving changes a quarter of this."""
    default, coarse = (np.array(curve_um("high_speed", mesh)) for mesh in (MeshSettings(), TWICE_AS_LARGE))
    print(f"mean {coarse.mean():.3f} -> {default.mean():.3f} um, p2p {np.ptp(coarse):.3f} -> {np.ptp(default):.3f}")
    # Found: 0.16 % of the mean, and of peak-to-peak 6 % of itself or 0.26 % of the mean.
    assert coarse.mean() == pytest.approx(default.mean(), rel=5e-3)
    assert np.ptp(coarse) == pytest.approx(np.ptp(default), abs=4e-3 * default.mean())


@pytest.mark.sample
@pytest.mark.parametrize("name", PAIRS)
def test_mesh_noise_is_below_one_percent_of_the_ripple(name: str) -> None:
    curve = np.array(curve_um(name, MeshSettings()))
    harmonics = np.abs(np.fft.rfft(curve)) / len(curve)
    noise = math.sqrt(2.0 * float(np.sum(harmonics[12:] ** 2)))
    print(f"{name}: noise {noise:.4f} um, {100 * noise / np.ptp(curve):.2f} % of {np.ptp(curve):.3f} um")
    assert noise < 0.01 * np.ptp(curve)


@pytest.mark.sample
@pytest.mark.parametrize("name", PAIRS)
def test_mean_stiffness_is_of_the_size_that_iso_6336_gives(name: str) -> None:
    spec = grc(name)
    force = spec.static_torque / spec.pair.pinion.base_radius
    stiffness = 1e6 * force * float(np.mean(1.0 / np.array(curve_um(name, MeshSettings()))))
    standard = mesh_stiffness(spec.pair, tangential_force=spec.static_torque / spec.pair.pinion.reference_radius)
    print(f"{name}: FE {stiffness / 1e9:.3f}, ISO 6336-1 B {standard.stiffness / 1e9:.3f} GN/m")
    # The standard is an average over measured solid gears with an empirical factor 0.8; what holds the gear decides
    # the rest. 0.75 to 1.35 is a gate against gross errors, no validation.
    assert 0.75 < stiffness / standard.stiffness < 1.35


def helical_pair(overlap: float) -> GearPair:
    """Two equal helical gears of a given overlap ratio, which their width sets."""
    helix, module = math.radians(20.0), 3e-3
    gear = Gear(
        name="gear",
        teeth=40,
        normal_module=module,
        helix_angle=helix,
        face_width=overlap * math.pi * module / math.sin(helix),
        held_diameter=80e-3,
    )
    mate = dataclasses.replace(gear, name="mate", helix_angle=-helix)
    return GearPair(name="slices", pinion=gear, gear=mate, centre_distance=40 * module / math.cos(helix))


def test_integer_overlap_has_nearly_no_ripple() -> None:
    # Slices of a helical pair share the mesh cycle evenly when the overlap is whole, so that their sum hardly changes.
    ripples = {}
    for overlap in (1.0, 1.5):
        pair = helical_pair(overlap)
        torque = 6e3 * pair.face_width
        mesh, contact = MeshSettings(layers=10, flank=14, thickness=8, rim=8), ContactSettings(slices=60)
        prepared = PairCompliance.from_flanks(pair, (flank(pair.pinion, 1, mesh), flank(pair.gear, 1, mesh)), contact)
        ste = static_transmission_error(prepared, torque, 20).ste.values
        ripples[overlap] = float(np.ptp(ste) / ste.mean())
    print({overlap: f"{100 * ripple:.2f} %" for overlap, ripple in ripples.items()})
    assert ripples[1.0] < 0.35 * ripples[1.5]
