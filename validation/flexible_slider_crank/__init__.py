"""A slider-crank with a rod that bends."""
