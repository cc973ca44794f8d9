"""The chart of a file of one's own: a row, a map and scattered points of its first two parameters."""

from types import SimpleNamespace

import numpy as np

from survey.errors import BadInput
from survey.measures.hill.multiprecision import Unsupported
from survey.precision.known import references as known
from survey.request import ranges
from survey.request.hill_scene import HillScene
from survey.truth import digits

ERROR = "discriminant"
ROW, MAP, SCATTERED, POINTS = 2_000, (60, 80), 2_000, 24


def case(path):
    """What a file in `cases` offers, for a Hill equation of one's own in a file, or in a workflow with its ranges."""
    found = ranges.of(path)
    if not isinstance(found.scene, HillScene):
        raise BadInput(f"{path}: charts are drawn of Hill equations y'' + z(u, p) y = 0 of one's own alone")
    try:
        truth = digits.own(found.scene)
    except Unsupported as error:
        raise BadInput(f"{path}: z cannot be run with more digits ({error}), so that no error is known") from None
    names, fixed = list(found.axes), dict(found.fixed)

    def scattered(number, seed):
        random = np.random.default_rng(seed)
        points = {name: found.values(name, 1001)[random.integers(0, 1001, number)] for name in names}
        return points | {name: np.full(number, value) for name, value in fixed.items()}

    across = {name: np.array([[value]]) for name, value in fixed.items()}
    row = across | {name: found.values(name, 3)[1:2, None] for name in names[1:]}
    row |= {names[0]: found.values(names[0], ROW)[None, :]}
    works = {"row": (row, {}), "scattered": (scattered(SCATTERED, 1), {})}
    if len(names) > 1:
        whole = {names[1]: found.values(names[1], MAP[0])[:, None], names[0]: found.values(names[0], MAP[1])[None, :]}
        works["map {}x{}".format(*MAP)] = (across | whole, {})
    exact = known(truth, scattered(POINTS, 5), {}, ERROR)
    most = {"rk4": 500, "dop853": 500}
    return SimpleNamespace(
        SCENE=found.scene, ERROR=ERROR, MOST=most, NAME=found.name, works=lambda: works, references=lambda work: exact
    )
