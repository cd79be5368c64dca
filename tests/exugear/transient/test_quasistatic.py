"""The law `table` in a gearbox that turns slowly under its load shows the finite-element curve it was made from."""

from __future__ import annotations

import tomllib
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from scipy.interpolate import CubicSpline

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.system.build import assemble
from exugear.system.statics import locked_equilibrium
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.laws.stiffness import pack
from fe_ste.transmission_error.surface import SteSurface
from fe_ste.transmission_error.table import MeshTable, TableInput

from ..cases.spur import COARSE_INPUT, SPUR_CASE

FACTORS = (0.2, 0.5, 1.0, 2.0)


def at_position(assembly: Assembly, pmc: float) -> Assembly:
    """All meshes at one place of their cycles."""
    elements = tuple(replace(element, phase=pmc) for element in assembly.elements)
    return replace(assembly, elements=elements, meshes=pack(elements, assembly.coordinates))


def largest_error(gearbox: Gearbox, tables: dict[str, xr.Dataset], positions: int) -> float:
    """Largest relative difference of deflections from the curves at the static load, all meshes and positions."""
    surfaces = {name: SteSurface.from_table(table) for name, table in tables.items()}
    assembly = assemble(gearbox, Choice("rigid", "table"), surfaces)
    curves = {}
    for name, table in tables.items():
        curve = table.ste.isel(torque=FACTORS.index(1.0), centre_distance=0, misalignment=0).to_numpy()
        curves[name] = CubicSpline(
            np.linspace(0.0, 1.0, len(curve) + 1), np.append(curve, curve[0]), bc_type="periodic"
        )
    load = gearbox.case.static_load
    worst = 0.0
    for pmc in np.arange(positions) / positions:
        here = at_position(assembly, float(pmc))
        q = locked_equilibrium(here, load.torques_N_m, load.locked)
        for element, state in zip(here.elements, here.mesh_states(q, 0 * q), strict=True):
            # The deflection turns gear 1 on by some thousandths of a cycle: compared where it then stands.
            expected = float(curves[element.mesh.pair.name](state[2]))
            worst = max(worst, abs(state[0] / expected - 1.0))
    return worst


def test_spur_pair_shows_its_curve() -> None:
    gearbox = Gearbox.from_dict(tomllib.loads(SPUR_CASE))
    spec = gearbox.pairs["spur"]
    wanted = COARSE_INPUT(pair=spec.pair, torque=tuple(spec.static_torque * f for f in FACTORS), positions=10)
    table = MeshTable.compute(wanted).dataset
    # Deflection turns gear 1 on, off the nodes: between ten positions of a spur pair two interpolations differ by a
    # thousandth, where those of fifty agree (below).
    assert largest_error(gearbox, {"spur": table}, 10) < 1.5e-3


@pytest.mark.validation
@pytest.mark.long
def test_every_pair_of_the_grc_shows_its_curve(grc: Gearbox) -> None:
    tables = {}
    for name, spec in grc.pairs.items():
        wanted = TableInput(pair=spec.pair, torque=tuple(spec.static_torque * f for f in FACTORS))
        tables[name] = MeshTable.compute(wanted).dataset
    assert largest_error(grc, tables, 50) < 1e-3


@pytest.mark.validation
@pytest.mark.sample
@pytest.mark.parametrize("pair", [pytest.param("sun_planet", marks=pytest.mark.long), "high_speed"])
def test_moment_of_misalignment_is_the_loads_lever(grc: Gearbox, pair: str) -> None:
    """The potential's derivative by misalignment against F times the place of the load in the finite-element contact.

    Nothing of `load_centroid` entered the surface: the derivative integrates the slopes of the transmission error over
    the load.
    """
    spec = grc.pairs[pair]
    tilts = np.array([-60e-6, -30e-6, 0.0, 30e-6, 60e-6]) / spec.pair.face_width
    factors = (0.05, 0.2, 0.5, 1.0, 2.0)
    wanted = TableInput(
        pair=spec.pair,
        torque=tuple(spec.static_torque * f for f in factors),
        positions=10,
        misalignment=tuple(tilts),
    )
    table = MeshTable.compute(wanted).dataset
    surface = SteSurface.from_table(table)
    point = table.isel(centre_distance=0, torque=factors.index(1.0))
    force = float(point.line_of_action_force[0, 0])
    loads = np.linspace(0.0, np.sqrt(force), 400) ** 2
    for p, pmc in enumerate(table.pmc.to_numpy()):
        for m, tilt in enumerate(tilts):
            h = 1e-9
            slope = [
                (surface.ste(f, float(pmc), None, tilt + h) - surface.ste(f, float(pmc), None, tilt - h)) / (2.0 * h)
                for f in loads
            ]
            lever = float(np.trapezoid(slope, loads)) / force
            # 2 % of half the face: the first piece of the load axis carries most of the difference.
            assert lever == pytest.approx(float(point.load_centroid[p, m]), abs=0.01 * spec.pair.face_width)
