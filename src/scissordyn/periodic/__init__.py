"""Motion from one period of a drive to the next: cycles, bifurcation diagrams, ensembles, Lyapunov exponents."""
