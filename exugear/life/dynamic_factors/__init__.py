"""The dynamic factor K_v of meshes: stated, or of what a gearbox did in a run or a steady response."""
