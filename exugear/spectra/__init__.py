"""Waterfalls, order cuts, resonances, and variants compared by them."""
