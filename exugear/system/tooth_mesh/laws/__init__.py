"""Mesh laws: how teeth in mesh push each other. One file a law, and one table of all of them, `registry`."""
