"""Spectra of run-ups: waterfalls, order cuts, resonances with their modes, and comparison of variants."""
