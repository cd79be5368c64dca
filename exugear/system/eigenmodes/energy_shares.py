"""Where the energy of modes sits: kinetic by body and motion, strain by element, and what moves in words."""

from __future__ import annotations

import numpy as np

from exugear.system.assembly import Assembly
from exugear.system.bodies.reduced_body import TILT_X, TILT_Y, UX, UY, UZ, ReducedBody
from exugear.system.kernels.coordinates import SPIN
from fe_ste.tools.arrays import Floats

BODY_MOTIONS = ("spin", "radial", "axial", "tilt", "bending", "twist", "stretch", "deformation")
"""What a body does: four motions as a rigid body, three deformations of an elastic shaft, the last of other bodies."""
RIGID_MOTIONS = slice(0, 4)
BENDING, TWIST, STRETCH, DEFORMATION = range(4, 8)
"""Their places in `BODY_MOTIONS`."""
COORDINATES_OF_MOTIONS = ((SPIN,), (UX, UY), (UZ,), (TILT_X, TILT_Y))
"""Coordinates of a rigid body that belong to each of its four motions."""


def kinetic_shares(assembly: Assembly, shapes: Floats, q: Floats) -> Floats:
    """Share of kinetic energy (n, bodies, 8) by body and motion of modes (size, n) about coordinates q (size,)."""
    energy = np.diag(assembly.mass_matrix)[:, None] * shapes**2
    shares = np.zeros((shapes.shape[1], len(assembly.bodies), len(BODY_MOTIONS)))
    for n, body in enumerate(assembly.bodies):
        if body.name in assembly.elastic_bodies:
            of_body = assembly.elastic_slices[body.name]
            body_shapes = shapes[of_body]
            if body.name in assembly.turning:  # its matrices are those of its own frame
                turning = assembly.turning[body.name]
                body_shapes = turning.rotated(body_shapes, -turning.angle(q[of_body]))
            shares[:, n] = _elastic_energies(assembly.elastic_bodies[body.name].reduced, body_shapes)
            continue
        index = assembly.coordinates[body.name]
        for motion, coordinates in enumerate(COORDINATES_OF_MOTIONS):
            for coordinate in coordinates:
                if index[coordinate] >= 0:
                    shares[:, n, motion] += energy[index[coordinate]]
    total: Floats = shares.sum(axis=(1, 2), keepdims=True)
    return shares / total


def _elastic_energies(body: ReducedBody, shapes: Floats) -> Floats:
    """Twice the kinetic energy (n, motions) of an elastic body: of its rigid part, and of each deformation.

    The rigid part is what the momentum of the whole tells; the rest is orthogonal to it. Turns about all three axes
    share their energy in the proportion that each has alone: a housing's products of inertia couple them.
    """
    rigid = body.rigid_motions(body.rigid_inertia.centre)
    inertia = rigid.T @ body.mass @ rigid
    # Rigid motions that have the momentum of the whole.
    velocities = np.linalg.solve(inertia, rigid.T @ body.mass @ shapes)
    rigid_energies = np.diag(inertia)[:, None] * velocities**2
    turning = np.einsum("im,ij,jm->m", velocities[3:], inertia[3:, 3:], velocities[3:])
    rigid_energies[3:] *= turning / np.maximum(rigid_energies[3:].sum(axis=0), 1e-300)
    ux, uy, uz, tilt_x, tilt_y, spin = rigid_energies
    energies = np.zeros((shapes.shape[1], len(BODY_MOTIONS)))
    energies[:, RIGID_MOTIONS] = np.stack([spin, ux + uy, uz, tilt_x + tilt_y], axis=1)
    deformed = shapes - rigid @ velocities
    for block in body.blocks:
        if body.spin[block].any():
            motion = TWIST
        elif rigid[block, UZ].any():
            motion = STRETCH
        else:
            motion = BENDING
        if len(body.blocks) == 1:  # a solid, which falls into no planes
            motion = DEFORMATION
        mass = body.mass[np.ix_(block, block)]
        energies[:, motion] += np.einsum("im,ij,jm->m", deformed[block], mass, deformed[block])
    return energies


def mode_name(assembly: Assembly, element_names: tuple[str, ...], kinetic: Floats, strain: Floats) -> str:
    """Describe a mode: who moves how, until 80 % of the kinetic energy is told, and what is strained most.

    Parameters
    ----------
    kinetic : (bodies, motions) share by body and motion
    strain : (elements,) share by mesh, bearing, coupling and elastic body
    """
    moving: dict[str, float] = {}
    for body, shares in zip(assembly.bodies, kinetic, strict=True):
        for motion, share in zip(BODY_MOTIONS, shares, strict=True):
            family = "planets" if body.carrier else body.name
            moving[f"{family} {motion}"] = moving.get(f"{family} {motion}", 0.0) + float(share)
    strained: dict[str, float] = {}
    # Those of all planets together; other names keep their digits.
    families = {mesh.name: mesh.family for mesh in assembly.gearbox.meshes}
    families |= {support.name: support.family for support in assembly.supports}
    for name, share in zip(element_names, strain, strict=True):
        family = families.get(name, name)
        strained[family] = strained.get(family, 0.0) + float(share)
    words = []
    told = 0.0
    for what, share in sorted(moving.items(), key=lambda item: -item[1]):
        if told >= 0.8 or share < 0.05:
            break
        words.append(f"{what} {100 * share:.0f} %")
        told += share
    most = max(strained, key=lambda name: strained[name])
    itself = most.removesuffix("_body")
    what = f"{itself} itself" if itself != most and itself in assembly.elastic_bodies else most
    return f"{', '.join(words)}; strained: {what} {100 * strained[most]:.0f} %"
