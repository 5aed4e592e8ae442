"""What a study asks: factors, designs, distributions, requirements, goals."""
