"""One point solved in time, as its scene's `trajectory` does."""

import numpy as np
import xarray as xr

from survey import api, own
from survey.analysis.point import parameters, values
from survey.dataset import options_of
from survey.errors import BadInput
from survey.scene import exists

SHOWN = 4  # parameters: of more, those that are 0 are left out of the title


def solve(point, time=None):
    """The motion at `point` (a dataset of one point), a Dataset whose attribute `panels` says how it is drawn."""
    if time is not None and not (np.asarray(time).dtype.kind in "iuf" and np.ndim(time) == 0 and 0 < time < np.inf):
        raise BadInput(f"time = {time!r}: give a positive number, how long the motion is followed")
    name, scene = own.find(own.of_dataset(point))
    make = getattr(scene, "trajectory", None)
    if make is None:
        raise BadInput(f"the scene {name} has no trajectory; it would be a function of that name in its file")
    given, chosen = parameters(point), options_of(point)
    needed = {o.name for o in scene.OUTPUTS if exists(o, chosen)}
    known = point if needed <= set(point) else api.evaluate(own.of_dataset(point), **given, **chosen)
    found = make(given, values(known), chosen, time)
    about = {"title": point.attrs.get("title", ""), "scene": name, "options": point.attrs["options"]}
    about |= {"parameters": ", ".join(f"{key}={value!r}" for key, value in given.items())}
    shown = [
        f"${point[key].attrs.get('symbol', key)} = {value:.6g}$"
        for key, value in given.items()
        if value or len(given) <= SHOWN
    ]
    about |= {"where": ", ".join(shown)}
    about |= {"panels": "; ".join(" ".join(panel) for panel in found.panels)}
    return xr.Dataset(dict(found.data), attrs=about)
