"""Evaluation of steady-state responses: comparison with measured run-ups, and operating deflection shapes."""
