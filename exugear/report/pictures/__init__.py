"""Diagrams of runs and modes, pictures and animations of gearboxes."""
