"""What loads over time amount to: time and revolutions at each load, cycles, equivalent loads."""
