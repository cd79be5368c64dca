"""Compiled laws on arrays of coordinates; they know nothing of what stands above."""
