"""Elastic parts of the normal force: force against indentation."""
