"""Results of a run: variables as arrays, the Dataset, the summary, the warnings and the saved file."""
