"""Controllers that track a reference motion."""
