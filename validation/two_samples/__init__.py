"""Comparison of the distributions of compliant and hard contact over the range of a study."""
