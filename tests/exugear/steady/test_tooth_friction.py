"""Friction of the teeth in the steady-state response: its forces by vectors, its power by the loss factor."""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.steady.mean_system.planet_sets import SteadyError
from exugear.steady.mean_system.tooth_friction import tooth_friction
from exugear.steady.settings import SpeedRange, SteadySettings
from exugear.steady.steady_file import steady_response
from exugear.steady.steady_response import harmonic_balance_model
from exugear.system.build import assemble
from exugear.system.tooth_mesh.element import MeshCurve
from exugear.system.tooth_mesh.placement import MeshGeometry
from fe_ste.geometry.gears import GearPair
from fe_ste.transmission_error.sliding import friction_over_cycle, table_loss_factor

from ...fe_ste.cases.line_loads import state_of
from ..cases.spur import SPUR_CASE

COEFFICIENT = 0.05
POSITIONS = 50


def line_loads(pair: GearPair, lines: int = 1) -> xr.Dataset:
    """Equal load on all tooth pairs in contact."""
    return state_of(pair, POSITIONS, lines)


def curves_with_friction(gearbox: Gearbox, stiffness: dict, lines: int = 9) -> dict[str, MeshCurve]:
    loads = {mesh.pair.name: line_loads(mesh.pair, lines) for mesh in gearbox.meshes}
    pairs = {mesh.pair.name: mesh.pair for mesh in gearbox.meshes}
    return {
        name: MeshCurve(values, values, 1e5, friction=friction_over_cycle(pairs[name], loads[name]))
        for name, values in stiffness.items()
    }


def with_friction(gearbox: Gearbox, coefficient: float = COEFFICIENT) -> Gearbox:
    return gearbox.varied({"damping.tooth_friction": coefficient})


def test_the_mean_moment_of_friction_is_that_of_the_loss_factor(grc: Gearbox) -> None:
    """P = mu H_V P_mesh by the same line loads: the moment acts at the sliding speed of the gears."""
    for mesh in grc.meshes:
        pair = mesh.pair
        state = line_loads(pair, 9)
        ratio = abs(1.0 + pair.gear.outward * pair.pinion.teeth / pair.gear.teeth)
        expected = table_loss_factor(pair, state) * pair.pinion.base_radius / ratio
        assert friction_over_cycle(pair, state)[1].mean() == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("load", [100.0, -100.0], ids=["flank +1", "flank -1"])
@pytest.mark.parametrize("speed", [150.0, -150.0])
def test_forces_are_those_of_vectors_at_the_contact_points(load: float, speed: float) -> None:
    """Each flank is pushed against its sliding speed, v = (omega_1 - omega_2) x r, at the point where it touches."""
    gearbox = Gearbox.from_dict(tomllib.loads(SPUR_CASE)).varied({"static_load.torques_N_m.shaft_1": load})
    gearbox = with_friction(gearbox)
    curves = curves_with_friction(gearbox, {"spur": 3e8 * np.ones(POSITIONS)}, 1)
    assembly = assemble(gearbox, Choice("bushing"), curves)
    model = harmonic_balance_model(assembly, np.sort(np.array([0.9, 1.1]) * speed), 20, 3)
    ports = model.ports_at(speed)
    forces = tooth_friction(model.waves, model.lines, ports, speed, 20)
    angles = 2.0 * np.pi * np.arange(POSITIONS) / POSITIONS
    found = model.lines.values(forces, angles[:, None])

    element = assembly.elements[0]
    mesh, flank = element.mesh, element.flank
    geometry = MeshGeometry.of(mesh)
    normal = geometry.plane_of_action(flank)
    turns = speed * (1.0 + 20.0 / 30.0)  # gear 1 relative to gear 2
    state = line_loads(mesh.pair)
    force = abs(load) / mesh.pair.pinion.base_radius
    sense = math.copysign(1.0, speed) * flank
    positions = ports.positions[0] + ports.static[0, -1] + sense * angles / (2.0 * np.pi)
    by_vectors = np.zeros((POSITIONS, 12))
    pitch_point = geometry.pinion_radius * geometry.radial
    axes = np.zeros(3), np.array([0.075, 0.0, 0.0])
    for tooth, place in enumerate(state["tooth"].to_numpy()):
        for n, pmc in enumerate(state["pmc"].to_numpy()):
            share = float(state["line_load"][n, tooth, 0]) / float(state["line_load"][n].sum())
            point = pitch_point + (place + pmc) * mesh.pair.transverse_base_pitch * normal
            velocity = np.cross([0.0, 0.0, turns], point - pitch_point)
            size = np.linalg.norm(velocity)
            on_first = -COEFFICIENT * force * share * velocity / size if size > 1e-12 else np.zeros(3)
            for body, sign in ((0, 1.0), (1, -1.0)):
                moment = np.cross(point - axes[body], sign * on_first)
                by_vectors[n, 6 * body : 6 * body + 6] += [*(sign * on_first), *moment]
    # Both as functions of the mesh position, with the harmonics of the response.
    spectrum = np.fft.rfft(by_vectors, axis=0)[:21] / POSITIONS
    phases = np.exp(2j * np.pi * positions[:, None] * np.arange(21))
    phases[:, 1:] *= 2.0
    expected = (phases @ spectrum).real
    index = assembly.meshes.coordinates[0][:12]
    size = np.abs(expected).max(axis=0)
    for column in (0, 1, 5, 6, 7, 11):
        # A line at the pitch point has no sense of sliding; the table's resolution reverses it over one position.
        assert np.abs(found[:, index[column]] - expected[:, column]).max() < 1e-6 * size[column]


def response(gearbox: Gearbox, variant: str, curves: dict, method: str = "linear", speeds: str = "15:22:3"):
    settings = SteadySettings(SpeedRange.from_text(speeds), method, at_resonances=False)
    return steady_response(gearbox, Choice(variant), curves, settings=settings)


@pytest.mark.parametrize("speeds", ["15:22:3", "-22:-15:3"])
def test_the_drive_overcomes_the_losses_of_all_meshes(grc: Gearbox, stiffness: dict, speeds: str) -> None:
    """Power of friction = sum of mu H_V P over the meshes, in either sense of rotation."""
    curves = curves_with_friction(grc, stiffness)
    usual = response(grc, "rigid", curves, speeds=speeds)
    found = response(with_friction(grc), "rigid", curves, speeds=speeds)
    locked = next(iter(grc.locked))
    forces = grc.train.static_mesh_forces()
    for n, speed in enumerate(found["speed"].to_numpy()):
        turns = grc.train.rolling_speeds(grc.case.overall.input, float(speed))
        lost = 0.0
        for mesh in grc.meshes:
            relative = abs(turns[mesh.pinion] - turns.get(mesh.frame, 0.0))
            power = abs(forces[mesh.name]) * relative * mesh.pair.pinion.base_radius
            lost += COEFFICIENT * table_loss_factor(mesh.pair, line_loads(mesh.pair, 9)) * power
        more = float(found["drive_torque"][n] - usual["drive_torque"][n])
        assert more * turns[locked] == pytest.approx(lost, rel=1e-5)


@pytest.mark.parametrize("method", ["linear", "parametric"])
def test_the_power_of_damping_is_that_of_meshes_and_friction(grc: Gearbox, stiffness: dict, method: str) -> None:
    curves = curves_with_friction(grc, stiffness)
    usual = response(grc, "bushing", curves, method)
    found = response(with_friction(grc), "bushing", curves, method)
    assert np.abs(found["energy_error"].to_numpy()).max() < 1e-8
    forces = [name for name in found["signal"].to_numpy() if str(name).startswith("support_force")]
    changed = np.abs(found["amplitude"].sel(signal=forces) - usual["amplitude"].sel(signal=forces))
    assert float(changed.max()) > 1.0


def test_the_response_to_friction_is_proportional_to_the_coefficient(grc: Gearbox, stiffness: dict) -> None:
    curves = curves_with_friction(grc, stiffness)
    motions = []
    for coefficient in (0.0, 0.03, 0.06):
        data = response(with_friction(grc, coefficient), "bushing", curves)
        motions.append(data["amplitude"].to_numpy() * np.exp(1j * data["phase"].to_numpy()))
    size = np.abs(motions[0]).max()
    assert np.abs(motions[2] - 2.0 * motions[1] + motions[0]).max() < 1e-5 * size


@pytest.mark.validation
def test_methods_agree_on_friction_and_small_variations_of_stiffness() -> None:
    gearbox = with_friction(Gearbox.from_dict(tomllib.loads(SPUR_CASE)), 1e-3)
    cycle = 2.0 * np.pi * np.arange(POSITIONS) / POSITIONS
    curves = curves_with_friction(gearbox, {"spur": 3e8 * (1.0 + 1e-3 * np.cos(cycle))}, 1)
    curves = {name: replace(curve, tangent=1.15 * curve.stiffness) for name, curve in curves.items()}
    found = {
        method: response(gearbox, "bushing", curves, method, "800:1200:3")
        for method in ("linear", "parametric", "nonlinear")
    }
    for signal in ("overall_dte", "support_force bearing_1 x"):
        own, *others = (data["amplitude"].sel(signal=signal, line=["spur", "2 x spur"]) for data in found.values())
        for other in others:
            # Differences are of second order in the variation of 1e-3, times the amplification.
            assert np.abs(other.to_numpy() / own.to_numpy() - 1.0).max() < 5e-5


def test_friction_needs_line_loads_and_a_plausible_coefficient(grc: Gearbox, stiffness: dict) -> None:
    with pytest.raises(SteadyError, match=r"damping.tooth_friction = 0.05: pair .* has no line loads"):
        response(with_friction(grc), "rigid", stiffness)
    with pytest.raises(GearboxFileError, match="damping.tooth_friction = 0.9: must lie between 0 and 0.5"):
        with_friction(grc, 0.9)
