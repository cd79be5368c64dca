"""Files of results: the results folder, and complete and incomplete runs."""
