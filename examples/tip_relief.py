"""
How much tip relief suits my load?
==================================

Loaded teeth bend, so the next tooth pair would meet too early. Tip relief makes room for it. The right amount belongs
to one load: this example looks for it.
"""

# %%
# A spur pair shows it best, for its load passes from one tooth pair to two and back.

import numpy as np

from fe_ste import FlankModification, Gear, GearPair, Relief, pair_compliance, static_transmission_error
from fe_ste.flanks import radius_at_roll_length_from_tip
from fe_ste.pictures.diagrams import plot_ripple, plot_ste_curves

gear = Gear(name="gear", teeth=40, normal_module=3e-3, face_width=25e-3, held_diameter=80e-3)
pair = GearPair(name="spur", pinion=gear, gear=gear, centre_distance=120e-3)
compliance = pair_compliance(pair)

# %%
# The costly part, how the gears yield, is computed once. Modified flanks change the gap between the teeth alone. A
# long relief begins where one tooth pair carries all the load: there the roll length from the tip is the contact
# ratio less one, in base pitches.

base_pitch = np.pi * gear.normal_module * np.cos(gear.normal_pressure_angle)
start = radius_at_roll_length_from_tip(gear, (pair.transverse_contact_ratio - 1.0) * base_pitch)


def relieved(amount):
    """Return the pair with this much material (m) removed from the tips of both gears."""
    modification = FlankModification(tip_relief=Relief(amount, start))
    return compliance.with_modifications(modification, modification)


# %%
# The ripple of the transmission error over the load, for four amounts. Fifteen positions of the mesh cycle are few:
# they give the ripple to some percent.

torques = [20.0, 100.0, 200.0, 300.0, 400.0, 500.0]
ripples = {
    f"{amount:g} um": static_transmission_error(relieved(1e-6 * amount), torque=torques, positions=15)
    for amount in (0.0, 6.0, 12.0, 18.0)
}
plot_ripple(ripples)

# %%
# Each relief has a load at which the ripple is least: more relief suits more load. Below that load the relieved tips
# leave the teeth apart for too long, above it the bending wins. Without relief the ripple grows with the load.

for name, dataset in ripples.items():
    ripple = 1e6 * np.ptp(dataset["ste"].squeeze().transpose("pmc", "torque").to_numpy(), axis=0)
    least = np.argmin(ripple)
    print(f"{name}: least ripple {ripple[least]:.2f} um at {torques[least]:.0f} N m")

# %%
# The curves at 300 N m show why.

plot_ste_curves({name: dataset.sel(torque=[300.0]) for name, dataset in ripples.items()})
