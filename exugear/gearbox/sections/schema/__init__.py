"""Description of the gearbox file: every key with unit, range, default and meaning."""
