"""The gear train as a mechanism of spins: how it rolls, and what its meshes carry at rest."""
