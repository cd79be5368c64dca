"""Results of a gearbox put back into the REXS file that it was imported from."""
