"""Bearings and other supports: how the bodies of a gearbox are supported."""
