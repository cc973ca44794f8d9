"""The chart of a user's own Hill equation or linear system: a row, a map and scattered points of its
first two parameters.
"""

from types import SimpleNamespace

import numpy as np

from survey.precision.known import references as known
from survey.request import ranges
from survey.request.floquet_scene import FloquetScene
from survey.truth import digits, own_systems

ERROR = "discriminant"  # of Hill equations; of linear systems the spectral radius
ROW, MAP, SCATTERED, POINTS = 2_000, (60, 80), 2_000, 24


def case(path):
    """What a file in `cases` offers, for a user's Hill equation or linear system in a file, or in a
    workflow with its ranges.
    """
    linear = isinstance(ranges.of(path).scene, FloquetScene)
    found, truth = (own_systems if linear else digits).of_file(path)
    error = "spectral_radius" if linear else ERROR
    names, fixed = list(found.axes), dict(found.fixed)

    def scattered(number, seed):
        random = np.random.default_rng(seed)
        points = {
            name: found.values(name, 1001)[random.integers(0, 1001, number)] for name in names
        }
        return points | {name: np.full(number, value) for name, value in fixed.items()}

    across = {name: np.array([[value]]) for name, value in fixed.items()}
    row = across | {name: found.values(name, 3)[1:2, None] for name in names[1:]}
    row |= {names[0]: found.values(names[0], ROW)[None, :]}
    works = {"row": (row, {}), "scattered": (scattered(SCATTERED, 1), {})}
    if len(names) > 1:
        grid = {
            names[1]: found.values(names[1], MAP[0])[:, None],
            names[0]: found.values(names[0], MAP[1])[None, :],
        }
        works["map {}x{}".format(*MAP)] = (across | grid, {})
    exact = known(truth, scattered(POINTS, 5), {}, error)
    most = {"rk4": 500, "dop853": 500}
    return SimpleNamespace(
        SCENE=found.scene,
        ERROR=error,
        MOST=most,
        NAME=found.name,
        works=lambda: works,
        references=lambda work: exact,
    )
