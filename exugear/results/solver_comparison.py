"""Comparison of the compiled solver with Exudyn: the beginning of a run, integrated by both.

The reference run of Exudyn is in the folder ``exudyn`` of the results folder, at the same relative path as the run in
the results folder. `exugear.project.Project.compare_with_exudyn` creates it.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from exugear.results.run_file import load_run
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import ReprMixin
from fe_ste.tools.drawing import axes_or_new
from fe_ste.tools.files import FileError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

EXUDYN_FOLDER = "exudyn"
COMPARED = {
    "overall_dte": "overall transmission error",
    "mesh_force": "mesh forces",
    "support_force": "bearing forces",
    "coupling_torque": "torques of couplings",
    "body_speed": "speeds",
}
"""Compared signals and their descriptions."""


@dataclass(frozen=True)
class SolverComparison(ReprMixin, line=" of {exudyn}, {duration:.3g} s: {largest:.1e} apart"):
    """Differences between a run and the same run by Exudyn, over the time covered by both."""

    exudyn: str
    """Version and method of Exudyn."""
    compiled: str
    """Method of the compiled solver."""
    duration: float
    """Compared time, s."""
    difference: dict[str, float]
    """By signal, largest difference at any time divided by the largest value of that signal at any place."""
    time: Floats
    """(n,) s."""
    overall: tuple[Floats, Floats]
    """(n,) overall transmission error by the compiled solver and by Exudyn, m."""

    @property
    def largest(self) -> float:
        """Largest of all differences."""
        return max(self.difference.values())

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the overall transmission error by both solvers over time, as deviation from the mean by Exudyn, in µm.

        Parameters
        ----------
        ax : matplotlib axes; by default new ones, whose ``ax.figure`` can be shown and saved

        Examples
        --------
        >>> time = np.linspace(0.0, 1.0, 3)
        >>> comparison = SolverComparison("Exudyn", "Newmark", 1.0, {"overall_dte": 1e-4}, time, (time, time))
        >>> [line.get_label() for line in comparison.plot().lines]
        ['compiled solver', 'Exudyn']
        """
        with axes_or_new(ax, 6.0, 3.4) as panel:
            names = ("compiled solver", "Exudyn")
            for name, values, style in zip(names, self.overall, ("-", "--"), strict=True):
                panel.plot(self.time, 1e6 * (values - self.overall[1].mean()), style, label=name)
            panel.set(xlabel="Time / s", ylabel="Overall transmission error / µm")
            panel.legend()
            return panel

    @property
    def words(self) -> str:
        """Summary of the comparison in one sentence."""
        apart = ", ".join(f"{COMPARED[name]} {value:.0e}" for name, value in self.difference.items())
        return (
            f"Comparison over the first {self.duration:.2g} s, compiled solver ({self.compiled}) against {self.exudyn}"
            f" with mesh forces from user functions; maximum difference: {apart} of the largest value."
        )


def compare_solvers(path: Path, exudyn_path: Path) -> SolverComparison:
    """Compare a run of the compiled solver with the same one by Exudyn.

    Raises
    ------
    FileError
        A file is missing or damaged, or the runs are not of the same input and solver pair.
    """
    compiled = load_run(path)
    other = load_run(exudyn_path)
    if compiled.attrs["input_hash"] != other.attrs["input_hash"]:
        raise FileError(f"{exudyn_path}: was computed from another input than {path.name}; compare with Exudyn again")
    if not str(other.attrs["solver"]).startswith("Exudyn") or str(compiled.attrs["solver"]).startswith("Exudyn"):
        raise FileError(f"{exudyn_path}: requires a run of the compiled solver and one of Exudyn")
    count = min(compiled.sizes["time"], other.sizes["time"])
    compiled = compiled.isel(time=slice(count))
    other = other.isel(time=slice(count))
    if count == 0 or not np.allclose(compiled["time"], other["time"], rtol=1e-9):
        raise FileError(f"{exudyn_path}: has other sample times than {path.name}; compare with Exudyn again")
    difference = {}
    for name in COMPARED:
        if name in compiled and compiled[name].size:
            scale = max(float(np.abs(other[name]).max()), np.finfo(float).tiny)
            difference[name] = float(np.abs(compiled[name] - other[name]).max()) / scale
    return SolverComparison(
        exudyn=str(other.attrs["solver"]),
        compiled=str(compiled.attrs["solver"]).removeprefix("compiled, "),
        duration=float(other["time"][-1]),
        difference=difference,
        time=compiled["time"].to_numpy(),
        overall=(compiled["overall_dte"].to_numpy(), other["overall_dte"].to_numpy()),
    )
