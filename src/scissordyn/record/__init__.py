"""Contents of a computed motion: variables as plain arrays, the Dataset, its summary and the saved file."""
