"""Gears by the standard, all factors by name, beside what the finite elements say."""
