"""Kernels of nutations."""
