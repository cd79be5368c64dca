"""Sections of the gearbox file as it is written: pydantic models, unit in the key."""
