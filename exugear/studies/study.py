"""Definition of a study (gearbox, varied points and outputs), read from a file and checked."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.named_files import NOTHING_MORE, Permissions
from exugear.gearbox.reading import GearboxFileError, error_line
from exugear.gearbox.variant import Variant
from exugear.gearbox.versions import LIFE, MODES, REDUCTION, RUN, STEADY, STUDY
from exugear.results.folder import case_digest, content_digest, read_content
from exugear.results.sound.radiated_power import radiating_names
from exugear.steady.mean_system.mean_system import mean_system
from exugear.steady.mean_system.mesh_waves import mesh_waves
from exugear.steady.mean_system.planet_sets import SteadyError
from exugear.steady.mean_system.signals import SURFACE_VELOCITY, mesh_signal_names, named_amplitudes, signal_rows
from exugear.steady.settings import SpeedRange, SteadySettings, check_law
from exugear.studies.point_results import PointSettings, life_loads
from exugear.studies.quantities import (
    LIVES,
    MINIMUM,
    OVERALL,
    QUANTITIES,
    SAFETIES,
    Output,
    OutputError,
    OutputKind,
    listed,
    nearest_names,
    outputs_of,
)
from exugear.studies.sampling import (
    PARAMETER,
    SAMPLE,
    SIDE,
    Design,
    PathError,
    Point,
    Tolerances,
    changed,
    check_path,
    design_of,
    tolerances_of,
)
from exugear.studies.sections import StudyError, StudyFile, parse_study, read_study_file
from exugear.system.bearings.stiffness import elastic_names, mounts_at_work
from exugear.system.build import assemble
from exugear.system.signals import AXES, signals_of, turning_bodies
from exugear.system.statics import BalanceError
from exugear.system.tooth_mesh.laws.registry import LAWS
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness
from fe_ste.tools.display import ReprMixin
from fe_ste.tools.files import file_digest
from fe_ste.tools.versions import TABLE

OF_POINTS = ("error", "doubts", "seconds", "memory")
"""Variables of a dataset for each point in addition to its outputs."""
OF_SEARCHES = ("evaluation", "on_front", "meets_limits")
SLOPE = "slope_"
"""Prefix of the name of an output for its local derivative."""
LIMITS: Mapping[str, tuple[float, float]] = {
    "count": (1, 10_000),
    "harmonic": (1, 1000),
    "positions": (4, 2000),
    "near_Hz": (0.0, 1e9),
    "from_Hz": (0.0, 1e9),
    "to_Hz": (0.0, 1e9),
    "spacing": (1e-6, 1e6),
    "centre": (0.0, 1e6),
    "torque_factors": (1e-6, 1e3),
    "misalignment_um": (-1e5, 1e5),
    "speed_rpm": (-1e7, 1e7),
}
"""Minimum and maximum of the options of outputs."""
SHOWN = 3
"""Maximum number of values of a point that a message lists."""
ORDER_WORDS = ("x", "+", "-", "rotation", "of", "in")
"""Words in the names of orders beside those of meshes and bodies: ``2 x stage_1``, ``12 x rotation of rotor``."""


def errors_of_names(study: StudyFile, kept: Mapping[str, Output]) -> Iterator[str]:
    """Report parameters and outputs whose names the dataset reserves for other variables."""
    taken = dict.fromkeys(OF_POINTS, "the results of each point")
    drawn = [name for name, parameter in study.parameters.items() if parameter.is_drawn]
    stepped = any(parameter.kind == "step" for parameter in study.parameters.values())
    if study.optimise is not None:
        taken |= dict.fromkeys(OF_SEARCHES, "the points of an optimisation")
        if study.tolerances:
            taken[SAMPLE] = "the draws"
            listed = [name for name, tolerance in study.tolerances.items() if tolerance.paths]
            taken |= {f"{name}_path": f"the paths of tolerances.{name}" for name in listed}
            sides = [(name, side) for name in study.outputs for side in ("high", "low")]
            taken |= {f"{name}_{side}": f"a percentile of outputs.{name}" for name, side in sides}
    elif drawn:
        taken[SAMPLE] = "the draws"
        taken |= {f"{name}_path": f"the paths of parameters.{name}" for name in drawn if study.parameters[name].paths}
    if stepped:
        taken |= dict.fromkeys((PARAMETER, SIDE, "step"), "local derivatives")
        taken |= {f"{SLOPE}{name}": f"the local derivative of outputs.{name}" for name in study.outputs}
    for name, output in kept.items():
        if output.quantity.dimension:
            taken.setdefault(output.quantity.dimension, f"a dimension of outputs.{name}")
    named = {"parameters": () if stepped else study.parameters, "tolerances": study.tolerances}
    for table, names in {**named, "outputs": study.outputs}.items():
        for name in names:
            if name in taken:
                yield f"{table}.{name}: this is the name of {taken[name]} in the dataset; choose another name"
    for first, second in (("parameters", "outputs"), ("parameters", "tolerances"), ("tolerances", "outputs")):
        for name in getattr(study, first):
            if name in getattr(study, second):
                yield f"{second}.{name}: {first}.{name} has the same name; rename one"


def errors_of_search(study: StudyFile, kept: Mapping[str, Output]) -> Iterator[str]:
    """Report outputs with several numbers where an optimisation requires one."""
    if study.optimise is None:
        return
    for key, names in (("minimise", study.optimise.minimise), ("limits", list(study.optimise.limits))):
        for name in names:
            along = kept[name].quantity.dimension
            if along:
                yield (
                    f"optimise.{key}: outputs.{name} has a value for each {along}; an optimisation requires a single "
                    "one"
                )


def errors_of_paths(study: StudyFile) -> Iterator[str]:
    """Report paths that two parameters set, or one of them twice, because only the last value would be effective.

    A tolerance may shift or scale the value of a parameter.
    """
    owners: list[tuple[str, str, str]] = []
    sections = [("parameters", *named) for named in study.parameters.items()]
    sections += [("tolerances", *named) for named in study.tolerances.items()]
    for table, name, parameter in sections:
        for path in parameter.targets:
            for before, owner, other in owners:
                if not (f"{path}.".startswith(f"{other}.") or f"{other}.".startswith(f"{path}.")):
                    continue
                if table != before and path == other and parameter.acts != "replaces":
                    continue
                if (before, owner) == (table, name):
                    yield f"{table}.{name}: sets {path} twice; remove one"
                elif table == before:
                    yield f"{table}.{name}: sets {path}, and {before}.{owner} {other}; remove one of them"
                else:
                    yield f'{table}.{name}: replaces {path}, which {before}.{owner} sets; set acts = "shifts"'
                break
            owners.append((table, name, path))


def errors_of_values(design: Design) -> Iterator[str]:
    """Report values that give the same point: listed twice, or scaled from zero."""
    for dimension, changes in design.levels.items():
        seen: dict[str, int] = {}
        for number, change in enumerate(changes):
            first = seen.setdefault(json.dumps(change, sort_keys=True), number)
            if first != number:
                values = ", ".join(f"{path} = {value!r}" for path, value in list(change.items())[:SHOWN])
                what = "draws" if dimension == SAMPLE else f"parameters.{dimension}: values"
                yield f"{what} {first + 1} and {number + 1} are the same point, {values}; remove one"
                break


def errors_of_options(kept: Mapping[str, Output], gearbox: Gearbox, choice: Choice) -> Iterator[str]:
    """Report invalid options of the built-in outputs: out of range, contradictory, or missing in this gearbox."""
    built_in = {id(quantity) for quantity in QUANTITIES.values()}
    known = _names(gearbox, choice)
    for name, output in kept.items():
        if id(output.quantity) not in built_in:
            continue
        for key, value in output.options.items():
            entries = value if isinstance(value, list) else [value]
            low, high = LIMITS.get(key, (-math.inf, math.inf))
            numbers = [entry for entry in entries if isinstance(entry, int | float) and not isinstance(entry, bool)]
            if not all(low <= entry <= high and math.isfinite(entry) for entry in numbers):
                yield f"outputs.{name}.{key} = {value!r}: must be finite, and lie between {low:g} and {high:g}"
            elif key in known and value and value not in known[key]:
                yield f"outputs.{name}.{key} = {str(value)[:200]!r}: no such {key}; there are {listed(known[key])}"
        options = output.options
        if options.get("from_Hz", 0.0) > options.get("to_Hz", math.inf):
            yield f"outputs.{name}.from_Hz = {options['from_Hz']:g}: must be below to_Hz = {options['to_Hz']:g}"
        most = gearbox.ste.positions // 2
        if options.get("harmonic", 1) > most:
            yield (
                f"outputs.{name}.harmonic = {options['harmonic']}: a table of {gearbox.ste.positions} positions has "
                f"{most} harmonics; set a lower harmonic, or more ste.positions"
            )


def errors_of_needs(study: StudyFile, kept: Mapping[str, Output], gearbox: Gearbox) -> Iterator[str]:
    """Report outputs that need results which the study does not compute."""
    for name, output in kept.items():
        needs = output.quantity.needs
        if needs == "steady" and study.steady is None:
            yield f"outputs.{name}: requires a steady-state response; add a section [steady] with speeds"
        if needs == "bearings" and (not Variant.of(study.choice.variant).has_bearings or not _rated_bearings(gearbox)):
            yield (
                f"outputs.{name}: requires bearings with a section catalogue, which the variant "
                f"{study.choice.variant!r} of this gearbox does not have"
            )


def errors_of_signals(kept: Mapping[str, Output], gearbox: Gearbox, choice: Choice) -> Iterator[str]:
    """Report signals and orders that neither runs nor steady-state responses of this gearbox have."""
    of_runs, single_of_runs = _run_signals(gearbox, choice)
    in_orders = [*(mesh.family for mesh in gearbox.meshes), *(body.name for body in gearbox.bodies())]
    named = [output.options.get("signal", OVERALL) for output in kept.values() if output.quantity.needs == "steady"]
    steady = _steady_signals(gearbox, choice) if any(signal != OVERALL for signal in named) else []
    for name, output in kept.items():
        signal = str(output.options.get("signal", OVERALL))
        if output.quantity.needs == "run":
            known = of_runs if output.quantity.dimension == "" else single_of_runs
            if signal not in known:
                yield f"outputs.{name}.signal = {signal[:200]!r}: no such signal; {nearest_names(signal, known)}"
        elif output.quantity.needs == "steady":
            if signal != OVERALL and named_amplitudes(steady, np.zeros(len(steady), complex), signal) is None:
                places = dict.fromkeys(" ".join(name.split(" ")[:2]) for name in steady)
                known = [*places, *(name for name in steady if name not in places)]
                yield f"outputs.{name}.signal = {signal[:200]!r}: no such signal; {nearest_names(signal, known)}"
            line = output.options.get("line")
            words = str(line).split()
            unknown = [word for word in words if not word.isdecimal() and word not in (*ORDER_WORDS, *in_orders)]
            if line is not None and (unknown or not line):
                yield (
                    f"outputs.{name}.line = {str(line)[:200]!r}: no such order; orders are such as {in_orders[0]} and "
                    f"2 x {in_orders[0]}, of {listed(list(dict.fromkeys(in_orders)))}"
                )


def _run_signals(gearbox: Gearbox, choice: Choice) -> tuple[list[str], list[str]]:
    """Return the names of all signals of a run, and of those that have one value at a time.

    One that has several values, such as ``support_force``, has its parts as well: ``support_force left x``.
    """
    jointed = choice.variant.spins_only
    supports = gearbox.joints if jointed else gearbox.bearings
    mounts = mounts_at_work(gearbox) if choice.variant.is_elastic else ()
    parts = {
        "mesh": [mesh.name for mesh in gearbox.meshes],
        "support": [support.name for support in (*supports, *mounts)],
        "axis": AXES,
        "coupling": [coupling.name for coupling in gearbox.couplings],
        "body": turning_bodies(gearbox, [body.name for body in gearbox.bodies() if not body.fixed]),
    }
    found: list[str] = []
    single: list[str] = []
    for signal in signals_of(choice.mesh_model == "table", jointed, bool(gearbox.couplings)):
        if signal.stored and signal.dimensions[0] == "time":
            names = [signal.name]
            for dimension in signal.dimensions[1:]:
                found += names
                names = [f"{name} {part}" for name in names for part in parts[dimension]]
            found += names
            single += names
    return sorted(found, key=lambda name: name.count(" ")), single


def _steady_signals(gearbox: Gearbox, choice: Choice) -> list[str]:
    """Return the names of all signals of a steady-state response.

    They do not depend on flexibility and mesh model, except for the surface velocity of a flexible housing.
    """
    variant = Variant.bushing if choice.variant.is_elastic else choice.variant
    law = "iso6336"
    plain = Choice(variant, law, choice.inertias)
    with suppress(BalanceError):
        system = mean_system(assemble(gearbox, plain, mesh_stiffness(gearbox, law)), np.ones(1))
        rows = signal_rows(system, 1.0).names
        names = [signal.name for signal in (*rows, *mesh_signal_names(mesh_waves(system)))]
        return [*names, SURFACE_VELOCITY.name] if radiating_names(gearbox, choice.variant) else names
    return []


def _rated_bearings(gearbox: Gearbox) -> list[str]:
    return [bearing.name for bearing in gearbox.bearings if bearing.catalogue is not None]


def _names(gearbox: Gearbox, choice: Choice) -> dict[str, Sequence[str]]:
    """Return the permitted values of options that are names."""
    families = list(dict.fromkeys(mesh.family for mesh in gearbox.meshes))
    law = LAWS.get(choice.mesh_model)
    elements = [mesh.name for mesh in gearbox.meshes] if law is None or law.has_force else []
    if choice.variant.has_bearings:
        elements += [bearing.name for bearing in gearbox.bearings]
    if choice.variant.is_elastic:
        elements += [mount.name for mount in mounts_at_work(gearbox)]
        elements += [f"{name}_body" for name in elastic_names(gearbox)]
    elements += [coupling.name for coupling in gearbox.couplings]
    rated = {} if gearbox.case.rating is None else {"gear": list(gearbox.case.rating.gears)}  # else reported
    return {
        **rated,
        "pair": list(gearbox.pairs),
        "mesh": families,
        "meshes": families,
        "element": elements,
        "bearing": _rated_bearings(gearbox),
        "of": list(SAFETIES),
        "by": [MINIMUM, *LIVES],
    }


@dataclass(frozen=True)
class Study(ReprMixin):
    """Study of a gearbox: parameters, model settings and outputs. Build one with `from_toml` or `from_dict`.

    Examples
    --------
    >>> study = Study.from_dict(
    ...     {
    ...         "name": "housing",
    ...         "case": "cases/grc750/gearbox.toml",
    ...         "choice": {"variant": "bushing", "mesh_model": "iso6336"},
    ...         "parameters": {"seat": {"path": "housing.factor", "values": [0.2, 0.3, 0.5]}},
    ...         "outputs": {"ringing": {"quantity": "nearest_frequency", "near_Hz": 3215.0}},
    ...     }
    ... )
    >>> study
    <Study 'housing': 3 points, ringing>
    """

    file: StudyFile
    source: str
    """Path or name of the study file."""
    gearbox: Gearbox
    """Gearbox with the changes common to all points."""
    choice: Choice
    settings: PointSettings
    outputs: Mapping[str, Output]
    design: Design
    """All points; none for an optimisation."""
    case_digest: str
    """Hash of the gearbox file without the changes."""
    tolerances: Tolerances | None = None
    """Draws at each point of an optimisation."""

    @classmethod
    def from_toml(
        cls,
        path: str | Path,
        permissions: Permissions = NOTHING_MORE,
        quantities: Mapping[str, OutputKind] = QUANTITIES,
    ) -> Study:
        """Read and check a study file and its gearbox file, to which the permissions apply.

        Raises
        ------
        StudyError, GearboxFileError
            Either file is invalid.
        """
        path = Path(path)
        return cls._checked(read_study_file(path), str(path), path.parent, permissions, quantities)

    @classmethod
    def from_dict(
        cls,
        content: dict[str, Any],
        source: str = "study",
        permissions: Permissions = NOTHING_MORE,
        quantities: Mapping[str, OutputKind] = QUANTITIES,
    ) -> Study:
        """Check content already in memory; the path of its gearbox file is relative to the working directory."""
        return cls._checked(parse_study(content, source), source, Path(), permissions, quantities)

    @classmethod
    def _checked(
        cls, file: StudyFile, source: str, folder: Path, permissions: Permissions, quantities: Mapping[str, OutputKind]
    ) -> Study:
        case = Gearbox.from_toml(folder / file.case, permissions)
        try:
            gearbox = Gearbox.from_dict(changed(case.content, file.changes), case.source, case.permissions)
            for table in ("parameters", "tolerances"):
                for name, parameter in getattr(file, table).items():
                    for path in parameter.targets:
                        try:
                            check_path(gearbox.content, path)
                        except PathError as error:
                            raise PathError(f"{table}.{name}: {error}") from None
            design = design_of(file, gearbox) if file.optimise is None else Design({}, {}, ())
            tolerances = tolerances_of(file, gearbox)
            kept = outputs_of(file.outputs, quantities)
            steady = None
            if file.steady is not None:
                section = file.steady
                check_law(file.choice.mesh_model, section.method)
                speeds = SpeedRange.from_text(section.speeds)
                steady = SteadySettings(
                    speeds, section.method, section.harmonics, section.combinations, section.at_resonances
                )
            settings = PointSettings(steady, file.run.duration_s, file.run.solver)
        except (PathError, OutputError, SteadyError, ValueError) as error:
            if isinstance(error, GearboxFileError | StudyError):
                raise
            raise StudyError(error_line(source, str(error))) from None
        choice = Choice(**file.choice.model_dump()).of(gearbox)
        errors = [*errors_of_names(file, kept), *errors_of_paths(file), *errors_of_values(design)]
        errors += [*errors_of_options(kept, gearbox, choice), *errors_of_needs(file, kept, gearbox)]
        errors += [*errors_of_signals(kept, gearbox, choice), *errors_of_search(file, kept)]
        if errors:
            raise StudyError("\n".join(error_line(source, error) for error in errors))
        of_life = _reads_life(kept)
        if of_life:
            life_loads(gearbox, choice)
        return cls(file, source, gearbox, choice, settings, kept, design, case_digest(case, of_life), tolerances)

    def _line(self) -> str:
        return f" {self.file.name[:60]!r}: {len(self.design.points)} points, {', '.join(self.outputs)}"

    @cached_property
    def case_hash(self) -> str:
        """SHA-256 of all input common to the points: gearbox file with its files, model settings, outputs, versions."""
        of_life = _reads_life(self.outputs)
        cases = self.gearbox.content.get("load_cases", {})
        read = read_content(self.gearbox, of_life)
        run = None if self.gearbox.case.rating is None else self.gearbox.case.rating.dynamic_factor_run
        content = {
            "versions": [STUDY, TABLE, REDUCTION, MODES, RUN, STEADY, *([LIFE] if of_life else [])],
            "case": {key: value for key, value in read.items() if key != "load_cases"},
            "load": [cases.get(self.choice.load_case), cases.get(run) if of_life else None],
            "files": self._digests(read),
            "choice": [self.choice.variant, self.choice.mesh_model, self.choice.inertias, self.choice.load_case],
            "settings": [repr(self.settings.steady), self.settings.duration, self.settings.solver],
            "outputs": self.file.outputs,
        }
        return content_digest(content)

    def hash_of(self, changes: Mapping[str, Any]) -> str:
        """Return the SHA-256 of all input of a point, with values by path in the gearbox file."""
        return content_digest([self.case_hash, changes, self._digests(changes)])

    def hashed_points(self) -> Iterator[tuple[str, Point]]:
        """Yield all points with their hashes."""
        for point in self.design.points:
            yield self.hash_of(point.changes), point

    def _digests(self, content: Any) -> list[str]:
        """Return checksums of the files in a content, named one by one or by a pattern."""
        folder = Path(self.gearbox.source).parent
        named = sorted({text for text in _texts(content) if 0 < len(text) < 256 and "\0" not in text})
        files = [folder / name for name in named]
        for pattern in sorted(set(_patterns(content))):
            with suppress(ValueError, NotImplementedError, OSError):  # an invalid pattern is refused where it is read
                files += sorted(folder.glob(pattern))
        return [file_digest(file) for file in files if file.suffix and file.is_file()]


def _texts(content: Any) -> Iterator[str]:
    if isinstance(content, str):
        yield content
    elif isinstance(content, Mapping):
        for value in content.values():
            yield from _texts(value)
    elif isinstance(content, list):
        for value in content:
            yield from _texts(value)


def _patterns(content: Any) -> Iterator[str]:
    """Yield file patterns in a content: values of keys `files`, also of paths that end in this key."""
    if isinstance(content, Mapping):
        for key, value in content.items():
            if isinstance(value, str) and str(key).rpartition(".")[2] == "files":
                yield value
            yield from _patterns(value)


def _reads_life(outputs: Mapping[str, Output]) -> bool:
    """Return whether load spectra are read."""
    return any(kept.quantity.needs in ("life", "bearings") for kept in outputs.values())
