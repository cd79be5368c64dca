"""Averaged (time-invariant) system of a gearbox in carrier frames: constant matrices, mesh components, signals."""
