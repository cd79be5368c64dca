"""Two solvers for one assembly: the compiled one, and Exudyn."""
