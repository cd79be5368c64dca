"""Contact of flanks: gap, cells, compliance, the complementarity problem."""
