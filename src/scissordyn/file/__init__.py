"""Files of results: runs, tables, and what is checked of a file that somebody else wrote."""
