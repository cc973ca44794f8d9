"""The seconds that a run still needs, estimated from the blocks that are finished."""

import time
from math import prod

import numpy as np

# fraction of the map: a finished block this close is a good enough estimate of another's cost
NEAR = 0.02


class TimeLeft:
    """Called, the seconds left: a block is taken to cost, per point, as much as the nearest
    finished block.
    """

    def __init__(self, shape, blocks, reused):
        self.points = np.array(
            [prod(cut.stop - cut.start for cut in block) for block in blocks], float
        )
        self.centres = np.array(
            [[(cut.start + cut.stop) / 2 for cut in block] for block in blocks], float
        )
        self.centres /= np.array(shape, float)
        self.open = np.ones(len(blocks), bool)
        self.open[list(reused)] = False
        self.nearest = np.full(len(blocks), np.inf)
        self.cost = np.zeros(len(blocks))
        self.began, self.worked = np.inf, 0.0

    def took(self, number, seconds):
        """Block `number` took one worker this many seconds, without compilation; None: its worker died."""
        self.open[number] = False
        if seconds is None:
            return
        self.began = min(self.began, time.perf_counter() - seconds)
        self.worked += seconds
        if self.nearest[number] < NEAR**2:
            return  # so that the work per block stays bounded for a million blocks
        distance = ((self.centres - self.centres[number]) ** 2).sum(axis=1)
        nearer = distance < self.nearest
        self.nearest[nearer], self.cost[nearer] = distance[nearer], seconds / self.points[number]

    def __call__(self):
        if not self.worked:
            return 0.0
        workers = self.worked / (time.perf_counter() - self.began)  # the mean number at work so far
        return float((self.cost * self.points)[self.open].sum() / workers)
