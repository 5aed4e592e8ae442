"""Controllers with feedback of the difference between a signal and its delayed value."""
