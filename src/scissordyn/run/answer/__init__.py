"""What is reported of a run: samples, measures, tables, warnings, summary."""
