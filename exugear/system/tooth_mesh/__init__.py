"""Gear meshes: tables, stiffness, where teeth stand, the mesh element."""
