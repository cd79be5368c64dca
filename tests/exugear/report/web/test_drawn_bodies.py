"""Bodies as a page draws them: planets from one shape, elastic bodies as their modes say."""

from __future__ import annotations

import base64
import re
import tomllib
import zlib

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.report.pictures.shapes import bodies_of, displacement_of, vibration_of
from exugear.report.web.document import ArrayStore
from exugear.report.web.mode_page import write_mode_page
from exugear.report.web.stage import drawn_bodies, drawn_mode, stage_data, turn_between
from exugear.system.modes import modes_of

from ...cases import gear_trains
from ...cases.assembled import assembled
from ...cases.spur import SPUR_CASE

SHAFT = """
[bodies.shaft_1.shape]
start_z_mm = -20.0
sections = [{ length_mm = 80.0, outer_diameter_mm = 25.0 }]
"""


@pytest.fixture(scope="module")
def elastic():
    content = tomllib.loads(SPUR_CASE + SHAFT)
    content["bodies"]["shaft_1"]["flexibility"] = "nonrotating"
    content["bearings"]["bearing_1"]["z_mm"] = 40.0
    content["elasticity"] = {"band_Hz": 12e3, "limit_Hz": 30e3}
    return assembled(Gearbox.from_dict(content), Choice("flexible"), {"spur": 3e8})


def test_a_rotor_of_stated_inertias_has_an_empty_stage():
    content = gear_trains.rotor()
    for key in ("shape", "flexibility"):
        del content["bodies"]["motor"][key]
    assembly = assembled(Gearbox.from_dict(content), Choice("bushing"), {})
    stage = stage_data(assembly, np.eye(assembly.size)[:, :2], {}, ArrayStore(), ())
    assert stage["bodies"] == []
    assert stage["diagonal"] > 0.0


def test_planets_are_drawn_from_one_shape():
    shapes = {body.name: body for body in bodies_of(Gearbox.from_toml("cases/grc750/gearbox.toml"))}
    first, other = shapes["planet_1"], shapes["planet_2"]
    angle = turn_between(first, other)
    assert angle is not None
    cosine, sine = np.cos(angle), np.sin(angle)
    turned = (first.surface.points - first.reference) @ np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]])
    np.testing.assert_allclose(turned + other.reference, other.surface.points, atol=1e-6)
    assert turn_between(shapes["ims"], shapes["hss"]) is None


@pytest.mark.parametrize("coordinate", range(5))
def test_an_elastic_body_that_moves_as_a_whole_is_drawn_as_a_rigid_one(elastic, coordinate):
    bodies = drawn_bodies(elastic)
    place = next(n for n, body in enumerate(bodies) if body.field is not None)
    reduced = elastic.elastic_bodies["shaft_1"].reduced
    centre = reduced.rigid_inertia.centre
    shape = np.zeros(elastic.size)
    shape[elastic.elastic_slices["shaft_1"]] = reduced.rigid_motions(centre)[:, coordinate]
    drawn = drawn_mode(elastic, bodies, shape, with_fields=True)
    points = bodies[place].shape.surface.points
    motion = np.eye(6)[coordinate]
    rigid = motion[:3] + np.cross(motion[3:], points - centre)
    rigid /= np.linalg.norm(rigid, axis=1).max()
    field = drawn.fields[place] / np.linalg.norm(drawn.fields[place], axis=1).max()
    np.testing.assert_allclose(field, rigid, atol=2e-3)  # single precision, and seats that average over their faces


def test_gears_ride_on_the_seats_of_their_elastic_shaft(elastic):
    modes = modes_of(elastic)
    bodies = drawn_bodies(elastic)
    mode = int(np.argmax(modes.frequency > 0.0))
    drawn = drawn_mode(elastic, bodies, modes.shapes[:, mode], with_fields=True)
    gear = next(n for n, body in enumerate(bodies) if body.owner == "shaft_1" and body.field is None)
    shaft = next(n for n, body in enumerate(bodies) if body.field is not None)
    # Points of the shaft next to the middle plane of the gear move as the gear does.
    points = bodies[shaft].shape.surface.points
    apart = np.abs(points[:, 2] - bodies[gear].shape.reference[2])
    near = apart < apart.min() + 1e-9
    motion = drawn.motions[gear]
    rigid = motion[:3] + np.cross(motion[3:], points[near] - bodies[gear].shape.reference)
    assert np.abs(drawn.fields[shaft][near] - rigid).max() < 0.03  # of the largest displacement


def test_the_largest_displacement_drawn_is_one(elastic):
    bodies, modes = drawn_bodies(elastic), modes_of(elastic)
    drawn = drawn_mode(elastic, bodies, modes.shapes[:, 3], with_fields=True)
    sizes = [np.linalg.norm(field, axis=1).max() for field in drawn.fields.values()]
    sizes += [
        np.linalg.norm(displacement_of(body.shape, drawn.motions[n].real), axis=1).max()
        for n, body in enumerate(bodies)
    ]
    assert max(sizes) == pytest.approx(1.0)


def test_no_point_is_displaced_further_than_at_the_beginning_of_a_vibration(elastic):
    """Of complex amplitudes, in which points move along ellipses and not in phase."""
    bodies = drawn_bodies(elastic)
    shapes = modes_of(elastic).shapes
    drawn = drawn_mode(elastic, bodies, np.exp(1j) * (shapes[:, 3] + 0.7j * shapes[:, 5]), with_fields=True)
    vibrations = [drawn.fields.get(n, vibration_of(body.shape, drawn.motions[n])) for n, body in enumerate(bodies)]
    largest = [
        max(np.linalg.norm((np.exp(1j * angle) * vibration).real, axis=1).max() for vibration in vibrations)
        for angle in np.linspace(0.0, 2.0 * np.pi, 100)
    ]
    assert largest[0] == pytest.approx(1.0)
    assert max(largest) < 1.0 + 1e-9
    assert min(largest) > 0.1  # a standing wave would pass its rest position


def test_fields_are_kept_to_a_127th_of_the_largest_displacement(elastic):
    modes, store = modes_of(elastic), ArrayStore()
    data = stage_data(elastic, modes.shapes, {}, store, {3})
    bodies = drawn_bodies(elastic)
    (place, reference), *_ = data["deformed"]["3"].items()
    (packed,) = re.findall(rf'id="{reference["blob"]}">([^<]*)<', store.elements())
    kept = np.frombuffer(zlib.decompress(base64.b64decode(packed)), dtype="i1").reshape(reference["shape"]) / 127.0
    drawn = drawn_mode(elastic, bodies, modes.shapes[:, 3], with_fields=True)
    np.testing.assert_allclose(kept[0].T, drawn.fields[int(place)].real, atol=0.51 / 127.0)
    assert not kept[1].any()  # a mode shape has no imaginary part


def test_a_page_without_modes_is_refused(elastic):
    with pytest.raises(ValueError, match="0 modes"):
        write_mode_page(elastic, np.zeros((elastic.size, 0)), [], "unused.html")
