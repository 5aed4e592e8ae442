"""Measures of a motion, one subject per file; each takes arrays or a run and returns a Dataset or a verdict."""
