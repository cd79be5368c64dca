"""Modal damping of a gearbox, stated as damping ratios of its modes: `[damping] modal_percent`.

Modal damping replaces the damping times of meshes, bearings and couplings. Dampers with values in the file, and
flexible bodies (`body_time_s`), count towards the stated ratio: modal damping adds only the difference. Each mode thus
has the stated damping ratio, or more where these dampers alone exceed it.

Modes are those at the static load, as `exugear modes` lists them; with flexible bodies, those within their frequency
band (`elasticity.band_Hz`). A flexible carrier turns with its planets, so that modes have no constant shapes; a model
with one has the damping times.

A fixed body from matrices with a loss factor eta has C = M Phi diag(eta w_i) Phi^T M of its own free modes Phi, with
w_i their angular frequencies: at its natural frequency each dissipates eta times its strain energy per radian, as
structural damping does. It is one of the dampers above.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import scipy.linalg

from exugear.gearbox.body_parts import damping_times
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.sections.case import DampingSection
from exugear.gearbox.variant import VariantError
from exugear.system.bearings.stiffness import equally_spaced, planet_families
from exugear.system.kernels.modal_damping import ModalArrays
from exugear.system.kernels.products import laid_out, symmetric_tiles
from exugear.system.statics import RIGID_BODY_LIMIT, linearise, static_state
from exugear.system.system import Assembly
from fe_ste.tools.arrays import Floats

NAMED = 3
"""Modes that are named where none is near a frequency."""
RIGID_MOTIONS = 6
"""Free motions of a body, which come first among its modes."""
TAKEN = 0.05
"""Permissible relative distance of a mode from its frequency in `modal_modes`."""


def with_modal_damping(assembly: Assembly, percent: float | None = None) -> Assembly:
    """Return an assembly with the modal damping of its gearbox file; the assembly itself if the file has none.

    Parameters
    ----------
    percent : damping of every mode in percent of critical, in place of that of the file

    Raises
    ------
    VariantError
        No mode is near a frequency of `modal_modes`.
    """
    section = assembly.gearbox.case.damping
    of_bodies = structural_damping(assembly)
    if section.modal_percent is None:
        return replace(assembly, modal=_arrays(assembly, of_bodies)) if of_bodies.any() else assembly
    if percent is not None:
        section = DampingSection(modal_percent=percent)
    q = static_state(assembly).q
    linear = linearise(assembly, q)
    # Only the symmetric part of the stiffness is used.
    free = unit_mass_motions(linear.mass, assembly.motions)
    values, vectors = np.linalg.eigh(free.T @ (0.5 * (linear.total_stiffness + linear.total_stiffness.T)) @ free)
    frequency = np.sqrt(np.maximum(values, 0.0)) / (2.0 * np.pi)
    damped = frequency > RIGID_BODY_LIMIT
    if assembly.elastic_bodies:
        damped &= frequency <= assembly.gearbox.case.elasticity.band_Hz
    frequency = frequency[damped]
    shapes = (free @ vectors)[:, damped]
    stated = np.einsum("im,ij,jm->m", shapes, linear.total_damping + of_bodies, shapes)
    wanted = 2.0 * damping_ratios(section, frequency) * 2.0 * np.pi * frequency
    columns = linear.mass @ shapes * np.sqrt(np.maximum(wanted - stated, 0.0))
    # Under preload the mode without stiffness differs from rolling by 1e-5; rolling itself is to have no damping.
    # Velocities (size, n) of the gear train as it rolls, one column for each of its degrees of freedom.
    gearbox = assembly.gearbox
    train = gearbox.train
    still = np.zeros(assembly.size)
    speeds = [dict(zip(train.spins, column.tolist(), strict=True)) for column in train.kinematic_modes.T]
    rolling = np.array([assembly.rolling_velocity(still, speed) for speed in speeds]).T
    carried = linear.mass @ rolling
    columns -= carried @ np.linalg.solve(rolling.T @ carried, rolling.T @ columns)
    result = replace(assembly, modal=_arrays(assembly, columns @ columns.T + of_bodies))
    result.known_rest.append(q)  # nothing is damped at rest
    return result


def structural_damping(assembly: Assembly) -> Floats:
    """Return the damping matrix (size, size) of fixed bodies with a loss factor."""
    damping = np.zeros((assembly.size,) * 2)
    for name, body in assembly.elastic_bodies.items():
        if body.loss_factor > 0.0:
            squares, shapes = scipy.linalg.eigh(body.reduced.stiffness, body.reduced.mass)
            momenta = body.reduced.mass @ shapes[:, RIGID_MOTIONS:]
            rates = body.loss_factor * np.sqrt(squares[RIGID_MOTIONS:])
            at = assembly.elastic_slices[name]
            damping[at, at] = momenta * rates @ momenta.T
    return damping


def with_damping_times(gearbox: Gearbox) -> Gearbox:
    """Return a gearbox whose damping is proportional to stiffness, by the damping times of its file or their defaults.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> damping_in_words(with_damping_times(gearbox).case.damping)
    'in proportion to stiffness: bearings 4 µs, meshes 4 µs, couplings 4 µs'
    """
    if gearbox.case.damping.modal_percent is None:
        return gearbox
    kept = {key: value for key, value in gearbox.content["damping"].items() if not key.startswith("modal_")}
    return gearbox.varied({"damping": kept})


def damping_in_words(section: DampingSection) -> str:
    """Describe the damping that a file states.

    Examples
    --------
    >>> damping_in_words(DampingSection(modal_percent=2.0))
    '2 % of critical in every mode'
    >>> damping_in_words(DampingSection(modal_percent=((100.0, 1.0), (3000.0, 4.0)), modal_modes=((642.0, 1.5),)))
    '1 % at 100 Hz to 4 % at 3000 Hz, 1.5 % in the mode near 642 Hz'
    >>> damping_in_words(DampingSection())
    'in proportion to stiffness: bearings 4 µs, meshes 4 µs, couplings 4 µs'
    """
    given = section.modal_percent
    if given is None:
        times = damping_times(section)
        listed = (("bearings", times.bearing), ("meshes", times.mesh), ("couplings", times.coupling))
        return f"in proportion to stiffness: {', '.join(f'{name} {1e6 * time:g} µs' for name, time in listed)}"
    if isinstance(given, float):
        words = [f"{given:g} % of critical in every mode"]
    else:
        (first, low), (last, high) = given[0], given[-1]
        words = [f"{low:g} % at {first:g} Hz to {high:g} % at {last:g} Hz"]
    words += [f"{percent:g} % in the mode near {near:g} Hz" for near, percent in section.modal_modes]
    return ", ".join(words)


def damping_ratios(section: DampingSection, frequency: Floats) -> Floats:
    """Return the damping ratios of a gearbox file for modes at frequencies (n,), Hz.

    A table is interpolated linearly over frequency and constant beyond its ends.

    Raises
    ------
    VariantError
        No mode is near a frequency of `modal_modes`.

    Examples
    --------
    >>> section = DampingSection(modal_percent=((100.0, 1.0), (1100.0, 3.0)), modal_modes=((610.0, 0.5),))
    >>> damping_ratios(section, np.array([50.0, 600.0, 5000.0]))
    array([0.01 , 0.005, 0.03 ])
    """
    given = section.modal_percent
    if given is None:
        return np.zeros(len(frequency))
    if isinstance(given, float):
        ratios = np.full(len(frequency), 0.01 * given)
    else:
        points, percent = np.array(given).T
        ratios = 0.01 * np.interp(frequency, points, percent)
    for near, percent_of_mode in section.modal_modes:
        place = np.abs(frequency - near)
        if not (place <= TAKEN * near).any():
            raise VariantError(
                f"damping.modal_modes: no mode within {100 * TAKEN:g} % of {near:g} Hz; modes are at "
                f"{', '.join(f'{value:.4g}' for value in frequency[np.argsort(place)][:NAMED])} Hz, ..."
            )
        ratios[np.argmin(place)] = 0.01 * percent_of_mode
    return np.asarray(ratios)


def unit_mass_motions(mass: Floats, motions: Floats) -> Floats:
    """Return a basis (size, n) of free motions (size, n) in which the mass matrix is the unit matrix.

    Examples
    --------
    >>> unit_mass_motions(np.diag([4.0, 1.0]), np.eye(2))
    array([[0.5, 0. ],
           [0. , 1. ]])
    """
    root = np.linalg.cholesky(mass)
    if motions.shape[0] == motions.shape[1]:  # all motions: the unit vectors are a basis already
        return np.asarray(scipy.linalg.solve_triangular(root.T, np.eye(len(mass))))
    return np.asarray(scipy.linalg.solve_triangular(root.T, scipy.linalg.orth(root.T @ motions)))


def _arrays(assembly: Assembly, damping: Floats) -> ModalArrays:
    """Return the arrays of a damping matrix (size, size) for the kernel, with planets grouped by carrier."""
    sets = planet_families(assembly.bodies)
    spins = [assembly.spin.get(str(planets[0].carrier), -1) for planets in sets]
    planets = [planet for family in sets for planet in family]
    return ModalArrays(
        tiles=laid_out([symmetric_tiles(damping)])[0],
        frame=np.array(spins, dtype=np.int64),
        first=np.cumsum([0, *map(len, sets)]).astype(np.int64),
        planets=np.array([assembly.coordinates[planet.name] for planet in planets], dtype=np.int64).reshape(-1, 6),
        place=np.array([(math.cos(p.orbit_angle), math.sin(p.orbit_angle)) for p in planets]).reshape(-1, 2),
        equal=np.array([int(equally_spaced(family)) for family in sets], dtype=np.int64),
    )
