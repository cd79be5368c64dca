"""Elimination of the unknowns of stiffness matrices: sparse, dense and in place, along a nested dissection."""
