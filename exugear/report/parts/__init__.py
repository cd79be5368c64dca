"""What sections of the report are made of: run-ups as data, line figures, levels in bytes."""
