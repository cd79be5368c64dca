"""The gearbox as data: file, sections, parts, checks. Nothing here computes dynamics."""
