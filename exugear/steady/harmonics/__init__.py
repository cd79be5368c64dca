"""Periodic and quasi-periodic functions: line sets, products of them, harmonic balance; no gearbox in it."""
