"""Where machine code of kernels is kept on disk: the folders, the files in them, and cleaning up."""
