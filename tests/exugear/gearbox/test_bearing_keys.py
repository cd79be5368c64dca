"""Keys of bearings: what makes no sense for a type, or cannot be, is refused by file, key and name."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import pytest

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.sections.connections import TYPES_OF_KEYS
from exugear.system.gearbox_checks import check_parts

from ..cases.case_mutations import bases

Content = tuple[Path, dict[str, Any]]


@pytest.fixture(scope="module")
def content(tmp_path_factory: pytest.TempPathFactory) -> Content:
    folder = tmp_path_factory.mktemp("cases")
    return folder, bases(folder)["modified"]


def with_keys(content: Content, keys: dict[str, Any], bearing: dict[str, Any]) -> Gearbox:
    """Give the case with other keys of its catalogue bearing, 30 x 62 x 16, and of the bearing itself; None deletes."""
    folder, case = content[0], copy.deepcopy(content[1])
    section = case["bearings"]["bearing_2"]
    for table, changes in ((section["catalogue"], keys), (section, bearing)):
        for key, value in changes.items():
            if value is None:
                del table[key]
            else:
                table[key] = value
    return Gearbox.from_dict(case, str(folder / "case.toml"))


def refusal(content: Content, keys: dict[str, Any], bearing: dict[str, Any] | None = None) -> str:
    with pytest.raises(GearboxFileError) as caught:
        check_parts(with_keys(content, keys, bearing or {}))
    message = str(caught.value)
    assert "\n" not in message
    assert "case.toml" in message
    assert "bearings.bearing_2" in message
    return message


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"contact_angle_deg": 10.0}, "contact_angle_deg = 10 is not applicable to type = 'cylindrical_roller'"),
        ({"type": "tapered_roller", "contact_angle_deg": 0.0}, "must lie between 5 and 45 for type = 'tapered_roller'"),
        ({"type": "tapered_roller", "contact_angle_deg": 50.0}, "contact_angle_deg = 50 must lie between 5 and 45"),
        ({"type": "four_point_ball", "contact_angle_deg": 5.0}, "contact_angle_deg = 5 must lie between 10 and 45"),
        ({"type": "spherical_roller", "arrangement": "O"}, "arrangement = 'O' is not applicable to type ="),
        ({"type": "deep_groove_ball", "arrangement": "tandem"}, "arrangement = 'tandem' is not applicable to type ="),
        ({"inner_groove_ratio": 0.52}, "inner_groove_ratio is not applicable to type = 'cylindrical_roller'"),
        ({"type": "self_aligning_ball", "outer_groove_ratio": 0.52}, "outer_groove_ratio is not applicable to type ="),
        ({"type": "deep_groove_ball", "element_length_mm": 9.0}, "element_length_mm is not applicable to type ="),
        ({"type": "deep_groove_ball", "profile": "none"}, "profile is not applicable to type = 'deep_groove_ball'"),
        ({"osculation": 0.98}, "osculation is not applicable to type = 'cylindrical_roller'"),
        ({"locates_towards": "-z"}, "locates_towards is not applicable to type = 'cylindrical_roller'"),
        (
            {"type": "tapered_roller", "locates_towards": "+z", "arrangement": "O"},
            "locates_towards is not applicable to arrangement =",
        ),
        ({"type": "tapered_roller", "row_count": 2}, "row_count is not applicable to type = 'tapered_roller'"),
        ({"axial_preload_um": 5.0}, "axial_preload_um is not applicable to type = 'cylindrical_roller'"),
        (
            {"type": "tapered_roller", "axial_preload_um": 5.0},
            "axial_preload_um requires arrangement = 'X' or 'O'; a single bearing has none",
        ),
        (
            {"row_distance_mm": 20.0},
            "row_distance_mm requires a second row: row_count = 2, or arrangement 'X', 'O' or 'tandem'",
        ),
        (
            {"row_count": 2, "arrangement": "X"},
            "row_count = 2 requires arrangement = 'single'; set the number of rows of the whole bearing",
        ),
        ({"type": "spherical_roller", "row_count": 3}, "has one or two rows"),
        (
            {"type": "spherical_roller", "row_distance_mm": 9.0},
            "has one or two rows; contact_angle_deg defines their distance",
        ),
        (
            {"type": "spherical_roller", "row_count": 1, "contact_angle_deg": 9.0},
            "contact_angle_deg is not applicable to row_count = 1",
        ),
        (
            {"radial_load_kN": None, "axial_load_kN": 1.0},
            "axial_load_kN without radial_load_kN: set both, or none to use the static load",
        ),
    ],
)
def test_keys_that_make_no_sense_are_refused(content: Content, keys: dict[str, Any], said: str) -> None:
    assert said in refusal(content, keys)


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"bore_mm": 62.0}, "bore_mm = 62 must be below outer_diameter_mm = 62"),
        ({"element_diameter_mm": 16.0}, "element_diameter_mm = 16 must be below the 16 mm"),
        ({"element_length_mm": 16.5}, "element_length_mm = 16.5 must not be above width_mm = 16"),
        ({"pitch_diameter_mm": 62.0}, "pitch_diameter_mm = 62 must lie between bore_mm = 30 and outer"),
        ({"pitch_diameter_mm": 33.0}, "pitch_diameter_mm = 33 reaches beyond the rings"),
        ({"element_count": 20, "element_diameter_mm": 9.0}, "element_count = 20 rolling elements"),
        ({"element_count": 2}, "element_count"),
        ({"type": "deep_groove_ball", "inner_groove_ratio": 0.5}, "inner_groove_ratio"),
        ({"type": "deep_groove_ball", "outer_groove_ratio": 0.49}, "outer_groove_ratio"),
        ({"profile": [[0.0, 0.0], [0.5, 1.0], [0.5, 2.0]]}, "profile: fractions of half the length ="),
        ({"profile": [[0.1, 0.0], [1.0, 5.0]]}, "must start at 0 and increase, up to 1"),
        ({"profile": [[0.0, 0.0], [1.1, 5.0]]}, "profile"),
        ({"profile": [[0.0, 0.0]]}, "profile"),
        ({"profile": "convex"}, "profile"),
        ({"type": "thrust_ball"}, "type"),
        ({"dynamic_rating_kN": 0.0}, "dynamic_rating_kN"),
        ({"fatigue_load_limit_kN": 60.0, "static_rating_kN": 60.0}, "fatigue_load_limit_kN = 60 must be below"),
    ],
)
def test_dimensions_that_cannot_be_are_refused(content: Content, keys: dict[str, Any], said: str) -> None:
    assert said in refusal(content, keys)


@pytest.mark.parametrize(
    ("keys", "bearing", "said"),
    [
        (
            {},
            {"model": "iso16281"},
            "model = 'iso16281' uses the computed load; remove catalogue.radial_load_kN and .axial_load_kN",
        ),
        ({}, {"model": "iso16281", "catalogue": None}, "table with the rolling elements"),
        ({}, {"cage": "turning"}, "cage = 'turning' requires model = 'iso16281'"),
        ({}, {"law": "linear"}, "law"),
    ],
)
def test_laws_that_make_no_sense_are_refused(
    content: Content, keys: dict[str, Any], bearing: dict[str, Any], said: str
) -> None:
    assert said in refusal(content, keys, bearing)


def test_the_non_linear_law_takes_a_catalogue_without_loads(content: Content) -> None:
    gearbox = with_keys(content, {"radial_load_kN": None}, {"model": "iso16281", "cage": "turning"})
    section = gearbox.case.bearings["bearing_2"]
    assert (section.model, section.cage) == ("iso16281", "turning")


def test_keys_of_a_type_alone_name_types_that_exist() -> None:
    known = set().union(*(types for types, _ in TYPES_OF_KEYS.values()))
    assert all(types for types, _ in TYPES_OF_KEYS.values())
    assert known <= set(Path("docs/reference/bearings.md").read_text(encoding="utf-8").replace("`", " ").split())


@pytest.mark.parametrize(("distance", "said"), [(0.0, "0 mm apart"), (7.0, "7 mm apart"), (17.0, None)])
def test_two_bearings_at_one_place_are_refused_by_name(content: Content, distance: float, said: str | None) -> None:
    folder, case = content[0], copy.deepcopy(content[1])
    second = copy.deepcopy(case["bearings"]["bearing_2"])
    case["bearings"]["bearing_3"] = second | {"z_mm": second["z_mm"] + distance}
    if said is None:  # side by side
        Gearbox.from_dict(case, str(folder / "case.toml"))
        return
    with pytest.raises(
        GearboxFileError, match=f"case.toml: bearings.bearing_3.z_mm.*is at the position of bearings.bearing_2 .{said}"
    ):
        Gearbox.from_dict(case, str(folder / "case.toml"))
