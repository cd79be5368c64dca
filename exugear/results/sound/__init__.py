"""Sound power of the housing, from its vibration."""
