"""Case files: the text of a mechanism and of the options of its simulation, read and written."""
