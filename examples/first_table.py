"""
How large is the transmission error of my gear pair?
====================================================

Two gears are described, meshed with finite elements, and rotated through one mesh cycle under a constant torque.
"""

# %%
# A gear is described by its drawing data. Lengths are in metres, angles in radians. ``held_diameter`` is the diameter
# that is fixed in the finite-element model: the bore, or the shaft below the teeth.

import math

from fe_ste import Gear, GearPair, static_transmission_error
from fe_ste.transmission_error.diagrams import plot_load_share, plot_ste_curves

helix = math.radians(12.0)
pinion = Gear(
    name="pinion", teeth=24, normal_module=3e-3, helix_angle=helix, profile_shift=0.3,
    face_width=42e-3, held_diameter=45e-3,
)  # fmt: skip
wheel = Gear(
    name="wheel", teeth=59, normal_module=3e-3, helix_angle=-helix, profile_shift=-0.0558,
    face_width=40e-3, held_diameter=90e-3,
)  # fmt: skip
pair = GearPair(name="helical", pinion=pinion, gear=wheel, centre_distance=128e-3)
print(f"transverse contact ratio {pair.transverse_contact_ratio:.2f}")
print(f"working pressure angle {math.degrees(pair.working_pressure_angle):.2f} deg")

# %%
# The torque acts on the pinion. The result is an xarray dataset over the position in the mesh cycle (``pmc``). Twenty
# positions suffice for a smooth helical pair; fifty are usual.

curve = static_transmission_error(pair, torque=150.0, positions=20)
ste = curve["ste"].squeeze()
print(f"mean {1e6 * float(ste.mean()):.2f} um, peak to peak {1e6 * float(ste.max() - ste.min()):.3f} um")

# %%
# The mean is the lag of the wheel under load. The variation about it excites the gearbox.

print("diagrams in results/first_table")
plot_ste_curves({"helical pair at 150 N m": curve}, "results/first_table/ste.png")

# %%
# Two or three tooth pairs share the load. A step in these curves would be an impact.

plot_load_share(curve, "results/first_table/load_share.png", title="helical pair at 150 N m")
