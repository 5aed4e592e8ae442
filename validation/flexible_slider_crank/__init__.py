"""Slider-crank with a rod that bends."""
