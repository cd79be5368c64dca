"""From loads over time to the life of gears and bearings, and to what limits it."""
