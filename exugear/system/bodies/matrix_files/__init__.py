"""Mass and stiffness matrices of bodies on interface nodes: files of other programs, and their checks."""
