"""The command `edit`: a gearbox file in a page, with all that is computed from it while it is typed."""
