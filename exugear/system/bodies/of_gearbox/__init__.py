"""Elastic bodies of a gearbox: from the sections of its file to reduced bodies with seats for gears and bearings."""
