"""Finite elements of teeth: meshes, bricks, the condensed compliance of a flank."""
