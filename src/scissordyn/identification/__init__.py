"""Identification of parameters from measured curves: least squares over runs, with uncertainties."""
