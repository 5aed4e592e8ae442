"""Scissor array of bars that bend, with a clearance joint."""
