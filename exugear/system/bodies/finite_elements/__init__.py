"""Finite elements of bodies: half-sections of turned shafts, solids of any shape, and where things sit on them."""
