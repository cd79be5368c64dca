"""Bearings and other supports: what holds the bodies of a gearbox, and how."""
