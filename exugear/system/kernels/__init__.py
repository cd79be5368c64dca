"""Compiled force models on arrays of coordinates, independent of all higher layers.

Coordinates and the order of a body's six are defined in `exugear.system.kernels.coordinates`.
"""
