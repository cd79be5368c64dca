"""Every key of the case model is read somewhere: none is taken and left without effect."""

from __future__ import annotations

import ast
import sys
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from typer.testing import CliRunner

import exugear
from exugear.cli.app import app
from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import connector_matrix
from exugear.gearbox.sections import (
    bodies,
    case,
    connections,
    entries,
    excitations,
    gears,
    loads,
    measurements,
)
from exugear.gearbox.sections import (
    loads as lubricant,
)
from exugear.gearbox.sections.entries import Section
from exugear.results.folder import keep_case
from exugear.steady.damping_band import damping_limits
from exugear.steady.mean_system.mean_system import mean_system
from exugear.steady.steady_response import harmonic_balance_model
from exugear.system.bearings.rolling.catalogue import catalogue_rows
from exugear.system.bearings.stiffness import catalogue_stiffness, elastic_names, linear_law
from exugear.system.bodies.of_gearbox import check_elastic_body
from exugear.system.build import assemble
from exugear.system.gearbox_checks import check_parts, gearbox_warnings, lacking
from exugear.system.modal_damping import damping_in_words
from exugear.system.operating_points import bearing_duties
from exugear.system.tooth_mesh.tables import wanted_table

from ...optional_libraries import needs_meshio
from ..cases import gear_trains
from ..cases.case_mutations import bases, toml_text

ELSEWHERE = {
    f"GearboxFile.{table}" for table in ("labels", "operation", "loads", "rating", "lubricant", "measurements")
}
ELSEWHERE |= {"CatalogueSection.fatigue_load_limit_kN", "ReportSection.quantity"}
"""Keys of pages and of a life, whose computation takes too long here: another test looks for them in the program."""
FOR_PEOPLE = {
    "LoadCaseSection.description",
    "ExcitationSection.description",
    "ForceSection.description",
    "BearingSection.designation",
    "CatalogueSection.designation",
}
"""Keys that stand in the file and its copy in the results for people to read."""


LIFE_SECTIONS = (
    loads.LoadsSection,
    loads.SourceSection,
    loads.WindSection,
    lubricant.LubricantSection,
    loads.RatingSection,
    loads.StrengthSection,
    case.OperationSection,
    connections.SealSection,
    measurements.MeasurementSection,
    measurements.MeasuredChannelSection,
    measurements.TachoSection,
    measurements.SpeedChannelSection,
)
CASE_MODEL = (entries, gears, bodies, connections, excitations, case)
"""Modules of the case model."""


def sections() -> set[type[Any]]:
    kinds = {kind for module in CASE_MODEL for kind in vars(module).values() if isinstance(kind, type)}
    return {kind for kind in kinds if issubclass(kind, Section)} - {bodies.DampedBodySection}  # its heirs have its keys


@pytest.fixture
def read_keys(monkeypatch: pytest.MonkeyPatch) -> set[tuple[str, str]]:
    """Collect the keys that anything but the case model itself reads."""
    found: set[tuple[str, str]] = set()
    plain = Section.__getattribute__
    own_files = {module.__file__ for module in CASE_MODEL}

    def noted(section: Any, name: str) -> Any:
        if sys._getframe(1).f_code.co_filename not in own_files:
            found.add((type(section).__name__, name))
        return plain(section, name)

    monkeypatch.setattr(Section, "__getattribute__", noted)
    return found


@needs_meshio
def test_every_key_is_read(read_keys: set[tuple[str, str]], tmp_path: Path) -> None:
    catalogue_stiffness.cache_clear()  # what other tests had computed would not be read again
    contents = bases(tmp_path)
    contents |= {"waves": gear_trains.pair(), "values": gear_trains.pair()}
    contents["values"]["pairs"]["helical"]["stiffness"] = {"over_cycle_N_per_m": [4e8, 3e8, 4e8]}
    thinned = next(iter(contents["values"]["gears"].values()))
    del thinned["tooth_thinning_mm"]
    thinned["tooth_thickness"] = {"upper_allowance_um": -20.0, "tolerance_um": 20.0}
    ring = next(gear for gear in contents["planetary"]["gears"].values() if gear.get("internal"))
    ring["cutter"] = {"teeth": 30, "tip_radius": 0.2, "addendum": 1.25}
    contents["waves"]["damping"] = {"modal_percent": 2.0, "modal_modes": [], "modal_band_percent": [1.0, 4.0]}
    contents["spur"]["ste"] = {"method": "nonlinear", "positions": 8}
    for kind in get_args(connections.BearingType):
        catalogue_rows(connections.CatalogueSection(type=kind, bore_mm=50.0, outer_diameter_mm=90.0, width_mm=20.0))
    ribbed = {"type": "cylindrical_roller", "ribs": "both"}
    catalogue_rows(connections.CatalogueSection(bore_mm=50.0, outer_diameter_mm=90.0, width_mm=20.0, **ribbed))
    for name, content in contents.items():
        file = tmp_path / f"{name}.toml"
        file.write_text(toml_text(content), encoding="utf-8")
        gearbox = Gearbox.from_toml(file)
        check_parts(gearbox)
        gearbox_warnings(gearbox)
        for pair, spec in gearbox.pairs.items():
            assert spec.table != bool(spec.stiffness)
            wanted_table(gearbox, pair, gearbox.ste.positions, gearbox.ste.grid)
        for variant in ("rigid", "bushing"):
            lacking(gearbox, variant)
            assembly = assemble(gearbox, Choice(variant), {pair: np.array([1e9]) for pair in gearbox.pairs})
            assert assembly.constant_forces.shape == (assembly.size,)
            bearing_duties(assembly)
        damping_in_words(gearbox.case.damping)
        if name == "waves":  # with modal damping, and without deviations, which steady-state responses refuse
            harmonic_balance_model(assembly, np.array([1.0, 2.0]), 1, 1).at(1.5)
            damping_limits(mean_system(assembly, np.array([1.0, 2.0])))
        for support in (*gearbox.bearings, *gearbox.mounts):
            linear_law(support, gearbox.case.damping.bearing_time_s)
            connector_matrix(support.stiffness)
        for body in elastic_names(gearbox):
            check_elastic_body(gearbox, body)
        assert gearbox.name
    # Both are refused: the first solves the static state alone, the second finds nothing besides its case.
    assert CliRunner().invoke(app, ["ste", str(tmp_path / "spur.toml"), "--grid"]).exit_code == 2
    keep_case(gearbox, tmp_path)
    assert CliRunner().invoke(app, ["report", str(tmp_path)]).exit_code == 2
    known = {(kind.__name__, key) for kind in sections() for key in kind.model_fields}
    of_life = {(kind.__name__, key) for kind in LIFE_SECTIONS for key in kind.model_fields}
    unread = {f"{kind}.{key}" for kind, key in known - read_keys - of_life}
    assert not unread - FOR_PEOPLE - ELSEWHERE, sorted(unread - FOR_PEOPLE - ELSEWHERE)


@pytest.mark.validation
def test_every_key_of_pages_and_of_a_life_is_read_in_the_program() -> None:
    """A key counts as read where it is taken as an attribute or by `si`, outside the models of the file."""
    root = Path(exugear.__file__).parent
    files = [file for file in root.rglob("*.py") if file.parent != root / "gearbox" / "sections"]
    trees = [ast.parse(file.read_text(encoding="utf-8")) for file in files]
    read = {node.attr for tree in trees for node in ast.walk(tree) if isinstance(node, ast.Attribute)}
    calls = [node for tree in trees for node in ast.walk(tree) if isinstance(node, ast.Call)]
    by_name = [call.args[1] for call in calls if ast.unparse(call.func) in ("si", "optional_si")]
    read |= {argument.value for argument in by_name if isinstance(argument, ast.Constant)}
    keys = {key for kind in LIFE_SECTIONS for key in kind.model_fields}
    keys |= {name.partition(".")[2] for name in ELSEWHERE}
    only_one_value = {"curve"}
    assert keys - only_one_value <= read, sorted(keys - read)
