"""Eigenmodes at the static load: shapes, energies, what moves them."""
