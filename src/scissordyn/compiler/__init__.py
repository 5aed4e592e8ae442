"""Kernels in C: the same Python functions that numba compiles, translated for a target without Python."""
