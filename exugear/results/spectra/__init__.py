"""Spectra of run-ups: waterfalls, order cuts, resonances and their modes, and variants compared by them."""
