"""Figures of a point: what is computed of a varied gearbox, and which numbers of it are kept."""
