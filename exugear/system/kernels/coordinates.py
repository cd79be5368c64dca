"""Coordinates of bodies, as all compiled laws read them: what each is, and where it stands among a body's six.

Coordinates are those of Exudyn's ``NodeRigidBodyRxyz``: translations x, y, z of the body's node (m), tilts a and b
(rad) about x and about the tilted y, and the unwrapped spin about the body's own z axis (rad), so that its axes
are turned by Rx(a) Ry(b) Rz(spin). All are zero in the reference state. Rates are the time derivatives of the
coordinates. Generalized forces are conjugate to them: N for translations, N m for angles.

A body has all six one after the other, or its spin alone; the ground has none. So has each seat of an elastic body,
which a mesh or a bearing takes for a rigid body. Laws that allow for missing coordinates give them the index -1; in
the arrays of the compiled solver they point to a coordinate that stays zero.

Numbers here become part of machine code: `fe_ste.tools.compilation` compiles anew when this file changes.
"""

from __future__ import annotations

AXIAL = 2
"""Translation along z, behind those along x and y."""
TILT = 3
"""First of the two tilts; the other one follows."""
SPIN = 5
"""Spin about the body's axis."""
BODY_SIZE = 6
"""Coordinates of a body or a seat."""
PADDED, PADDED_TILT, PADDED_SPIN = 8, 4, 6
"""Size of the padded row x y z 0 a b spin 0 that loops arranged for speed take a body's coordinates in, first tilt and
spin there."""
COSINE, SINE = range(2)
"""Columns of the cosines and sines of all angles that turn anything, which such loops take once per evaluation."""
