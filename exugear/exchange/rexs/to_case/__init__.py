"""Conversion of a REXS tree to a gearbox file: bodies, gears, shafts, supports, loads, with their sources."""
