"""The loads of a gearbox over its life: sources, distributions, and how often each part meets them."""
