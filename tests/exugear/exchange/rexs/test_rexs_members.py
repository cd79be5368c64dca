"""Members that a speed of zero holds, splines, contradictions with a remedy, and data of a rating that are used."""

from __future__ import annotations

import pytest

from exugear.exchange.rexs.to_case.conversion import Imported, to_case
from exugear.exchange.rexs.to_case.notes import Rules
from exugear.exchange.rexs.tree import RexsError

from .own_files import OwnFile, spur_pair


def planetary(ring_speed: float | None, defines: bool | None = True, planet_shift: float = 0.0) -> OwnFile:
    """Sun of 24 teeth, three planets of 24, ring of 72 on a shaft of its own with a speed, carrier."""
    file = OwnFile()
    sun_shaft = file.shaft((-60.0, 0.0, 0.0), [(0.0, 100.0, 40.0)], speed=1000.0)
    ring_shaft = file.shaft((60.0, 0.0, 0.0), [(0.0, 40.0, 40.0)], speed=ring_speed)
    file.give(ring_shaft, defines_speed=defines)
    carrier = file.shaft((20.0, 0.0, 0.0), [(0.0, 100.0, 60.0)])
    stage = file.add("planetary_stage")
    file.relate("planet_carrier_shaft", shaft=carrier, planetary_stage=stage)
    sun = file.gear(sun_shaft, (0.0, 0.0, 0.0), 24, 3.0)
    ring = file.gear(ring_shaft, (0.0, 0.0, 0.0), 72, 3.0, ring=True)
    for place in ((72.0, 0.0), (-36.0, 62.353829072479584), (-36.0, -62.353829072479584)):
        planet_shaft = file.shaft((-20.0, *place), [(0.0, 40.0, 30.0)])
        file.relate("planet_shaft", shaft=planet_shaft, planetary_stage=stage)
        planet = file.gear(planet_shaft, (0.0, *place), 24, 3.0, shift=planet_shift)
        file.stage(sun, planet, 72.0)
        file.stage(planet, ring, 72.0)
        file.stiff_bearing(planet_shaft, (0.0, *place), on=carrier)
    for shaft, u in ((sun_shaft, -50.0), (sun_shaft, -40.0), (carrier, 100.0), (carrier, 110.0), (ring_shaft, 90.0)):
        file.stiff_bearing(shaft, (u, 0.0, 0.0))
    file.load(sun_shaft, 100.0)
    file.load(carrier, None)
    return file


def imported(file: OwnFile, **rules: str) -> Imported:
    return to_case(file.model(), "own", rules=Rules(**rules))  # type: ignore[arg-type]


@pytest.mark.parametrize(("speed", "defines"), [(0.0, True), (0.0, None), (None, True)])
def test_a_ring_whose_speed_is_zero_is_held(speed: float | None, defines: bool | None) -> None:
    """i = 1 + 72 / 24 from the sun to the carrier with the ring at rest: 0.25 the other way round."""
    made = imported(planetary(speed, defines))
    assert made.gearbox.train.ratio == pytest.approx(0.25, rel=1e-9)
    assert any(": fixed, since the file defines its speed as 0" in line for line in made.changed)
    ring = next(body for body in made.gearbox.bodies() if "ring" in body.wheels)
    assert ring.fixed


def test_members_are_not_held_where_no_speed_of_the_file_is_other_than_zero() -> None:
    file, _ = spur_pair()
    for number, part in file.model().components.items():
        if part.type == "shaft":
            file.give(number, rotational_speed=0.0)
    assert not any(body.fixed and body.wheels for body in imported(file).gearbox.bodies())


def test_a_spline_that_is_paired_as_a_stage_joins_two_shafts() -> None:
    """As the REXS API for Java writes splines: a relation `stage` of connection, shaft and hub."""
    file, shafts = spur_pair()
    sleeve = file.shaft((100.0, 0.0, 0.0), [(0.0, 30.0, 50.0)])
    spline = file.add("involute_spline_connection", support_vector=(105.0, 0.0, 0.0))
    file.relate("side", assembly=spline, inner_part=shafts[0], outer_part=sleeve)
    teeth = [file.add(f"involute_spline_gear_{part}", number_of_teeth=20) for part in ("shaft", "hub")]
    file.relate("stage", stage=spline, gear_1=teeth[0], gear_2=teeth[1])
    made = imported(file)
    assert made.gearbox.train.ratio == pytest.approx(-0.5)
    plain = imported(spur_pair()[0]).gearbox
    assert len(made.gearbox.bodies()) == len(plain.bodies())
    # The sleeve: steel of 50 mm diameter and 30 mm length.
    mass = made.gearbox.body("shaft_1").mass - plain.body("shaft_1").mass
    assert mass == pytest.approx(7850.0 * 3.141593 / 4.0 * 0.05**2 * 0.03, rel=1e-4)


def test_more_rolling_elements_than_fit_are_told_and_as_many_taken_as_fit() -> None:
    """31 rollers of 57 mm fit on 570 mm: pi / asin(0.1) = 31.36; programs hold 32 to be possible."""
    file, shafts = spur_pair()
    file.rolling_bearing(
        shafts[1],
        (50.0, 90.0, 0.0),
        rows=[({"number_of_rolling_elements": 32, "reference_diameter_rolling_bearing": 57.0},
               {"diameter_of_rolling_element": 5.7, "length_of_rolling_element": 8.0})],
        bearing_type="radial_roller_bearing",
        inner_diameter=46.0, outer_diameter=68.0, width=12.0,
    )  # fmt: skip
    made = imported(file)
    (catalogue,) = [one.catalogue for one in made.gearbox.bearings if one.catalogue is not None]
    assert catalogue.element_count == 31
    assert any(
        "32 of 5.7 mm do not fit on 57 mm, 31 rolling elements used; ratings of the file are kept" in line
        for line in made.changed
    )


def test_a_planet_of_shift_zero_follows_from_its_sun_and_the_ring_from_the_planet() -> None:
    """The sun has 0.2, so that sun and planet contradict 72 mm; planet and ring of shift zero agree."""
    file = planetary(0.0)
    model = file.model()
    sun = next(one for one in model.components_of_type("cylindrical_gear"))
    for side in ("left", "right"):
        flank = model.related("flank", "gear", sun.number, side)[0]
        file.give(flank.number, addendum_modification_coefficient=0.2)
    with pytest.raises(RexsError, match="--shifts centre-distance, which replaces a shift of 0"):
        imported(file)
    made = imported(file, shifts="centre-distance")
    shifts = {name: gear.profile_shift for name, gear in made.gearbox.gears.items()}
    assert shifts["sun"] == 0.2
    assert shifts["planet_gear"] == pytest.approx(-0.2, abs=1e-6)
    assert shifts["ring"] == pytest.approx(-0.2, abs=1e-6)


def test_data_of_a_rating_that_have_keys_are_used() -> None:
    """Tolerance class, roughness of roots and viscosity at 100 degrees; the root factor follows from the roughness."""
    file, _ = spur_pair()
    model = file.model()
    file.give(file.steel, endurance_limit_flank=1500.0, endurance_limit_root=461.0)
    for gear in model.components_of_type("cylindrical_gear"):
        given = {"averaged_peak_to_valley_height_root": 0.02, "tolerance_class_according_to_iso_1328_2013": 7}
        file.give(gear.number, **given)
    oil = {"viscosity_at_40_degree_celsius": 100.0, "viscosity_at_100_degree_celsius": 11.0}
    file.add("lubricant", **oil, density_at_15_degree_celsius=0.88)
    file.add("gear_casing", temperature_lubricant=72.0)
    case = imported(file).gearbox.case
    assert case.rating is not None and case.lubricant is not None
    for strength in case.rating.gears.values():
        assert (strength.tolerance_class, strength.root_roughness_Rz_um, strength.root_factor) == (7, 20.0, None)
    assert len(case.rating.gears) == 2
    assert (case.lubricant.viscosity_40_mm2_per_s, case.lubricant.viscosity_100_mm2_per_s) == (100.0, 11.0)
    assert (case.lubricant.density_15_kg_per_m3, case.lubricant.temperature_C) == (880.0, 72.0)
    assert case.rating.viscosity_40_mm2_per_s is None
