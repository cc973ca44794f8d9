"""The plane that a chart or a map of failures covers: of a user's own file, or of a workflow's
first two axes.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from survey.errors import BadInput
from survey.request import starter, user_scene, workflow


@dataclass(frozen=True)
class Ranges:
    """`axes`: {parameter: its values from least to greatest}, one or two; `fixed`: numbers of the others."""

    scene: object
    name: str
    axes: Mapping[str, np.ndarray]
    fixed: Mapping[str, float]
    options: Mapping[str, str]

    def values(self, name, number):
        """`number` values of an axis, spaced as it is."""
        given = self.axes[name]
        return np.interp(np.linspace(0.0, 1.0, number), np.linspace(0.0, 1.0, given.size), given)


def is_file(scene):
    """Does `scene` name a user's own file, or a workflow?"""
    return str(scene).endswith((".py", ".toml"))


def of(path):
    """The Ranges of a user's own file (its parameters' domains, or what `survey init` writes), or
    of a workflow.
    """
    if str(path).endswith(".toml"):
        checked = workflow.read(path)
        given = checked.grid.parameters
        axes = {name: values for name, (dims, values) in given.items() if dims and values.size > 1}
        fixed = {name: float(np.ravel(values)[0]) for name, (_dims, values) in given.items()}
        scene, options = checked.scene, dict(checked.request.options)
    else:
        _, scene = user_scene.find(path)
        axes = {p.name: np.array(starter.ends(p)) for p in scene.PARAMETERS}
        fixed = {
            p.name: starter.inside(p) if p.default is None else p.default for p in scene.PARAMETERS
        }
        options = {}
    if not axes:
        raise BadInput(f"{path}: it has no axis; a chart needs a range of a parameter at least")
    chosen = dict(list(axes.items())[:2])
    left = {name: value for name, value in fixed.items() if name not in chosen}
    return Ranges(scene, Path(path).stem, chosen, left, options)
