"""The state a run starts from, and what is chosen before its first step."""
