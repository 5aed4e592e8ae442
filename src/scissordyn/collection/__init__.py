"""Named mechanisms with their sources and the numbers that a right program gives; each is a folder of data."""
