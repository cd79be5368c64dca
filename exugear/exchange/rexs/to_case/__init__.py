"""From the tree of a REXS file to a gearbox file: bodies, gears, shafts, supports, loads, with their sources."""
