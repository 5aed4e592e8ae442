"""Components: springs, loads, motors, stops, latches and their like, one a file, description and kernel together."""
