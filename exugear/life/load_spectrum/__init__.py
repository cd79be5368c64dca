"""Load spectrum of a gearbox: load sources, distributions, and load cycles of each part."""
