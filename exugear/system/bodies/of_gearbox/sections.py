"""Sections of the gearbox file as a reduction takes them: materials, blanks, frames, widths of seats."""

from __future__ import annotations

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import Bearing, Body
from exugear.gearbox.sections.bodies import BlankSection
from exugear.gearbox.sections.gears import MaterialSection
from exugear.system.bodies.reduced_body import Blank, Frame
from fe_ste.geometry.gears import Material


def material_of(section: MaterialSection) -> Material:
    """Material of a body, Pa and kg/m3."""
    return Material(section.youngs_modulus_GPa * 1e9, section.poissons_ratio, section.density_kg_per_m3)


def blank_of(section: BlankSection) -> Blank:
    """Rigid ring on a seat, kg and kg m2."""
    return Blank(section.mass_kg, section.transverse_kg_m2, section.axial_kg_m2)


def seat_width(bearing: Bearing) -> float:
    """Width of a bearing's seat (m): that of its rows; a plane where only a stiffness is given."""
    if bearing.catalogue is None:
        return 0.0
    rows = 1 if bearing.catalogue.arrangement == "single" else 2
    return rows * bearing.catalogue.width_mm * 1e-3


def frame_of(gearbox: Gearbox, body: Body) -> Frame:
    """Frame that an elastic body is seen from: the ground, its own that turns, or one that does not."""
    if body.fixed:
        return "ground"
    if any(other.carrier == body.name for other in gearbox.bodies()):
        return "carrier"
    return "nonrotating"
