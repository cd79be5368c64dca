"""Equations of motion of a variant, independent of any solver: modes, statics, sensitivity."""
