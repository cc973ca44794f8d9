"""Planar motions of a satellite along one row of the map: w = dx/du and z = c0 + rho c1 + rho^2 at given u.

A row is `rows[r]` = (k, k', half period, oblate): for rotations k > 1 and k' is the complement of 1/k.
Notes (scenes/satellite.md), section 1: z = (rho + w)^2 + g with g = dn^2 (PL), -k^2 sn^2 (OL), cn^2 (PR),
-sn^2 (OR): no cancelling constant.
"""

import numpy as np

from survey.kernels.elliptic import LANES, MEANS, complete, jacobi, jacobi_lanes, means
from survey.kernels.jit import inline, kernel


@kernel
def _complete_integrals(k, kc, first, second):
    for i in range(len(k)):
        first[i], second[i] = complete(k[i], kc[i])


def complete_integrals(k, kc):
    """K and E of contiguous arrays of moduli and complements."""
    first, second = np.empty_like(k), np.empty_like(k)
    _complete_integrals(k, kc, first, second)
    return first, second


@inline
def motion(u, k, oblate, pairs, last):
    """w and g at u: w = k cn(u, k) for librations, k dn(k u, 1/k) for rotations."""
    if k <= 1.0:
        sn, cn, dn = jacobi(u, pairs, last)
        return k * cn, -(k * k) * sn * sn if oblate else dn * dn
    sn, cn, dn = jacobi(k * u, pairs, last)
    return k * dn, -sn * sn if oblate else cn * cn


@kernel
def sample(rows, nodes, out):
    """c0 = w^2 + g and c1 = 2 w at the `nodes` (fractions) of the steps of the half period: out[r, step, c, node]."""
    pairs = np.empty((2, MEANS))
    steps, width = out.shape[1], len(nodes)
    lanes = np.empty((LANES, steps * width))
    for r in range(rows.shape[0]):
        k, kc, span, oblate = rows[r, 0], rows[r, 1], rows[r, 2], rows[r, 3] > 0.0
        last = means(kc, pairs)
        scale = span / steps if k <= 1.0 else k * (span / steps)
        for n in range(steps):
            for i in range(width):
                place = n + nodes[i]
                # cn(2K - u) = -cn(u): the second half mirrors the first, where u has a smaller rounding error.
                mirror = k <= 1.0 and 2.0 * place > steps
                lanes[0, n * width + i] = (steps - place if mirror else place) * scale
        jacobi_lanes(lanes, pairs, last)
        for n in range(steps):
            for i in range(width):
                sn, cn, dn = lanes[1, n * width + i], lanes[2, n * width + i], lanes[3, n * width + i]
                if k <= 1.0:
                    w, g = k * cn, -(k * k) * sn * sn if oblate else dn * dn
                    w = -w if 2.0 * (n + nodes[i]) > steps else w
                else:
                    w, g = k * dn, -sn * sn if oblate else cn * cn
                out[r, n, 0, i] = w * w + g
                out[r, n, 1, i] = 2.0 * w


@inline
def potential(u, rho, row, table):
    """z at any u in [0, half period] and what its rounding is relative to; `table` from `tabulate`."""
    mirror = row[0] <= 1.0 and 2.0 * u > row[2]
    w, g = motion(row[2] - u if mirror else u, row[0], row[3] > 0.0, table, int(table[0, MEANS]))
    shifted = rho - w if mirror else rho + w
    return shifted * shifted + g, (abs(rho) + abs(w)) * abs(shifted) + abs(g)


@inline
def tabulate(row, table):
    """What `potential` needs of a row, once: the means of 1 and k', and in the last place their number."""
    table[0, MEANS] = means(row[1], table)
