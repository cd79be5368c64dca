"""Diagrams of tables, pictures of teeth in contact and of their stress."""
