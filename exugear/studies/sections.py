"""Sections of a study file: parameters, computations and outputs."""

from __future__ import annotations

import difflib
from collections.abc import Collection
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, AllowInfNan, BaseModel, ConfigDict, Field, ValidationError, model_validator

from exugear.gearbox.reading import error_line, one_of, parsed_toml, shortened
from exugear.gearbox.renames import STUDY_RENAMES, renamed_hint
from exugear.gearbox.sections.entries import Name, Text
from exugear.gearbox.variant import Variant
from fe_ste.tools.files import FileError, read_text

Value = int | Annotated[float, AllowInfNan(True)] | str | bool | list[Any]
"""Value of a key of the gearbox file; an invalid one yields a failed point with its name."""
MOST_VALUES = 100_000
DottedPath = Annotated[str, Field(min_length=1, max_length=400)]


class StudyPart(BaseModel):
    """Table of the study file; unknown keys and wrong types are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class RangeSection(StudyPart):
    """Range of values."""

    first: float
    """First value."""
    last: float
    """Last value."""
    count: Annotated[int, Field(ge=2, le=MOST_VALUES)]
    """Number of values, both ends included."""
    scale: Literal["linear", "logarithmic"] = "linear"
    """Equal differences or equal ratios."""

    @model_validator(mode="after")
    def _signs(self) -> RangeSection:
        if self.scale == "logarithmic" and not (self.first > 0.0 and self.last > 0.0):
            raise ValueError("a logarithmic range requires two positive values")
        return self


class NormalSection(StudyPart):
    """Normal distribution, truncated at limits if these are given."""

    mean: float = 0.0
    """Mean."""
    deviation: Annotated[float, Field(gt=0.0)]
    """Standard deviation before truncation."""
    min: float | None = None
    """Lower limit of the draws."""
    max: float | None = None
    """Upper limit of the draws."""

    @model_validator(mode="after")
    def _order(self) -> NormalSection:
        if self.min is not None and self.max is not None and self.min >= self.max:
            raise ValueError("min must be below max")
        return self


class UniformSection(StudyPart):
    """Uniform distribution between two values."""

    min: float
    """Lower end."""
    max: float
    """Upper end."""

    @model_validator(mode="after")
    def _order(self) -> UniformSection:
        if self.min >= self.max:
            raise ValueError("min must be below max")
        return self


class ToleranceSection(StudyPart):
    """Flank deviation of a tolerance class of ISO 1328-1: normal, truncated at the tolerance (three sigma)."""

    gear: Name
    """Gear of the gearbox file."""
    deviation: Literal["profile_slope", "helix_slope", "single_pitch", "cumulative_pitch", "runout"]
    """Kind of deviation."""
    tolerance_class: Annotated[int, Field(ge=1, le=11)]
    """1 to 11."""


KINDS = ("values", "range", "normal", "uniform", "iso1328", "settings", "step")
"""Keys for the values of a parameter."""


class ParameterSection(StudyPart):
    """Parameter: one key of the gearbox file, or several together, and their values."""

    path: DottedPath | None = None
    """Key of the gearbox file, such as ``housing.factor``."""
    paths: Annotated[list[DottedPath], Field(min_length=2, max_length=500)] | None = None
    """Several keys: with a common value, or with separate draws according to `correlation`."""
    acts: Literal["replaces", "scales", "shifts"] = "replaces"
    """Whether a value replaces that of the gearbox file, multiplies it or is added to it."""
    values: Annotated[list[Value], Field(min_length=1, max_length=MOST_VALUES)] | None = None
    """List of values."""
    range: RangeSection | None = None
    """Range of values."""
    normal: NormalSection | None = None
    """Normal distribution."""
    uniform: UniformSection | None = None
    """Uniform distribution."""
    iso1328: ToleranceSection | None = None
    """Tolerance class of flank deviations."""
    settings: Annotated[dict[str, dict[DottedPath, Value]], Field(min_length=1, max_length=1000)] | None = None
    """Several keys with their values, by the name of each combination."""
    step: Annotated[float, Field(gt=0.0)] | None = None
    """Step of the central difference for a local derivative, in the unit of the values."""
    correlation: Annotated[float, Field(ge=0.0, le=1.0)] = 1.0
    """Correlation of the draws of several paths: 1 is one draw for all, 0 are independent draws."""

    @property
    def kind(self) -> str:
        """Key of `KINDS` that it contains."""
        return next(kind for kind in KINDS if getattr(self, kind) is not None)

    @property
    def targets(self) -> tuple[str, ...]:
        """Keys of the gearbox file that it sets."""
        if self.settings is not None:
            return tuple(dict.fromkeys(path for setting in self.settings.values() for path in setting))
        if self.path is not None:
            return (self.path,)
        return tuple(self.paths or ())

    @property
    def is_drawn(self) -> bool:
        """Whether its values are drawn from a distribution."""
        return self.kind in ("normal", "uniform", "iso1328")

    @model_validator(mode="after")
    def _one_of_each(self) -> ParameterSection:
        given = [kind for kind in KINDS if getattr(self, kind) is not None]
        if len(given) != 1:
            raise ValueError(f"set exactly one of {', '.join(KINDS)}; {' and '.join(given) or 'none'} is set")
        if (self.path is not None) + (self.paths is not None) + (self.settings is not None) != 1:
            raise ValueError("set path or paths; settings contain their own paths and require neither")
        if self.correlation != 1.0 and not (self.is_drawn and self.paths):
            raise ValueError("correlation applies to the draws of several paths; set paths and a distribution")
        if self.settings is not None and len({frozenset(setting) for setting in self.settings.values()}) > 1:
            raise ValueError("all settings must set the same keys")
        return self


class ChoiceSection(StudyPart):
    """Model settings, as on the command line."""

    variant: Annotated[str, AfterValidator(Variant.offered)] = Variant.bushing
    """Support of the bodies."""
    mesh_model: str = "line_of_action"
    """Mesh model."""
    inertias: str | None = None
    """Inertia set; by default that of the gearbox file."""
    load_case: str | None = None
    """Load case of runs; the first by default."""


class SteadySection(StudyPart):
    """Settings of steady-state responses, for outputs that need them."""

    speeds: str
    """FIRST:LAST:COUNT in rpm of the input."""
    method: Literal["linear", "parametric", "nonlinear"] = "parametric"
    """Method of the response: mean mesh stiffness, time-varying stiffness, or contact loss."""
    harmonics: Annotated[int, Field(ge=1, le=100)] | None = None
    """Number of harmonics of each mesh frequency; by default chosen from the mesh stiffness."""
    combinations: Annotated[int, Field(ge=1, le=20)] = 3
    """Largest sum of multiples of several mesh frequencies."""
    at_resonances: bool = True
    """Whether speeds are added at crossings of orders with modes."""


class RunSection(StudyPart):
    """Settings of runs, for outputs that need them."""

    duration_s: Annotated[float, Field(gt=0.0)] | None = None
    """Simulated time; by default that of the load case."""
    solver: Literal["compiled", "exudyn"] | None = None
    """Solver; by default the compiled one where applicable."""


class LimitSection(StudyPart):
    """Limits of an output in an optimisation."""

    min: float | None = None
    """Lower limit."""
    max: float | None = None
    """Upper limit."""

    @model_validator(mode="after")
    def _order(self) -> LimitSection:
        if self.min is None and self.max is None:
            raise ValueError("set min, max or both")
        if self.min is not None and self.max is not None and self.min > self.max:
            raise ValueError("min must not be above max")
        return self


class OptimisationSection(StudyPart):
    """Optimisation: parameters, each within its `uniform` limits, that minimise outputs."""

    minimise: Annotated[list[Name], Field(min_length=1, max_length=2)]
    """One output, or two with weights."""
    limits: dict[Name, LimitSection] = {}
    """Outputs with limits."""
    percentile: Annotated[float, Field(ge=50.0, le=100.0)] | None = None
    """Percentile of each output over the tolerances, on its unfavourable side; by default 95. 100: the worst draw."""
    weightings: Annotated[int, Field(ge=1, le=50)] = 5
    """For two outputs: number of weightings, with one search each, from the first output alone to the second alone."""
    population: Annotated[int, Field(ge=5, le=1000)] = 16
    """Number of points of a generation."""
    generations: Annotated[int, Field(ge=1, le=10000)] = 20
    """Maximum number of generations of a search."""


class StudyFile(StudyPart):
    """Whole study file."""

    name: Annotated[Text, Field(max_length=200)]
    """Title of the study."""
    case: Annotated[str, Field(min_length=1, max_length=1000)]
    """Gearbox file, with a path relative to the study file."""
    description: Text = ""
    """Free description."""
    choice: ChoiceSection = ChoiceSection()
    """Model settings."""
    changes: dict[DottedPath, Value] = {}
    """Keys of the gearbox file with other values in all points."""
    parameters: Annotated[dict[Name, ParameterSection], Field(min_length=1, max_length=200)]
    """Varied parameters, by name."""
    outputs: Annotated[dict[Name, dict[str, Any]], Field(min_length=1, max_length=200)]
    """Outputs, by name: `quantity` selects the kind, other keys are its options."""
    sampling: Literal["sobol", "latin_hypercube", "random"] = "latin_hypercube"
    """Sampling method for distributions."""
    samples: Annotated[int, Field(ge=1, le=10_000_000)] | None = None
    """Number of draws if parameters have distributions; in an optimisation with tolerances, per point."""
    seed: Annotated[int, Field(ge=0)] = 0
    """Seed of the random numbers; the same seed gives the same draws."""
    steady: SteadySection | None = None
    """Settings of steady-state responses."""
    run: RunSection = RunSection()
    """Settings of runs."""
    optimise: OptimisationSection | None = None
    """Optimisation instead of all combinations."""
    tolerances: Annotated[dict[Name, ParameterSection], Field(max_length=200)] = {}
    """Production scatter, by name: drawn at each point of an optimisation."""

    @model_validator(mode="after")
    def _fits(self) -> StudyFile:
        drawn = [name for name, parameter in self.parameters.items() if parameter.is_drawn]
        if self.optimise is not None:
            wrong = [name for name, parameter in self.parameters.items() if parameter.kind != "uniform"]
            if wrong:
                raise ValueError(
                    f"an optimisation requires bounds for each parameter; set a key uniform for {wrong[0]}"
                )
            self._check_search(self.optimise)
            return self
        if self.tolerances:
            raise ValueError("tolerances: require [optimise]; otherwise define the draws as parameters")
        if drawn and self.samples is None:
            raise ValueError(f"parameters.{drawn[0]} has a distribution; set the number of draws, such as samples = 64")
        if self.samples is not None and not drawn:
            raise ValueError("samples: no parameter has a distribution; remove the key")
        self._check_sobol(bool(drawn))
        steps = [parameter.kind == "step" for parameter in self.parameters.values()]
        if any(steps) and not all(steps):
            raise ValueError("local derivatives: set a step for each parameter, or for none")
        return self

    def _check_search(self, wanted: OptimisationSection) -> None:
        for key, names in (("minimise", wanted.minimise), ("limits", list(wanted.limits))):
            lost = [name for name in names if name not in self.outputs]
            if lost:
                raise ValueError(f"optimise.{key}: no result {lost[0]!r}; results are {', '.join(self.outputs)}")
        if len(set(wanted.minimise)) < len(wanted.minimise):
            raise ValueError(
                f"optimise.minimise: {wanted.minimise[0]} is listed twice; set two different results, or one"
            )
        listed = [name for name, tolerance in self.tolerances.items() if not tolerance.is_drawn]
        if listed:
            raise ValueError(f"tolerances.{listed[0]}: set a distribution: normal, uniform or iso1328")
        if self.tolerances and self.samples is None:
            raise ValueError("tolerances: set the number of draws per point, such as samples = 32")
        if not self.tolerances and wanted.percentile is not None:
            raise ValueError("optimise.percentile: requires tolerances; add [tolerances.NAME], or remove the key")
        self._check_sobol(bool(self.tolerances))

    def _check_sobol(self, drawn: bool) -> None:
        if drawn and self.sampling == "sobol" and self.samples and self.samples & (self.samples - 1):
            raise ValueError(f"samples = {self.samples}: a Sobol sequence requires a power of two")


# Reading a study file: TOML to checked sections, and errors as lines with file, key and remedy

LARGEST_STUDY = 10_000_000
"""Largest study file that is read, bytes."""
SHOWN_ERRORS = 20
"""Maximum number of errors that a message shows."""


class StudyError(ValueError):
    """Error: an invalid study; each error line has file, key, value and what is permitted."""


def read_study_file(path: Path) -> StudyFile:
    """Read and check a study file.

    Raises
    ------
    StudyError
        The file is invalid.

    Examples
    --------
    >>> read_study_file(Path("nowhere.study.toml"))
    Traceback (most recent call last):
    ...
    exugear.studies.sections.StudyError: nowhere.study.toml: no such file
    """
    try:
        content = parsed_toml(read_text(path, LARGEST_STUDY).removeprefix("\ufeff"), str(path))
    except (FileError, ValueError) as error:
        raise StudyError(str(error)) from None
    return parse_study(content, str(path))


def parse_study(content: dict[str, Any], source: str) -> StudyFile:
    """Check content already in memory.

    Raises
    ------
    StudyError
        The content is invalid.

    Examples
    --------
    >>> parse_study({"bodies": {}, "static_load": {}}, "g.toml")
    Traceback (most recent call last):
    ...
    exugear.studies.sections.StudyError: g.toml: is a gearbox file; specify a study file, which names it as case
    >>> parse_study({"name": "a", "case": "b.toml", "parameters": {}, "output": {}}, "s.toml")
    Traceback (most recent call last):
    ...
    exugear.studies.sections.StudyError: s.toml: parameters: must have at least 1 entry
    s.toml: outputs: this key is missing
    s.toml: output: unknown key; did you mean 'outputs'?
    """
    if {"bodies", "static_load"} <= content.keys():
        raise StudyError(error_line(source, "is a gearbox file; specify a study file, which names it as case"))
    try:
        return StudyFile.model_validate(content)
    except ValidationError as error:
        errors = error.errors(include_url=False)
    lines = list(dict.fromkeys(error_line(source, _described(error)) for error in errors))
    more = [f"and {len(lines) - SHOWN_ERRORS} more errors"] if len(lines) > SHOWN_ERRORS else []
    raise StudyError("\n".join([*lines[:SHOWN_ERRORS], *more]))


def suggestion(name: str, known: Collection[str], otherwise: str) -> str:
    """Return the most similar of known names as a question, or else another hint."""
    near = difflib.get_close_matches(name[:100], known, n=1)
    return f"did you mean {near[0]!r}?" if near else otherwise


_REMEDIES = {
    "missing": "this key is missing",
    "float_type": "must be a number",
    "int_type": "must be a whole number",
    "string_type": "must be text in quotes",
    "dict_type": "must be a table",
    "model_type": "must be a table",
    "list_type": "must be an array in brackets",
}


def _described(error: Any) -> str:
    """Return key, value and what is permitted."""
    location = [str(part) for part in error["loc"] if part not in ("[key]", "int", "float", "str", "bool")]
    key = ".".join(location) or "the file"
    if error["type"] == "extra_forbidden":
        if hint := renamed_hint(location, STUDY_RENAMES):
            return f"{key}: {hint}"
        section: Any = StudyFile  # which contains the unknown key
        for part in location[:-1]:
            fields = getattr(section, "model_fields", {})
            kind = fields[part].annotation if part in fields else section
            section = next((model for model in _models(kind)), section)
        known = list(getattr(section, "model_fields", {}))
        return f"{key}: unknown key; " + suggestion(location[-1], known, f"known keys are {', '.join(known)}")
    remedy = _REMEDIES.get(error["type"])
    if error["type"] == "too_short":
        least = error["ctx"]["min_length"]
        remedy = f"must have at least {least} {'entry' if least == 1 else 'entries'}"
    if error["type"] == "literal_error":
        remedy = one_of(error["ctx"]["expected"], error["input"])
    if remedy is None:
        text = str(error["msg"]).removeprefix("Value error, ").replace("Input should", "must", 1)
        remedy = text[:1].lower() + text[1:]
    value = error["input"]
    shown = "" if isinstance(value, dict) or error["type"] == "missing" else f" = {shortened(value)}"
    return f"{key}{shown}: {remedy}"


def _models(kind: Any) -> list[Any]:
    """Return a section and all sections in its type arguments."""
    own = [kind] if hasattr(kind, "model_fields") else []
    return own + [model for part in getattr(kind, "__args__", ()) for model in _models(part)]
