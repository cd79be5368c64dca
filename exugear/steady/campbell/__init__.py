"""Campbell diagram of a gearbox: modes of the mean system followed over speed, named by type."""
