"""Kernels of flows on the cylinder."""
