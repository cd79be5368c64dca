"""The gearbox file described: every key with unit, range, default and meaning."""
