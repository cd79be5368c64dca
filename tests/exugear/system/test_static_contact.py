"""Contact at the static misalignment, against whole tables, mirrors, further steps and contact on its own."""

from __future__ import annotations

import tomllib
from dataclasses import astuple, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import exugear.system.operating_points
from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.templates.kinds import template
from exugear.system.build import assemble
from exugear.system.statics import StaticState, static_state
from exugear.system.system import input_hash
from exugear.system.tooth_mesh.contact_state import StaticContacts, static_contacts
from exugear.system.tooth_mesh.element import MeshCurve
from fe_ste.contact.kinematics import ContactError
from fe_ste.tools.arrays import Floats
from fe_ste.tools.stores import FOLDER_VARIABLE
from fe_ste.transmission_error.mean_contact import forget_contacts, mean_contact
from fe_ste.transmission_error.table import prepared_compliance
from fe_ste.transmission_error.transmission_error import static_transmission_error

from ..cases.coarse_contact import coarse_curves, coarse_input, coarse_surfaces

GRC = Path(__file__).parents[3] / "cases" / "grc750" / "gearbox.toml"
RELIEF = {"tip_relief_um": 12.0, "tip_relief_length_mm": 4.0, "lead_crowning_um": 4.0}


@cache
def gearbox_of(kind: str) -> Gearbox:
    if kind == "grc":
        return Gearbox.from_toml(GRC)
    if kind == "relieved":
        changes = {f"gears.{name}.modification": RELIEF for name in ("pinion_2", "wheel_2")}
        return gearbox_of("parallel").varied(changes)
    return Gearbox.from_dict(tomllib.loads(template(kind)))


@cache
def curves_of(kind: str) -> dict[str, MeshCurve]:
    return coarse_curves(gearbox_of(kind))


@cache
def solved(kind: str) -> StaticState:
    return static_state(assemble(gearbox_of(kind), Choice("bushing", "line_of_action"), curves_of(kind)))


def radial_loads(state: StaticState) -> Floats:
    loads = state.assembly.bearing_loads(state.q, np.zeros_like(state.q))
    return np.asarray(np.hypot(loads[:, 0], loads[:, 1]))


def around(state: StaticState) -> dict[str, tuple[float, float]]:
    """Misalignments by pair in the axes of its table, rad: those of all its meshes, and a fifth of what teeth yield."""
    found: dict[str, tuple[float, float]] = {}
    for element, misalignment in zip(state.assembly.elements, state.misalignment, strict=True):
        pair, own = element.mesh.pair, element.flank * float(misalignment)
        more = 0.2 * element.contact.deflection / pair.face_width
        low, high = found.get(pair.name, (own, own))
        found[pair.name] = min(low, own - more), max(high, own + more)
    return found


@pytest.mark.validation
@pytest.mark.parametrize(
    "kind", ["grc", *(pytest.param(kind, marks=pytest.mark.long) for kind in ("relieved", "pair", "wind"))]
)
def test_static_state_is_that_of_the_law_of_whole_tables(kind: str) -> None:
    """External, internal, relieved and crowned pairs; the grid has the same finite elements and positions."""
    state = solved(kind)
    gearbox = gearbox_of(kind)
    tables = static_state(assemble(gearbox, Choice("bushing", "table"), coarse_surfaces(gearbox, around(state))))
    # Or 1 % of what teeth yield, over the face.
    for element, one, other in zip(state.assembly.elements, state.misalignment, tables.misalignment, strict=True):
        yielding = element.contact.deflection / element.mesh.pair.face_width
        assert one == pytest.approx(other, rel=0.015, abs=0.01 * yielding)
    loads = radial_loads(tables)
    assert radial_loads(state) == pytest.approx(loads, abs=2e-3 * loads.max())
    assert np.abs(radial_loads(state) / loads - 1.0)[loads > 0.1 * loads.max()].max() < 5e-3


@pytest.mark.validation
def test_a_third_step_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    for kind in ("grc", "relieved"):
        before = solved(kind).misalignment
        monkeypatch.setattr(exugear.system.operating_points, "CONTACT_STEPS", 3)
        curves = curves_of(kind)
        after = static_state(assemble(gearbox_of(kind), Choice("bushing", "line_of_action"), curves)).misalignment
        assert after == pytest.approx(before, rel=0.01, abs=1e-3 * np.abs(before).max())
        monkeypatch.undo()


@pytest.mark.validation
def test_the_moment_of_each_mesh_is_that_of_its_contact_alone() -> None:
    """Force and moment at the static state, against contact solved at the very force and misalignment of the mesh."""
    state = solved("grc")
    prepared = {}
    for element, force, misalignment in zip(state.assembly.elements, state.mesh_force, state.misalignment, strict=True):
        wanted, contact = coarse_input(gearbox_of("grc"), element.mesh.pair.name), element.contact
        compliance = prepared.setdefault(wanted.pair.name, prepared_compliance(wanted))
        alone = static_transmission_error(
            compliance,
            float(force) * wanted.pair.pinion.base_radius,
            wanted.positions,
            misalignment=float(element.flank * misalignment),
        ).mean("pmc")
        centre = element.flank * float(alone["load_centroid"].item())
        more = contact.tangent_load_centroid * (force - contact.force)
        tilted = contact.tilt_stiffness * (misalignment - contact.misalignment)
        moment = contact.force * contact.load_centroid + more - tilted
        # Planets share one contact: up to a few hundredths of the face from where it was solved.
        assert moment / force == pytest.approx(centre, abs=4e-3 * wanted.pair.face_width)


def mirrored(gearbox: Gearbox) -> Gearbox:
    """Seen in a mirror that holds all axes: other hands, other torques, and so the other flanks."""
    content: dict[str, Any] = gearbox.content
    changes: dict[str, Any] = {}
    for name, gear in content["gears"].items():
        changes[f"gears.{name}.helix_angle_deg"] = -gear.get("helix_angle_deg", 0.0)
    torques = content["static_load"]["torques_N_m"]
    changes["static_load.torques_N_m"] = {name: -torque for name, torque in torques.items()}
    return gearbox.varied(changes)


@pytest.mark.validation
def test_a_mirrored_gearbox_stands_as_its_original() -> None:
    """Flank -1: its misalignment and load centre are those of flank +1 seen in the mirror."""
    state, other = solved("relieved"), mirrored(gearbox_of("relieved"))
    image = static_state(assemble(other, Choice("bushing", "line_of_action"), coarse_curves(other)))
    flanks = [element.flank for element in state.assembly.elements]
    assert [-element.flank for element in image.assembly.elements] == flanks
    for one, two in zip(state.assembly.elements, image.assembly.elements, strict=True):
        found, original = (np.hstack([np.ravel(own) for own in astuple(end.contact)]) for end in (two, one))
        assert found == pytest.approx(original, rel=1e-6)
    # Rolling elements stand elsewhere under the load of a mirrored gearbox, as they do with even contact.
    assert image.misalignment == pytest.approx(state.misalignment, rel=2e-2)
    assert radial_loads(image) == pytest.approx(radial_loads(state), rel=2e-3)


def test_equal_planets_share_one_contact_and_others_have_their_own() -> None:
    contacts = solved("grc").assembly.contacts.contacts
    suns = [contacts[f"sun_planet_{number}"] for number in (1, 2, 3)]
    assert suns[0] is suns[1] is suns[2]
    assert len({id(contact) for contact in contacts.values()}) == 4


def test_teeth_far_askew_press_with_their_force_at_their_deflection(monkeypatch: pytest.MonkeyPatch) -> None:
    """A deflection at mid-face that is mostly gap shifts the curve once, however many steps there are."""

    def askew(places: Any) -> StaticContacts:
        found = static_contacts(places)
        moved = {mesh: replace(one, deflection=one.deflection - 60e-6) for mesh, one in found.contacts.items()}
        return StaticContacts(moved, found.unsolved)

    monkeypatch.setattr(exugear.system.operating_points, "static_contacts", askew)
    curves = curves_of("grc")
    assembly = assemble(gearbox_of("grc"), Choice("bushing", "line_of_action"), curves)
    even = assemble(gearbox_of("grc"), Choice("bushing", "iso6336"), {name: np.array([2e9]) for name in curves})
    for element, plain in zip(assembly.elements, even.elements, strict=True):
        contact = element.contact
        assert contact.deflection < 0.0
        apart = element.mesh.centre_distance - contact.centre_distance
        # At zero coordinates, the deflection that the curve sees where that at mid-face is the contact's.
        seen = contact.deflection + element.offset[0] - plain.offset[0] + contact.deflection_by_distance * apart
        assert float(np.mean(element.stiffness)) * seen == pytest.approx(contact.force, rel=1e-9)


def test_what_is_kept_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    curves = curves_of("grc")
    before = solved("grc").assembly
    monkeypatch.setattr("fe_ste.transmission_error.mean_contact.mean_contact", None)
    assert input_hash(assemble(gearbox_of("grc"), before.choice, curves)) == input_hash(before)


@pytest.mark.validation
def test_where_contact_cannot_be_solved_teeth_bear_evenly_and_it_is_said(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def failing(wanted: Any) -> Any:
        if wanted.pair.name == "intermediate":
            raise ContactError("pair intermediate: not today")
        return mean_contact(wanted)

    gearbox, curves = gearbox_of("grc"), curves_of("grc")
    # Contacts that other tests have kept would be taken.
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path))
    forget_contacts()
    monkeypatch.setattr("fe_ste.transmission_error.mean_contact.mean_contact", failing)
    assembly = assemble(gearbox, Choice("bushing", "line_of_action"), curves)
    assert assembly.contacts.unsolved == {"intermediate": "pair intermediate: not today"}
    assert len(assembly.contacts.contacts) == len(assembly.elements) - 1
    forget_contacts()
    of_it = assembly.elements[assembly.mesh_names.index("intermediate")]
    stiffness = float(np.mean(curves["intermediate"].tangent))
    assert of_it.contact.tilt_stiffness == pytest.approx(stiffness * of_it.mesh.pair.face_width**2 / 12.0, rel=1e-2)


@pytest.mark.parametrize("law", ["constant", "iso6336", "tangential"])
def test_laws_without_tables_solve_no_contact(law: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fe_ste.transmission_error.mean_contact.mean_contact", None)
    stiffness = {name: np.array([2e9]) for name in gearbox_of("grc").gear_pairs}
    assert not assemble(gearbox_of("grc"), Choice("bushing", law), stiffness).contacts.contacts


def test_gears_that_cannot_tilt_solve_no_contact(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fe_ste.transmission_error.mean_contact.mean_contact", None)
    assert not assemble(gearbox_of("grc"), Choice("rigid", "line_of_action"), curves_of("grc")).contacts.contacts
