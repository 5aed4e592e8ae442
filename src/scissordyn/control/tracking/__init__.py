"""Controllers that follow a reference course."""
