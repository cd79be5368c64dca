"""Verbs of the command line that make, describe or exchange gearbox files."""
