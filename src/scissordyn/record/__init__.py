"""What a computed motion contains: variables of plain arrays, the Dataset, its summary, and the saved file."""
