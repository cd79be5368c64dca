"""The commands: their options, and the tasks that they start."""
