"""Studies of many runs: parameters, runners, diagrams, ensembles, exponents."""
