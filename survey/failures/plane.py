"""A plane of points: its axes, the parameters of its points, and their truth."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from survey.request import user_scene
from survey.request.checks import check_options, methods_of

MAP = "auto, as a map"
RTOL = 1e-10


@dataclass(frozen=True)
class PlaneAxis:
    """An axis of a picture: its label, the number of its cells, and {cell: tick label}."""

    label: str
    size: int
    ticks: Mapping[float, str]


@dataclass(frozen=True)
class Plane:
    """Points of a scene and what is known of them.

    `given` holds numbers, or arrays that broadcast to (y, x). `truth` is one of `survey.truth`.
    `shared`: dimensions along which a parameter does not vary are not spread out, so that one
    solution serves all times or angles.
    """

    title: str
    x: PlaneAxis
    y: PlaneAxis
    scene: object
    given: Mapping[str, object]
    truth: Callable
    source: str  # of the truth, in a sentence
    options: Mapping[str, object] = field(default_factory=dict)
    shared: bool = False
    slow: tuple[str, ...] = ()  # methods that are left out: they would take hours

    @property
    def name(self):
        return self.title.replace("$", "").replace("\n", " ")

    @property
    def shape(self):
        return self.y.size, self.x.size

    @property
    def size(self):
        return self.y.size * self.x.size

    def methods(self):
        """The scene's methods, `auto` last, and the map as a whole where the plane is one."""
        _, module = user_scene.find(self.scene)
        options = check_options(module, self.options, self.given)
        named = [method for method in methods_of(module, options) if method not in self.slow]
        product = not self.shared and all(
            min(np.shape(v)) == 1 for v in self.given.values() if np.ndim(v) == 2
        )
        return [*named, "auto", *([MAP] if product else [])]

    def flat(self):
        """The parameters of all points, one after the other."""
        return {
            name: np.broadcast_to(np.asarray(v, float), self.shape).ravel()
            for name, v in self.given.items()
        }


def few(share, number, least=4):
    """A number of cells at this share of the points."""
    return max(least, round(share * number))


def plain(label, values):
    """An axis of even values."""
    some = np.unique(np.linspace(0, len(values) - 1, 5).round().astype(int))
    return PlaneAxis(label, len(values), {i: f"{values[i]:.3g}" for i in some})


def logarithmic(label, exponents):
    """An axis of powers of ten, ticks at whole exponents."""
    low, high = sorted((exponents[0], exponents[-1]))
    decades = np.arange(math.ceil(low), math.floor(high) + 1)
    decades = decades[:: max(1, len(decades) // 4)]
    order = np.argsort(exponents)
    at = np.interp(decades, np.asarray(exponents)[order], np.arange(len(exponents))[order])
    return PlaneAxis(
        label, len(exponents), {i: f"$10^{{{k}}}$" for i, k in zip(at, decades, strict=True)}
    )


def two_sided(label, exponents):
    """(axis, offsets): -10^e, e descending, then 10^e ascending; the middle of the axis is 0."""
    offsets = np.concatenate([-(10.0 ** exponents[::-1]), 10.0**exponents])
    size = len(exponents)
    marks = round(0.5 * (exponents[0] + exponents[-1])), math.floor(exponents[-1])
    at = np.interp(marks, exponents, np.arange(size))
    ticks = {size - 1 - i: f"$-10^{{{k}}}$" for i, k in zip(at, marks, strict=True)} | {
        size - 0.5: "0"
    }
    ticks |= {size + i: f"$10^{{{k}}}$" for i, k in zip(at, marks, strict=True)}
    return PlaneAxis(label, 2 * size, ticks), offsets


def named(label, names):
    """An axis of a few cells, each with its own name."""
    return PlaneAxis(label, len(names), dict(enumerate(names)))
