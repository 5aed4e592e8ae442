"""What lets a user's own Python function stand where the package's own kernels stand."""
