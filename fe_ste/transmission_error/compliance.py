"""A gear pair with the compliance of both loaded flanks: all that does not depend on position or load.

The finite elements of both gears are the costly part of a table. They are computed here once and used at all positions,
loads, centre distances and modifications. Frame and signs as in `fe_ste.contact.kinematics`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from fe_ste.contact.compliance import RegularCompliance
from fe_ste.contact.kinematics import ContactSettings
from fe_ste.elasticity.hexmesh import MeshSettings
from fe_ste.flanks import FlankModification
from fe_ste.geometry.gears import GearPair
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.display import ReprMixin, TitledRows, value_range
from fe_ste.tools.threads import one_dense_thread

if TYPE_CHECKING:
    from fe_ste.elasticity.flank import FlankCompliance


@dataclass(frozen=True)
class PairCompliance(ReprMixin):
    """A gear pair with the compliance of both loaded flanks: all that does not depend on position or load."""

    pair: GearPair
    flanks: tuple[FlankCompliance, FlankCompliance]
    """Gear 1, gear 2."""
    contact: ContactSettings
    axial: Floats
    """(slices,) middle of the contact slices, m."""
    teeth: Integers
    """Tooth pairs that may touch."""
    reach: int
    """Largest difference of tooth pairs in contact at once."""
    regular: tuple[RegularCompliance, RegularCompliance]
    """Gear 1, gear 2."""
    modifications: tuple[FlankModification, FlankModification] = (FlankModification(), FlankModification())
    """Gear 1, gear 2."""
    tooth_gap: Floats | None = None
    """Gap of each of `teeth` on the transverse line of action, m."""

    @classmethod
    def from_flanks(
        cls,
        pair: GearPair,
        flanks: tuple[FlankCompliance, FlankCompliance],
        contact: ContactSettings | None = None,
    ) -> PairCompliance:
        """Prepare `pair` for contact with flanks computed before."""
        contact = contact or ContactSettings()
        edges = np.linspace(-pair.face_width / 2, pair.face_width / 2, contact.slices + 1)
        axial = (edges[1:] + edges[:-1]) / 2
        reach, outermost = _teeth_in_contact(pair, flanks)
        teeth = np.arange(-outermost, outermost + 1)
        senses = (1, 1 if pair.gear.internal else -1)
        with one_dense_thread():
            pinion, gear = (
                RegularCompliance.from_flank(flank, sense, teeth, reach)
                for flank, sense in zip(flanks, senses, strict=True)
            )
        return cls(pair, flanks, contact, axial, teeth, reach, (pinion, gear))

    def at_centre_distance(self, centre_distance: float) -> PairCompliance:
        """Return the same gears at another operating centre distance."""
        return replace(self, pair=self.pair.with_centre_distance(centre_distance))

    def with_modifications(self, pinion: FlankModification, gear: FlankModification) -> PairCompliance:
        """Return the same gears with modified flanks."""
        return replace(self, modifications=(pinion, gear))

    def with_tooth_gaps(self, gaps: Mapping[int, float]) -> PairCompliance:
        """Return the same gears with some tooth pairs out of place.

        Parameters
        ----------
        gaps
            Number of the tooth pair, counted ahead of the one that touches at the pitch point at pmc 0 -> gap of its
            flanks, m on the transverse line of action, negative where they touch before the others; see
            `fe_ste.flanks`.

        Raises
        ------
        ValueError
            If a pair cannot touch in the mesh cycle.
        """
        unknown = sorted(set(gaps) - set(self.teeth.tolist()))
        if unknown:
            raise ValueError(
                f"tooth pair {unknown[0]}: only pairs {self.teeth[0]} to {self.teeth[-1]} may touch in the mesh cycle"
            )
        return replace(self, tooth_gap=np.array([gaps.get(tooth, 0.0) for tooth in self.teeth.tolist()]))

    @property
    def slice_width(self) -> float:
        """Axial width of a contact slice, m."""
        return self.pair.face_width / len(self.axial)

    def _line(self) -> str:
        lowest = self.teeth[0]
        highest = self.teeth[-1]
        return f" of {self.pair.name!r}: {len(self.axial)} slices, tooth pairs {lowest} to {highest}"

    def _table(self) -> TitledRows:
        pinion, gear = self.modifications
        return f"compliance of gear pair {self.pair.name}", {
            "pinion": repr(self.flanks[0]),
            "gear": repr(self.flanks[1]),
            "modifications": f"{pinion} {gear}",
            "contact": repr(self.contact),
            "tooth pairs that may touch": f"{self.teeth[0]} to {self.teeth[-1]}",
            "gaps of tooth pairs": "none" if self.tooth_gap is None else value_range(self.tooth_gap, "µm", 1e6),
        }


def _teeth_in_contact(pair: GearPair, flanks: tuple[FlankCompliance, FlankCompliance]) -> tuple[int, int]:
    """Largest difference of tooth pairs in contact at once, and outermost tooth pair that may touch.

    A closed ring has all its teeth, and contact needs one more tooth pair on either side than the contact ratio; an
    open sector has only its own teeth.
    """
    reach = min([math.ceil(pair.total_contact_ratio)] + [flank.tooth_reach for flank in flanks if flank.closed])
    open_reach = [flank.tooth_reach for flank in flanks if not flank.closed]
    if open_reach:
        return min([reach, 2 * min(open_reach)]), min(open_reach)
    return reach, reach + 1


def pair_compliance(
    pair: GearPair,
    mesh: MeshSettings | None = None,
    contact: ContactSettings | None = None,
    *,
    open_teeth: int | None = None,
    incompatible_modes: bool = True,
) -> PairCompliance:
    """Compute the compliance of both gears of `pair` by finite elements, or take it from where it is kept.

    Parameters
    ----------
    open_teeth : odd number of teeth of open sectors; without it closed rings

    See Also
    --------
    fe_ste.elasticity.flank.known_flanks : Where computed gears are kept.
    """
    # finite elements, which a table that is there spares
    from fe_ste.elasticity.flank import TOOTH_REACH, known_flanks

    sides = ((pair.pinion, 1), (pair.gear, -1 if pair.gear.internal else 1))
    # Of wide helical gears more pairs touch at once than neighbours are usually kept.
    reach = max(TOOTH_REACH, math.ceil(pair.total_contact_ratio))
    pinion, gear = known_flanks(
        sides, mesh, open_teeth=open_teeth, tooth_reach=reach, incompatible_modes=incompatible_modes
    )
    return PairCompliance.from_flanks(pair, (pinion, gear), contact)
