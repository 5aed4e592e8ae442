"""What a motion is like: one measure a file; arrays or a run in, a Dataset or a verdict out. Nothing here runs a simulation."""
