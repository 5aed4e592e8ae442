"""Named mechanisms with their sources and reference values; each is a folder of data."""
