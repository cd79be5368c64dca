"""Contact about a state: means and slopes against states on their own, whole mesh cycles and balances; what is kept."""

from __future__ import annotations

import dataclasses
import errno
import functools
import io
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import fe_ste.transmission_error.mean_contact
from fe_ste.contact.kinematics import ContactError, ContactSettings
from fe_ste.elasticity.hexmesh import MeshSettings
from fe_ste.flanks import FlankModification
from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.tools import stores
from fe_ste.tools.stores import FOLDER_VARIABLE, write_sealed
from fe_ste.transmission_error.compliance import PairCompliance, pair_compliance
from fe_ste.transmission_error.mean_contact import (
    MeanContact,
    contact_input,
    contacts_told,
    forget_contacts,
    known_contacts,
    mean_contact,
)
from fe_ste.transmission_error.table import TableInput
from fe_ste.transmission_error.transmission_error import static_transmission_error

from ..conftest import grc_pair
from ..damage import damages

GEAR = Gear(
    name="gear",
    teeth=30,
    normal_module=3e-3,
    helix_angle=np.radians(12.0),
    face_width=30e-3,
    held_diameter=50e-3,
)
MATE = dataclasses.replace(GEAR, name="mate", helix_angle=-GEAR.helix_angle)
PAIR = GearPair(name="pair", pinion=GEAR, gear=MATE, centre_distance=92.02e-3)
MESH, CONTACT = MeshSettings(layers=6, flank=8, thickness=6), ContactSettings(slices=24)
TABLE = TableInput(pair=PAIR, torque=(150.0,), mesh=MESH, contact=CONTACT)
CROWNED = dataclasses.replace(TABLE, pinion_modification=FlankModification(lead_crowning=4e-6))
FORCE, TILT = 150.0 / GEAR.base_radius, 1.1e-4


@functools.cache
def compliance() -> PairCompliance:
    return pair_compliance(PAIR, MESH, CONTACT)


@pytest.fixture(scope="module")
def contact() -> MeanContact:
    return mean_contact(contact_input(TABLE, FORCE, TILT, PAIR.centre_distance))


def test_a_state_lies_between_its_two_on_the_lattice() -> None:
    for tilt in (-3e-4, 0.0, TILT):
        wanted = contact_input(TABLE, FORCE, tilt, PAIR.centre_distance + 4e-6)
        low, high = wanted.misalignment
        assert low <= tilt <= high
        # Steps are small against what teeth yield, some 8 um here.
        assert (high - low) * PAIR.face_width < 0.5e-6
        assert wanted.torque[0] == pytest.approx(150.0, rel=0.0101)
        assert wanted.centre_distance[0] == PAIR.centre_distance


def test_states_nearby_share_one_contact_and_straight_teeth_stand_between_two() -> None:
    wanted = contact_input(TABLE, FORCE, 0.0, PAIR.centre_distance)
    for tilt in (1e-9, -1e-9):  # rounding
        assert contact_input(TABLE, FORCE * (1.0 + tilt), tilt, PAIR.centre_distance + tilt).hash == wanted.hash
    assert wanted.misalignment[0] == -wanted.misalignment[1]
    assert contact_input(TABLE, 1.1 * FORCE, 0.0, PAIR.centre_distance).hash != wanted.hash


@pytest.mark.parametrize("state", [(0.0, 0.0, 0.09), (-1.0, 0.0, 0.09), (np.nan, 0.0, 0.09), (1.0, np.inf, 0.09)])
def test_a_state_without_contact_is_refused(state: tuple[float, float, float]) -> None:
    with pytest.raises(ValueError, match="needs a positive force and finite numbers"):
        contact_input(TABLE, *state)


def test_the_deflection_changes_with_tilt_by_the_tangent_load_centroid(contact: MeanContact) -> None:
    """Maxwell's theorem: the slope of the deflection by misalignment is where a little more load acts."""
    slope = np.diff(contact.deflection)[0] / np.diff(contact.misalignment)[0]
    assert slope == pytest.approx(contact.tangent_load_centroid.mean(), rel=2e-2)


def test_stiffness_and_tangent_load_centroid_are_slopes_by_force(contact: MeanContact) -> None:
    """Against two forces half a per cent apart, each solved by itself."""
    tilt, forces = contact.misalignment[0], contact.force * np.array([0.9975, 1.0025])
    two = static_transmission_error(compliance(), tuple(forces * GEAR.base_radius), 5, misalignment=float(tilt)).mean(
        "pmc"
    )
    deflection = two["ste"].to_numpy().ravel()
    moment = two["load_centroid"].to_numpy().ravel() * forces
    assert contact.stiffness[0] == pytest.approx(np.diff(forces)[0] / np.diff(deflection)[0], rel=5e-3)
    # Cells that begin to touch add their whole share to the tangent at once.
    centre = np.diff(moment)[0] / np.diff(forces)[0]
    assert contact.tangent_load_centroid[0] == pytest.approx(centre, abs=2e-3 * PAIR.face_width)


@pytest.mark.validation
def test_few_positions_stand_for_the_whole_mesh_cycle(contact: MeanContact) -> None:
    whole = mean_contact(contact_input(TABLE, FORCE, TILT, PAIR.centre_distance, positions=40))
    assert contact.tilt_stiffness == pytest.approx(whole.tilt_stiffness, rel=2e-2)
    assert contact.deflection == pytest.approx(whole.deflection, rel=5e-3)
    assert contact.load_centroid == pytest.approx(whole.load_centroid, abs=0.01 * PAIR.face_width)
    assert contact.face_load_factor == pytest.approx(whole.face_load_factor, rel=0.08)


def test_what_changes_over_the_mesh_cycle_is_that_of_states_on_their_own(contact: MeanContact) -> None:
    """At twenty positions of each misalignment; their first harmonics are those of forty positions."""
    for end, tilt in enumerate(contact.misalignment):
        asked = functools.partial(static_transmission_error, compliance(), contact.force * GEAR.base_radius)
        alone = asked(20, misalignment=float(tilt)).squeeze()
        whole = asked(40, misalignment=float(tilt)).squeeze()
        for own, name in (
            (contact.cycle_deflection, "ste"),
            (contact.cycle_stiffness, "tangent_stiffness"),
            (contact.cycle_load_centroid, "load_centroid"),
            (contact.cycle_tangent_load_centroid, "tangent_load_centroid"),
        ):
            assert own[end] == pytest.approx(alone[name].to_numpy(), rel=1e-6)
            few, many = (np.fft.rfft(values)[1:3] / len(values) for values in (own[end], whole[name].to_numpy()))
            assert np.abs(few - many).max() < 0.1 * np.abs(many).max(), name


def test_between_the_two_states_all_is_straight(contact: MeanContact) -> None:
    """Against a state of its own in the middle."""
    middle = float(contact.misalignment.mean())
    alone = static_transmission_error(compliance(), contact.force * GEAR.base_radius, 5, misalignment=middle).mean(
        "pmc"
    )
    assert float(contact.at(contact.deflection, middle)) == pytest.approx(float(alone["ste"].item()), rel=1e-4)
    centre = float(contact.at(contact.load_centroid, middle))
    assert centre == pytest.approx(float(alone["load_centroid"].item()), abs=2e-4 * PAIR.face_width)


def test_load_along_the_face_holds_force_and_load_centroid(contact: MeanContact) -> None:
    """The distribution that K_Hbeta is taken from has the sum and the resultant of the same contact."""
    for load, centre, factor in zip(contact.line_load, contact.load_centroid, contact.face_load_factor, strict=True):
        assert load @ contact.axial / load.sum() == pytest.approx(centre, rel=1e-6)
        assert load.max() / load.mean() == pytest.approx(factor, rel=1e-12)
        # Line loads are per length of contact line: the transverse force is their sum over the face.
        total = load.sum() * PAIR.face_width / len(load)
        assert total == pytest.approx(contact.force, rel=1e-6)


def test_crowning_gives_way_to_tilt() -> None:
    """A crowned flank bears further to its end under the same misalignment, and against it less stiffly."""
    plain, crowned = (
        mean_contact(contact_input(table, FORCE, 0.0, PAIR.centre_distance)) for table in (TABLE, CROWNED)
    )
    assert 0.5 * plain.tilt_stiffness < crowned.tilt_stiffness < plain.tilt_stiffness
    # Second way: teeth as a bed of equal springs, k b^2 / 12, stiffer at least by what their neighbours take.
    bed = plain.stiffness.mean() * PAIR.face_width**2 / 12.0
    assert bed < plain.tilt_stiffness < 2.0 * bed


def test_an_internal_pair_has_its_moment_against_misalignment() -> None:
    pair = grc_pair("ring_planet")
    table = TableInput(pair=pair, torque=(26e3,), mesh=MeshSettings(layers=5, flank=8, thickness=6), contact=CONTACT)
    force = 26e3 / pair.pinion.base_radius
    one, other = (mean_contact(contact_input(table, force, tilt, pair.centre_distance)) for tilt in (-1e-4, 1e-4))
    # What opens the +z end moves the load to the -z end.
    assert one.load_centroid.mean() > 10e-3 and other.load_centroid.mean() < -10e-3
    for contact in (one, other):
        bed = contact.stiffness.mean() * pair.face_width**2 / 12.0
        assert 0.8 * bed < contact.tilt_stiffness < 2.0 * bed


def test_a_position_that_cannot_be_solved_is_told() -> None:
    overloaded = dataclasses.replace(TABLE, torque=(1e9,), misalignment=(0.0, 1e-5), centre_distance=(92.02e-3,))
    with pytest.raises(ContactError, match="pair pair: pmc 0.000"):
        mean_contact(dataclasses.replace(overloaded, positions=2))


@pytest.fixture
def kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Folder of the files; memory is empty before and after."""
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path / "kept"))
    forget_contacts()
    yield tmp_path / "kept"
    forget_contacts()


@pytest.fixture
def solved(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Hashes of what is solved."""
    hashes = []

    def counted(wanted: TableInput) -> MeanContact:
        hashes.append(wanted.hash)
        return mean_contact(wanted)

    monkeypatch.setattr(fe_ste.transmission_error.mean_contact, "mean_contact", counted)
    return hashes


WANTED = dataclasses.replace(contact_input(TABLE, FORCE, TILT, PAIR.centre_distance), positions=1)


def assert_same(one: MeanContact | ContactError, other: MeanContact | ContactError) -> None:
    for field in dataclasses.fields(MeanContact):
        assert np.array_equal(getattr(one, field.name), getattr(other, field.name)), field.name


def test_a_kept_contact_is_the_solved_one(kept: Path, solved: list[str]) -> None:
    first, again = known_contacts([WANTED, WANTED])
    assert first is again
    forget_contacts()
    (from_file,) = known_contacts([WANTED])
    assert_same(from_file, first)
    assert solved == [WANTED.hash]
    assert len(list(kept.glob("contact-*.npz"))) == 1


def test_another_input_is_not_misread(kept: Path, solved: list[str]) -> None:
    (first,) = known_contacts([WANTED])
    other = dataclasses.replace(WANTED, gear_modification=FlankModification(lead_crowning=1e-6))
    (crowned,) = known_contacts([other])
    assert solved == [WANTED.hash, other.hash]
    assert isinstance(first, MeanContact) and isinstance(crowned, MeanContact)
    assert not np.array_equal(first.load_centroid, crowned.load_centroid)


def test_another_version_does_not_use_the_files(kept: Path, solved: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    known_contacts([WANTED])
    forget_contacts()
    monkeypatch.setattr(fe_ste.transmission_error.mean_contact, "MEAN_CONTACT", -1)
    known_contacts([WANTED])
    assert len(solved) == 2


@pytest.mark.validation
def test_damaged_files_are_solved_again(kept: Path, solved: list[str]) -> None:
    (first,) = known_contacts([WANTED])
    (path,) = kept.glob("contact-*.npz")
    whole = path.read_bytes()
    errors = [b"", b"text", *damages(whole, 14)]
    for damaged in errors:
        path.write_bytes(damaged)
        forget_contacts()
        assert_same(*known_contacts([WANTED]), first)
        assert path.read_bytes() == whole
    assert len(solved) == 1 + len(errors)


def test_a_file_of_another_make_runs_no_code_and_is_replaced(kept: Path, solved: list[str]) -> None:
    known_contacts([WANTED])
    (path,) = kept.glob("contact-*.npz")
    content = io.BytesIO()
    np.savez(content, force=np.array([print], dtype=object))
    write_sealed(path, content.getvalue())
    forget_contacts()
    known_contacts([WANTED])
    assert len(solved) == 2


def test_what_is_stopped_goes_on_from_the_contacts_that_are_solved(kept: Path, solved: list[str]) -> None:
    several = [
        dataclasses.replace(contact_input(TABLE, FORCE, tilt, PAIR.centre_distance), positions=1)
        for tilt in (-1e-4, 0.0, 1e-4)
    ]

    def stop(done: int, total: int) -> None:
        assert total == 3
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), contacts_told(stop):
        known_contacts(several)
    forget_contacts()
    told: list[tuple[int, int]] = []
    with contacts_told(lambda done, total: told.append((done, total))):
        known_contacts(several)
    known_contacts([WANTED])  # nobody listens any more
    assert told == [(0, 1), (1, 1)]
    assert sorted(solved[:-1]) == sorted(one.hash for one in several)


def test_contacts_used_least_lately_are_removed(kept: Path, solved: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fe_ste.transmission_error.mean_contact._contacts, "in_files", 6400)
    known_contacts([WANTED])
    other = dataclasses.replace(WANTED, misalignment=(0.0, 1e-5))
    known_contacts([other])
    forget_contacts()
    known_contacts([other])
    assert len(solved) == 2 and len(list(kept.glob("contact-*.npz"))) == 1


def test_nothing_is_kept_when_switched_off(kept: Path, solved: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(FOLDER_VARIABLE, "off")
    known_contacts([WANTED])
    forget_contacts()
    known_contacts([WANTED])
    assert len(solved) == 2 and not kept.exists()


def test_why_a_contact_could_not_be_solved_stands_in_its_place(kept: Path) -> None:
    overloaded = dataclasses.replace(WANTED, torque=(1e9,))
    error, fine = known_contacts([overloaded, WANTED])
    assert isinstance(error, ContactError) and isinstance(fine, MeanContact)
    assert len(list(kept.glob("contact-*.npz"))) == 1


def test_a_folder_that_cannot_be_written_costs_nothing_but_time(
    kept: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "file").write_text("no folder")
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path / "file"))
    (contact,) = known_contacts([WANTED])
    assert isinstance(contact, MeanContact)
    assert "each contact cannot be stored" in caplog.text


def test_a_full_disk_costs_nothing_but_time(
    kept: Path, solved: list[str], monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def full(path: Path, content: memoryview) -> str:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(stores, "write_sealed", full)
    known_contacts([WANTED])
    assert "No space left on device" in caplog.text and not list(kept.glob("contact-*"))
