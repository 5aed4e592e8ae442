"""Exit statuses."""

DONE = 0
BUG = 1
BAD_INPUT = 2
UNFINISHED = 3
"""The run failed; its results up to the failure are kept."""
INTERRUPTED = 130
"""128 + SIGINT, as in shells."""
