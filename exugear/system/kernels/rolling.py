"""Compiled law of rolling bearings: rows of rollers and of balls between two rigid rings, one element after the other.

An element at the polar angle p sees three numbers of the inner ring's displacement (x, y, z, a, b) against the outer
one, along the outer ring's axes: q = x cos p + y sin p, z, and the tilt in its axial plane w = a sin p - b cos p. Each
has a potential U(q, z, w), which the tables and constants of `exugear.system.bearings.rolling.point_contact` give:

    roller       U(d, w),  d = cos(al) q + sin(al) z + e w - gap,  e = r sin(al) - z0 cos(al)
    ball         2/5 k max(0, l - span)^(5/2),  l the distance of the grooves' centres, whose line is the normal
    aligned      the same of d, without tilt: the outer raceway is a sphere about the bearing's middle

Forces are its gradient, tangents its second derivatives: both exact, so that energy closes. A cage that turns with the
rings (phi = phase + cage_ratio * spin between them) takes the torque -U_phi from them. A damped row has the force of a
displacement that is ahead by time * rate: to first order time * tangent * rate more. It acts where something touches
alone, never pulls, takes energy at every rate (the potential is convex), and costs nothing. Machine code is kept by
`fe_ste.tools.compilation`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from exugear.system.kernels.cubics import cubic
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.bundles import cached_bundle
from fe_ste.tools.compilation import kernel, summing_kernel

ROLLER, BALL, ALIGNED_BALL = range(3)
"""Values of `FORM`."""
FORM, COUNT, CIRCLE, TABLE, STRIPS, GAPS, HALF_SLICES = range(7)
"""Columns of `RollingArrays.layout`."""
LAYOUT_SIZE = 7
COSINE, SINE, LEVER, GAP, TILTING, RADIUS, AXIAL, CONSTANT = range(8)
"""First columns of `RollingArrays.geometry`; `CONSTANT` is that of a ball, or of one slice of a roller."""
CENTRE_RADIAL, CENTRE_AXIAL, SPAN = range(8, 11)
"""Next columns of a row of balls."""
PER_TILT, MOST_TILT, PER_ROOT, MOST_DEPTH, SLICE_LENGTH = range(8, 13)
"""Next columns of a row of rollers."""
GEOMETRY_SIZE = 13
STRIP_TILT, STRIP_PER = 4, 5
"""In each strip of tilts behind the four coefficients of D: its first tilt, and 1 over its width."""
STRIP_SIZE = 6
PATCH_SIZE = 16
ELASTIC_PART, DAMPED_PART, CAGE_TORQUE, CAGE_DAMPING, STORED, MEMORY = 0, 6, 12, 13, 14, 15
"""Entries of what `rolling_forces` fills: six elastic forces, six damped ones, torque, its damped part, energy."""
ENERGY, TURNED, TOUCHING, CONTACT_SIZE = 5, 21, 26, 4
"""Memory: sums in the cage's axes (five forces, energy), the displacement in them, elements in touch."""
LINE_POWER = 10.0 / 9.0
"""Load of a line contact over its approach (ISO/TS 16281)."""


class RollingArrays(NamedTuple):
    """Rolling laws of c connectors; r rows."""

    first: Integers
    """(c + 1,) first row of each connector; equal neighbours: no rolling law."""
    scale: Floats
    """(c,) displacement of the inner ring against the outer one over the connector's strain: its sign is: negative
    where the second body carries the outer ring, its size is the share f of the deflection that the bearing takes,
    the seat the rest. Energy is U / f, so that force and tangent are those of a potential."""
    time: Floats
    """(c,) damping over tangent stiffness, s."""
    cage_ratio: Floats
    phase: Floats
    """(c,) cage angle (rad) = phase + ratio * (spin of second body - spin of first body)."""
    layout: Integers
    """(r, 7) form, number of elements, first line in `circle`; of a row of rollers first entry of its table in:
    `tables`, number of strips, first entry of its gaps, half the number of slices."""
    geometry: Floats
    """(r, 13) columns as named in this module, m, rad, N."""
    circle: Floats
    """(e, 2) cosine and sine of the elements' angles in their cage."""
    tables: Floats
    """Flat: of each kind of roller its strips (n, 6) of tilts, patches (m, n, 16) over the root of the depth with.
    the coefficients of U / depth^2, those along the root together, gaps (h,) of the slices of half a roller."""


def no_rolling(connectors: int) -> RollingArrays:
    """Arrays of connectors without any rolling law."""
    none = np.zeros(connectors)
    return RollingArrays(
        first=np.zeros(connectors + 1, dtype=np.int64),
        scale=np.ones(connectors),
        time=none,
        cage_ratio=none,
        phase=none,
        layout=np.zeros((0, LAYOUT_SIZE), dtype=np.int64),
        geometry=np.zeros((0, GEOMETRY_SIZE)),
        circle=np.zeros((0, 2)),
        tables=np.zeros(0),
    )


def selected_rolling(rolling: RollingArrays, connectors: Integers) -> RollingArrays:
    """Arrays of some connectors, in the order of their numbers; tables are shared, not copied."""
    counts = np.diff(rolling.first)[connectors]
    rows = [np.arange(rolling.first[n], rolling.first[n + 1]) for n in connectors]
    chosen = np.concatenate([np.zeros(0, dtype=np.int64), *rows])
    return rolling._replace(
        first=np.append(0, np.cumsum(counts)).astype(np.int64),
        scale=rolling.scale[connectors],
        time=rolling.time[connectors],
        cage_ratio=rolling.cage_ratio[connectors],
        phase=rolling.phase[connectors],
        layout=rolling.layout[chosen],
        geometry=rolling.geometry[chosen],
    )


def rolling_memory(rolling: RollingArrays) -> Floats:
    """Memory for `rolling_forces`, which also holds what it finds."""
    return np.zeros(TOUCHING + CONTACT_SIZE * int(rolling.layout[:, COUNT].max(initial=0)))


@summing_kernel
def slices_law(r: int, d: float, w: float, rolling: RollingArrays) -> tuple[float, float, float, float, float, float]:
    """Sum over the slices of a roller: U, its derivatives by d and w, then by d d, d w, w w."""
    first = rolling.layout[r, GAPS]
    half = rolling.layout[r, HALF_SLICES]
    constant = rolling.geometry[r, CONSTANT]
    length = rolling.geometry[r, SLICE_LENGTH]
    u = 0.0
    ud = 0.0
    uw = 0.0
    udd = 0.0
    udw = 0.0
    uww = 0.0
    for n in range(2 * half):
        t = (n - half + 0.5) * length
        approach = d - w * t - rolling.tables[first + (n - half if n >= half else half - 1 - n)]
        if approach > 0.0:
            stiffness = constant * approach ** (LINE_POWER - 1.0)
            force = stiffness * approach
            stiffness *= LINE_POWER
            u += force * approach / (1.0 + LINE_POWER)
            ud += force
            uw -= force * t
            udd += stiffness
            udw -= stiffness * t
            uww += stiffness * t * t
    return u, ud, uw, udd, udw, uww


@summing_kernel
def first_contact(r: int, d: float, tilt: float, rolling: RollingArrays) -> tuple[float, int, float]:
    """Depth (m) of an element whose normal stays behind its first contact, not above zero where it is apart.

    Also the strip of its tilt (rad, not negative) in the table of the row and the share of the strip's width. Without
    the table, beyond its tilts, the depth is the table's limit.
    """
    geometry = rolling.geometry[r]
    layout = rolling.layout[r]
    if layout[FORM] != ROLLER:
        return d, 0, 0.0
    if d + layout[HALF_SLICES] * geometry[SLICE_LENGTH] * tilt <= 0.0:  # not even an end of the roller
        return 0.0, 0, 0.0
    if tilt >= geometry[MOST_TILT]:
        return geometry[MOST_DEPTH], 0, 0.0
    j = int(math.sqrt(tilt * geometry[PER_TILT]))
    at = layout[TABLE] + STRIP_SIZE * j
    strip = rolling.tables[at : at + STRIP_SIZE]
    y = (tilt - strip[STRIP_TILT]) * strip[STRIP_PER]
    return d - (((strip[3] * y + strip[2]) * y + strip[1]) * y + strip[0]), j, y


@summing_kernel
def contact_law(
    r: int, d: float, w: float, depth: float, j: int, y: float, rolling: RollingArrays
) -> tuple[float, float, float, float, float, float]:
    """Potential of an element at the approach d (m) and the tilt w (rad), as `slices_law`, after `first_contact`.

    With the depth s = d - D(w) after first contact and x = sqrt(s) the table of a roller has V(x, w) = U / s^2, even in
    w. It varies little, so that cubics are sufficient from first contact to the limit of the raceways. Beyond it slices
    are summed.
    """
    geometry = rolling.geometry[r]
    layout = rolling.layout[r]
    if layout[FORM] != ROLLER:
        stiff = geometry[CONSTANT] * math.sqrt(d)
        return 0.4 * stiff * d * d, stiff * d, 0.0, 1.5 * stiff, 0.0, 0.0
    if depth >= geometry[MOST_DEPTH]:
        return slices_law(r, d, w, rolling)
    at = layout[TABLE] + STRIP_SIZE * j
    strip = rolling.tables[at : at + STRIP_SIZE]
    per = strip[STRIP_PER]
    slope = ((3.0 * strip[3] * y + 2.0 * strip[2]) * y + strip[1]) * per
    bend = (6.0 * strip[3] * y + 2.0 * strip[2]) * per * per
    root = math.sqrt(depth)
    per_root = geometry[PER_ROOT]
    x = root * per_root
    i = int(x)
    x -= i
    at = layout[TABLE] + STRIP_SIZE * layout[STRIPS] + PATCH_SIZE * (i * layout[STRIPS] + j)
    patch = rolling.tables[at : at + PATCH_SIZE]
    # Coefficients along the root at this tilt, and their derivatives by the tilt; then along the root.
    v0, w0, b0 = cubic(patch[0], patch[4], patch[8], patch[12], y)
    v1, w1, b1 = cubic(patch[1], patch[5], patch[9], patch[13], y)
    v2, w2, b2 = cubic(patch[2], patch[6], patch[10], patch[14], y)
    v3, w3, b3 = cubic(patch[3], patch[7], patch[11], patch[15], y)
    v = ((v3 * x + v2) * x + v1) * x + v0
    vx = ((3.0 * v3 * x + 2.0 * v2) * x + v1) * per_root
    vxx = (6.0 * v3 * x + 2.0 * v2) * per_root * per_root
    vw = (((w3 * x + w2) * x + w1) * x + w0) * per
    vxw = ((3.0 * w3 * x + 2.0 * w2) * x + w1) * per_root * per
    vww = (((b3 * x + b2) * x + b1) * x + b0) * per * per
    # U = s^2 V by s, and by w at constant s; then at constant d, where s changes with -D'(w).
    square = depth * depth
    us = depth * (2.0 * v + 0.5 * root * vx)
    uss = 2.0 * v + 1.75 * root * vx + 0.25 * depth * vxx
    usw = depth * (2.0 * vw + 0.5 * root * vxw)
    mixed = usw - slope * uss
    sense = 1.0 if w >= 0.0 else -1.0
    twice = square * vww - slope * (usw + mixed) - bend * us
    return square * v, us, sense * (square * vw - slope * us), uss, sense * mixed, twice


@summing_kernel
def normal_law(r: int, d: float, w: float, rolling: RollingArrays) -> tuple[float, float, float, float, float, float]:
    """Potential of an element whose normal stays, as `slices_law`."""
    depth, j, y = first_contact(r, d, abs(w), rolling)
    if depth <= 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    return contact_law(r, d, w, depth, j, y, rolling)


@summing_kernel
def ball_law(r: int, x: float, y: float, rolling: RollingArrays) -> tuple[float, float, float, float, float, float]:
    """Potential of a ball whose normal follows the grooves' centres, y axially and x radially apart (m).

    Returns U, its derivatives by x and y, then by x x, x y, y y.
    """
    length = math.sqrt(x * x + y * y)
    approach = length - rolling.geometry[r, SPAN]
    if approach <= 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    x = x / length
    y = y / length
    root = rolling.geometry[r, CONSTANT] * math.sqrt(approach)
    force = root * approach
    # Along the normal it is Hertz's contact that yields, across it the normal that turns.
    along = 1.5 * root
    across = force / length
    second = along * x * x + across * y * y, (along - across) * x * y, along * y * y + across * x * x
    return 0.4 * force * approach, force * x, force * y, second[0], second[1], second[2]


@summing_kernel
def add_normal_row(r: int, turned: Floats, rolling: RollingArrays, sums: Floats, touching: Floats) -> None:
    """Add forces and energy of a row whose normals stay to sums: see `sum_rows`.

    In two passes over `touching`: one element's way through its table is long, and many at once are on it like this.
    """
    x = turned[0]
    y = turned[1]
    z = turned[2]
    a = turned[3]
    b = turned[4]
    row = rolling.geometry[r]
    cosine = row[COSINE]
    sine = row[SINE]
    lever = row[LEVER]
    tilting = row[TILTING]
    # Approach and tilt are sums of a constant, a cosine and a sine of the element's place.
    d0 = sine * z - row[GAP]
    dc = cosine * x - lever * b
    ds = cosine * y + lever * a
    a = tilting * a
    b = tilting * b
    energy = 0.0
    f = 0.0
    fc = 0.0
    fs = 0.0
    mc = 0.0
    ms = 0.0
    start = rolling.layout[r, CIRCLE]
    count = 0
    for k in range(start, start + rolling.layout[r, COUNT]):
        c = rolling.circle[k, 0]
        s = rolling.circle[k, 1]
        depth, j, y = first_contact(r, d0 + dc * c + ds * s, abs(a * s - b * c), rolling)
        if depth > 0.0:
            o = CONTACT_SIZE * count
            touching[o], touching[o + 1], touching[o + 2], touching[o + 3] = k, depth, j, y
            count += 1
    for n in range(count):
        o = CONTACT_SIZE * n
        k = int(touching[o])
        depth = touching[o + 1]
        j = int(touching[o + 2])
        y = touching[o + 3]
        c = rolling.circle[k, 0]
        s = rolling.circle[k, 1]
        u, force, moment, _, _, _ = contact_law(r, d0 + dc * c + ds * s, a * s - b * c, depth, j, y, rolling)
        energy += u
        f += force
        fc += force * c
        fs += force * s
        mc += moment * c
        ms += moment * s
    sums[0] += cosine * fc
    sums[1] += cosine * fs
    sums[2] += sine * f
    sums[3] += lever * fs + tilting * ms
    sums[4] -= lever * fc + tilting * mc
    sums[ENERGY] += energy


@summing_kernel
def add_ball_row(r: int, turned: Floats, rolling: RollingArrays, sums: Floats) -> None:
    """Add forces and energy of a row of balls to sums: see `sum_rows`."""
    x = turned[0]
    y = turned[1]
    z = turned[2]
    a = turned[3]
    b = turned[4]
    row = rolling.geometry[r]
    radius = row[RADIUS]
    axial = row[AXIAL]
    radial_start = row[CENTRE_RADIAL]
    axial_start = row[CENTRE_AXIAL] + z
    energy = 0.0
    rc = 0.0
    rs = 0.0
    t = 0.0
    tc = 0.0
    ts = 0.0
    start = rolling.layout[r, CIRCLE]
    for k in range(start, start + rolling.layout[r, COUNT]):
        c = rolling.circle[k, 0]
        s = rolling.circle[k, 1]
        w = a * s - b * c
        u, fx, fy, _, _, _ = ball_law(r, radial_start + x * c + y * s - axial * w, axial_start + radius * w, rolling)
        energy += u
        rc += fx * c
        rs += fx * s
        t += fy
        tc += fy * c
        ts += fy * s
    sums[0] += rc
    sums[1] += rs
    sums[2] += t
    sums[3] += radius * ts - axial * rs
    sums[4] -= radius * tc - axial * rc
    sums[ENERGY] += energy


@summing_kernel
def turn_pairs(cosine: float, sine: float, values: Floats) -> None:
    """Turn the components across the axis of a displacement or a load (5 or more,) about z by an angle."""
    for n in (0, 3):
        x = values[n]
        y = values[n + 1]
        values[n], values[n + 1] = cosine * x - sine * y, sine * x + cosine * y


@summing_kernel
def sum_rows(
    n: int, strain: Floats, rate: Floats, ahead: float, turn: float, rolling: RollingArrays, out: Floats
) -> float:
    """Fill forces and energy of connector n's rows into the sums in out, at a strain that is ahead by a time (s).

    Returns the derivative of the energy by the angle of the cage (N m). See `rolling_forces`.

    Notes
    -----
    The potential knows the tilts a and b, whose rates are w_x - b w_z and w_y + a w_z to first order where the second
    body spins.
    """
    scale = rolling.scale[n]
    angle = rolling.phase[n] + rolling.cage_ratio[n] * turn
    cosine = math.cos(angle)
    sine = math.sin(angle)
    sums = out[MEMORY:TURNED]
    turned = out[TURNED:TOUCHING]
    touching = out[TOUCHING:]
    sums[:] = 0.0
    for i in range(5):
        turned[i] = scale * (strain[i] + ahead * rate[i])
    turned[3] -= scale * ahead * strain[4] * rate[5]
    turned[4] += scale * ahead * strain[3] * rate[5]
    # In the cage's axes elements stay where they are.
    turn_pairs(cosine, -sine, turned)
    for r in range(rolling.first[n], rolling.first[n + 1]):
        if rolling.layout[r, FORM] == BALL:
            add_ball_row(r, turned, rolling, sums)
        else:
            add_normal_row(r, turned, rolling, sums, touching)
    # A cage that turns ahead does what the ring does that stays behind.
    about_axis = turned[1] * sums[0] - turned[0] * sums[1] + turned[4] * sums[3] - turned[3] * sums[4]
    turn_pairs(cosine, sine, sums)
    return float(about_axis)


@summing_kernel
def set_force(n: int, part: int, strain: Floats, about_axis: float, rolling: RollingArrays, out: Floats) -> None:
    """Fill force and moment on the first body (6,) from `part` on, and the cage's torque, from the sums in out.

    Moments that do no work on the spin have the part a M_y - b M_x about z.
    """
    sense, share = (1.0, rolling.scale[n]) if rolling.scale[n] > 0.0 else (-1.0, -rolling.scale[n])
    for i in range(5):
        out[part + i] = sense * out[MEMORY + i]
    out[part + 5] = strain[3] * out[part + 4] - strain[4] * out[part + 3]
    out[CAGE_TORQUE] = rolling.cage_ratio[n] * about_axis / share
    out[STORED] = out[MEMORY + ENERGY] / share


@summing_kernel
def rolling_force(n: int, strain: Floats, rate: Floats, turn: float, rolling: RollingArrays, out: Floats) -> None:
    """Fill the force of connector n with its damping from `ELASTIC_PART` on, and the cage's torque at `CAGE_TORQUE`.

    Both parts of `rolling_forces` together, for half of its time.
    """
    about_axis = sum_rows(n, strain, rate, rolling.time[n], turn, rolling, out)
    set_force(n, ELASTIC_PART, strain, about_axis, rolling, out)


@summing_kernel
def rolling_forces(n: int, strain: Floats, rate: Floats, turn: float, rolling: RollingArrays, out: Floats) -> None:
    """Fill elastic and damped forces, cage torque and energy of connector n into out (m,), see `rolling_memory`.

    Parameters
    ----------
    strain : (5 or 6,) displacement and tilts of the second body against the first in the first one's axes, m, rad
    rate : (6,) velocity and angular velocity likewise, m/s, rad/s
    turn : spin of the second body less that of the first, rad
    out : (m,) elastic part from `ELASTIC_PART` and damped part from `DAMPED_PART` on, six each, of force and moment
        on the first body (N, N m); at `CAGE_TORQUE` the derivative of the energy by `turn` (N m), which acts on the
        first body's spin and against that of the second, at `CAGE_DAMPING` what damping adds to it; at `STORED` the
        energy (J); the rest is memory
    """
    about_axis = sum_rows(n, strain, rate, rolling.time[n], turn, rolling, out)
    set_force(n, DAMPED_PART, strain, about_axis, rolling, out)
    damped_torque = out[CAGE_TORQUE]
    about_axis = sum_rows(n, strain, rate, 0.0, turn, rolling, out)
    set_force(n, ELASTIC_PART, strain, about_axis, rolling, out)
    for i in range(6):
        out[DAMPED_PART + i] -= out[ELASTIC_PART + i]
    out[CAGE_DAMPING] = damped_torque - out[CAGE_TORQUE]


@summing_kernel
def element_stiffness(
    r: int, q: float, z: float, w: float, rolling: RollingArrays
) -> tuple[float, float, float, float, float, float]:
    """Second derivatives of an element's potential by q q, q z, q w, z z, z w, w w (see the module)."""
    row = rolling.geometry[r]
    if rolling.layout[r, FORM] == BALL:
        radius = row[RADIUS]
        axial = row[AXIAL]
        x = row[CENTRE_RADIAL] + q - axial * w
        y = row[CENTRE_AXIAL] + z + radius * w
        _, _, _, xx, xy, yy = ball_law(r, x, y, rolling)
        xw = radius * xy - axial * xx
        yw = radius * yy - axial * xy
        return xx, xy, xw, yy, yw, radius * yw - axial * xw
    c = row[COSINE]
    s = row[SINE]
    lever = row[LEVER]
    tilting = row[TILTING]
    d = c * q + s * z + lever * w - row[GAP]
    _, _, _, dd, dw, ww = normal_law(r, d, tilting * w, rolling)
    dw = tilting * dw
    ww = tilting * ww
    across = lever * dd + dw
    return c * c * dd, c * s * dd, c * across, s * s * dd, s * across, lever * (across + dw) + ww


@summing_kernel
def rolling_tangent(n: int, strain: Floats, turn: float, rolling: RollingArrays, out: Floats) -> None:
    """Fill the derivative of the elastic force of `rolling_forces` by the strain into out (5 or more, same)."""
    scale = rolling.scale[n]
    angle = rolling.phase[n] + rolling.cage_ratio[n] * turn
    c0 = math.cos(angle)
    s0 = math.sin(angle)
    x = scale * strain[0]
    y = scale * strain[1]
    z = scale * strain[2]
    a = scale * strain[3]
    b = scale * strain[4]
    out[:] = 0.0
    share = abs(scale)
    for r in range(rolling.first[n], rolling.first[n + 1]):
        start = rolling.layout[r, CIRCLE]
        for k in range(start, start + rolling.layout[r, COUNT]):
            ck = rolling.circle[k, 0]
            sk = rolling.circle[k, 1]
            c = c0 * ck - s0 * sk
            s = s0 * ck + c0 * sk
            qq, qt, qm, tt, tm, mm = element_stiffness(r, x * c + y * s, z, a * s - b * c, rolling)
            out[0, 0] += share * qq * c * c
            out[0, 1] += share * qq * c * s
            out[0, 2] += share * qt * c
            out[0, 3] += share * qm * c * s
            out[0, 4] -= share * qm * c * c
            out[1, 1] += share * qq * s * s
            out[1, 2] += share * qt * s
            out[1, 3] += share * qm * s * s
            out[1, 4] -= share * qm * c * s
            out[2, 2] += share * tt
            out[2, 3] += share * tm * s
            out[2, 4] -= share * tm * c
            out[3, 3] += share * mm * s * s
            out[3, 4] -= share * mm * c * s
            out[4, 4] += share * mm * c * c
    for i in range(1, 5):
        for j in range(i):
            out[i, j] = out[j, i]


@kernel
def pass_rolling(
    numbers: Integers,
    strain: Floats,
    rate: Floats,
    turn: Floats,
    rolling: RollingArrays,
    memory: Floats,
    forces: Floats,
    torques: Floats,
) -> None:
    """Fill the elastic and damped forces (k, 6) and cage torques (k,) of connectors with these numbers."""
    for k in range(numbers.size):
        rolling_force(numbers[k], strain[k], rate[k], turn[k], rolling, memory)
        for i in range(6):
            forces[k, i] = memory[ELASTIC_PART + i]
        torques[k] = memory[CAGE_TORQUE]


def rolling_loads(
    numbers: Integers, strain: Floats, rate: Floats, turn: Floats, rolling: RollingArrays
) -> tuple[Floats, Floats]:
    """Find forces (..., k, 6) and cage torques (..., k) of connectors, see `rolling_force`.

    Parameters
    ----------
    numbers : (k,)
    strain, rate : (..., k, 6)
    turn : (..., k)
    """
    forces = np.empty(strain.shape)
    torques = np.empty(turn.shape)
    strains, rates = (np.ascontiguousarray(values).reshape(-1, 6) for values in (strain, rate))
    every = np.broadcast_to(numbers, turn.shape).flatten()
    memory = rolling_memory(rolling)
    out = (forces.reshape(-1, 6), torques.ravel())
    pass_rolling(every, strains, rates, turn.ravel(), cached_bundle(rolling), memory, *out)
    return forces, torques
