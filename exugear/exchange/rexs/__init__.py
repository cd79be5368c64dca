"""Files of the industry's exchange format REXS: containers, versions, units, and the tree of what they hold."""
