"""Mechanisms that other programs drew, and mechanisms and forces for other programs."""
