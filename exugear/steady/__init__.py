"""Steady response of a gearbox over speed: balance of all mesh lines, resonances, file."""
