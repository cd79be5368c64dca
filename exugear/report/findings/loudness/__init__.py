"""What is loud in a steady response: its resonances ranked by three quantities, within the range of operation."""
