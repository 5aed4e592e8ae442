"""Explorer: a page in the browser that changes the values of a case and shows the new run."""
