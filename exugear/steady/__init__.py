"""Steady response of a gearbox over speed: rotating frame, mean system, harmonic balance of its meshes."""
