"""Shared basis of the report sections: gearbox file of the results folder, its models, and notes for the page."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from exugear.gearbox.choice import Choice, choice_of
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.variant import Variant, VariantError
from exugear.results.findings import Finding
from exugear.results.folder import bodies_folder
from exugear.results.run_file import FINAL_NAME, PARTIAL_NAME, invalidity_of, load_run
from exugear.results.spectra.run_spectra import RunSignals, VariantRun, analysed, run_signals
from exugear.results.spectra.waterfall import order_lines
from exugear.steady.steady_file import load_response, settings_of
from exugear.system.bearings.rolling.rows import BearingError
from exugear.system.bodies.elastic_body import ElasticBody
from exugear.system.bodies.of_gearbox import reduced_bodies
from exugear.system.build import assemble
from exugear.system.modes import load_modes
from exugear.system.statics import BalanceError
from exugear.system.system import Assembly, input_hash
from exugear.system.tooth_mesh.element import MeshCurve
from exugear.system.tooth_mesh.laws.iso6336 import iso6336_stiffness
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness
from exugear.system.tooth_mesh.placement import MeshError
from exugear.system.tooth_mesh.tables import fitting_table
from fe_ste.tools.arrays import Floats
from fe_ste.tools.files import FileError, file_digest
from fe_ste.transmission_error.contact_stress import face_load_factor, largest_contact_stress
from fe_ste.transmission_error.cycle import harmonics_of
from fe_ste.transmission_error.surface import SteSurface
from fe_ste.transmission_error.table import MeshTable, TableError

if TYPE_CHECKING:
    import xarray as xr

REFERENCE_VARIANT = Variant.rigid
"""Variant that the others are compared with."""
VISIBLE_SHARE = 0.01
"""Minimum TE participation (fraction) of a mode that counts as visible in the overall TE."""


MESH_MODEL_LABELS = {
    "kinematic": "kinematic constraint",
    "constant": "mean mesh stiffness",
    "iso6336": "mesh stiffness to ISO 6336",
    "tangential": "tangential mesh model",
    "line_of_action": "mesh stiffness over the mesh cycle",
    "table": "mesh stiffness with contact loss",
}
"""Names of the mesh models on the page."""
METHOD_LABELS = {
    "linear": "mean stiffness",
    "parametric": "time-varying stiffness",
    "nonlinear": "mesh models evaluated in time",
}
"""Names of the methods of steady-state responses on the page."""


def model_label(choice: Choice) -> str:
    """Return model settings as text for headings."""
    label = Variant.of(choice.variant).label
    return f"{choice.variant} ({label}), {MESH_MODEL_LABELS[choice.mesh_model]}, inertia set {choice.inertias}"


def response_label(data: xr.Dataset) -> str:
    """Return model settings and method of a steady-state response as text for headings."""
    return f"{model_label(choice_of(data.attrs))}, {METHOD_LABELS[str(data.attrs['method'])]}"


class ReportError(ValueError):
    """Error: the folder contains no results for a report, or none that can be compared."""


@dataclass(frozen=True)
class ReportNotes:
    """Messages for the top and the end of the page, each list in order of occurrence."""

    statements: list[str] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    """Checks of the results that the headline is from, and invalid runs."""
    invalid_runs: list[str] = field(default_factory=list)
    """Invalid runs, with the reason."""
    left_out: list[str] = field(default_factory=list)
    """Skipped files that do not belong to the gearbox file, and results that could not be computed, with the reason."""


@dataclass(frozen=True)
class Context:
    """Data that all sections of one report share."""

    folder: Path
    gearbox: Gearbox
    """Gearbox of the gearbox file stored in the folder."""
    target: float | None
    """Target frequency for the search for modes, Hz."""
    tell: Callable[[str], None]
    """Callback for progress messages."""
    notes: ReportNotes = field(default_factory=ReportNotes)
    assemblies: dict[Choice, Assembly] = field(default_factory=dict)
    stiffnesses: dict[str, dict[str, Floats | MeshCurve | SteSurface]] = field(default_factory=dict)
    """Mesh stiffness read so far, by mesh model."""

    def stiffness(self, law: str) -> dict[str, Floats | MeshCurve | SteSurface]:
        """Return the mesh stiffness of a mesh model from the tables of the folder; it is read once."""
        if law not in self.stiffnesses:
            self.stiffnesses[law] = mesh_stiffness(self.gearbox, law, self.folder)
        return self.stiffnesses[law]

    def assembled(self, choice: Choice) -> Assembly:
        """Return the model for given settings, assembled once with the tables of the folder."""
        if choice not in self.assemblies:
            bodies = self.bodies_of(choice)(self.gearbox)
            self.assemblies[choice] = assemble(self.gearbox, choice, self.stiffness(choice.mesh_model), bodies)
        return self.assemblies[choice]

    def bodies_of(self, choice: Choice) -> Callable[[Gearbox], dict[str, ElasticBody]]:
        """Return a function that computes the reduced flexible bodies of a (varied) gearbox for given settings."""
        if not choice.variant.is_elastic:
            return lambda gearbox: {}
        return lambda gearbox: reduced_bodies(gearbox, choice.inertia_set(gearbox), bodies_folder(self.folder))

    def name_of(self, path: Path) -> Path:
        """Return the path of a file relative to the results folder."""
        return path.relative_to(self.folder)

    def leave_out(self, path: Path, reason: object) -> None:
        """Note that a file of the results folder is skipped, and why."""
        self.notes.left_out.append(f"{self.name_of(path)}: {reason}")


# Results in the folder that belong to its gearbox file: tables, modes and runs

OTHER_INPUT = "was computed from another input; recompute it"
_UNFIT = (GearboxFileError, MeshError, VariantError, BearingError, BalanceError, KeyError)
"""Errors of the gearbox file for the model settings of a stored result."""


@dataclass(frozen=True)
class StoredResults:
    """Stored results that a report is made from."""

    tables: Mapping[str, MeshTable]
    """By pair name."""
    modes: Mapping[Choice, xr.Dataset]
    """As `exugear.system.modes.Modes.to_dataset` makes them."""
    runs: Sequence[VariantRun]
    steady: Sequence[xr.Dataset] = ()
    """Steady-state responses as `exugear.steady.steady_file.load_response` reads them."""
    measured: Sequence[xr.Dataset] = ()
    """As `exugear.steady.evaluation.measured_comparison.load_comparison` reads them, with the attributes of a model."""

    def __bool__(self) -> bool:
        """Return whether there is anything to report."""
        return bool(self.tables or self.modes or self.runs or self.steady or self.measured)


def stored_models(context: Context) -> StoredResults:
    """Read the tables and modes that belong to the gearbox file of the folder (fast); note the others as skipped."""
    tables = {}
    for name in dict.fromkeys(mesh.pair.name for mesh in context.gearbox.meshes):
        if name in context.gearbox.stated_stiffness:
            continue
        try:
            tables[name] = fitting_table(context.gearbox, name, context.folder)
        except TableError as error:
            context.notes.left_out.append(f"table of {name}: {error}")
    modes = {}
    for path in sorted(context.folder.glob("*/*/modes.nc")):
        try:
            data = load_modes(path)
        except FileError as error:
            context.notes.left_out.append(str(error))
            continue
        if _fits(context, path, data.attrs):
            modes[choice_of(data.attrs)] = data
    return StoredResults(tables, modes, ())


def with_responses(context: Context, models: StoredResults) -> StoredResults:
    """Add the runs and steady-state responses that belong to the gearbox file; note the others as skipped."""
    runs = list(_stored_runs(context, models.modes))
    return replace(models, runs=runs, steady=list(_stored_steady(context)), measured=list(_stored_measured(context)))


def _stored_steady(context: Context) -> Iterator[xr.Dataset]:
    for path in sorted(context.folder.glob("*/*/steady-*.nc")):
        try:
            data = load_response(path)
            settings = settings_of(data.attrs)
            fits = settings.hash_with(context.assembled(choice_of(data.attrs))) == data.attrs["input_hash"]
        except FileError as error:
            context.notes.left_out.append(str(error))
            continue
        except (*_UNFIT, ValueError) as error:
            context.leave_out(path, error)
            continue
        if fits:
            yield data
        else:
            context.leave_out(path, OTHER_INPUT)


def _stored_measured(context: Context) -> Iterator[xr.Dataset]:
    """Read the comparisons with measured run-ups that belong to the section and to the response of the gearbox file."""
    # Recordings and spectra that other commands do not read
    from exugear.steady.evaluation.measured_comparison import comparison_hash, load_comparison

    for name, section in context.gearbox.case.measurements.items():
        for path in sorted(context.folder.glob(f"*/*/measured-{name}.nc")):
            try:
                data = load_comparison(path)
                response = load_response(path.with_name(f"{path.stem}-steady.nc"))
                found = settings_of(response.attrs).hash_with(context.assembled(choice_of(response.attrs)))
            except FileError as error:
                context.notes.left_out.append(str(error))
                continue
            except (*_UNFIT, ValueError) as error:
                context.leave_out(path, error)
                continue
            own = data.attrs
            if comparison_hash(str(own["recording_sha256"]), section, found) != own["input_hash"]:
                context.leave_out(path, OTHER_INPUT)
            elif _is_replaced(context.gearbox, name, str(own["recording_sha256"])):
                context.leave_out(path, f"its recording {section.file} was replaced; run exugear measured again")
            else:
                yield data.assign_attrs({key: response.attrs[key] for key in ("variant", "mesh_model", "inertias")})
        at_loads = (context.folder.glob(f"{depth}/*/*/measured-{name}.nc") for depth in ("at-*", "at-*/at-*"))
        for path in sorted(chain(*at_loads)):
            folder = path.parents[2]
            context.leave_out(path, f"is at another load; exugear report {shown_path(folder)} shows it")


def _is_replaced(gearbox: Gearbox, name: str, digest: str) -> bool:
    """Return whether the recording of a measurement has another SHA-256; without the recording it is not known.

    Results are also looked at where the recording, which is much larger, is missing.
    """
    from exugear.steady.evaluation.run_up import recording_path  # for measurements only

    try:
        return file_digest(recording_path(gearbox, name)) != digest
    except (GearboxFileError, FileError):
        return False


def _stored_runs(context: Context, modes: Mapping[Choice, xr.Dataset]) -> Iterator[VariantRun]:
    """Read the matching runs; runs to be compared use the longest window of their group, whatever the reading order."""
    lines = order_lines(context.gearbox)
    groups: dict[tuple[str, ...], list[tuple[RunSignals, float]]] = {}
    for path in _run_files(context.folder):
        found = _fitting_signals(context, path)
        if found is not None:
            groups.setdefault(run_key(found[0].attributes), []).append(found)
    for group in groups.values():
        longest = max(window for _, window in group)
        for signals, _ in group:
            context.tell(f"spectra of {context.name_of(signals.path)}")
            try:
                yield analysed(signals, lines, modes.get(choice_of(signals.attributes)), longest)
            except ValueError as error:
                context.leave_out(signals.path, error)


def _fitting_signals(context: Context, path: Path) -> tuple[RunSignals, float] | None:
    """Return the signals of a run that matches the gearbox file and its suitable window (s); None if it is skipped."""
    try:
        attributes = load_run(path, ()).attrs
        if not _fits(context, path, attributes):
            return None
        if verdict := invalidity_of(attributes):
            name = context.name_of(path)
            context.notes.invalid_runs.append(f"{name}: {verdict}")
            context.notes.findings.append(Finding("warning", f"invalid run {name}: {verdict}"))
            context.notes.statements.append(f"Invalid: {name}: {verdict}")
        signals = run_signals(path)
        return signals, signals.suitable_window
    except FileError as error:
        context.notes.left_out.append(str(error))
    except ValueError as error:
        context.leave_out(path, error)
    return None


def bytes_of_runs(context: Context) -> int:
    """Return the total size of the run files in the folder, bytes."""
    return sum(path.stat().st_size for path in _run_files(context.folder) if path.is_file())


def _run_files(folder: Path) -> list[Path]:
    """List completed runs, and aborted ones that were not resumed."""
    ended = set(folder.glob(f"*/*/{FINAL_NAME}"))
    stopped = {path for path in folder.glob(f"*/*/{PARTIAL_NAME}") if path.with_name(FINAL_NAME) not in ended}
    return sorted(ended | stopped)


def _fits(context: Context, path: Path, attributes: Mapping[str, Any]) -> bool:
    """Return whether a file was computed from the gearbox file of the folder; if not, note why it is skipped."""
    load_case = attributes.get("load_case")
    try:
        if load_case is not None and load_case not in context.gearbox.load_cases:
            raise GearboxFileError(f"the gearbox file has no load case {load_case!r}")
        if input_hash(context.assembled(choice_of(attributes)), load_case) == attributes.get("input_hash"):
            return True
        context.leave_out(path, OTHER_INPUT)
    except _UNFIT as error:
        context.leave_out(path, error)
    return False


def run_key(attributes: Mapping[str, Any]) -> tuple[str, str, str]:
    """Return load case, mesh model and inertia set, which runs to be compared have in common."""
    return str(attributes["load_case"]), str(attributes["mesh_model"]), str(attributes["inertias"])


# Excitation: static transmission error of each pair over the mesh cycle, and its harmonics

HARMONICS = 6
"""Number of harmonics of the mesh frequency in the report."""


@dataclass(frozen=True)
class PairExcitation:
    """Static transmission error of a pair at its static load."""

    pair: str
    torque: float
    """On gear 1, N m."""
    position: Floats
    """(n,) in the mesh cycle, 0 to 1."""
    error: Floats
    """(n,) transmission error, m."""
    stiffness: Floats
    """(n,) mesh stiffness, N/m."""
    harmonics: Floats
    """(HARMONICS,) amplitudes of the transmission error at multiples of the mesh frequency, m."""
    face_load_factor: float
    contact_stress: float
    """K_Hbeta, and largest contact stress of the mesh cycle within the path of contact, Pa: aligned gears."""
    iso_stiffness: float
    """Mesh stiffness to ISO 6336-1 method B, N/m."""


def excitations(context: Context, results: StoredResults) -> tuple[PairExcitation, ...]:
    """Read the static states of all tables."""
    found = []
    for name, table in results.tables.items():
        state = table.static_state
        error = np.asarray(state["ste"].to_numpy(), dtype=np.float64)
        found.append(
            PairExcitation(
                pair=name,
                torque=float(state["torque"]),
                position=np.asarray(state["pmc"].to_numpy(), dtype=np.float64),
                error=error,
                stiffness=np.asarray(state["mesh_stiffness"].to_numpy(), dtype=np.float64),
                harmonics=harmonics_of(error, HARMONICS),
                face_load_factor=float(face_load_factor(state)),
                contact_stress=float(largest_contact_stress(context.gearbox.pairs[name].pair, state)),
                iso_stiffness=iso6336_stiffness(context.gearbox.pairs[name]),
            )
        )
    return tuple(found)


def shown_path(path: str | Path) -> str:
    """Return a path from the current folder, or its name: the page does not show where it is on this machine."""
    absolute = Path(path).absolute()
    if absolute.is_relative_to(Path.cwd()):
        return str(absolute.relative_to(Path.cwd()))
    return absolute.name
