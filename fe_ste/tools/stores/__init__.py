"""What is kept under a key, in one file or in many."""
