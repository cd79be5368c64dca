"""The web page carries all it needs and the numbers it is given."""

import base64
import json
import re
from html.parser import HTMLParser

import numpy as np
import pytest

from exugear.pictures.motions import displacement_of, mode_scene
from exugear.pictures.shapes import BodyShape
from exugear.pictures.surfaces import tube_surface
from exugear.pictures.viewer import write_mode_page


def bodies():
    shaft = tube_surface(0.1, 0.0, 0.5)
    return (
        BodyShape("housing", "housing", tube_surface(0.4, 0.0, 0.1, bore=0.3), np.zeros(3), fixed=True),
        BodyShape("shaft", "shaft", shaft, np.array([0.0, 0.0, 0.2])),
    )


def scenes(names=("812 Hz\nshaft turns", "3215 Hz </script><b>&")):
    return [mode_scene(bodies(), {"shaft": [0, 1e-3, 0, 0, 0, n + 1.0]}, title=name) for n, name in enumerate(names)]


class Page(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.elements, self.data, self.inside = [], "", False
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.elements.append((tag, dict(attributes)))
        self.inside = tag == "script" and dict(attributes).get("id") == "data"

    def handle_endtag(self, tag):
        self.inside = False

    def handle_data(self, text):
        if self.inside:
            self.data += text


@pytest.fixture
def page(tmp_path):
    path = write_mode_page(scenes(), tmp_path / "new" / "modes.html", heading="GRC <750> & more", first=1)
    text = path.read_text(encoding="utf-8")
    return text, Page(text)


def test_page_needs_nothing_from_elsewhere(page):
    text, parsed = page
    assert not re.search(r"https?:|src=|@import|url\(", text)
    assert not [tag for tag, _ in parsed.elements if tag in ("link", "img", "iframe")]


def test_names_cannot_break_the_page(page):
    text, parsed = page
    assert text.count("<script") == 2 == text.count("</script>")
    assert "GRC &lt;750&gt; &amp; more" in text
    assert [mode["title"] for mode in json.loads(parsed.data)["modes"]] == [
        "812 Hz\nshaft turns",
        "3215 Hz </script><b>&",
    ]


def test_bodies_come_out_as_they_went_in(page):
    data = json.loads(page[1].data)
    assert [body["name"] for body in data["bodies"]] == ["housing", "shaft"]
    assert [body["fixed"] for body in data["bodies"]] == [True, False]
    for body, shape in zip(data["bodies"], bodies(), strict=True):
        points = np.frombuffer(base64.b64decode(body["points"]), dtype="<f4").reshape(-1, 3)
        triangles = np.frombuffer(base64.b64decode(body["triangles"]), dtype="<u4").reshape(-1, 3)
        np.testing.assert_allclose(points, shape.surface.points, atol=1e-7)
        np.testing.assert_array_equal(triangles, shape.surface.triangles)


def test_motions_and_largest_displacement_are_those_of_the_scene(page):
    data = json.loads(page[1].data)
    assert data["first"] == 1
    for mode, scene in zip(data["modes"], scenes(), strict=True):
        np.testing.assert_allclose(mode["motions"], scene.motions, rtol=1e-5)
        largest = np.linalg.norm(displacement_of(scene.bodies[1], scene.motions[1]), axis=1).max()
        assert mode["largest"] == pytest.approx(largest)


def test_shaders_name_every_uniform_that_is_set(page):
    text, _ = page
    declared = set(re.findall(r"uniform \w+ ([\w, \[\]]+);", text))
    names = {name.split("[")[0].strip() for group in declared for name in group.split(",")}
    used = set(re.findall(r"place\.(\w+)", text)) - {"xy", "z"}
    assert used == names


def test_modes_of_different_bodies_are_refused():
    other = mode_scene(bodies()[:1], {"housing": np.ones(6)})
    with pytest.raises(ValueError, match="same bodies"):
        write_mode_page([*scenes(), other], "unused.html")
    with pytest.raises(ValueError, match="no mode"):
        write_mode_page([], "unused.html")
