"""Load cases: torque series, and what they do to the rolling train."""
