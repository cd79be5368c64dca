"""Export of results into the REXS file from which a gearbox was imported."""
