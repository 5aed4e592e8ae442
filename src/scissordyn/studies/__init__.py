"""Studies of many runs: their description, their computation and their answers."""
