"""Computation of the cases of a study: blocks, engines, optimisation, and the store of results."""
