"""One point solved in time, as its scene's `trajectory` does."""

import numpy as np
import xarray as xr

from survey import api
from survey.analysis.given import check_names, options_at, parameters
from survey.analysis.point import values
from survey.errors import BadInput
from survey.request import user_scene

SHOWN = 4  # parameters in a title; if there are more, those that are 0 are left out


def solve(point, time=None):
    """The motion at `point` (a dataset of one point), a Dataset whose attribute `panels` says how
    it is drawn.
    """
    if time is not None and not (
        np.asarray(time).dtype.kind in "iuf" and np.ndim(time) == 0 and 0 < time < np.inf
    ):
        raise BadInput(f"time = {time!r}: give a positive number, the duration of the motion")
    name, scene = user_scene.find(user_scene.of_dataset(point))
    make = getattr(scene, "trajectory", None)
    if make is None:
        raise BadInput(
            f"the scene {name} has no trajectory; its file would have to define that function"
        )
    check_names(point, scene)
    options = options_at(point, scene)
    symbols = {p.name: p.symbol for p in scene.PARAMETERS}
    given = {key: value for key, value in parameters(point).items() if key in symbols}
    # solved again: a motion is computed from parameters, never from other values in a file
    known = api.evaluate(user_scene.of_dataset(point), **given, **options)
    found = make(given, values(known), options, time)
    if found is None:
        asked = " and ".join(f"{key} = {value}" for key, value in options.items())
        raise BadInput(f"the scene {name} draws no trajectory{asked and ' with ' + asked}")
    about = {
        "title": point.attrs.get("title", ""),
        "scene": name,
        "options": point.attrs.get("options", ""),
    }
    about |= {"parameters": ", ".join(f"{key}={value!r}" for key, value in given.items())}
    shown = [
        f"${symbols[key]} = {value:.6g}$"
        for key, value in given.items()
        if value or len(given) <= SHOWN
    ]
    about |= {"where": ", ".join(shown)}
    about |= {"panels": "; ".join(" ".join(panel) for panel in found.panels)}
    return xr.Dataset(dict(found.data), attrs=about)
