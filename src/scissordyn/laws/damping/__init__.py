"""Damping parts of the normal force: factors and dashpots for approach and rebound."""
