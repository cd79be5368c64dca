"""Load cases in time: start in balance, integrate, stream the results.

Two solvers take the same assembly: `exugear.solvers.compiled.solver`, and Exudyn as the model of record. Both hand
their states to one `Recorder`, which filters, accounts for energy and writes. Without a step asked for,
`exugear.solvers.compiled.step.choose_step`
finds the longest that is stable and keeps the excitation in the band: 6.4 kHz is the high-speed mesh of the GRC at
215 rpm. Exudyn is loaded only where it integrates.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args

from exugear.dynamics.assemble import assemble
from exugear.dynamics.assembly import Assembly
from exugear.model.gearbox import Gearbox
from exugear.results.folder import bodies_folder
from exugear.runs.extent import SAMPLE_RATE, check_duration, too_fine
from exugear.runs.outcome import Progress, Run, RunError
from exugear.runs.recorder import Recorder
from exugear.runs.run_folder import held, run_directory
from exugear.solvers.compiled.solver import unsupported_reason
from exugear.solvers.compiled.step import choose_step, fastest_motion
from exugear.tooth_mesh.law import Angles, MeshData

if TYPE_CHECKING:
    from exugear.solvers.exudyn_model.system import MeshRoute


Solver = Literal["compiled", "exudyn"]
SOLVERS: tuple[str, ...] = get_args(Solver)
BAND = 6.4e3
"""Highest frequency whose amplitude is kept, Hz."""


def simulate(
    gearbox: Gearbox,
    variant: str,
    stiffness: Mapping[str, MeshData],
    out: str | Path,
    *,
    load_case: str = "reference",
    mesh_law: str = "line_of_action",
    inertias: str | None = None,
    duration: float | None = None,
    step: float | None = None,
    band: float = BAND,
    sample_rate: float = SAMPLE_RATE,
    solver: Solver | None = None,
    mesh_route: MeshRoute = "element",
    angles: Angles = "reference",
    resume: bool = False,
    progress: Callable[[Progress], None] | None = None,
) -> Run:
    """Run a load case and stream the results to ``<out>/<variant>/<...>/run.nc``.

    Parameters
    ----------
    gearbox : Gearbox
    variant : {"rigid", "bushing", "flexible", "jointed"}
    stiffness : mapping of pair name to (n,) array
        Mesh stiffness over the cycle, see `exugear.tooth_mesh.laws.stiffness.mesh_stiffness`.
    out : path
        Results directory.
    load_case, mesh_law, inertias, angles : str
        As in the gearbox file and `exugear.tooth_mesh.element`.
    duration : float, optional
        Simulated time, s; the load case's by default.
    step : float, optional
        Integration step, s; chosen from `band` and the fastest eigenfrequency by default.
    band, sample_rate : float
        Highest frequency whose amplitude is kept, and stored rate, Hz; the rate must divide the steps.
    solver : {"compiled", "exudyn"}, optional
        The compiled one where it applies by default; a body in a floating frame needs Exudyn.
    mesh_route : {"element", "loads"}
        See `exugear.solvers.exudyn_model.system`; "loads" is Exudyn's alone.
    resume : bool
        Go on with a run that was stopped.
    progress : callable, optional
        Called about every quarter of a simulated second.

    Returns
    -------
    Run
        Not complete after Ctrl-C; its folder then holds everything up to there, see
        `exugear.results.run_file.load_run`.

    Raises
    ------
    CaseError
        A load case or a duration that cannot be run: too short, too long for the disk, or with a motion so fast that
        it asks for an absurd step.
    RunError
        The compiled solver does not take the variant or the step, a state that is not finite, a step that Exudyn
        cut, or nothing to resume.
    FileError
        Another process is at work on this run.
    OSError
        The results cannot be written; what was written before is kept.
    LimitError
        A limit of `exugear.runs.trust` that no run may go beyond; softer ones end in `Run.reasons`.
    """
    if load_case not in gearbox.load_cases:
        raise gearbox.fault(f"no load case {load_case!r}; load cases are {', '.join(gearbox.load_cases)}")
    case = gearbox.load_cases[load_case]
    check_duration(gearbox, case, duration, sample_rate)
    folder = bodies_folder(Path(out))
    assembly = assemble(gearbox, variant, stiffness, mesh_law, inertias, angles=angles, folder=folder)
    directory = run_directory(out, variant, load_case, mesh_law, assembly.inertias)
    total = case.duration if duration is None else duration
    chosen = _solver(solver, assembly, mesh_route)
    if step is None:
        step = choose_step(assembly, sample_rate, band)
        if too_fine(step, total, sample_rate):
            raise gearbox.fault(f"{fastest_motion(assembly)}; {too_fine(step, total, sample_rate)}")
    with held(directory):
        recorder = Recorder(assembly, case, directory, total, step, band, sample_rate, chosen, resume, progress)
        return recorder.run(mesh_route)


def _solver(asked: str | None, assembly: Assembly, mesh_route: str) -> str:
    """Solver to take: the one asked for if it can, else the compiled one where it applies."""
    if asked is not None and asked not in SOLVERS:
        raise RunError(f"solver {asked!r} is unknown; solvers are {', '.join(SOLVERS)}")
    reason = unsupported_reason(assembly) if mesh_route == "element" else "user-function loads exist in Exudyn only"
    if asked == "compiled" and reason:
        raise RunError(f"the compiled solver cannot run this: {reason}; use --solver exudyn")
    return "exudyn" if reason else asked or "compiled"
