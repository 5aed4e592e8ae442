"""The explorer: a page in the browser that changes the numbers of a case and shows the new run."""
