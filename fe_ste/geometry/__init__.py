"""Gears and gear pairs: macro geometry, tooth profile, what makes them impossible."""
