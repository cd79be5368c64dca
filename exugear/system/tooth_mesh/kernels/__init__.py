"""Compiled laws of meshes on arrays of coordinates."""
