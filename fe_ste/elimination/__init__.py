"""Elimination of the unknowns of stiffness matrices: dense and in place, along a nested dissection."""
