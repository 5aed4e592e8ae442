"""Simulation: mechanism, consistent start, time stepping, Dataset."""
