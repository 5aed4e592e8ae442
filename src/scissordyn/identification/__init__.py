"""Numbers of a mechanism from measured curves: least squares over runs, with what the data cannot tell."""
