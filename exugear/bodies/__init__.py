"""Elastic bodies: finite elements, reduced to seats and modal coordinates."""
