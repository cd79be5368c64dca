"""Compiled laws of bearings on arrays of coordinates."""
