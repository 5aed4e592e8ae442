"""Provide one-step methods with dense output, root finding of guards inside steps, and the loop that advances a problem.

This room does not know mechanics: a problem is a set of functions with typed pointers and an opaque tuple of arrays.
"""
