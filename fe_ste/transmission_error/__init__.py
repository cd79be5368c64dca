"""Static transmission error: states over the mesh cycle, grids of states, tables."""
