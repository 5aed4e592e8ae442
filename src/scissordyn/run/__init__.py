"""Runs of a mechanism: consistent start, time integration, recorded results, batches of runs."""
