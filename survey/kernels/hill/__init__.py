"""Kernels of Hill's question."""
