"""Steady response of a gearbox at one speed, by mesh forces that are linear in the deflections.

With what the mesh laws read y, and the forces F that the meshes have beyond those of their mean stiffness

    y_k = y_static [k = 0] - G(w_k) F_k

for every line k. Level `linear`: F is what the static transmission error excites under the mean force. Level
`parametric`: F = (k(pmc) - k_mean) d, all mesh frequencies at once; the equations are linear and GMRES solves them.
A curve of load over deflection is taken by its tangent k(pmc) at the static load F_0, with the exponent m(pmc):

    force k d - (m - 1) F_0 = k (d - e),  e = s - F_0 / k,  s the static transmission error.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from exugear.steady.excitation import Gearset, Interface
from exugear.steady.harmonics.krylov import solve_lines
from exugear.steady.harmonics.lines import SAME
from exugear.steady.mean_system.mesh_places import mesh_places
from exugear.steady.mean_system.mesh_ports import DEFLECTION, POSITION, MeshPorts
from fe_ste.tools.arrays import Complexes, Floats

TOLERANCE = 1e-9
"""Residual of the balance over the static deflections."""


@dataclass(frozen=True, eq=False)
class Response:
    """Steady state at one speed; n lines, m mesh waves, f forces of each.

    Arrays of lines hold coefficients; `exugear.steady.harmonics.lines.LineSet` says how they make a signal.

    Attributes
    ----------
    interface : Interface
    deflection : (n, m) complex array
        Deflections that the laws read, m.
    excess : (n, m, f) complex array
        Forces beyond those of the mean system, in the law's coordinates, N and N m.
    force : (n, m) complex array
        Forces of the meshes on the line of action, N.
    products : int
        Products with the operator that the solution took.
    apart : (m,) array
        Share of time in which teeth are apart.
    free : (b,) array
        Share of time in which no rolling element of a non-linear bearing touches, by law.
    """

    interface: Interface
    deflection: Complexes
    excess: Complexes
    force: Complexes
    products: int
    apart: Floats
    free: Floats

    @cached_property
    def motion(self) -> Complexes:
        """Coefficients (n, size) of the motion about the static state, in the rotating frame."""
        lines, size = self.interface.motion.shape[:2]
        found = self.interface.motion.reshape(lines, size, -1) @ self.excess.reshape(lines, -1, 1)
        return np.asarray(-found[..., 0])

    @property
    def torque(self) -> float:
        """Mean torque of the drive that keeps the speed, N m."""
        return self.interface.torque - float(np.sum(self.interface.torque_per_force * self.excess[0].real))


def linear_response(gearset: Gearset, interface: Interface) -> Response:
    """Response to the static transmission errors as given displacements, of first order in the variation of stiffness.

    F = -k_mean e with e = s - mean of s, the transmission error under the static force F_0; of a curve k_mean is the
    mean of the tangent.
    """
    static = interface.ports.static[:, DEFLECTION]
    excess = transmission_errors(gearset, interface)[..., 0]
    deflection = _answer(interface, excess)
    deflection[0] += static
    return _response(gearset, interface, deflection, excess, 0)


def transmission_errors(gearset: Gearset, interface: Interface) -> Complexes:
    """Find the forces (n, m, 1) that static transmission errors make of the mean stiffness, N; see there."""
    if gearset.waves.carriers:
        return _errors_in_time(gearset, interface.ports, interface.speed)
    errors = _harmonics_of_errors(gearset, interface.ports, interface.speed)
    excess = np.zeros((len(gearset.lines.index), len(errors)), dtype=complex)
    for n, wave in enumerate(gearset.waves.waves):
        alone = np.zeros((gearset.harmonics + 1, gearset.lines.index.shape[1]), dtype=np.int64)
        alone[:, wave.base] = np.arange(gearset.harmonics + 1)
        at, mirrored = gearset.lines.find(alone)
        use = (at > 0) & ~mirrored
        excess[at[use], n] = -gearset.waves.mean_stiffness[n] * errors[n, use]
    return excess[..., None]


def transmission_error_line(gearset: Gearset, ports: MeshPorts, speed: float, line: int) -> Complexes:
    """Find the forces (m,) of one line of a single base as `transmission_errors` does for all."""
    if gearset.waves.carriers:
        return np.asarray(_errors_in_time(gearset, ports, speed)[line, :, 0])
    # A line may be a harmonic of several bases.
    ratios = gearset.lines.orders[line] / gearset.waves.base_orders[[wave.base for wave in gearset.waves.waves]]
    harmonics = np.rint(ratios).astype(np.int64)
    own = (np.abs(ratios - harmonics) < SAME * ratios) & (harmonics <= gearset.harmonics)
    errors = _harmonics_of_errors(gearset, ports, speed)
    found = errors[np.arange(len(own)), np.where(own, harmonics, 0)] * own
    return np.asarray(-gearset.waves.mean_stiffness * found)


def _errors_in_time(gearset: Gearset, ports: MeshPorts, speed: float) -> Complexes:
    """Find the forces of `transmission_errors` (n, m, 1) where each planet meshes out of phase with the others."""
    places = mesh_places(gearset.waves, speed, ports.positions, gearset.lattice.angles)
    deflection, ahead = places.there @ gearset.pressed(ports.static), places.there @ ports.static[:, POSITION]
    mean = gearset.waves.mean_stiffness[list(places.means)]
    excess = np.empty_like(places.positions)
    for u, n in enumerate(places.means):
        harmonics = gearset.cycle_compliances[n]
        turning = np.exp(2j * np.pi * (places.positions[:, [u]] + ahead[..., [u]]) * np.arange(1, len(harmonics)))
        excess[:, u] = -(mean[u] ** 2) * deflection[..., u] * 2.0 * (turning @ harmonics[1:]).real
    found = gearset.lattice.coefficients((places.back @ excess[..., None])[..., 0])
    found[0] = 0.0
    return found[..., None]


def _harmonics_of_errors(gearset: Gearset, ports: MeshPorts, speed: float) -> Complexes:
    """Harmonics (m, h + 1) of the static transmission errors by the bases' angles, m; the first is no error."""
    force = gearset.waves.mean_stiffness * gearset.pressed(ports.static)
    compliances = gearset.by_angle(gearset.cycle_compliances, ports.positions, speed)
    ahead = gearset.slopes(compliances, speed)
    return np.asarray(force[:, None] * compliances + force[gearset.mean_waves, None] * ahead)


def parametric_response(gearset: Gearset, interface: Interface) -> Response:
    """Response to stiffness that varies with the position in the mesh cycle, this moving with the mean speed alone."""
    coefficients, mean = gearset.coefficients(interface.speed), gearset.waves.mean_stiffness
    slopes, means = gearset.slopes(coefficients, interface.speed), gearset.mean_waves

    def following(deflection: Complexes) -> Complexes:
        found = gearset.stretched(coefficients, deflection) - mean * deflection
        return np.asarray(found + gearset.stretched(slopes, deflection[:, means]))

    def apply(deflection: Complexes) -> Complexes:
        return np.asarray(deflection - _answer(interface, following(deflection)))

    given = given_forces(gearset, interface)
    start = _answer(interface, given)
    start[0] += interface.ports.static[:, DEFLECTION]
    deflection, products = solve_lines(apply, start, TOLERANCE)
    return _response(gearset, interface, deflection, given + following(deflection), products)


def given_forces(gearset: Gearset, interface: Interface) -> Complexes:
    """Find the forces (n, m) of tangents without deflection beyond those of the mean system: of curves alone, N."""
    waves, ports = gearset.waves, interface.ports
    found = np.zeros((len(gearset.lines.index), len(waves.waves)), dtype=complex)
    if not waves.loads.any():
        return found
    pulls = gearset.by_angle(gearset.cycle_pulls, ports.positions, interface.speed)
    one, ahead = np.zeros_like(found), np.zeros_like(found)
    one[0], ahead[0] = [wave.wave == 0 for wave in waves.waves], 1.0
    found -= gearset.stretched(pulls, one) + gearset.stretched(gearset.slopes(pulls, interface.speed), ahead)
    found[0] += waves.mean_stiffness * waves.rest
    return found


def _answer(interface: Interface, excess: Complexes) -> Complexes:
    """Deflections -G F (n, m) under forces (n, m) of laws with one force."""
    return np.asarray(-np.einsum("nij,nj->ni", interface.deflection[..., 0], excess))


def _response(
    gearset: Gearset, interface: Interface, deflection: Complexes, excess: Complexes, products: int
) -> Response:
    """Complete a response with the whole forces of its meshes, those of mean stiffness and damping among them."""
    waves = gearset.waves
    rates = rates_of(gearset, interface, deflection)
    force = excess + waves.mean_stiffness * deflection + waves.damping * rates
    force[0] -= waves.mean_stiffness * waves.rest
    force *= waves.line_of_action
    return Response(interface, deflection, excess[..., None], force, products, np.zeros(len(waves.waves)), np.zeros(0))


def rates_of(gearset: Gearset, interface: Interface, values: Complexes) -> Complexes:
    """Rates (n, m, ...) of what meshes read (n, m, ...), as the meshes see it that travel through the waves."""
    frequencies = interface.frequencies.reshape(-1, *(1,) * (values.ndim - 1))
    partners = gearset.partners[: values.shape[1], : values.shape[1]]
    carried = np.moveaxis(np.tensordot(partners, values, axes=(1, 1)), 0, 1)
    return np.asarray(1j * frequencies * values + interface.speed * carried)


def signals(gearset: Gearset, response: Response) -> Complexes:
    """Coefficients (n, signals) of all signals of a response, in the order of `Gearset.signal_names`."""
    interface = response.interface
    of_motion = interface.rows.of(response.motion, interface.frequencies)
    # Rows have the bearings of the mean system; what non-linear ones have beyond it acts on their bodies, too.
    beyond = response.excess[:, len(gearset.waves.waves) :, : gearset.bearing_signals.shape[1]]
    of_motion[:, gearset.bearing_signals] -= beyond
    levers, deflection = interface.ports.levers, response.deflection
    if levers.any():
        deflection = deflection + response.motion @ levers[:, :-1].T
        deflection[0] += levers[:, -1]
    return np.concatenate([of_motion, deflection, response.force], axis=1)


def dissipated_and_given(gearset: Gearset, response: Response) -> tuple[float, float]:
    """Mean power that damping takes from the vibration, and that varying meshes give to it, W.

    Both are equal in a steady state.
    """
    interface, motion = response.interface, response.motion
    w, moving = interface.frequencies[1:, None], motion[1:]
    damping, stiffness = gearset.system.damping_at(interface.speed), gearset.system.stiffness_at(interface.speed)
    rates = 1j * w * moving
    # A stiffness that is not symmetric takes power, too. Matrices are real: so are the products with both parts.
    places, speeds = np.concatenate([moving.real, moving.imag]), np.concatenate([rates.real, rates.imag])
    taken = 2.0 * float(np.sum(speeds * (speeds @ damping.T + places @ stiffness.T)))
    ports = interface.ports
    along = np.tensordot(rates, ports.forces, axes=(1, 2)) * gearset.weights[:, None]
    return taken, -2.0 * float(np.sum((response.excess[1:] * along.conj()).real))
