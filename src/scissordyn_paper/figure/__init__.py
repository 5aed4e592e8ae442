"""The paper's figures, one group a file: (runs by case) -> Figure."""
