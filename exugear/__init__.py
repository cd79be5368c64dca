"""Gearbox dynamics in Exudyn with finite-element transmission error tables.

Names are imported at first use, so that ``import exugear`` and the command line's help start quickly.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from exugear.exchange.rexs.containers import read_rexs
    from exugear.exchange.rexs.to_case.conversion import to_case
    from exugear.gearbox.choice import Choice
    from exugear.gearbox.gearbox import Gearbox
    from exugear.gearbox.reading import GearboxFileError
    from exugear.gearbox.templates.kinds import template
    from exugear.gearbox.variant import Variant
    from exugear.life.life import compute_life
    from exugear.project import Project
    from exugear.report.findings.ranking import resonances
    from exugear.report.pictures.diagrams import plot_campbell, plot_response
    from exugear.report.writer import write_report
    from exugear.results.run_file import load_run
    from exugear.results.spectra.diagrams import plot_waterfalls
    from exugear.results.spectra.run_spectra import run_waterfall
    from exugear.results.spectra.waterfall import order_lines
    from exugear.steady.settings import SpeedRange, SteadySettings
    from exugear.steady.steady_file import steady_response
    from exugear.studies.dataset import load_study
    from exugear.studies.runner import run_study
    from exugear.studies.study import Study
    from exugear.system.bodies.solids import SolidModel
    from exugear.system.build import assemble
    from exugear.system.modes import Modes, eigenmodes
    from exugear.system.statics import static_state
    from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness
    from exugear.transient.outcome import Run
    from exugear.transient.runup import simulate

#: Public names and their modules.
_HOMES = {
    "GearboxFileError": "exugear.gearbox.reading",
    "Choice": "exugear.gearbox.choice",
    "Gearbox": "exugear.gearbox.gearbox",
    "Modes": "exugear.system.modes",
    "Project": "exugear.project",
    "Run": "exugear.transient.outcome",
    "SolidModel": "exugear.system.bodies.solids",
    "SpeedRange": "exugear.steady.settings",
    "SteadySettings": "exugear.steady.settings",
    "Study": "exugear.studies.study",
    "Variant": "exugear.gearbox.variant",
    "assemble": "exugear.system.build",
    "compute_life": "exugear.life.life",
    "eigenmodes": "exugear.system.modes",
    "load_run": "exugear.results.run_file",
    "load_study": "exugear.studies.dataset",
    "mesh_stiffness": "exugear.system.tooth_mesh.laws.stiffness",
    "order_lines": "exugear.results.spectra.waterfall",
    "plot_campbell": "exugear.report.pictures.diagrams",
    "plot_response": "exugear.report.pictures.diagrams",
    "plot_waterfalls": "exugear.results.spectra.diagrams",
    "read_rexs": "exugear.exchange.rexs.containers",
    "resonances": "exugear.report.findings.ranking",
    "run_waterfall": "exugear.results.spectra.run_spectra",
    "simulate": "exugear.transient.runup",
    "static_state": "exugear.system.statics",
    "steady_response": "exugear.steady.steady_file",
    "run_study": "exugear.studies.runner",
    "template": "exugear.gearbox.templates.kinds",
    "to_case": "exugear.exchange.rexs.to_case.conversion",
    "write_report": "exugear.report.writer",
}

__all__ = [
    "GearboxFileError",
    "Choice",
    "Gearbox",
    "Modes",
    "Project",
    "Run",
    "SolidModel",
    "SpeedRange",
    "SteadySettings",
    "Study",
    "Variant",
    "__version__",
    "assemble",
    "compute_life",
    "eigenmodes",
    "load_run",
    "load_study",
    "mesh_stiffness",
    "order_lines",
    "plot_campbell",
    "plot_response",
    "plot_waterfalls",
    "read_rexs",
    "resonances",
    "run_waterfall",
    "simulate",
    "static_state",
    "steady_response",
    "run_study",
    "template",
    "to_case",
    "write_report",
]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return importlib.import_module("importlib.metadata").version("exugear")
    if name in _HOMES:
        return getattr(importlib.import_module(_HOMES[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
