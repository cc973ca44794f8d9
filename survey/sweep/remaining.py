"""The seconds that are left of a run."""

import time
from math import prod

import numpy as np

NEAR = 0.02  # of the map: what a block so near has cost tells this one's cost well enough


class Remaining:
    """The seconds that are left, when called: each block costs, a point, what the nearest block took that is known."""

    def __init__(self, shape, blocks, reused):
        self.points = np.array([prod(cut.stop - cut.start for cut in block) for block in blocks], float)
        self.places = np.array([[(cut.start + cut.stop) / 2 for cut in block] for block in blocks], float)
        self.places /= np.array(shape, float)
        self.open = np.ones(len(blocks), bool)
        self.open[list(reused)] = False
        self.nearest, self.cost = np.full(len(blocks), np.inf), np.zeros(len(blocks))
        self.began, self.worked = np.inf, 0.0

    def took(self, number, seconds):
        """Block `number` took so many seconds of one worker, what it compiled left out; None: its worker died."""
        self.open[number] = False
        if seconds is None:
            return
        self.began = min(self.began, time.perf_counter() - seconds)
        self.worked += seconds
        if self.nearest[number] < NEAR**2:
            return  # so that a million blocks take no longer, each, than some
        distance = ((self.places - self.places[number]) ** 2).sum(axis=1)
        nearer = distance < self.nearest
        self.nearest[nearer], self.cost[nearer] = distance[nearer], seconds / self.points[number]

    def __call__(self):
        if not self.worked:
            return 0.0
        workers = self.worked / (time.perf_counter() - self.began)  # as many as have been at work
        return float((self.cost * self.points)[self.open].sum() / workers)
