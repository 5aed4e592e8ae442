"""Controllers that compare a signal with its own past."""
