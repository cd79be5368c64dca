"""Commands on the gearbox file: write, import, describe, check and migrate it, export results. One module each."""
