"""Gear meshes: tables, stiffness, tooth positions, the mesh element."""
