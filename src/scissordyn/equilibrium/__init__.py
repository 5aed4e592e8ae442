"""Equilibrium analyses: the state a run starts from, static equilibrium, small motions about it, buckling."""
