"""Kernels in C: functions of numbers and arrays, translated from Python."""
