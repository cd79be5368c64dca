"""Template gearbox files."""
