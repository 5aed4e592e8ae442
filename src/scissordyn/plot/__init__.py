"""Pictures of runs: draw on given Axes or on a new Figure, return the Axes, never show. No physics."""
