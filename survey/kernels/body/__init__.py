"""Kernels of whole gyrostats: their motions, and deviations from the invariant set of rotation
about axis 1.
"""
