"""Files of the industrial exchange format REXS: containers, versions, units, and the tree of their content."""
