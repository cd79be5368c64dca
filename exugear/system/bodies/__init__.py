"""Elastic bodies reduced to seats and modal coordinates."""
