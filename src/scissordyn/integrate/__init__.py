"""One-step methods with dense output, guards looked for inside the step, and the one loop that advances them.

Nothing here knows mechanics: a problem is a handful of functions behind typed pointers and an opaque tuple of arrays.
"""
