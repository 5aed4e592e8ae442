"""Steps in time: the driver of a mechanism, its state, where it stops, and threads."""
