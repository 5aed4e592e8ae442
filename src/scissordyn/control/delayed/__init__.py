"""Controllers that feed back the difference of a signal and its delayed value."""
