"""Questions of a study: factors, designs, distributions, requirements, goals."""
