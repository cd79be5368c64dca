"""Where bodies and seats stand in the compiled solver: padded coordinates, sines, axes; and what acts on them there.

Each place has eight numbers x y z 0 a b spin 0 (see `exugear.system.kernels.coordinates`) and their rates behind, two
vectors of four each, as the processor takes them; forces likewise. Machine code is kept by `fe_ste.tools.compilation`.
"""

from __future__ import annotations

import math

from exugear.system.kernels.coordinates import (
    COSINE,
    PADDED,
    PADDED_SPIN,
    PADDED_TILT,
    SINE,
    SPIN,
    TILT,
)
from exugear.transient.compiled.arrays import (
    COS_A,
    COS_B,
    SIN_A,
    SIN_B,
    W_X,
    W_Y,
    W_Z,
    WRENCH,
    Bodies,
    Places,
    Work,
)
from fe_ste.tools.arrays import Floats
from fe_ste.tools.compilation import kernel
from fe_ste.tools.octets import SIZE, all_eight, put

SMALL_ANGLE = 1.0 / 32.0
"""Below it the first terms of the series below are exact to round-off: the next ones are 1e-17 of them."""


@kernel
def tilt_sines(angle: float) -> tuple[float, float]:
    """Cosine and sine of a tilt, which is small: a quarter of the time of the library's.

    Examples
    --------
    >>> tilt_sines(0.5) == (math.cos(0.5), math.sin(0.5))
    True
    """
    if abs(angle) > SMALL_ANGLE:
        return math.cos(angle), math.sin(angle)
    y = angle * angle
    cosine = 1.0 - y * (1.0 / 2.0 - y * (1.0 / 24.0 - y * (1.0 / 720.0 - y / 40320.0)))
    return cosine, angle * (1.0 - y * (1.0 / 6.0 - y * (1.0 / 120.0 - y / 5040.0)))


@kernel
def tilts_of_axis(x: float, y: float, z: float) -> tuple[float, float]:
    """Two tilts of a body from its unit z axis.

    Examples
    --------
    >>> a, b = tilts_of_axis(math.sin(0.02), -math.sin(0.01) * math.cos(0.02), math.cos(0.01) * math.cos(0.02))
    >>> round(a, 15), round(b, 15)
    (0.01, 0.02)
    """
    if z <= 0.0 or abs(x) > SMALL_ANGLE or abs(y) > SMALL_ANGLE * z:
        return math.atan2(-y, z), math.asin(min(1.0, max(-1.0, x)))
    t = -y / z
    s = x * x
    u = t * t
    a = t * (1.0 - u * (1.0 / 3.0 - u * (1.0 / 5.0 - u * (1.0 / 7.0 - u * (1.0 / 9.0 - u / 11.0)))))
    b = x * (1.0 + s * (1.0 / 6.0 + s * (3.0 / 40.0 + s * (5.0 / 112.0 + s * (35.0 / 1152.0 + s * 63.0 / 2816.0)))))
    return a, b


@kernel
def place_bodies(q: Floats, v: Floats, bodies: Bodies, work: Work) -> None:
    """Take sines, rotation matrices and angular velocities of all bodies, once per evaluation."""
    for n in range(bodies.turning.size):
        angle = q[bodies.turning[n]]
        work.turns[n, COSINE], work.turns[n, SINE] = math.cos(angle), math.sin(angle)
    for n in range(bodies.start.size - 1):
        o = bodies.start[n]
        ca, sa = tilt_sines(q[o + TILT])
        cb, sb = tilt_sines(q[o + TILT + 1])
        cg = work.turns[bodies.slot[n], COSINE]
        sg = work.turns[bodies.slot[n], SINE]
        frame = work.frames[n]
        # Rx(a) Ry(b) Rz(spin), row by row; then the angular velocity in global axes.
        frame[0], frame[1], frame[2] = cb * cg, -cb * sg, sb
        frame[3], frame[4], frame[5] = ca * sg + sa * sb * cg, ca * cg - sa * sb * sg, -sa * cb
        frame[6], frame[7], frame[8] = sa * sg - ca * sb * cg, sa * cg + ca * sb * sg, ca * cb
        da = v[o + TILT]
        db = v[o + TILT + 1]
        dg = v[o + SPIN]
        frame[W_X], frame[W_Y], frame[W_Z] = da + sb * dg, ca * db - sa * cb * dg, sa * db + ca * cb * dg
        frame[SIN_A], frame[COS_A], frame[SIN_B], frame[COS_B] = sa, ca, sb, cb


@kernel
def gather_places(q: Floats, v: Floats, places: Places, work: Work) -> None:
    """Fill `work.places` from the state; nothing acts there yet."""
    for n in range(places.start.size):
        place = work.places[n]
        load = work.loads[n]
        o = places.start[n]
        for i in range(3):
            place[i], place[PADDED_TILT + i] = q[o + i], q[o + TILT + i]
            place[PADDED + i], place[PADDED + PADDED_TILT + i] = v[o + i], v[o + TILT + i]
        put(load, 0, all_eight(0.0))
        put(load, SIZE, all_eight(0.0))
    # Bodies with their spin alone stay where they are.
    for n in range(places.spin.size):
        place = work.places[places.start.size + n]
        load = work.loads[places.start.size + n]
        o = places.spin[n]
        place[PADDED_SPIN], place[PADDED + PADDED_SPIN] = q[o], v[o]
        load[PADDED_SPIN] = 0.0


@kernel
def add_loads_of_places(bodies: Bodies, places: Places, work: Work) -> None:
    """Add what acts on all places to the generalized forces `work.force`."""
    f = work.force
    for n in range(places.start.size):
        load = work.loads[n]
        o = places.start[n]
        for i in range(3):
            f[o + i] += load[i]
            f[o + TILT + i] += load[PADDED_TILT + i]
    for n in range(bodies.start.size - 1):
        load = work.loads[n]
        o = bodies.start[n]
        frame = work.frames[n]
        sa = frame[SIN_A]
        ca = frame[COS_A]
        sb = frame[SIN_B]
        cb = frame[COS_B]
        x = load[WRENCH + PADDED_TILT]
        y = load[WRENCH + PADDED_TILT + 1]
        z = load[WRENCH + PADDED_TILT + 2]
        for i in range(3):
            f[o + i] += load[WRENCH + i]
        # Moments about the axes that the three angles turn about: x, the tilted y, the body's z.
        f[o + TILT] += x
        f[o + TILT + 1] += ca * y + sa * z
        f[o + SPIN] += sb * x - sa * cb * y + ca * cb * z
    for n in range(places.spin.size):
        f[places.spin[n]] += work.loads[places.start.size + n, PADDED_SPIN]
