"""Import and export of files of other programs: gearboxes and loads."""
