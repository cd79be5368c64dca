"""Rating and life of gears and bearings from load series, and the parts that limit it."""
