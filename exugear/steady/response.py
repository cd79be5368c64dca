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
from exugear.steady.mean_system.mesh_ports import DEFLECTION, MISALIGNMENT, POSITION, MeshPorts
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
    mean of the tangent. Where the load moves along the face by w, s has w (g - g0) in it, and F_0 w is a moment.
    """
    static = interface.ports.static[:, DEFLECTION]
    excess = transmission_errors(gearset, interface)
    deflection = _answer(interface, excess)[..., DEFLECTION]
    deflection[0] += static
    return _response(gearset, interface, deflection, excess, 0)


def transmission_errors(gearset: Gearset, interface: Interface) -> Complexes:
    """Find the forces (n, m, f) that static transmission errors make of the mean stiffness, and moments, N and N m."""
    if gearset.waves.carriers:
        return _errors_in_time(gearset, interface.ports, interface.speed)
    errors = _harmonics_of_errors(gearset, interface.ports, interface.speed)
    excess = np.zeros((len(gearset.lines.index), len(errors), errors.shape[2]), dtype=complex)
    for n, wave in enumerate(gearset.waves.waves):
        alone = np.zeros((gearset.harmonics + 1, gearset.lines.index.shape[1]), dtype=np.int64)
        alone[:, wave.base] = np.arange(gearset.harmonics + 1)
        at, mirrored = gearset.lines.find(alone)
        use = (at > 0) & ~mirrored
        excess[at[use], n] = errors[n, use]
    return excess


def transmission_error_line(gearset: Gearset, ports: MeshPorts, speed: float, line: int) -> Complexes:
    """Find the forces (m, f) of one line of a single base as `transmission_errors` does for all."""
    if gearset.waves.carriers:
        return np.asarray(_errors_in_time(gearset, ports, speed)[line])
    # A line may be a harmonic of several bases.
    ratios = gearset.lines.orders[line] / gearset.waves.base_orders[[wave.base for wave in gearset.waves.waves]]
    harmonics = np.rint(ratios).astype(np.int64)
    own = (np.abs(ratios - harmonics) < SAME * ratios) & (harmonics <= gearset.harmonics)
    errors = _harmonics_of_errors(gearset, ports, speed)
    return np.asarray(errors[np.arange(len(own)), np.where(own, harmonics, 0)] * own[:, None])


def _errors_in_time(gearset: Gearset, ports: MeshPorts, speed: float) -> Complexes:
    """Find the forces of `transmission_errors` (n, m, f) where each planet meshes out of phase with the others."""
    places = mesh_places(gearset.waves, speed, ports.positions, gearset.lattice.angles)
    deflection, ahead = places.there @ gearset.pressed(ports.static), places.there @ ports.static[:, POSITION]
    mean = gearset.waves.mean_stiffness[list(places.means)]
    excess = np.empty((*places.positions.shape, ports.forces.shape[1]))
    for u, n in enumerate(places.means):
        harmonics = np.arange(1, gearset.harmonics + 1)
        turning = np.exp(2j * np.pi * (places.positions[:, [u]] + ahead[..., [u]]) * harmonics)
        force = mean[u] * deflection[..., u]
        excess[:, u, DEFLECTION] = -mean[u] * force * 2.0 * (turning @ gearset.cycle_compliances[n, 1:]).real
        if gearset.wander:
            way = 2.0 * (turning @ gearset.cycle_ways[n, 1:]).real
            tilt = (places.there @ ports.static[:, MISALIGNMENT])[..., u]
            excess[:, u, DEFLECTION] -= mean[u] * tilt * way
            excess[:, u, MISALIGNMENT] = -force * way
    found = gearset.lattice.coefficients(places.back @ excess)
    found[0] = 0.0
    return found


def _harmonics_of_errors(gearset: Gearset, ports: MeshPorts, speed: float) -> Complexes:
    """Harmonics (m, h + 1, f) by the bases' angles of the forces of static transmission errors; the first is none."""
    mean = gearset.waves.mean_stiffness
    force = mean * gearset.pressed(ports.static)
    excess = [-mean[:, None] * _along_cycle(gearset, gearset.cycle_compliances, force, ports, speed)]
    if gearset.wander:
        static = ports.static[: len(mean)]
        excess[0] -= mean[:, None] * _along_cycle(gearset, gearset.cycle_ways, static[:, MISALIGNMENT], ports, speed)
        excess.append(-_along_cycle(gearset, gearset.cycle_ways, force, ports, speed))
    return np.stack(excess, axis=2)


def _along_cycle(
    gearset: Gearset, coefficients: Complexes, values: Floats, ports: MeshPorts, speed: float
) -> Complexes:
    """Harmonics (m, h + 1) by the bases' angles of static values (m,) times a function of the mesh cycle."""
    turned = gearset.by_angle(coefficients, ports.positions, speed)
    ahead = gearset.slopes(turned, speed)
    return np.asarray(values[:, None] * turned + values[gearset.mean_waves, None] * ahead)


def parametric_response(gearset: Gearset, interface: Interface) -> Response:
    """Response to stiffness that varies with the position in the mesh cycle, this moving with the mean speed alone."""
    tangents = {at: turned_tangents(gearset, interface, own) for at, own in gearset.cycle_tangents.items()}
    mean, means = gearset.waves.mean_stiffness, gearset.mean_waves
    forces = interface.ports.forces.shape[1]
    lengths = gearset.lengths[: len(mean), :forces]

    def following(readings: Complexes) -> Complexes:
        found = np.zeros(readings.shape, dtype=complex)
        for (force, read), (own, _) in tangents.items():
            found[..., force] += gearset.stretched(own, readings[..., read])
        found[..., DEFLECTION] -= mean * readings[..., DEFLECTION]
        for (force, read), (_, ahead) in tangents.items():
            found[..., force] += gearset.stretched(ahead, readings[:, means, read])
        return found

    def apply(scaled: Complexes) -> Complexes:
        return np.asarray(scaled - lengths * _answer(interface, following(scaled / lengths)))

    given = given_forces(gearset, interface)
    start = _answer(interface, given)
    start[0] += interface.ports.static[:, :forces]
    scaled, products = solve_lines(apply, lengths * start, TOLERANCE)
    readings = scaled / lengths
    return _response(gearset, interface, readings[..., DEFLECTION], given + following(readings), products)


def turned_tangents(gearset: Gearset, interface: Interface, cycle: Complexes) -> tuple[Complexes, Complexes]:
    """Coefficients (m, h + 1) over mesh cycles by the bases' angles, and their slopes as `Gearset.slopes` has them."""
    own = gearset.by_angle(cycle, interface.ports.positions, interface.speed)
    return own, gearset.slopes(own, interface.speed)


def given_forces(gearset: Gearset, interface: Interface) -> Complexes:
    """Find the forces (n, m, f) of tangents without deflection beyond those of the mean system: of curves alone."""
    waves, ports = gearset.waves, interface.ports
    found = np.zeros((len(gearset.lines.index), *ports.forces.shape[:2]), dtype=complex)
    if not waves.loads.any():
        return found
    one, ahead = (np.zeros(found.shape[:2], dtype=complex) for _ in range(2))
    one[0], ahead[0] = [wave.wave == 0 for wave in waves.waves], 1.0
    pulls = [gearset.cycle_pulls] + [-gearset.cycle_moments[1]] * gearset.wander
    for force, cycle in enumerate(pulls):
        own, slopes = turned_tangents(gearset, interface, cycle)
        found[..., force] -= gearset.stretched(own, one) + gearset.stretched(slopes, ahead)
    found[0, :, DEFLECTION] += waves.mean_stiffness * waves.rest
    return found


def _answer(interface: Interface, excess: Complexes) -> Complexes:
    """Find the readings -G F (n, m, f) that laws along a row push along, under their forces (n, m, f)."""
    if excess.shape[2] == 1:
        return np.asarray(-np.einsum("nij,nj->ni", interface.deflection[..., 0], excess[..., 0]))[..., None]
    return np.asarray(-(interface.along_forces @ excess.reshape(len(excess), -1, 1))).reshape(excess.shape)


def _response(
    gearset: Gearset, interface: Interface, deflection: Complexes, excess: Complexes, products: int
) -> Response:
    """Complete a response with the whole forces of its meshes, those of mean stiffness and damping among them."""
    waves = gearset.waves
    rates = rates_of(gearset, interface, deflection)
    force = excess[..., DEFLECTION] + waves.mean_stiffness * deflection + waves.damping * rates
    force[0] -= waves.mean_stiffness * waves.rest
    force *= waves.line_of_action
    return Response(interface, deflection, excess, force, products, np.zeros(len(waves.waves)), np.zeros(0))


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
    if gearset.bearings is not None:
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
