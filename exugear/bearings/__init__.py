"""Bearings and other supports: stiffness from catalogue dimensions, matrices."""
