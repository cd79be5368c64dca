"""Findings from a results folder as text and numbers, for the report page and the command line."""
