"""Reference models: the same physics by other equations and another integrator, sharing no code with the package."""
