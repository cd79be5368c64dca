"""Verbs about the gearbox file: write, import, describe and check one, put results back. One module each."""
