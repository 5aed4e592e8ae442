"""Translate kernels, functions of numbers and arrays, from Python to C."""
