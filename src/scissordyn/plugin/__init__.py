"""Let user-defined Python functions replace the package's kernels."""
