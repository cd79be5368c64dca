"""Gear standards, to compare with."""
