"""Time integration of one run: driver, time loop, change points, tolerances, checkpoints."""
