"""Zoo of mechanisms: case files with sources and reference values, one folder each."""
