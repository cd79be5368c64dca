"""The report of a results folder: one web page with its pictures, tables, assumptions, hashes and times."""

from __future__ import annotations

import math
import platform
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from exugear.bodies.of_gearbox import ElasticBody, reduced_bodies
from exugear.dynamics.assemble import assemble
from exugear.dynamics.assembly import Assembly, VariantError
from exugear.dynamics.fingerprint import input_hash
from exugear.dynamics.modes import Modes, load_modes, modes_of
from exugear.dynamics.sensitivity import Remedy, Sweep, parameters_of, remedies, sweep_modes
from exugear.dynamics.signals import BALANCE_TERMS, MESH_TIMES, energy_residual
from exugear.model.choice import Choice
from exugear.model.gearbox import Gearbox
from exugear.model.named_files import Permissions
from exugear.model.reading import CaseError
from exugear.pictures.diagrams import (
    Sensitivity,
    plot_mode_energies,
    plot_order_levels,
    plot_sensitivities,
    plot_waterfalls,
)
from exugear.pictures.elastic_scene import draw_elastic_bodies, elastic_scene
from exugear.pictures.scene import draw_mode
from exugear.pictures.shapes import bodies_of, mode_scene, motions_of
from exugear.pictures.tables import PICTURE_FOLDER
from exugear.report import page
from exugear.results.folder import REPORT_FILE, bodies_folder, kept_case, times_spent
from exugear.results.run_file import FINAL_NAME, PARTIAL_NAME, load_run
from exugear.runs.trust import verdict_of
from exugear.spectra.comparison import (
    NEAR,
    RPM,
    Comparison,
    Finding,
    ModeReport,
    VariantRun,
    compare,
    nearest_mode,
    read_run,
    report_mode,
)
from exugear.spectra.orders import order_lines
from exugear.tooth_mesh.placement import MeshError
from exugear.tooth_mesh.stiffness import iso6336_stiffness, mesh_stiffness
from exugear.tooth_mesh.tables import fitting_table
from fe_ste.tools.arrays import Floats
from fe_ste.tools.files import FileError, write_file
from fe_ste.tools.rendering import RenderingError
from fe_ste.transmission_error.surface import SteSurface
from fe_ste.transmission_error.table import MeshTable, TableError

STIFF = "rigid"
"""Variant that others are compared with."""
SEEN = 0.01
"""Least share of the overall transmission error's mobility for a mode to be called seen by it."""
DRAWN = 0.001
"""Least share for a mode to be drawn in a diagram of sensitivities."""
MESH_TIME_LABELS = ("longest pull of a mesh", "longest time teeth are apart", "longest time outside a table")
"""Labels of `exugear.dynamics.signals.MESH_TIMES`, in their order."""
PACKAGES = ("exugear", "exudyn", "numpy", "scipy", "numba", "scikit-fem", "xarray", "h5netcdf", "matplotlib", "pyvista")


class ReportError(ValueError):
    """A folder that nothing can be reported from."""


@dataclass(frozen=True)
class Model:
    """What a run or modes were computed of."""

    variant: str
    law: str
    inertias: str

    @classmethod
    def of(cls, attributes: Mapping[str, Any]) -> Model:
        """Read from the attributes of a file."""
        return cls(*(str(attributes[key]) for key in ("variant", "mesh_law", "inertias")))

    @property
    def choice(self) -> Choice:
        """The choice that it stands for."""
        return Choice(self.variant, self.law, self.inertias)

    @property
    def words(self) -> str:
        """For headings."""
        return f"{self.variant}, law {self.law}, inertias {self.inertias}"

    @property
    def file_part(self) -> str:
        """For names of files."""
        return f"{self.variant}-{self.law}-{self.inertias}"


@dataclass(frozen=True)
class Report:
    """A report that was written.

    Attributes
    ----------
    path : Path
        The page.
    statements : tuple of str
        What it says in short.
    left_out : tuple of str
        Files that do not belong to the case, and pictures that could not be made, with the reason.
    pictures : tuple of Path
    """

    path: Path
    statements: tuple[str, ...]
    left_out: tuple[str, ...]
    pictures: tuple[Path, ...]


@dataclass
class _Writer:
    """A report in the making."""

    folder: Path
    gearbox: Gearbox
    reference: float | None
    tell: Callable[[str], None]
    statements: list[str] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)
    pictures: list[Path] = field(default_factory=list)
    distrusted: list[str] = field(default_factory=list)
    models: dict[Model, Assembly] = field(default_factory=dict)
    stiffnesses: dict[str, dict[str, Floats | SteSurface]] = field(default_factory=dict)

    @property
    def target(self) -> float:
        """Frequency (Hz) that modes are looked for at; only where there is one."""
        assert self.reference is not None
        return self.reference

    def stiffness(self, law: str) -> dict[str, Floats | SteSurface]:
        """Mesh stiffness of a law from the tables of the folder, read once."""
        if law not in self.stiffnesses:
            self.stiffnesses[law] = mesh_stiffness(self.gearbox, law, self.folder)
        return self.stiffnesses[law]

    def assembled(self, model: Model) -> Assembly:
        """Equations of a model, with the tables of the folder."""
        if model not in self.models:
            stiffness = self.stiffness(model.law)
            bodies = self.bodies_of(model)(self.gearbox)
            self.models[model] = assemble(self.gearbox, model.choice, stiffness, bodies)
        return self.models[model]

    def bodies_of(self, model: Model) -> Callable[[Gearbox], dict[str, ElasticBody]]:
        """Reduced elastic bodies of a gearbox, varied or not, as a model has them."""
        if model.variant != "flexible":
            return lambda gearbox: {}
        return lambda gearbox: reduced_bodies(gearbox, model.inertias, bodies_folder(self.folder))

    def fits(self, path: Path, attributes: Mapping[str, Any]) -> bool:
        """Tell whether a file was computed from the case of the folder; if not, say why it is left out."""
        load_case = attributes.get("load_case")
        try:
            if load_case is not None and load_case not in self.gearbox.load_cases:
                raise CaseError(f"the case has no load case {load_case!r}")
            if input_hash(self.assembled(Model.of(attributes)), load_case) == attributes.get("input_hash"):
                return True
            reason = "was computed from another input; compute it again"
        except (CaseError, MeshError, VariantError, KeyError) as error:
            reason = str(error)
        self.left_out.append(f"{path.relative_to(self.folder)}: {reason}")
        return False

    def picture(self, name: str) -> Path:
        """Place of a new picture of the report."""
        path = self.folder / PICTURE_FOLDER / f"{name}.png"
        self.pictures.append(path)
        return path


def write_report(
    folder: str | Path,
    target: float | None = None,
    tell: Callable[[str], None] | None = None,
    files_below: Path | None = None,
) -> Report:
    """Write ``report.html`` from what a results folder holds: tables, runs, modes, pictures.

    Parameters
    ----------
    folder : path
        What ``exugear ste``, ``run`` and ``modes`` wrote into.
    target : float, optional
        Frequency to look for modes at, Hz; the case's reference frequency by default. Without either, modes are listed.
    tell : callable, optional
        Called with what is being done.
    files_below : Path, optional
        A further folder that files may lie in which the gearbox file names. Scripts among them never run: what they
        would make must be kept in the folder.

    Returns
    -------
    Report

    Raises
    ------
    CaseError
        The folder holds no results.
    ReportError
        Neither tables nor modes nor runs in it belong to its case.
    """
    folder = Path(folder)
    gearbox = kept_case(folder, Permissions(below=files_below))
    reference = gearbox.case.report.reference_frequency_Hz if target is None else target
    writer = _Writer(folder, gearbox, reference, tell or (lambda what: None))
    tables = _tables(writer)
    modes = dict(_stored_modes(writer))
    runs = list(_stored_runs(writer, modes))
    if not (tables or modes or runs):
        raise ReportError(
            "\n".join([f"{folder}: nothing here belongs to its case", *(writer.left_out or ["no files"])])
        )
    body = [
        _runs_section(writer, runs),
        _modes_section(writer, modes),
        _tables_section(writer, tables),
        _times_section(folder),
        _provenance_section(writer, tables, runs, modes),
    ]
    head = [page.paragraph(_subtitle(writer.gearbox)), page.section("In short", page.bullets(writer.statements))]
    if writer.distrusted:
        title = "Runs that are not to be trusted; what follows shows them all the same"
        head.insert(0, page.alert(title, writer.distrusted))
    if writer.left_out:
        head.append(page.section("Left out", page.bullets(writer.left_out)))
    head.append(_assumptions_section(writer))
    path = folder / REPORT_FILE
    whole = page.whole(f"{writer.gearbox.name}: transmission error and dynamics", *head, *body)
    write_file(path, whole.encode("utf-8"))
    return Report(path, tuple(writer.statements), tuple(writer.left_out), tuple(writer.pictures))


def _subtitle(gearbox: Gearbox) -> str:
    return f"Ratio {gearbox.train.ratio:.6f}; case {gearbox.source}."


def _tables(writer: _Writer) -> dict[str, MeshTable]:
    found = {}
    for name in dict.fromkeys(mesh.pair.name for mesh in writer.gearbox.meshes):
        try:
            found[name] = fitting_table(writer.gearbox, name, writer.folder)
        except TableError as error:
            writer.left_out.append(f"table of {name}: {error}")
    return found


def _stored_modes(writer: _Writer) -> Iterator[tuple[Model, xr.Dataset]]:
    for path in sorted(writer.folder.glob("*/*/modes.nc")):
        try:
            data = load_modes(path)
        except FileError as error:
            writer.left_out.append(str(error))
            continue
        if writer.fits(path, data.attrs):
            yield Model.of(data.attrs), data


def _stored_runs(writer: _Writer, modes: Mapping[Model, xr.Dataset]) -> Iterator[VariantRun]:
    """Read the runs that fit; those to be compared share one window."""
    lines = order_lines(writer.gearbox)
    windows: dict[tuple[str, ...], float] = {}
    whole = set(writer.folder.glob(f"*/*/{FINAL_NAME}"))
    stopped = {path for path in writer.folder.glob(f"*/*/{PARTIAL_NAME}") if path.with_name(FINAL_NAME) not in whole}
    for path in sorted(whole | stopped):
        try:
            attributes = load_run(path, ()).attrs
            if not writer.fits(path, attributes):
                continue
            _note_distrust(writer, path, attributes)
            writer.tell(f"spectra of {path.relative_to(writer.folder)}")
            key = _run_key(attributes)
            run = read_run(path, lines, modes.get(Model.of(attributes)), windows.get(key))
        except FileError as error:
            writer.left_out.append(str(error))
            continue
        except ValueError as error:
            writer.left_out.append(f"{path.relative_to(writer.folder)}: {error}")
            continue
        windows[key] = run.spectra.window_length
        yield run


def _note_distrust(writer: _Writer, path: Path, attributes: Mapping[str, Any]) -> None:
    """Name a run that is not to be trusted, with the reason that its file gives."""
    verdict = verdict_of(attributes)
    if verdict:
        name = path.relative_to(writer.folder)
        writer.distrusted.append(f"{name}: {verdict}")
        writer.statements.append(f"Not to be trusted: {name}: {verdict}")


def _run_key(attributes: Mapping[str, Any]) -> tuple[str, str, str]:
    """Load case, law and inertia set: what runs to be compared have in common."""
    return str(attributes["load_case"]), str(attributes["mesh_law"]), str(attributes["inertias"])


def _runs_section(writer: _Writer, runs: Sequence[VariantRun]) -> str:
    groups: dict[tuple[str, str, str], list[VariantRun]] = {}
    for run in runs:
        groups.setdefault(_run_key(run.attributes), []).append(run)
    content = [_group(writer, key, members) for key, members in sorted(groups.items(), key=_default_first(writer))]
    return page.section("Run-ups", *content)


def _default_first(writer: _Writer) -> Callable[[tuple[tuple[str, str, str], object]], tuple[bool, tuple[str, ...]]]:
    return lambda item: (item[0][2] != writer.gearbox.case.default_inertias, item[0])


def _group(writer: _Writer, key: tuple[str, str, str], runs: Sequence[VariantRun]) -> str:
    """Section of the runs of one load case, law and inertia set."""
    load_case, law, inertias = key
    label = f"load case {load_case}, law {law}, inertias {inertias}, housing factor " + ", ".join(
        sorted({f"{float(run.attributes['housing_factor']):g}" for run in runs})
    )
    writer.tell(f"waterfalls, {label}")
    stiff = [run for run in runs if run.variant == STIFF]
    others = [run for run in runs if run.variant != STIFF]
    comparisons = [compare(other, stiff[0]) for other in others] if stiff else []
    file_part = f"{load_case}-{law}-{inertias}"
    doubtful = [f"{run.variant}: {verdict_of(run.attributes)}" for run in runs if verdict_of(run.attributes)]
    content = [page.alert("Not to be trusted", doubtful)] if doubtful else []
    content.append(_waterfall_picture(writer, stiff + others, comparisons, label, file_part))
    content += [_only_table(writer, comparison, label) for comparison in comparisons]
    content.append(_levels_picture(writer, stiff + others, label, file_part))
    for run in stiff + others:
        rows = [_finding_row(finding) for finding in run.findings()]
        title = f"All resonances of variant {run.variant}: {len(rows)}"
        content.append(page.folded(title, page.table(rows, ("order", "mode"))))
    content.append(page.section("What was run", page.table([_run_row(run) for run in runs], ("solver",)), level=4))
    return page.section(label[0].upper() + label[1:], *content, level=3)


def _waterfall_picture(
    writer: _Writer, runs: Sequence[VariantRun], comparisons: Sequence[Comparison], label: str, file_part: str
) -> str:
    lines = order_lines(writer.gearbox)
    fundamental = max(writer.gearbox.train.mesh_frequencies(2.0 * math.pi).values())
    fastest = max(float(run.spectra.speed.max()) for run in runs)
    top = min(1.1 * fundamental * fastest / (2.0 * math.pi), *(float(run.spectra.frequency[-1]) for run in runs))
    marks = {c.first.variant: [finding.strongest for finding in c.only_first] for c in comparisons}
    path = writer.picture(f"waterfall-{file_part}")
    spectra = {run.variant: run.spectra for run in runs}
    plot_waterfalls(spectra, lines, path, marks=marks, highest_frequency=top)
    caption = f"Overall transmission error over speed; {label}. {runs[0].spectra.description}."
    if comparisons:
        caption += f" Circles: resonances that variant {STIFF} does not show, numbered as in the table below."
    return page.picture(path, caption)


def _only_table(writer: _Writer, comparison: Comparison, label: str) -> str:
    name = comparison.first.variant
    found = comparison.only_first
    rows = [{"no.": number, **_finding_row(finding)} for number, finding in enumerate(found, start=1)]
    back = comparison.only_second
    listed, reverse = _listed(found), _listed(back)
    writer.statements.append(
        f"Resonances in {name} and not in {STIFF} ({label}): {listed}. In {STIFF} and not in {name}: {reverse}."
    )
    return page.section(
        f"Resonances in {name} and not in {STIFF}",
        page.table(rows, ("order", "mode")) or page.paragraph("None."),
        page.paragraph(
            f"Rule: {comparison.rule.description}. Frequencies agree with eigenfrequencies within the resolution of "
            f"the sweep. The other way round, in {STIFF} and not in {name}: {reverse}."
        ),
        level=4,
    )


def _listed(found: Sequence[Finding]) -> str:
    return ", ".join(f"{finding.resonance.frequency:.0f}" for finding in found) + " Hz" if found else "none"


def _finding_row(finding: Finding) -> dict[str, object]:
    pick = finding.strongest
    matched = finding.mode is not None
    return {
        "frequency / Hz": f"{finding.resonance.frequency:.0f} ± {finding.resonance.resolution:.0f}",
        "speed / rpm": f"{finding.speed:.1f}",
        "order": f"{pick.line.name} ({pick.line.order:.2f})",
        "orders that show it": len({other.line for other in finding.resonance.picks}),
        "level / dB": f"{pick.level:.1f}",
        "prominence / dB": f"{pick.prominence:.1f}",
        "eigenfrequency / Hz": f"{finding.mode_frequency:.1f}" if matched else "–",
        "mode": finding.mode_name if matched else "none within the resolution",
    }


def _levels_picture(writer: _Writer, runs: Sequence[VariantRun], label: str, file_part: str) -> str:
    lines = order_lines(writer.gearbox, 1)
    reached = [line for line in lines if any(np.isfinite(line.frequency(run.spectra.speed)).any() for run in runs)]
    path = writer.picture(f"orders-{file_part}")
    plot_order_levels(
        {run.variant: run.spectra for run in runs}, reached, path, marks={run.variant: run.picks for run in runs}
    )
    return page.picture(path, f"Level of the overall transmission error along the mesh orders; {label}.")


def _run_row(run: VariantRun) -> dict[str, object]:
    data = load_run(run.path, ("time", *MESH_TIMES, *BALANCE_TERMS))
    times = [float(data[name].max()) for name in MESH_TIMES]
    figures = energy_residual(data)
    end = float(data["time"][-1])
    return {
        "variant": run.variant,
        "to be trusted": "NO, see above" if verdict_of(run.attributes) else "yes",
        "solver": run.attributes["solver"],
        "step / µs": f"{1e6 * float(run.attributes['step']):g}",
        "simulated / s": f"{end:.2f}" + ("" if int(run.attributes["complete"]) else " (stopped)"),
        "fastest / rpm": f"{float(run.spectra.speed.max()) / RPM:.1f}",
        "energy not accounted for": f"{figures:.1e}",
        **{f"{what} / s": f"{time:.3g}" for what, time in zip(MESH_TIME_LABELS, times, strict=True)},
    }


def _modes_section(writer: _Writer, modes: Mapping[Model, xr.Dataset]) -> str:
    if not modes:
        return ""
    for model, data in modes.items():
        growth = float(data.attrs["growth_rate"])
        if growth > 0.0:
            writer.statements.append(f"{model.words}: unstable, disturbances grow by up to {growth:.3g} 1/s.")
    listed = [_all_modes(model, data) for model, data in modes.items()]
    if writer.reference is None:
        return page.section("Modes", *listed)
    return page.section(f"Modes near {writer.target:.0f} Hz", *_modes_near(writer, modes), *listed)


def _modes_near(writer: _Writer, modes: Mapping[Model, xr.Dataset]) -> Iterator[str]:
    """Tell of the modes near the reference frequency, what they depend on, and what would bring one there."""
    rows, pictures = [], []
    for model, data in modes.items():
        nearest = nearest_mode(data, writer.target)
        seen = nearest_mode(data, writer.target, SEEN)
        if nearest is None or seen is None:
            continue
        rows.append(_nearest_row(model, nearest, writer.target))
        if seen.place != nearest.place:
            rows.append(_nearest_row(model, seen, writer.target))
        writer.statements.append(_nearest_statement(model, data, nearest, seen, writer.target))
        pictures.append(_energies_picture(writer, model, seen))
    sensitivity, found = _sensitivity(writer, modes)
    yield page.table(rows, ("inertias", "what moves"))
    yield page.paragraph(
        "Share: of the mode in the mobility of the overall transmission error; amplification: overall transmission "
        "error at resonance per transmission error of the mesh named. Where the nearest mode has a share under "
        f"{100 * SEEN:g} %, the nearest that has more stands below it. Near means within {100 * NEAR:g} %."
    )
    yield _mode_picture(writer, modes, found)
    yield page.folded("Where the energy of these modes sits", "".join(pictures))
    yield sensitivity


def _nearest_row(model: Model, mode: ModeReport, target: float) -> dict[str, object]:
    return {
        "variant": model.variant,
        "inertias": f"{model.inertias} ({model.law})",
        "frequency / Hz": f"{mode.frequency:.1f}",
        "near": "yes" if mode.is_near(target) else "no",
        "damping / %": f"{100 * mode.damping_ratio:.2f}",
        "share / %": f"{100 * mode.share:.1f}",
        "amplification": f"{mode.amplification:.2f} ({mode.mesh})",
        "what moves": mode.name,
    }


def _nearest_statement(model: Model, data: xr.Dataset, nearest: ModeReport, seen: ModeReport, target: float) -> str:
    factor = float(data.attrs["housing_factor"])
    what = f"Variant {model.words}, housing factor {factor:g}"
    if seen.is_near(target):
        return (
            f"{what}: a mode at {seen.frequency:.0f} Hz, near {target:.0f} Hz, which the overall transmission error "
            f"sees with a share of {100 * seen.share:.0f} % ({seen.name})."
        )
    if nearest.is_near(target):
        return (
            f"{what}: a mode at {nearest.frequency:.0f} Hz, near {target:.0f} Hz, but the overall transmission error "
            f"hardly sees it (share {100 * nearest.share:.2g} %; {nearest.name})."
        )
    return (
        f"{what}: no mode within {100 * NEAR:g} % of {target:.0f} Hz; the nearest that the overall transmission error "
        f"sees is at {seen.frequency:.0f} Hz ({seen.name})."
    )


def _energies_picture(writer: _Writer, model: Model, mode: ModeReport) -> str:
    path = writer.picture(f"energies-{model.file_part}")
    title = f"{model.words}: {mode.frequency:.0f} Hz, damping {100 * mode.damping_ratio:.1f} %"
    plot_mode_energies(mode.strain, mode.kinetic, path, title=title)
    return page.picture(path, title)


def _all_modes(model: Model, data: xr.Dataset) -> str:
    reports = [report_mode(data, place) for place in range(data.sizes["mode"])]
    rows = [
        {
            "no.": mode.place + 1,
            "frequency / Hz": f"{mode.frequency:.1f}",
            "damping / %": f"{100 * mode.damping_ratio:.2f}",
            "share / %": f"{100 * mode.share:.2f}",
            "amplification": f"{mode.amplification:.2f}",
            "by mesh": mode.mesh if mode.amplification >= 0.01 else "–",
            "what moves": mode.name,
        }
        for mode in reports
    ]
    return page.folded(f"All {len(rows)} modes of {model.words}", page.table(rows, ("what moves", "by mesh")))


def _sensitivity(writer: _Writer, modes: Mapping[Model, xr.Dataset]) -> tuple[str, list[tuple[Model, Remedy]]]:
    """Diagrams of the sensitivities of the compliant models, and what brings a mode to the target."""
    content: list[str] = []
    found: list[tuple[Model, Remedy]] = []
    compliant = [model for model in modes if model.variant != STIFF] or list(modes)
    for model in sorted(compliant, key=lambda model: model.inertias != writer.gearbox.case.default_inertias):
        writer.tell(f"sensitivities of {model.words}")
        stiffness = writer.stiffness(model.law)
        parameters = parameters_of(writer.gearbox, model.choice, stiffness, writer.bodies_of(model))
        sweeps = [sweep_modes(parameter) for parameter in parameters]
        found += [(model, remedy) for remedy in remedies(sweeps, writer.target, SEEN)]
        content.append(_sweeps_picture(writer, model, sweeps))
        content.append(_damping_table(sweeps, writer.target))
    rows = [_remedy_row(writer, model, remedy) for model, remedy in found]
    told = page.table(rows, ("inertias", "assumption", "what moves"))
    if found:
        writer.statements.append(
            f"Assumptions that bring a mode seen by the overall transmission error to {writer.target:.0f} Hz: "
            + "; ".join(_remedy_words(model, remedy) for model, remedy in found)
            + "."
        )
    none = page.paragraph(f"No value in the ranges drawn brings a mode that is seen to {writer.target:.0f} Hz.")
    title = f"Assumptions that bring a mode to {writer.target:.0f} Hz"
    joined = page.section("Sensitivity to what was assumed", *content, level=3)
    return joined + page.section(title, told or none, level=3), found


def _remedy_words(model: Model, remedy: Remedy) -> str:
    parameter = remedy.parameter
    return (
        f"{parameter.label} = {remedy.value:.3g} instead of {parameter.default:g} "
        f"({model.words}: {remedy.modes.frequency[remedy.place]:.0f} Hz)"
    )


def _remedy_row(writer: _Writer, model: Model, remedy: Remedy) -> dict[str, object]:
    mode = report_mode(remedy.modes.to_dataset(), remedy.place)
    counterpart = _counterpart(writer, model, remedy)
    return {
        "variant": model.variant,
        "inertias": f"{model.inertias} ({model.law})",
        "assumption": f"{remedy.parameter.label} = {remedy.value:.3g}, default {remedy.parameter.default:g}",
        "frequency / Hz": f"{mode.frequency:.0f}",
        "share / %": f"{100 * mode.share:.1f}",
        "amplification": f"{mode.amplification:.2f} ({mode.mesh})",
        f"nearest seen in {STIFF} / Hz": f"{counterpart:.0f}",
        "what moves": mode.name,
    }


def _counterpart(writer: _Writer, model: Model, remedy: Remedy) -> float:
    """Frequency (Hz) of the nearest mode that is seen in the stiff variant under the same assumption."""
    stiffness = writer.stiffness(model.law)
    choice = replace(model.choice, variant=STIFF)
    same = [
        parameter
        for parameter in parameters_of(writer.gearbox, choice, stiffness)
        if parameter.label == remedy.parameter.label
    ]
    stiff = same[0].build(remedy.value) if same else writer.assembled(Model(STIFF, model.law, model.inertias))
    found = nearest_mode(modes_of(stiff).to_dataset(), writer.target, SEEN)
    return found.frequency if found else math.nan


def _sweeps_picture(writer: _Writer, model: Model, sweeps: Sequence[Sweep]) -> str:
    window = (0.45 * writer.target, 1.65 * writer.target)
    drawn = [sweep.near(window, DRAWN) for sweep in sweeps]
    # Only what lies in the window sets the scale: modes far below are amplified a hundred times more.
    inside = [float(np.max(sweep.amplification, initial=0.0, where=(sweep.frequency >= window[0]))) for sweep in drawn]
    loudest = max([*inside, 1e-12])
    path = writer.picture(f"sensitivity-{model.file_part}")
    plot_sensitivities(
        [
            Sensitivity(
                sweep.parameter.label,
                np.array(sweep.parameter.values),
                np.where((sweep.frequency >= window[0]) & (sweep.frequency <= window[1]), sweep.frequency, np.nan),
                np.minimum(sweep.amplification / loudest, 1.0),
                sweep.parameter.default,
                sweep.parameter.logarithmic,
            )
            for sweep in drawn
        ],
        path,
        target=writer.target,
        window=window,
        title=f"{model.words}; size of the points: amplification, largest {loudest:.1f}",
    )
    caption = (
        f"Eigenfrequencies of {model.words}, each with all other inputs at their defaults; modes with a share over "
        f"{100 * DRAWN:g} % of the overall transmission error's mobility."
    )
    return page.picture(path, caption)


def _damping_table(sweeps: Sequence[Sweep], target: float) -> str:
    """Amplification over mesh damping of the seen mode nearest to the target: its frequency hardly moves."""
    chosen = [sweep for sweep in sweeps if sweep.parameter.label.startswith("mesh damping")]
    if not chosen:
        return ""
    sweep = chosen[0]
    seen = np.flatnonzero(sweep.share[0] >= SEEN)
    if not seen.size:
        return ""
    mode = int(seen[np.argmin(np.abs(sweep.frequency[0, seen] - target))])
    rows = [
        {
            sweep.parameter.label: f"{value:g}",
            "frequency / Hz": f"{sweep.frequency[n, mode]:.1f}",
            "damping / %": f"{100 * sweep.damping_ratio[n, mode]:.2f}",
            "amplification": f"{sweep.amplification[n, mode]:.2f}",
        }
        for n, value in enumerate(sweep.parameter.values)
    ]
    return page.folded(f"Mesh damping and the mode at {sweep.frequency[0, mode]:.0f} Hz", page.table(rows))


def _mode_picture(writer: _Writer, modes: Mapping[Model, xr.Dataset], found: Sequence[tuple[Model, Remedy]]) -> str:
    """Picture of the mode near the target: one of the stored models, or under an assumption that is named."""
    pictures = []
    near = []
    for model, data in modes.items():
        seen = nearest_mode(data, writer.target, SEEN)
        if seen is not None:
            near.append((model.variant == STIFF or not seen.is_near(writer.target), seen.frequency, model, seen))
    for stands_back, _, model, seen in sorted(near, key=lambda item: (item[0], abs(item[1] - writer.target)))[:1]:
        title = f"{seen.frequency:.0f} Hz: {model.words}\n{seen.name}"
        shape = modes[model]["shape"].isel(mode=seen.place).to_numpy()
        pictures.append(_drawn_mode(writer, writer.assembled(model), shape, title, f"mode-{model.file_part}"))
        if stands_back and found:
            other, remedy = max(found, key=lambda item: _share(item[1]))
            changed = f"{remedy.parameter.label} = {remedy.value:.3g} instead of {remedy.parameter.default:g}"
            title = f"{remedy.modes.frequency[remedy.place]:.0f} Hz: {other.words}, {changed}\n"
            title += remedy.modes.names[remedy.place]
            shape = remedy.modes.shapes[:, remedy.place]
            pictures.insert(0, _drawn_mode(writer, remedy.modes.assembly, shape, title, f"mode-{writer.target:.0f}-Hz"))
    return "".join(pictures)


def _share(remedy: Remedy) -> float:
    modes: Modes = remedy.modes
    return float(modes.overall[remedy.place] ** 2 / np.sum(modes.overall**2))


def _drawn_mode(writer: _Writer, assembly: Assembly, shape: Any, title: str, name: str) -> str:
    writer.tell("picture of a mode")
    path = writer.picture(name)
    try:
        if assembly.elastic_bodies:
            draw_elastic_bodies(elastic_scene(assembly, shape, title=title), path)
        else:
            draw_mode(mode_scene(bodies_of(assembly.gearbox), _motions(assembly, shape), title=title), path)
    except RenderingError as error:
        writer.pictures.remove(path)
        writer.left_out.append(f"picture of a mode: {error}")
        return page.paragraph(f"No picture of the mode: {error}", "warning")
    return page.picture(path, f"Mode shape, {title}.".replace("\n", "; "))


def _motions(assembly: Assembly, shape: Any) -> dict[str, Any]:
    """Motions of the bodies that have a shape to draw."""
    drawn = {body.name for body in bodies_of(assembly.gearbox)}
    motions = motions_of(assembly.bodies, assembly.coordinates, assembly.rigid_part(shape))
    return {name: motion for name, motion in motions.items() if name in drawn}


def _tables_section(writer: _Writer, tables: Mapping[str, MeshTable]) -> str:
    if not tables:
        return ""
    rows = [
        {
            "pair": name,
            "torque on gear 1 / N m": f"{float(state['torque']):.1f}",
            "positions": state.sizes["pmc"],
            "mean / µm": f"{1e6 * float(state['ste'].mean()):.2f}",
            "peak to peak / µm": f"{1e6 * float(state['ste'].max() - state['ste'].min()):.3f}",
            "mean stiffness / (N/µm)": f"{1e-6 * float(state['mesh_stiffness'].mean()):.0f}",
            "ISO 6336-1 B / (N/µm)": f"{1e-6 * iso6336_stiffness(writer.gearbox.pairs[name]):.0f}",
        }
        for name, state in ((name, table.static_state) for name, table in tables.items())
    ]
    folder = writer.folder / PICTURE_FOLDER
    curves = folder / "ste.png"
    shown = page.picture(curves, "Static transmission error over the mesh cycle.") if curves.is_file() else ""
    teeth = [folder / f"{kind}_{name}.png" for name in tables for kind in ("contact", "load_share")]
    more = "".join(page.picture(path, path.stem.replace("_", " ")) for path in teeth if path.is_file())
    return page.section(
        "Static transmission error", page.table(rows), shown, page.folded("Teeth in contact", more) if more else ""
    )


def _assumptions_section(writer: _Writer) -> str:
    gearbox, case = writer.gearbox, writer.gearbox.case
    acceleration = np.linalg.norm(case.gravity.acceleration_m_per_s2)
    return page.section(
        "Assumptions",
        page.bullets(
            [
                f"Inertia sets: {', '.join(gearbox.inertia_sets)}; default {case.default_inertias}.",
                f"Housing factor on the stiffness of bearings in the housing: {case.housing.factor:g}.",
                "Damping proportional to stiffness: bearings "
                f"{1e6 * case.damping.bearing_time_s:g} µs, meshes {1e6 * case.damping.mesh_time_s:g} µs, couplings "
                f"{1e6 * case.damping.coupling_time_s:g} µs times the stiffness.",
                f"Gravity {'off' if acceleration == 0.0 else f'{acceleration:.2f} m/s²'}.",
                "Mesh stiffness is that at the static load of the case; meshes are bilateral, and the time in which "
                "teeth would have to pull is counted.",
                "Modes: linearised at the static load, mesh stiffness averaged over the mesh cycle.",
                *_elastic_words(writer),
            ]
        ),
        page.paragraph(f"Sources and confidence of all inputs: {gearbox.source} and the README beside it."),
    )


def _elastic_words(writer: _Writer) -> Iterator[str]:
    """Say which bodies are elastic in the models of the report, and how finely."""
    assembly = next((one for one in writer.models.values() if one.elastic_bodies), None)
    if assembly is None:
        return
    case = writer.gearbox.case
    parts = []
    for name, body in assembly.elastic_bodies.items():
        unknowns = sum(body.reduced.figures.unknowns.values())
        parts.append(f"{name} ({unknowns} unknowns reduced to {body.reduced.size} coordinates)")
    yield (
        f"Elastic in the variant {assembly.variant}: {', '.join(parts)}; damping {1e6 * case.damping.body_time_s:g} µs "
        f"times the stiffness, modes listed up to {case.elasticity.band_Hz:g} Hz."
    )
    if any(body.fixed for body in assembly.bodies):
        yield f"In the variant {assembly.variant} the elastic housing takes the place of the housing factor."


def _times_section(folder: Path) -> str:
    spent = times_spent(folder)
    rows = [
        {"step": entry.step, "wall / s": f"{entry.seconds:.1f}", "peak memory / MB": f"{1e-6 * entry.memory:.0f}"}
        for entry in spent
    ]
    return page.section(
        "Where the time went",
        page.table(rows),
        page.paragraph("Each step was a process of its own; some ran side by side.") if rows else "",
    )


def _provenance_section(
    writer: _Writer, tables: Mapping[str, MeshTable], runs: Iterable[VariantRun], modes: Mapping[Model, xr.Dataset]
) -> str:
    rows: list[dict[str, object]] = [
        {"result": f"table {name}", "SHA-256 of its input": table.input_hash} for name, table in tables.items()
    ]
    rows += [
        {"result": str(run.path.relative_to(writer.folder)), "SHA-256 of its input": run.attributes["input_hash"]}
        for run in runs
    ]
    rows += [
        {"result": f"modes {model.words}", "SHA-256 of its input": data.attrs["input_hash"]}
        for model, data in modes.items()
    ]
    versions = [f"Python {platform.python_version()}", *(f"{name} {_version(name)}" for name in PACKAGES)]
    return page.section(
        "Provenance",
        page.table(rows, ("SHA-256 of its input",)),
        page.paragraph(f"{', '.join(versions)}; {platform.platform()}."),
    )


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "(not installed)"
