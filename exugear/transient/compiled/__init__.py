"""The compiled solver: equations of motion and a Runge-Kutta loop as one piece."""
