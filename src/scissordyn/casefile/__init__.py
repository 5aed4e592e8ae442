"""Case files: reading and writing the text of a mechanism and of the options of its simulation."""
