"""An assembled Exudyn system: built, run, linearised.

All meshes together are one ``ObjectGenericODE2`` on the nodes that the bodies already own, with an analytic jacobian.
``mesh_route="loads"`` is the textbook way instead: per mesh and gear a force and a torque load with a user function.
It gives the same trajectory, slower, and without any jacobian.

The variant `rigid` runs in minimal coordinates (one spin per body, nothing else is free under ideal joints);
`jointed` keeps the bodies and the ideal joints and is what it is checked against.

Exudyn's behaviour that is relied upon: user forces are right-hand sides, user jacobians belong to the left-hand side;
coordinates come without reference values; explicit solvers do not notice NaN; returning False from a user function
stops a run silently.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, Literal

import numpy as np

from exugear.gearbox.variant import VariantError
from exugear.system.kernels.meshes import MeshArrays
from exugear.system.loads import LoadTable
from exugear.system.system import Assembly
from exugear.transient.exudyn_model.bodies import Parts, add_bodies
from exugear.transient.exudyn_model.forces import (
    add_couplings,
    add_joint,
    add_loads,
    add_mesh_element,
    add_mesh_loads,
    add_minimal_system,
    add_modal_element,
    add_supports,
    add_varying_loads_element,
)
from exugear.transient.exudyn_model.library import SolverFailure, exudyn
from fe_ste.tools.arrays import Floats, Integers

MeshRoute = Literal["element", "loads"]
Observer = Callable[[float, Floats, Floats], bool]
"""Called at the start and after each step with time, coordinates and velocities; False stops the run."""


class ExudynSystem:
    """An assembled Exudyn model of a gearbox variant.

    Parameters
    ----------
    q, v : (size,) initial coordinates and velocities in the assembly's order
    mesh_route : {"element", "loads"}
        One element for all meshes, or user-function loads per mesh.
    meshes : mesh arrays other than the assembly's; None for the assembly's
    with_meshes : False leaves the meshes out, for linearisation of the rest

    Attributes
    ----------
    mbs : exudyn.MainSystem
        The system, open to everything Exudyn offers.
    parts : Parts
        Its nodes and objects by the names of the assembly; none in the variant `rigid`.

    Raises
    ------
    VariantError
        The mesh route "loads" without rigid bodies to load.
    """

    def __init__(
        self,
        assembly: Assembly,
        q: Floats,
        v: Floats,
        loads: LoadTable,
        mesh_route: MeshRoute = "element",
        meshes: MeshArrays | None = None,
        with_meshes: bool = True,
    ) -> None:
        self.assembly = assembly
        self.loads = loads
        self._container = exudyn.SystemContainer()
        self.mbs = self._container.AddSystem()
        self.parts = Parts(self.mbs, assembly)
        self._minimal = assembly.variant.spins_only
        if assembly.elastic_bodies and mesh_route != "element":
            raise VariantError("mesh_route 'loads' requires rigid bodies; use the variant jointed or bushing")
        if self._minimal and mesh_route != "element":
            raise VariantError("mesh_route 'loads' requires bodies; use the variant jointed or bushing")
        chosen = assembly.meshes if meshes is None else meshes
        at_work = chosen if with_meshes else None
        if self._minimal:
            add_minimal_system(self.mbs, assembly, q, v, loads, at_work)
        else:
            self._add_parts(q, v, mesh_route, at_work)
        self.mbs.Assemble()
        self._order = self._coordinate_order()
        if self.parts.floating is not None:
            self.mbs.SetPostStepUserFunction(self._add_step_observer(None))

    def _add_parts(self, q: Floats, v: Floats, mesh_route: MeshRoute, meshes: MeshArrays | None) -> None:
        """Add bodies, what joins them, what acts on them, and the meshes unless None."""
        parts = self.parts
        add_bodies(parts, q, v)
        add_supports(parts)
        add_couplings(parts)
        if parts.floating is None:
            add_modal_element(parts)
        add_loads(parts, self.loads)
        if parts.floating is None and self.loads.varying is not None and self.loads.varying.turning.size:
            add_varying_loads_element(parts, self.loads.varying)
        if self.assembly.variant.is_constrained:
            for joint in self.assembly.gearbox.joints:
                add_joint(parts, joint)
        if parts.floating is not None:
            applied = partial(self.loads.generalized, self.assembly)
            parts.floating.add_forces(self.mbs, parts.all_nodes, meshes, applied, self.loads.varying)
        elif meshes is not None and mesh_route == "element":
            add_mesh_element(parts, meshes)
        elif meshes is not None:
            add_mesh_loads(parts, meshes)

    def _coordinate_order(self) -> Integers:
        """Position in Exudyn's coordinate vector of each coordinate of the assembly."""
        if self._minimal:
            return np.arange(self.assembly.size, dtype=np.int64)
        floating = self.parts.floating
        order = np.zeros(self.assembly.size if floating is None else floating.size, dtype=np.int64)
        for name, coordinates in self.assembly.elastic_slices.items():
            begin = (coordinates if floating is None else floating.slices[name]).start
            for node in self.parts.elastic_nodes[name]:
                count = len(self.mbs.GetNodeOutput(node, exudyn.OutputVariableType.Coordinates))
                order[begin : begin + count] = self.mbs.GetNodeODE2Index(node) + np.arange(count)
                begin += count
        for body in self.assembly.bodies:
            if body.name in self.parts.elastic_nodes:
                continue
            first = self.mbs.GetNodeODE2Index(self.parts.nodes[body.name])
            present = [index for index in self.assembly.coordinates[body.name] if index >= 0]
            order[present] = first + np.arange(len(present))
        return order

    def state(self) -> tuple[float, Floats, Floats]:
        """Time (s), coordinates and velocities now."""
        data = self.mbs.systemData
        q = np.array(data.GetODE2Coordinates())
        v = np.array(data.GetODE2Coordinates_t())
        if self._minimal:
            return float(data.GetTime()), self.assembly.motions @ q, self.assembly.motions @ v
        q = q[self._order]
        v = v[self._order]
        if self.parts.floating is not None:
            q, v = self.parts.floating.state(q, v)
        return float(data.GetTime()), q, v

    def run(self, start: float, steps: int, step: float, observe: Observer | None = None, explicit: bool = True) -> int:
        """Integrate equal steps from the initial state; return the number of steps that Exudyn counted.

        Parameters
        ----------
        start : time at the beginning, s
        steps, step : number and length (s) of the steps
        observe : callable, optional
            Called at the start and after each step; returning False ends the run there.
        explicit : RK44; else generalized-alpha, which the variant `jointed` and floating frames need

        Raises
        ------
        SolverFailure
            Exudyn gave up; the observer has seen everything up to there.
        """
        settings = exudyn.SimulationSettings()
        integration = settings.timeIntegration
        integration.startTime = start
        integration.endTime = start + steps * step
        integration.numberOfSteps = steps
        integration.verboseMode = 0
        integration.generalizedAlpha.spectralRadius = 0.9
        integration.newton.useModifiedNewton = True
        # Stiff elastic bodies leave more round-off than joints; below it Exudyn would cut its steps in vain.
        jointed = self.assembly.variant.is_constrained
        integration.newton.relativeTolerance = 1e-10 if jointed else 1e-8
        integration.newton.absoluteTolerance = 1e-12 if jointed else 1e-10
        settings.linearSolverType = exudyn.LinearSolverType.EigenSparse
        settings.solutionSettings.writeSolutionToFile = False
        settings.displayStatistics = False
        if observe is not None:
            self.mbs.SetPostStepUserFunction(self._add_step_observer(observe))
        solver = exudyn.MainSolverExplicit() if explicit else exudyn.MainSolverImplicitSecondOrder()
        if explicit:
            integration.explicitIntegration.dynamicSolverType = exudyn.DynamicSolverType.RK44
        try:
            solver.SolveSystem(self.mbs, settings)
        except exudyn.ExudynError as error:
            raise SolverFailure(str(error).splitlines()[0]) from None
        return int(solver.it.currentStepIndex) - 1

    def _add_step_observer(self, observe: Observer | None) -> Callable[[Any, float], bool]:
        def post_step(mbs: Any, t: float) -> bool:
            _, q, v = self.state()
            if self.parts.floating is not None:
                self.parts.floating.accept(q)
            return observe is None or observe(t, q, v)

        return post_step

    def linearised(self) -> tuple[Floats, Floats, Floats]:
        """Mass, stiffness and damping matrices of Exudyn about the initial state, in the assembly's order.

        Raises
        ------
        VariantError
            A body moves in a floating frame, which has other coordinates.
        """
        if self.parts.floating is not None:
            raise VariantError("a floating frame has coordinates of its own; linearise the assembly")
        mass, stiffness, damping = self.mbs.ComputeLinearizedSystem()[:3]
        grid = np.ix_(self._order, self._order)
        return np.array(mass)[grid], np.array(stiffness)[grid], np.array(damping)[grid]

    def joint_null_space(self) -> tuple[Floats, Floats]:
        """Motions (size, n) that ideal joints leave, a unit spin per column, and the mass in them (n, n)."""
        mass, _, _, _, null = self.mbs.ComputeLinearizedSystem(
            projectIntoConstraintNullspace=True, returnConstraintNullspace=True
        )[:5]
        basis = np.array(null).T[self._order]
        spins = [self.assembly.spin[body.name] for body in self.assembly.bodies]
        to_spins = np.linalg.inv(basis[spins])
        return basis @ to_spins, to_spins.T @ np.array(mass) @ to_spins
