"""Steady response of a gearbox at one speed.

With the waves' deflections d and the forces F that the meshes have beyond those of their mean stiffness

    d_k = d_static [k = 0] - G(w_k) F_k

for every line k. Level `linear`: F is what the static transmission error excites under the mean force. Level
`parametric`: F = (k(pmc) - k_mean) d, all mesh frequencies at once; the equations are linear and GMRES solves them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from exugear.harmonics.krylov import solve_lines
from exugear.steady.excitation import Gearset, Interface
from fe_ste.tools.arrays import Complexes, Floats

TOLERANCE = 1e-9
"""Residual of the balance over the static deflections."""


@dataclass(frozen=True, eq=False)
class Response:
    """Steady state at one speed; n lines, m mesh waves.

    Attributes
    ----------
    interface : Interface
    deflection : (n, m) complex array
        Coefficients of the deflections, m; `exugear.harmonics.lines.LineSet` says how they make a signal.
    force : (n, m) complex array
        Those of the forces beyond the mean stiffness, in the law's coordinate, N.
    products : int
        Products with the operator that the solution took.
    """

    interface: Interface
    deflection: Complexes
    force: Complexes
    products: int

    @property
    def motion(self) -> Complexes:
        """Coefficients (n, size) of the motion about the static state, in the rotating frame."""
        return np.asarray(-np.einsum("nsm,nm->ns", self.interface.motion, self.force))

    @property
    def torque(self) -> float:
        """Mean torque of the drive that keeps the speed, N m."""
        return self.interface.torque - float(np.real(self.interface.torque_per_force @ self.force[0]))


def linear_response(gearset: Gearset, interface: Interface) -> Response:
    """Response to the static transmission errors as given displacements, of first order in the variation of stiffness.

    F = -k_mean e with e = F_0 (1/k - mean of 1/k), the transmission error under the static force F_0 = k_mean d.
    """
    compliances = gearset.compliances(interface.speed)
    steady = interface.mean_stiffness * interface.static
    force = np.zeros((len(gearset.lines.index), len(interface.static)), dtype=complex)
    for n, wave in enumerate(gearset.waves.waves):
        alone = np.zeros((gearset.harmonics + 1, gearset.lines.index.shape[1]), dtype=np.int64)
        alone[:, wave.base] = np.arange(gearset.harmonics + 1)
        at, mirrored = gearset.lines.find(alone)
        use = (at > 0) & ~mirrored
        force[at[use], n] = -interface.mean_stiffness[n] * steady[n] * compliances[n, use]
    return Response(interface, _deflections(interface, force), force, 0)


def parametric_response(gearset: Gearset, interface: Interface, start: Complexes | None = None) -> Response:
    """Response to stiffness that varies with the position in the mesh cycle, this moving with the mean speed alone."""
    maps = gearset.coupling(interface.coefficients)

    def forces(deflection: Complexes) -> Complexes:
        conjugate = deflection.conj()
        full = np.stack([s @ deflection[:, n] + t @ conjugate[:, n] for n, (s, t) in enumerate(maps)], axis=1)
        return np.asarray(full - interface.mean_stiffness * deflection)

    def apply(deflection: Complexes) -> Complexes:
        return np.asarray(deflection - _answer(interface, forces(deflection)))

    given = np.zeros((len(gearset.lines.index), len(interface.static)), dtype=complex)
    given[0] = interface.static
    deflection, products = solve_lines(apply, given, TOLERANCE, start)
    return Response(interface, deflection, forces(deflection), products)


def _answer(interface: Interface, force: Complexes) -> Complexes:
    """Deflections -G F (n, m) under forces (n, m)."""
    return np.asarray(-np.einsum("nij,nj->ni", interface.compliance, force))


def _deflections(interface: Interface, force: Complexes) -> Complexes:
    found = _answer(interface, force)
    found[0] += interface.static
    return found


def signals(gearset: Gearset, response: Response) -> Complexes:
    """Coefficients (n, signals) of all signals of a response, in the order of `Gearset.signal_names`."""
    interface, waves = response.interface, gearset.waves
    of_motion = interface.rows.of(response.motion, interface.frequencies)
    rates = 1j * interface.frequencies[:, None] * response.deflection
    rates += interface.speed * response.deflection @ waves.partners.T
    force = response.force + interface.mean_stiffness * response.deflection + waves.damping * rates
    return np.concatenate([of_motion, response.deflection, force * waves.line_of_action], axis=1)


def dissipated_and_given(gearset: Gearset, response: Response) -> tuple[float, float]:
    """Mean power that damping takes from the vibration, and that varying meshes give to it, W.

    Both are equal in a steady state.
    """
    interface, motion = response.interface, response.motion
    w = interface.frequencies[1:]
    damping = gearset.system.damping_at(interface.speed)
    moving = motion[1:]
    taken = 2.0 * float(np.sum(w**2 * np.real(np.einsum("ns,st,nt->n", moving.conj(), damping, moving))))
    # A stiffness that is not symmetric takes power, too.
    stiffness = gearset.system.stiffness_at(interface.speed)
    taken += 2.0 * float(np.sum(w * np.imag(np.einsum("ns,st,nt->n", moving.conj(), stiffness, moving))))
    rates: Floats = np.real(response.force[1:] * np.conj(1j * w[:, None] * response.deflection[1:]))
    given = -2.0 * float(np.sum(rates * gearset.waves.weights))
    return taken, given
