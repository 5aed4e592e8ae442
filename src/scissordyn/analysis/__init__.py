"""Measures of a motion: contact statistics, Poincaré maps, Lyapunov exponents, 0-1 test, motor requirements."""
