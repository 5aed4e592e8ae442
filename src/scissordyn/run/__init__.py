"""Runs: consistent start, time stepping, what is recorded, Dataset."""
