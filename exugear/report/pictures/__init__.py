"""Diagrams of runs and modes, and pictures and animations of gearboxes."""
