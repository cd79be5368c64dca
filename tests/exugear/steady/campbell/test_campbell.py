"""Campbell diagram of gearboxes: types of planetary modes, whirl, frequencies at rest, and its way through a file."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.templates.kinds import template
from exugear.steady.campbell import LAYOUT, campbell_from, campbell_of, modes_over_speed
from exugear.steady.mean_system.mean_system import mean_system
from exugear.system.build import assemble
from exugear.system.modes import eigenmodes
from fe_ste.tools.stores import Layout, load_dataset, write_dataset

PLANETS = 4
FAST = 200.0
STIFFNESS = {"sun_planet": 4e8, "ring_planet": 5e8}
ISOTROPIC = {"stiffness": {"radial_N_per_m": 1e8, "axial_N_per_m": 1e7, "tilt_N_m_per_rad": 1e5}}


@pytest.fixture(scope="module")
def planetary(tmp_path_factory):
    """Template with four planets in phase (24 and 96 teeth divide by 4) on bearings alike in all directions.

    The load is small: a torque on tilted bodies makes directions unlike, by 0.3 % of a frequency at 300 N m.
    """
    path = tmp_path_factory.mktemp("planetary") / "gearbox.toml"
    path.write_text(template("planetary"), encoding="utf-8")
    gearbox = Gearbox.from_toml(path)
    bearings = {"sun": {"body": "sun", "z_mm": -100.0}, "carrier": {"body": "carrier", "z_mm": 120.0}}
    bearings["planet"] = {"body": "planet", "on": "carrier", "z_mm": 0.0}
    changes = {
        "bodies.planet.planet_angles_deg": [0.0, 90.0, 180.0, 270.0],
        "static_load.torques_N_m": {"sun": 1.0},
        "bearings": {name: {**own, **ISOTROPIC} for name, own in bearings.items()},
    }
    return gearbox.varied(changes)


@pytest.fixture(scope="module")
def diagram(planetary):
    system = mean_system(assemble(planetary, Choice("bushing"), STIFFNESS), np.array([0.0, FAST]))
    return campbell_of(system, modes_over_speed(system, 0.0, FAST, 1e5))


@pytest.fixture(scope="module")
def told(diagram):
    """Modes but those in which planets only tilt on their pins: of one frequency, whose shapes mix at will."""
    return np.array(["planets tilt 100 %" not in name for name in diagram.names])


def test_types_have_the_multiplicity_of_lin_and_parker(diagram, told):
    """At rest translational modes come in pairs of one frequency and others alone, and each motion of a planet has
    N - 3 planet modes: along radius, tangent and axis, and its spin."""
    kinds = np.array(diagram.kinds)
    assert set(kinds[told]) == {"rotational", "translational", "planet", ""}
    assert np.count_nonzero(told & (kinds == "planet")) == 4 * (PLANETS - 3)
    slow = diagram.frequency[0]
    pairs = np.sort(slow[told & (kinds == "translational")]).reshape(-1, 2)
    np.testing.assert_allclose(pairs[:, 0], pairs[:, 1], rtol=1e-4)
    alone = np.sort(slow[told & (kinds == "rotational")])
    assert (np.diff(alone) > 1e-3 * alone[1:]).all()


def test_pairs_part_with_speed_into_forward_and_backward_whirl(diagram, told):
    """Of bodies alike in all directions every whirl is a circle."""
    translational = told & (np.array(diagram.kinds) == "translational")
    whirl = diagram.whirl[-1, translational]
    half = np.count_nonzero(translational) // 2
    assert np.count_nonzero(whirl > 0.98) == np.count_nonzero(whirl < -0.98) == half > 5


def test_frequencies_at_rest_are_those_of_the_eigenmodes(diagram, planetary):
    """Damped against undamped ones; all planets are alike already."""
    known = eigenmodes(planetary, Choice("bushing"), STIFFNESS).frequency
    found = diagram.frequency[0] / np.sqrt(1.0 - diagram.damping[0] ** 2)
    np.testing.assert_allclose(np.sort(found), known[known > 1.0], rtol=1e-3)


def test_a_mode_is_found_by_speed_and_frequency(diagram):
    own = diagram.frequency[-1]
    lonely = int(np.argmax(np.diff(own, append=np.inf, prepend=-np.inf)[:-1].clip(max=1e9)))
    assert diagram.mode_at(FAST, own[lonely]) == lonely
    assert diagram.mode_at(FAST, 3.0 * own.max()) is None


def test_below_all_modes_the_diagram_is_empty(planetary):
    system = mean_system(assemble(planetary, Choice("rigid"), STIFFNESS), np.array([0.0, FAST]))
    empty = campbell_of(system, modes_over_speed(system, 0.0, FAST, 1.0))
    assert empty.names == () and empty.frequency.shape == (len(empty.speeds), 0)
    assert empty.mode_at(1.0, 1.0) is None


@pytest.mark.parametrize("modes", [None, 0])
def test_a_file_gives_the_diagram_back(diagram, tmp_path, modes):
    """Also one of no modes."""
    path, kept = tmp_path / "campbell.nc", slice(modes)
    diagram = replace(
        diagram,
        **{name: getattr(diagram, name)[:, kept] for name in ("frequency", "damping", "whirl")},
        **{name: getattr(diagram, name)[kept] for name in ("over_angle", "kinds", "names")},
    )
    write_dataset(path, xr.Dataset(diagram.variables(), attrs={"method_version": 1}))
    found = campbell_from(load_dataset(path, Layout("diagram", 1, LAYOUT)))
    np.testing.assert_array_equal(found.frequency, diagram.frequency)
    assert (found.kinds, found.names) == (diagram.kinds, diagram.names)
