"""Provide one-step methods with dense output, root finding of guards inside steps, and the loop that advances a problem.

This package is independent of mechanics: a problem is a set of functions with typed pointers and an opaque tuple of arrays.
"""
