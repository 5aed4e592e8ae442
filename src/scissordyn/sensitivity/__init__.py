"""Exact derivatives of runs by parameters, through every contact."""
