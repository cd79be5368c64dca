"""Steady states that runs in time settle to: motions in time seen in the rotating frame, and their lines."""
