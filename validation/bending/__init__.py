"""Bars that bend."""
