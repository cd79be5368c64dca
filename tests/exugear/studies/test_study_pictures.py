"""Pictures of studies: one for each output, drawn as its dimensions ask for."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from exugear.studies.pictures import draw_study
from exugear.studies.sampling import SAMPLE


def dataset(**variables):
    coordinates = {
        "seat": ("seat", np.linspace(0.1, 1.0, 5)),
        "build": ("build", np.array(["soft", "hard"], dtype=object)),
        "mode": ("mode", np.array(["1", "2", "3"], dtype=object)),
        SAMPLE: (SAMPLE, np.arange(1, 21)),
    }
    sizes = {name: values.size for name, (_, values) in coordinates.items()}
    rng = np.random.default_rng(1)
    made = {
        name: (dimensions, rng.random([sizes[own] for own in dimensions]), {"units": "Hz"})
        for name, dimensions in variables.items()
    }
    used = {dimension for dimensions in variables.values() for dimension in dimensions}
    return xr.Dataset(made, {name: own for name, own in coordinates.items() if name in used}, {"title": "test"})


@pytest.mark.sample
@pytest.mark.parametrize(
    "dimensions",
    [
        ("seat",),
        ("build",),
        ("seat", "build"),
        ("build", "seat", "mode"),
        ("build", "mode"),
        (SAMPLE,),
        ("build", SAMPLE, "mode"),
        ("seat", "build", SAMPLE, "mode"),
    ],
)
def test_a_figure_over_any_dimensions_is_drawn(tmp_path, dimensions):
    data = dataset(frequency=dimensions, other=dimensions[:1])
    data["frequency"][{dimensions[0]: 0}] = np.nan  # a point that failed
    paths = draw_study(data, tmp_path)
    assert {path.name for path in paths} == {"frequency.png", "other.png"}
    assert all(path.stat().st_size > 5000 for path in paths)


def test_what_no_point_has_is_not_drawn(tmp_path):
    data = dataset(frequency=("seat",), seconds=("seat",))
    data["frequency"][:] = np.nan
    assert draw_study(data, tmp_path) == []
