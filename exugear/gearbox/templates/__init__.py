"""Gearbox files to start from."""
