"""Files of results: the folder, runs in pieces and whole."""
