"""Positions of ideal mechanisms, without time: paths, singular positions, branches, transmission."""
