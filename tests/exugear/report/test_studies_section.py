"""Studies in the report: those of the same case are shown with their extremes, others are left out by name."""

from __future__ import annotations

import json
import tomllib

import numpy as np
import xarray as xr

from exugear.findings.context import Context
from exugear.findings.stored import StoredResults
from exugear.findings.words import Words
from exugear.model.gearbox import Gearbox
from exugear.model.versions import STUDY
from exugear.report.parts.material import Material
from exugear.report.sections.studies import studies_section
from exugear.studies.dataset import write_study
from exugear.web.arrays import ArrayStore

from ..spur_case import SPUR_CASE


def stored_study(folder, content):
    """A study of five points whose figure has its least in the middle."""
    values = np.array([0.2, 0.4, 0.6, 0.8, 1.0])
    empty = np.full(5, "", dtype=object)
    data = xr.Dataset(
        {
            "level": ("factor", (values - 0.6) ** 2 + 1.0, {"units": "µm", "long_name": "loudest level"}),
            "error": ("factor", empty),
            "doubts": ("factor", empty),
        },
        {"factor": ("factor", values, {"units": "1", "path": "housing.factor"})},
        {"title": "seats <b>", "study": "{}", "case": json.dumps(content), "input_hash": "0", "points": 5, "failed": 0}
        | {"missing": 0, "variant": "bushing", "description": "", "method_version": STUDY},
    )
    folder.mkdir(parents=True)
    write_study(folder, data)


def test_studies_of_the_case_are_shown_and_others_left_out(tmp_path):
    content = tomllib.loads(SPUR_CASE)
    stored_study(tmp_path / "studies" / "own", content)
    stored_study(tmp_path / "studies" / "other", content | {"housing": {"factor": 0.7}})
    context = Context(tmp_path, Gearbox.from_dict(content), None, lambda what: None)
    results = StoredResults({}, {}, [])
    arrays = ArrayStore()
    part = studies_section(Material(context, results, Words(context.gearbox), (), (), (), arrays))
    assert "seats &lt;b&gt;" in part.html
    assert "factor = 0.6" in part.html  # where the figure is least
    assert list(part.data["charts"]) == ["study-own-0"]
    (left_out,) = context.notes.left_out
    assert "studies/other/study.nc" in left_out
