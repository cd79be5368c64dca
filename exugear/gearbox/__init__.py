"""Gearbox data: input file, sections, parts and checks. This package contains no dynamics."""
