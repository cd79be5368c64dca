"""A gearbox seen from its turning carriers: mean system with constant matrices, waves of its meshes, signals."""
