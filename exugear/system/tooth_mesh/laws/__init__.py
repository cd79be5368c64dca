"""Mesh models: force between teeth in mesh. One file per model, and one table of all of them, `registry`."""
