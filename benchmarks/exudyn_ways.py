"""Ways to solve the bushing variant that need Exudyn, apart, so that the others are measured without it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from timing import Cost, timed

from exugear.system.kernels.cubics import stiffness_at
from exugear.system.loads import LoadTable
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.element import MeshElement
from exugear.transient.exudyn_model.library import exudyn, items
from exugear.transient.exudyn_model.system import ExudynSystem, MeshRoute


class PythonMesh:
    """One mesh as the textbook would write it: the law of `exugear.system.kernels.meshes` in plain Python."""

    def __init__(self, system: ExudynSystem, element: MeshElement) -> None:
        mesh = element.mesh
        names = dict.fromkeys(n for n in (mesh.pinion, mesh.gear, mesh.frame) if n in system.assembly.spin)
        start = {name: 6 * n for n, name in enumerate(names)}
        self.starts = [start.get(mesh.pinion), start.get(mesh.gear)]
        self.frame = start.get(mesh.frame)
        self.element, self.size = element, 6 * len(start)
        self.coefficients = system.assembly.meshes.stiffness[system.assembly.elements.index(element)]
        system.mbs.AddObject(
            items.ObjectGenericODE2(nodeNumbers=[system.parts.nodes[n] for n in names], forceUserFunction=self.force)
        )

    def force(self, mbs: Any, t: float, item: int, q: Any, v: Any) -> list[float]:
        """Generalized force on the coordinates of the two gears and the frame."""
        e = self.element
        psi = q[self.frame + 5] if self.frame is not None else 0.0
        c, s = math.cos(psi), math.sin(psi)
        gradient, delta, rate = [0.0] * self.size, 0.0, 0.0
        for end, start in enumerate(self.starts):
            row = e.deflection[6 * end : 6 * end + 6]
            delta -= row[5] * psi
            if self.frame is not None:
                gradient[self.frame + 5] -= row[5]
            if start is None:
                continue
            for pair, place in ((0, e.axis[end]), (3, (0.0, 0.0))):
                x, y = place[0] + q[start + pair], place[1] + q[start + pair + 1]
                lx, ly = c * x + s * y, c * y - s * x
                delta += row[pair] * (lx - place[0]) + row[pair + 1] * (ly - place[1])
                gradient[start + pair] += c * row[pair] - s * row[pair + 1]
                gradient[start + pair + 1] += s * row[pair] + c * row[pair + 1]
                if self.frame is not None:
                    gradient[self.frame + 5] += row[pair] * ly - row[pair + 1] * lx
            delta += row[2] * q[start + 2] + row[5] * q[start + 5]
            gradient[start + 2] += row[2]
            gradient[start + 5] += row[5]
        for i, entry in enumerate(gradient):
            rate += entry * v[i]
        pmc = e.phase + e.cycles * (q[self.starts[0] + 5] - psi)
        stiffness = stiffness_at.py_func(self.coefficients, len(e.stiffness), pmc)[0]
        scalar = stiffness * delta + e.damping * rate
        return [-scalar * entry for entry in gradient]


def with_python_meshes(assembly: Assembly, q: np.ndarray, v: np.ndarray, load: dict[str, float]) -> ExudynSystem:
    """Build the bushing variant with one plain Python object per mesh, without a jacobian of its own."""
    system = ExudynSystem(assembly, q, v, LoadTable(load), with_meshes=False)
    for element in assembly.elements:
        PythonMesh(system, element)
    system.mbs.Assemble()
    return system


def system_of(
    assembly: Assembly, q: np.ndarray, v: np.ndarray, load: dict[str, float], route: MeshRoute = "element"
) -> ExudynSystem:
    """Build the variant as the program does."""
    return ExudynSystem(assembly, q, v, LoadTable(load), route)


def without_meshes(assembly: Assembly, q: np.ndarray, v: np.ndarray) -> ExudynSystem:
    """Build bodies and bearings alone."""
    return ExudynSystem(assembly, q, v, LoadTable(), with_meshes=False)


def solve(system: ExudynSystem, steps: int, step: float, method: str) -> None:
    """Take some steps in Exudyn by RK44, or generalized-alpha with full or modified Newton."""
    settings = exudyn.SimulationSettings()
    integration = settings.timeIntegration
    integration.endTime, integration.numberOfSteps = steps * step, steps
    integration.verboseMode = 0
    integration.generalizedAlpha.spectralRadius = 0.9
    integration.newton.useModifiedNewton = method == "modified"
    integration.explicitIntegration.dynamicSolverType = exudyn.DynamicSolverType.RK44
    settings.linearSolverType = exudyn.LinearSolverType.EigenSparse
    settings.solutionSettings.writeSolutionToFile = False
    explicit = method == "RK44"
    solver = exudyn.MainSolverExplicit() if explicit else exudyn.MainSolverImplicitSecondOrder()
    solver.SolveSystem(system.mbs, settings)


def integrate(system: ExudynSystem, steps: int, step: float, method: str) -> Cost:
    """Cost of some steps."""
    return timed(lambda: solve(system, steps, step, method))


def trajectory(system: ExudynSystem, steps: int, step: float, method: str) -> tuple[np.ndarray, np.ndarray] | None:
    """States (steps, size) after each step; None where Newton failed and Exudyn went on with half the step."""
    rows: list[np.ndarray] = []

    def keep(mbs: Any, t: float) -> bool:
        rows.append(np.array(system.state()[1:]))
        return True

    system.mbs.SetPostStepUserFunction(keep)
    solve(system, steps, step, method)
    if len(rows) != steps + 1:
        return None
    q, v = np.array(rows[1:]).transpose(1, 0, 2)
    return q, v
