"""Wear of joints over many cycles, and the number of cycles until a requirement fails."""
