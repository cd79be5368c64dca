"""What the results of a folder say, in words and figures: the page shows it, the command line prints it."""
