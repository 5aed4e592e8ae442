"""What is told of a run: samples, measures, tables, warnings, summary."""
