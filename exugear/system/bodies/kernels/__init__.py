"""Compiled laws of elastic bodies on arrays of coordinates."""
