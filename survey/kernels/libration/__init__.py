"""Kernels of the triangular libration points."""
