"""Compilation of a mechanism into the tables that the kernels read."""
