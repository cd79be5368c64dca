"""Results in the folder that belong to its case: tables, modes and runs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import xarray as xr

from exugear.gearbox.choice import Choice
from exugear.gearbox.reading import CaseError
from exugear.gearbox.variant import VariantError
from exugear.report.findings.context import Context, choice_of
from exugear.results.run_file import FINAL_NAME, PARTIAL_NAME, load_run, verdict_of
from exugear.results.spectra.orders import order_lines
from exugear.results.spectra.run_spectra import RunSignals, VariantRun, analysed, run_signals
from exugear.steady.steady_file import load_response, settings_of
from exugear.system.bearings.rolling.rows import BearingError
from exugear.system.eigenmodes.modes import load_modes
from exugear.system.fingerprint import input_hash
from exugear.system.statics import BalanceError
from exugear.system.tooth_mesh.placement import MeshError
from exugear.system.tooth_mesh.tables import fitting_table
from fe_ste.tools.files import FileError
from fe_ste.transmission_error.table import MeshTable, TableError

OTHER_INPUT = "was computed from another input; compute it again"
_UNFIT = (CaseError, MeshError, VariantError, BearingError, BalanceError, KeyError)
"""What the case of the folder may say to the choice that a file was computed of."""


@dataclass(frozen=True)
class StoredResults:
    """What a report is made from."""

    tables: Mapping[str, MeshTable]
    """By pair name."""
    modes: Mapping[Choice, xr.Dataset]
    """As `exugear.system.eigenmodes.modes.Modes.to_dataset` makes them."""
    runs: Sequence[VariantRun]
    steady: Sequence[xr.Dataset] = ()
    """Steady responses as `exugear.steady.steady_file.load_response` reads them."""

    def __bool__(self) -> bool:
        """Tell whether there is anything to report."""
        return bool(self.tables or self.modes or self.runs or self.steady)


def stored_models(context: Context) -> StoredResults:
    """Read the tables and modes that belong to the case of the folder, which is soon done; note what does not."""
    return StoredResults(_stored_tables(context), dict(_stored_modes(context)), ())


def with_responses(context: Context, models: StoredResults) -> StoredResults:
    """Add the runs and steady responses that belong to the case of the folder; what does not is noted as left out."""
    runs = list(_stored_runs(context, models.modes))
    return replace(models, runs=runs, steady=list(_stored_steady(context)))


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
            context.notes.left_out.append(f"{context.name_of(path)}: {error}")
            continue
        if fits:
            yield data
        else:
            context.notes.left_out.append(f"{context.name_of(path)}: {OTHER_INPUT}")


def _stored_tables(context: Context) -> dict[str, MeshTable]:
    tables = {}
    for name in dict.fromkeys(mesh.pair.name for mesh in context.gearbox.meshes):
        if name in context.gearbox.stated_stiffness:
            continue
        try:
            tables[name] = fitting_table(context.gearbox, name, context.folder)
        except TableError as error:
            context.notes.left_out.append(f"table of {name}: {error}")
    return tables


def _stored_modes(context: Context) -> Iterator[tuple[Choice, xr.Dataset]]:
    for path in sorted(context.folder.glob("*/*/modes.nc")):
        try:
            data = load_modes(path)
        except FileError as error:
            context.notes.left_out.append(str(error))
            continue
        if _fits(context, path, data.attrs):
            yield choice_of(data.attrs), data


def _stored_runs(context: Context, modes: Mapping[Choice, xr.Dataset]) -> Iterator[VariantRun]:
    """Read the runs that fit; those to be compared share one window, the longest, whichever is read first."""
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
                context.notes.left_out.append(f"{context.name_of(signals.path)}: {error}")


def _fitting_signals(context: Context, path: Path) -> tuple[RunSignals, float] | None:
    """Signals of a run that fits the case, and the window that suits it (s); None where it is left out."""
    try:
        attributes = load_run(path, ()).attrs
        if not _fits(context, path, attributes):
            return None
        _note_distrust(context, path, attributes)
        signals = run_signals(path)
        return signals, signals.suitable_window
    except FileError as error:
        context.notes.left_out.append(str(error))
    except ValueError as error:
        context.notes.left_out.append(f"{context.name_of(path)}: {error}")
    return None


def bytes_of_runs(context: Context) -> int:
    """Size of the runs in the folder that ended."""
    return sum(path.stat().st_size for path in _run_files(context.folder) if path.is_file())


def _run_files(folder: Path) -> list[Path]:
    """List runs that ended, and those that were stopped and not taken up again."""
    ended = set(folder.glob(f"*/*/{FINAL_NAME}"))
    stopped = {path for path in folder.glob(f"*/*/{PARTIAL_NAME}") if path.with_name(FINAL_NAME) not in ended}
    return sorted(ended | stopped)


def _fits(context: Context, path: Path, attributes: Mapping[str, Any]) -> bool:
    """Tell whether a file was computed from the case of the folder; if not, note why it is left out."""
    load_case = attributes.get("load_case")
    try:
        if load_case is not None and load_case not in context.gearbox.load_cases:
            raise CaseError(f"the case has no load case {load_case!r}")
        if input_hash(context.assembled(choice_of(attributes)), load_case) == attributes.get("input_hash"):
            return True
        reason = OTHER_INPUT
    except _UNFIT as error:
        reason = str(error)
    context.notes.left_out.append(f"{context.name_of(path)}: {reason}")
    return False


def _note_distrust(context: Context, path: Path, attributes: Mapping[str, Any]) -> None:
    """Name a run that is not to be trusted, with the reason that its file gives."""
    verdict = verdict_of(attributes)
    if verdict:
        name = context.name_of(path)
        context.notes.distrusted.append(f"{name}: {verdict}")
        context.notes.statements.append(f"Not to be trusted: {name}: {verdict}")


def run_key(attributes: Mapping[str, Any]) -> tuple[str, str, str]:
    """Load case, law and inertia set: what runs to be compared have in common."""
    return str(attributes["load_case"]), str(attributes["mesh_law"]), str(attributes["inertias"])
