"""Compiled laws on arrays of coordinates; they know nothing of what stands above.

What a coordinate is and how a body's six are arranged stands in `exugear.system.kernels.coordinates`.
"""
