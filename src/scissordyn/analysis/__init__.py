"""Measures of a motion, one subject per file: from arrays or a run to a Dataset or a verdict, without any simulation."""
