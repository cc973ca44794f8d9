"""Linear periodic systems of n states: power series of a matrix, steps, and their products."""
