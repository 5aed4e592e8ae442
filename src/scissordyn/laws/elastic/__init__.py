"""Elastic laws: the elastic part of the normal force over the indentation."""
