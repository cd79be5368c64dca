"""Files of loads over time: turbine simulations, test benches, tables."""
