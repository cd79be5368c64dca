"""Operating deflection shapes, as the page shows them, against stored signals of the response and against modes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.report.findings.ranking import ranking_of
from exugear.report.web.stage import drawn_bodies, drawn_mode
from exugear.steady.evaluation.deflection_shapes import deflection_shapes
from exugear.steady.settings import SpeedRange, SteadySettings
from exugear.steady.steady_file import steady_response
from exugear.system.build import assemble
from exugear.system.modes import modes_of

CHOICE = Choice("bushing", "line_of_action", "assemblies")


@pytest.fixture(scope="module")
def assembly(grc, stiffness):
    return assemble(grc, CHOICE, stiffness)


@pytest.fixture(scope="module")
def data(grc, stiffness):
    """Speeds of the operating range, about the negative z axis as the load case has them."""
    settings = SteadySettings(SpeedRange.from_text("-11:-28:60"))
    return steady_response(grc, CHOICE, stiffness, settings=settings)


@pytest.fixture(scope="module")
def highest(data):
    """Resonances at the peak of the transmission error, so that both amplitudes belong to one speed."""
    return ranking_of(data, wanted="transmission_error").resonances[:4]


@pytest.fixture(scope="module")
def shapes(assembly, data, highest):
    return deflection_shapes(assembly, data, [(resonance.order, resonance.speed) for resonance in highest])


def test_spins_of_input_and_output_make_the_ranked_transmission_error(assembly, grc, highest, shapes):
    """The file keeps single precision: 1e-7 of the amplitude."""
    overall = grc.case.overall
    ratio = grc.train.rolling_speeds(overall.input, 1.0)[overall.output]
    assert len(highest) == 4
    for resonance, shape in zip(highest, shapes, strict=True):
        spins = shape[assembly.spin[overall.output]] - ratio * shape[assembly.spin[overall.input]]
        assert abs(grc.output_radius * spins) == pytest.approx(resonance.amplitudes["error"].amplitude, rel=1e-6)


def stored(data, resonance, signal):
    """Amplitude of the resonance's order in a signal as it runs in time: at a negative speed the angle decreases."""
    point = int(np.argmin(np.abs(data["speed"].to_numpy() - resonance.speed)))
    line = int(np.argmin(np.abs(data["order"].to_numpy() - resonance.order)))
    at = data[["amplitude", "phase"]].isel(point=point, line=line).sel(signal=signal)
    return float(at["amplitude"]) * np.exp(-1j * float(at["phase"]))


def shown_motions(assembly, shape):
    """Complex motions (6,) of bodies as the page has them, and their reference points."""
    bodies = drawn_bodies(assembly)
    drawn = drawn_mode(assembly, bodies, shape, with_fields=False)
    motions = {body.shape.name: motion for body, motion in zip(bodies, drawn.motions, strict=True)}
    references = {body.shape.name: body.shape.reference for body in bodies}
    return motions, references


def test_motions_on_the_page_make_the_stored_acceleration_of_a_bearing(assembly, grc, data, highest, shapes):
    """Minus the squared frequency times the displacement of the seat of a shaft that does not orbit."""
    support = next(bearing for bearing in assembly.supports if bearing.name == "hss_bc")
    overall = grc.case.overall
    ratio = grc.train.rolling_speeds(overall.input, 1.0)[overall.output]
    for resonance, shape in zip(highest, shapes, strict=True):
        motions, references = shown_motions(assembly, shape)
        error = grc.output_radius * (motions[overall.output][5] - ratio * motions[overall.input][5])
        scale = stored(data, resonance, "overall_dte") / error
        motion, reference = motions[support.body], references[support.body]
        arm = np.array([0.0, 0.0, support.position[2] - reference[2]])
        seat = motion[:3] + np.cross(motion[3:].real, arm) + 1j * np.cross(motion[3:].imag, arm)
        acceleration = -((2.0 * math.pi * resonance.frequency) ** 2) * scale * seat
        expected = [stored(data, resonance, f"seat_acceleration hss_bc {axis}") for axis in "xyz"]
        np.testing.assert_allclose(acceleration, expected, atol=1e-4 * np.linalg.norm(expected))


def test_each_planet_moves_in_its_own_phase(assembly, grc, data, highest, shapes):
    """Radial, tangential and axial acceleration by component around the carrier, as the response has them.

    The response has Coriolis terms, 2 times the carrier's speed over the frequency: below 1 %.
    """
    planets = [body for body in grc.bodies(CHOICE.inertia_set(grc)) if body.carrier]
    support = next(bearing for bearing in assembly.supports if bearing.body == planets[0].name)
    for resonance, shape in zip(highest, shapes, strict=True):
        square = (2.0 * math.pi * resonance.frequency) ** 2
        values = []
        for body in planets:
            x, y, z, tilt_x, tilt_y, _ = np.append(shape, 0.0)[list(assembly.coordinates[body.name])]
            height = support.position[2] - body.centre_of_mass_z
            x, y = x + height * tilt_y, y - height * tilt_x
            c, s = math.cos(body.orbit_angle), math.sin(body.orbit_angle)
            values.append([-square * part for part in (c * x + s * y, c * y - s * x, z)])
        angles = np.array([body.orbit_angle for body in planets])
        weights = {"mean": np.ones(3) / 3.0, "cosine": np.cos(angles) / 1.5, "sine": np.sin(angles) / 1.5}
        for axis, name in enumerate(("radial", "tangential", "z")):
            for wave, weight in weights.items():
                component = weight @ np.array(values)[:, axis]
                expected = stored(data, resonance, f"seat_acceleration {support.family} {wave} {name}")
                assert abs(component - expected) < 0.01 * np.abs(values).max()


def test_at_an_isolated_resonance_the_shape_is_the_mode(assembly, data, highest, shapes):
    """Neighbouring modes and other rotating speeds leave a few per cent of the modal assurance criterion."""
    modes = modes_of(assembly)
    mass = assembly.mass_matrix
    for resonance, shape in zip(highest, shapes, strict=True):
        near = modes.nearest(resonance.frequency)
        product = abs(modes.shapes[:, near] @ mass @ shape) ** 2
        assert product / (shape.conj() @ mass @ shape).real > 0.95


def test_a_state_that_is_not_the_stored_one_has_no_shape(assembly, data, highest):
    other = data.assign(amplitude=1.5 * data["amplitude"])
    assert deflection_shapes(assembly, other, [(highest[0].order, highest[0].speed)]) == [None]
