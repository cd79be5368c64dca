"""Bodies reduced by this program, which tests write and read back."""

from __future__ import annotations

from typing import Any

import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.system.bodies.external import interface_of
from exugear.system.bodies.matrix_files.interface import InterfaceMatrices
from exugear.system.bodies.reduction import ReducedBody
from exugear.system.system import Assembly

from ....cases.assembled import assembled
from ....cases.box import box_content
from ....cases.case_mutations import shaped_shafts
from .shared import STIFFNESS


@pytest.fixture(scope="module")
def housed(tmp_path_factory: pytest.TempPathFactory) -> Assembly:
    """With the box reduced here."""
    folder = tmp_path_factory.mktemp("box")
    return assembled(Gearbox.from_dict(box_content(folder), str(folder / "case.toml")), Choice("flexible"), STIFFNESS)


@pytest.fixture(scope="module")
def box(housed: Assembly) -> InterfaceMatrices:
    return interface_of(housed.elastic_bodies["box"].reduced)


@pytest.fixture(scope="module")
def shaft() -> tuple[dict[str, Any], ReducedBody]:
    """A gearbox file with a shaft whose inertia is that of its shape, and this shaft reduced here."""
    content = shaped_shafts()
    body = assembled(Gearbox.from_dict(content, "case.toml"), Choice("flexible"), STIFFNESS).elastic_bodies["shaft_1"]
    inertia = body.shape_inertia
    content["bodies"]["shaft_1"]["inertia"]["disc"] = {
        "mass_kg": inertia.mass, "axial_kg_m2": inertia.axial, "transverse_kg_m2": inertia.transverse,
        "centre_of_mass_z_mm": 1e3 * inertia.centre[2],
    }  # fmt: skip
    exact = assembled(Gearbox.from_dict(content, "case.toml"), Choice("flexible"), STIFFNESS).elastic_bodies["shaft_1"]
    assert exact.main_seat == "torque"
    return content, exact.reduced
