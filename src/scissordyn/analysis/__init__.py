"""Measures of a motion, one per file: from arrays or a run to a Dataset or a verdict, without any simulation."""
