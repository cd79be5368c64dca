"""Files of other programs: gearboxes and loads, in and out."""
