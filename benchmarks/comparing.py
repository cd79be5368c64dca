"""What two files hold, compared number by number: netCDF and npz, read without the project's own code."""

from __future__ import annotations

import json
import math
import re
import textwrap
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

#: What is told but may differ: hashes of inputs, versions.
NOTED = re.compile(r"hash|version|(^|/)key$")
#: What a clock measured.
TIMES = re.compile(r"(^|/)(seconds|wall)")
#: Hash in the name of a reduced body.
NAME_HASH = re.compile(r"-[0-9a-f]{16}(?=\.npz$)")


@dataclass(frozen=True)
class Comparison:
    """A file of both commits, by the names of what it holds.

    Attributes
    ----------
    equal : what is bitwise equal
    differences : of the rest, relative to its largest magnitude; infinite if it is missing or cannot be subtracted
    noted : what is not judged, hashes, versions and attributes that are new, and how it compares
    """

    equal: list[str] = field(default_factory=list)
    differences: dict[str, float] = field(default_factory=dict)
    noted: dict[str, str] = field(default_factory=dict)

    @property
    def greatest(self) -> float:
        """Greatest of the differences."""
        return max(self.differences.values(), default=0.0)

    def verdict(self, tolerance: float) -> str:
        """Say in a line how the file compares."""
        if not self.differences:
            return "bitwise equal"
        worst = max(self.differences, key=lambda name: self.differences[name])
        word = "equal within the tolerance" if self.greatest <= tolerance else "DIFFERENT"
        return f"{word}, {worst} {amount(self.greatest)}"


def amount(apart: float) -> str:
    """Say how large a difference is."""
    return f"by {apart:.2g}" if math.isfinite(apart) else "is missing, or differs in text, type or shape"


def difference(before: np.ndarray, after: np.ndarray) -> float | None:
    """Greatest difference relative to the largest magnitude before; None if bitwise equal.

    Infinite where text differs, type or shape, or where NaN or infinity stand at other places.
    """
    if before.dtype != after.dtype or before.shape != after.shape:
        return math.inf
    if before.dtype.kind not in "biufc":
        return None if np.array_equal(before, after) else math.inf
    if before.tobytes() == after.tobytes():
        return None
    wide = np.result_type(before, np.float64)
    old, new = before.astype(wide), after.astype(wide)
    apart = (old != new) & ~(np.isnan(old) & np.isnan(new))
    if not apart.any():
        return 0.0  # signs of zeros
    if not np.isfinite([old[apart], new[apart]]).all():
        return math.inf
    scale = float(np.abs(old[np.isfinite(old)]).max())
    return float(np.abs(new[apart] - old[apart]).max()) / scale if scale else math.inf


def compare(before: Mapping[str, np.ndarray], after: Mapping[str, np.ndarray]) -> Comparison:
    """Compare what two files hold, by name."""
    comparison = Comparison()
    for name in dict.fromkeys([*before, *after]):
        apart = difference(before[name], after[name]) if name in before and name in after else math.inf
        if name not in before and "@" in name:
            comparison.noted[name] = "new"
        elif NOTED.search(name) and name in after:
            comparison.noted[name] = "equal" if apart is None else "different"
        elif apart is None:
            comparison.equal.append(name)
        else:
            comparison.differences[name] = apart
    return comparison


def contents(path: Path) -> dict[str, np.ndarray]:
    """Variables and attributes of a file, but for what a clock measured; an attribute's name begins with @."""
    if path.suffix == ".npz":
        with np.load(path, allow_pickle=False) as stored:
            raw: dict[str, Any] = {name: stored[name] for name in stored.files}
    else:
        with xr.open_dataset(path, engine="h5netcdf", decode_cf=False) as stored:
            raw = {str(name): variable.to_numpy() for name, variable in stored.variables.items()}
            raw |= {f"@{key}": value for key, value in stored.attrs.items()}
            for name, variable in stored.variables.items():
                raw |= {f"{name}@{key}": value for key, value in variable.attrs.items()}
    return {leaf: entry for name, value in raw.items() for leaf, entry in leaves(name, value) if not TIMES.search(leaf)}


def leaves(name: str, value: Any) -> Iterator[tuple[str, np.ndarray]]:
    """Give a value as an array; text that is a JSON object falls into its entries."""
    if isinstance(value, dict):
        for key, entry in value.items():
            yield from leaves(f"{name}/{key}", entry)
    elif isinstance(value, list) and not all(isinstance(entry, int | float) for entry in value):
        yield name, np.array(json.dumps(value))
    elif np.ndim(value) == 0 and str(value).startswith("{"):
        yield from leaves(name, json.loads(str(value)))
    else:
        yield name, np.asarray(value)


def files_below(folder: Path) -> set[Path]:
    """All files of a folder."""
    return {path for path in folder.rglob("*") if path.is_file()}


def compare_folders(before: Path, after: Path) -> dict[str, Comparison]:
    """Compare all files with numbers; one that only one of the folders holds differs."""
    old, new = ({_title(path, folder): path for path in files_below(folder)} for folder in (before, after))
    titles = sorted(title for title in {*old, *new} if title.endswith((".nc", ".npz")))
    missing = Comparison(differences={"the file, which is missing": math.inf})
    return {
        title: compare(contents(old[title]), contents(new[title])) if title in old and title in new else missing
        for title in titles
    }


def _title(path: Path, folder: Path) -> str:
    return NAME_HASH.sub("", path.relative_to(folder).as_posix())


def report(title: str, comparison: Comparison, tolerance: float) -> str:
    """Say of a file how it compares, then of each of its variables."""
    variables = [name for name in comparison.equal if "@" not in name]
    attributes = len(comparison.equal) - len(variables)
    equal = f"bitwise equal: {', '.join([*variables, f'{attributes} attributes'])}"
    lines = textwrap.wrap(equal, 110, break_on_hyphens=False)
    lines += [f"differs: {name} {amount(apart)}" for name, apart in comparison.differences.items()]
    noted = ", ".join(f"{name} {word}" for name, word in comparison.noted.items())
    lines += textwrap.wrap(f"not judged: {noted}", 110, break_on_hyphens=False) if noted else []
    return "\n    ".join([f"{title}: {comparison.verdict(tolerance)}", *lines])


def summary(comparison: Comparison, tolerance: float) -> dict[str, Any]:
    """Entry of a file in stored results; JSON has no infinity."""
    apart = {name: value if math.isfinite(value) else None for name, value in comparison.differences.items()}
    return {
        "verdict": comparison.verdict(tolerance),
        "bitwise_equal": len(comparison.equal),
        "differences": apart,
        "noted": comparison.noted,
    }
