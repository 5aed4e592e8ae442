"""Damping parts of the normal force: what an approach and a rebound make of the elastic part."""
