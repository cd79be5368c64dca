"""Sections of the gearbox file as it is written: pydantic models, with units in the keys."""
