"""What a user meets in a notebook shows itself in one short line, and in HTML that no name can break."""

from __future__ import annotations

import base64
import dataclasses
import io
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from matplotlib import image

import fe_ste
from fe_ste.elasticity.hexmesh import sector_mesh
from fe_ste.reference.position import stress_of_position
from fe_ste.reference.table import NonlinearInput, NonlinearTable
from fe_ste.tools.drawing import inline_picture
from fe_ste.transmission_error.search import contact_state
from fe_ste.transmission_error.states import StateAxes, StateResults

HOSTILE = "<script>x</script>&"
LONGEST = 105
GEAR = fe_ste.Gear(name=HOSTILE, teeth=30, normal_module=3e-3, face_width=20e-3, held_diameter=50e-3)
PAIR = fe_ste.GearPair(name=HOSTILE, pinion=GEAR, gear=GEAR, centre_distance=90e-3)
MESH = fe_ste.MeshSettings(layers=4, flank=8, thickness=6, rim=5)
CONTACT = fe_ste.ContactSettings(slices=8)
INPUT = fe_ste.TableInput(
    pair=PAIR, torque=(50.0, 100.0), positions=3, misalignment=(-1e-4, 0.0, 1e-4), mesh=MESH, contact=CONTACT
)
COARSE = fe_ste.NonlinearSettings(
    teeth=3,
    mesh=fe_ste.ContactMesh(layers=3, contact_elements=3, growth=1.0, thickness=5, fillet=2, root=2, rim=4),
)
FINE_TOPOGRAPHY = fe_ste.FlankTopography(
    tuple(np.linspace(43e-3, 48e-3, 60)), tuple(np.linspace(-10e-3, 10e-3, 90)), ((1.23456e-6,) * 90,) * 60
)


@pytest.fixture(scope="module")
def shown() -> dict[str, object]:
    """Class name -> an object with arrays as large as a user's, or nearly."""
    compliance = fe_ste.pair_compliance(PAIR, MESH, CONTACT)
    state = contact_state(compliance, 100.0, 0.25)
    table = fe_ste.MeshTable.compute(INPUT)
    position = fe_ste.nonlinear_position(PAIR, 100.0, 0.0, COARSE)
    objects = [
        GEAR,
        PAIR,
        fe_ste.tooth_profile(GEAR),
        fe_ste.FlankModification(
            tip_relief=fe_ste.Relief(amount=12.5e-6, start_radius=46e-3), lead_crowning=8e-6, topography=FINE_TOPOGRAPHY
        ),
        FINE_TOPOGRAPHY,
        fe_ste.iso6336.mesh_stiffness(PAIR),
        INPUT,
        table,
        fe_ste.SteSurface.from_table(table.dataset),
        compliance,
        *compliance.flanks[:1],
        *compliance.regular[:1],
        StateAxes.checked(
            PAIR, np.linspace(10.0, 2000.0, 40).tolist(), misalignment=np.linspace(-1e-3, 1e-3, 9).tolist()
        ),
        StateResults.empty(compliance, (50, 6, 5, 5)),
        state,
        state.cells,
        state.solution,
        COARSE,
        position,
        position.model,
        position.model.bricks,
        position.model.first,
        position.equilibrium,
        position.sectors[0],
        stress_of_position(position),
        NonlinearInput(pair=PAIR, torque=100.0, settings=COARSE),
        NonlinearTable.compute(NonlinearInput(pair=PAIR, torque=100.0, positions=1, settings=COARSE)),
        sector_mesh(GEAR),
        sector_mesh(GEAR).section,
    ]
    return {type(value).__name__: value for value in objects}


@pytest.mark.validation
def test_each_shows_itself_in_one_short_line(shown):
    lines = {name: repr(value) for name, value in shown.items()}
    assert {name: line for name, line in lines.items() if len(line) > LONGEST or "\n" in line} == {}
    assert {name: line for name, line in lines.items() if not line.startswith(f"<{name}")} == {}


class Page(HTMLParser):
    """Elements and text of a piece of HTML."""

    def __init__(self):
        super().__init__()
        self.elements: set[str] = set()
        self.text = ""

    def handle_starttag(self, tag, attrs):
        self.elements.add(tag)

    def handle_data(self, data):
        self.text += data


def test_a_notebook_shows_small_tables_and_runs_no_name(shown):
    pieces = {name: value._repr_html_() for name, value in shown.items()}
    tables = {name: re.split("<img |<p>", piece)[0] for name, piece in pieces.items() if piece.startswith("<table>")}
    assert {"Gear", "GearPair", "FlankModification", "MeshTable", "NonlinearTable", "SteSurface"} < set(tables)
    for name, table in tables.items():
        page = Page()
        page.feed(table)
        assert page.elements == {"table", "caption", "tr", "th", "td"}, name
        assert len(table) < 2000, name


def test_a_mesh_table_shows_its_transmission_error_as_a_picture():
    """The picture is drawn: its pixels are not those of the same axes without curves."""
    coarse = fe_ste.MeshSettings(layers=3, flank=4, thickness=4)
    table = fe_ste.MeshTable.compute(fe_ste.TableInput(pair=PAIR, torque=(100.0,), positions=4, mesh=coarse))
    (encoded,) = re.findall('src="data:image/png;base64,([^"]+)"', table._repr_html_())
    pixels = image.imread(io.BytesIO(base64.b64decode(encoded)))
    axes = table.plot()
    for line in axes.lines:
        line.set_visible(False)
    (encoded,) = re.findall('base64,([^"]+)"', inline_picture(axes.figure, "MeshTable"))
    empty = image.imread(io.BytesIO(base64.b64decode(encoded)))
    assert pixels.shape == empty.shape
    assert (pixels != empty).any()


def test_a_hostile_name_is_shown_as_it_is(shown):
    page = Page()
    page.feed(shown["MeshTable"]._repr_html_())
    assert page.text.startswith(f"static transmission error of gear pair {HOSTILE}")


def test_units_stand_beside_the_numbers(shown):
    assert repr(shown["MeshTable"]).endswith(": 3 positions, 50 to 100 N m, 90 mm, -100 to 100 µrad>")
    assert "normal module 3 mm" in repr(GEAR)
    page = Page()
    page.feed(PAIR._repr_html_())
    assert "centre distance90 mm" in page.text


def test_an_unmodified_flank_says_so():
    assert repr(fe_ste.FlankModification()) == "<FlankModification: none>"
    assert repr(fe_ste.FlankModification(twist=-2e-6)) == "<FlankModification: twist -2 µm>"


def test_states_that_failed_are_no_hindrance(shown):
    table = shown["MeshTable"]
    failed = dataclasses.replace(table, dataset=table.dataset * np.nan)
    failed.dataset.attrs = table.dataset.attrs
    assert "<td>no value</td>" in failed._repr_html_()
