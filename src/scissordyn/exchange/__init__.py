"""Read mechanisms from files of other programs, and write mechanisms and forces for other programs."""
