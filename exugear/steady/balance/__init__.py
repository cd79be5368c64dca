"""Balance of all lines at one speed: unknowns; forces linear in the deflections, or evaluated in time."""
