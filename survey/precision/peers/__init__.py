"""Other programs that the work-precision charts measure beside survey's methods, each by its best
documented use.

One file per peer, found by its name, which is that of the package it imports:

    POINTS                      how many points of a work it is timed on, so that a chart takes minutes
    integrate(system, rtol)     states (points, n) at the end of every point's span, or (points, samples, n)

A peer is imported only when it is measured; `[bench]` in pyproject.toml installs them all.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class PeerSystem:
    """An autonomous system of ODEs at many points, each over its own span from 0.

    `slope(state, parameters, sin, cos)` gives a tuple; it only indexes, adds, multiplies, divides
    and calls the sine and cosine of the peer, so that every peer can take it as it is: as Python,
    compiled, traced or as symbols. `steps` estimates the number of steps at each point, up to a
    common factor.
    """

    slope: Callable
    start: np.ndarray
    parameters: np.ndarray
    span: np.ndarray
    steps: np.ndarray
    # the shares of the span, ascending from 0, after which states are wanted, if any
    samples: np.ndarray | None = None


def batches(system, lanes):
    """Indices (batches, lanes) of points, like numbers of steps together; the last points fill up
    the last batch.
    """
    order = np.argsort(system.steps, kind="stable")
    return np.append(order, np.repeat(order[-1:], -order.size % lanes)).reshape(-1, lanes)
