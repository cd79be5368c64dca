"""Studies: many variations of one gearbox, computed on all cores or a cluster, as one labelled dataset."""
