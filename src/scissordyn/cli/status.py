"""Exit statuses."""

__all__ = ["BAD_INPUT", "BUG", "DONE", "INTERRUPTED", "UNFINISHED"]

DONE = 0
BUG = 1
BAD_INPUT = 2
UNFINISHED = 3
"""The solver could not finish; what it computed was kept."""
INTERRUPTED = 130
"""128 + SIGINT, as shells count."""
