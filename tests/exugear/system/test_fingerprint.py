"""What makes stored modes and runs stale: what their equations depend on, and nothing else."""

from __future__ import annotations

from typing import Any

import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.system.build import assemble
from exugear.system.modes import modes_of
from exugear.system.system import input_hash
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness

from ..cases.gear_trains import pair, planetary


def hashes(changes: dict[str, Any]) -> tuple[str, str]:
    """Hash of modes, and of a run of the load case `steady`."""
    gearbox = Gearbox.from_dict(pair()).varied(changes)
    assembly = assemble(gearbox, Choice("bushing", "constant"), mesh_stiffness(gearbox, "constant", "."))
    return input_hash(assembly), input_hash(assembly, "steady")


@pytest.mark.parametrize(
    ("changes", "modes_stay", "run_stays"),
    [
        ({"load_cases.other": {"torques_N_m": {"input": 1.0}}}, True, True),
        ({"load_cases.steady.start_speed_rpm": 500.0}, True, False),
        ({"ste.positions": 12, "report.reference_frequency_Hz": 3000.0}, True, True),
        ({"bodies.output.inertia.discs.mass_kg": 3.0}, False, False),
        ({"static_load.torques_N_m.input": 90.0}, False, False),
    ],
)
def test_modes_are_stale_when_their_equations_change_and_not_with_load_cases(
    changes: dict[str, Any], modes_stay: bool, run_stays: bool
) -> None:
    before, after = hashes({}), hashes(changes)
    assert (before[0] == after[0], before[1] == after[1]) == (modes_stay, run_stays)


def test_names_of_meshes_keep_their_digits_and_those_of_planets_are_one() -> None:
    content = pair()
    content["meshes"] = {"stage_1": content["meshes"]["helical"]}
    for gearbox, told in (
        (Gearbox.from_dict(content), "stage_1"),
        (Gearbox.from_dict(planetary("ring")), "sun_planet"),
    ):
        stiffness = mesh_stiffness(gearbox, "constant", ".")
        (name, *_) = modes_of(assemble(gearbox, Choice("rigid", "constant"), stiffness)).names[-1:]
        assert f"strain energy: {told} " in name or "strain energy: planet_ring " in name
