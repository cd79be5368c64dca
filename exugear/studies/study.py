"""A study: a gearbox, the points that vary it, and the figures that are kept, read from a file and checked."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from exugear.exchange.load_files.reading import file_digest
from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.named_files import NOTHING_MORE, Permissions
from exugear.gearbox.reading import CaseError, fault_line
from exugear.gearbox.versions import LIFE, MODES, REDUCTION, RUN, STEADY, STUDY
from exugear.results.study_files import case_digest, read_content
from exugear.steady.mean_system.rotating_frame import SteadyError
from exugear.steady.settings import SpeedRange, SteadySettings, check_law
from exugear.studies.design.paths import PathError, changed, check_path
from exugear.studies.design.reading import StudyError, parse_study, read_study_file
from exugear.studies.design.sampling import Design, Point, design_of
from exugear.studies.design.sections import StudyFile
from exugear.studies.design.tolerances import Tolerances, tolerances_of
from exugear.studies.figures.figure import Figure, FigureError
from exugear.studies.figures.point_lives import life_loads
from exugear.studies.figures.point_results import PointSettings
from exugear.studies.figures.registry import FIGURES, KeptFigure, kept_figures
from exugear.studies.soundness import (
    faults_of_names,
    faults_of_needs,
    faults_of_options,
    faults_of_paths,
    faults_of_search,
    faults_of_signals,
    faults_of_values,
)
from fe_ste.tools.display import Displayed
from fe_ste.tools.versions import TABLE


@dataclass(frozen=True)
class Study(Displayed):
    """What is varied, computed and kept. Build one with `from_toml` or `from_dict`.

    Examples
    --------
    >>> study = Study.from_dict(
    ...     {
    ...         "name": "housing",
    ...         "case": "cases/grc750/gearbox.toml",
    ...         "choice": {"variant": "bushing", "mesh_law": "iso6336"},
    ...         "parameters": {"seat": {"path": "housing.factor", "values": [0.2, 0.3, 0.5]}},
    ...         "figures": {"ringing": {"figure": "nearest_frequency", "near_Hz": 3215.0}},
    ...     }
    ... )
    >>> study
    <Study 'housing': 3 points, ringing>
    """

    file: StudyFile
    """The file as it is written."""
    source: str
    """Its path or name."""
    gearbox: Gearbox
    """The case, with the changes that all points have."""
    choice: Choice
    settings: PointSettings
    figures: Mapping[str, KeptFigure]
    """By name."""
    design: Design
    """All points; of a search none."""
    case_digest: str
    """Hash of the case without the changes."""
    tolerances: Tolerances | None = None
    """Draws at each point of a search."""

    @classmethod
    def from_toml(
        cls, path: str | Path, permissions: Permissions = NOTHING_MORE, figures: Mapping[str, Figure] = FIGURES
    ) -> Study:
        """Read and check a study file and the gearbox file that it names.

        Parameters
        ----------
        permissions : what the gearbox file may do
        figures : figures that may be named

        Raises
        ------
        StudyError, CaseError
            Anything wrong with either file.
        """
        path = Path(path)
        return cls._of(read_study_file(path), str(path), path.parent, permissions, figures)

    @classmethod
    def from_dict(
        cls,
        content: dict[str, Any],
        source: str = "study",
        permissions: Permissions = NOTHING_MORE,
        figures: Mapping[str, Figure] = FIGURES,
    ) -> Study:
        """Check content already in memory; its case lies where it says, seen from the working directory."""
        return cls._of(parse_study(content, source), source, Path(), permissions, figures)

    @classmethod
    def _of(
        cls, file: StudyFile, source: str, folder: Path, permissions: Permissions, figures: Mapping[str, Figure]
    ) -> Study:
        case = Gearbox.from_toml(folder / file.case, permissions)
        try:
            gearbox = _varied(case, file.changes)
            for table in ("parameters", "tolerances"):
                for name, parameter in getattr(file, table).items():
                    for path in parameter.targets:
                        _guarded(f"{table}.{name}", check_path, gearbox.content, path)
            design = design_of(file, gearbox) if file.optimise is None else Design({}, {}, ())
            tolerances = tolerances_of(file, gearbox)
            kept = kept_figures(file.figures, figures)
            settings = _settings(file)
        except (PathError, FigureError, SteadyError, ValueError) as error:
            if isinstance(error, CaseError | StudyError):
                raise
            raise StudyError(fault_line(source, str(error))) from None
        choice = Choice(**file.choice.model_dump()).of(gearbox)
        faults = [*faults_of_names(file, kept), *faults_of_paths(file), *faults_of_values(design)]
        faults += [*faults_of_options(kept, gearbox, choice), *faults_of_needs(file, kept, gearbox)]
        faults += [*faults_of_signals(kept, gearbox, choice), *faults_of_search(file, kept)]
        if faults:
            raise StudyError("\n".join(fault_line(source, fault) for fault in faults))
        of_life = _of_life(kept)
        if of_life:
            life_loads(gearbox, choice)
        return cls(file, source, gearbox, choice, settings, kept, design, case_digest(case, of_life), tolerances)

    def _line(self) -> str:
        return f" {self.file.name[:60]!r}: {len(self.design.points)} points, {', '.join(self.figures)}"

    @cached_property
    def case_hash(self) -> str:
        """SHA-256 of all that every point depends on: the case with its files, choices, figures, versions."""
        of_life = _of_life(self.figures)
        cases = self.gearbox.content.get("load_cases", {})
        read = read_content(self.gearbox, of_life)
        run = None if self.gearbox.case.rating is None else self.gearbox.case.rating.dynamic_factor_run
        content = {
            "versions": [STUDY, TABLE, REDUCTION, MODES, RUN, STEADY, *([LIFE] if of_life else [])],
            "case": {key: value for key, value in read.items() if key != "load_cases"},
            "load": [cases.get(self.choice.load_case), cases.get(run) if of_life else None],
            "files": self._digests(read),
            "choice": [self.choice.variant, self.choice.mesh_law, self.choice.inertias, self.choice.load_case],
            "settings": [repr(self.settings.steady), self.settings.duration, self.settings.solver],
            "figures": self.file.figures,
        }
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()

    def hash_of(self, changes: Mapping[str, Any]) -> str:
        """SHA-256 of all that a point depends on, with values at paths of the case."""
        text = json.dumps([self.case_hash, changes, self._digests(changes)], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()

    def hashed_points(self) -> Iterator[tuple[str, Point]]:
        """All points with their hashes."""
        for point in self.design.points:
            yield self.hash_of(point.changes), point

    def _digests(self, content: Any) -> list[str]:
        """Checksums of the files that a content names, one by one or by a pattern."""
        folder = Path(self.gearbox.source).parent
        named = sorted({text for text in _texts(content) if 0 < len(text) < 256 and "\0" not in text})
        files = [folder / name for name in named]
        for pattern in sorted(set(_patterns(content))):
            with suppress(ValueError, NotImplementedError, OSError):  # what is no pattern is refused where it is read
                files += sorted(folder.glob(pattern))
        return [file_digest(file) for file in files if file.suffix and file.is_file()]


def _varied(gearbox: Gearbox, changes: Mapping[str, Any]) -> Gearbox:
    return Gearbox.from_dict(changed(gearbox.content, changes), gearbox.source, gearbox.permissions)


def _guarded(key: str, check: Any, *arguments: Any) -> None:
    try:
        check(*arguments)
    except PathError as error:
        raise PathError(f"{key}: {error}") from None


def _texts(content: Any) -> Iterator[str]:
    """All texts in a content."""
    if isinstance(content, str):
        yield content
    elif isinstance(content, Mapping):
        for value in content.values():
            yield from _texts(value)
    elif isinstance(content, list):
        for value in content:
            yield from _texts(value)


def _patterns(content: Any) -> Iterator[str]:
    """Names of many files in a content: what stands at keys `files`, also of paths that end in one."""
    if isinstance(content, Mapping):
        for key, value in content.items():
            if isinstance(value, str) and str(key).rpartition(".")[2] == "files":
                yield value
            yield from _patterns(value)


def _of_life(figures: Mapping[str, KeptFigure]) -> bool:
    """Whether loads of a life are read."""
    return any(kept.figure.needs in ("life", "bearings") for kept in figures.values())


def _settings(file: StudyFile) -> PointSettings:
    """Read the settings of what points compute."""
    steady = None
    if file.steady is not None:
        own = file.steady
        check_law(file.choice.mesh_law, own.level)
        speeds = SpeedRange.from_text(own.speeds)
        steady = SteadySettings(speeds, own.level, own.harmonics, own.combinations, own.at_resonances)
    return PointSettings(steady, file.run.duration_s, file.run.solver)
