"""The motion at one point of a survey, among some of its neighbours, as a picture shows it."""

import numpy as np

from survey.scene import Trajectory

AROUND, POINTS = np.arange(0, 2 * np.pi, np.pi / 3), 2001
ON_CYLINDER, ON_PLANE = (("cylinder", "phi", "w"), ("lines", "t", "w")), (("plane", "phi", "w"), ("lines", "t", "w"))


def solve(trajectories, outputs, system, point, time=None, panels=ON_CYLINDER):
    """The Trajectory from `phi0`, `w0` of `point`, whose other parameters `system` names.

    `trajectories` gives {output: array} of a block, as a scene's `solve` does.
    """
    time = 40.0 if time is None else float(time)
    own = point.get("phi0", 0.0), point.get("w0", 1.0)
    starts = np.array([own, *[(phi, w) for phi in AROUND for w in (-1.5, -0.5, 0.0, 0.5, 1.5)]])
    t = np.linspace(0.0, time, POINTS)
    asked = {name: np.full((1, 1), point[name]) for name in system} | {"t": t[None]}
    asked |= {
        "phi0": starts[:, :1],
        "w0": starts[:, 1:] * np.where(np.arange(len(starts)) > 0, max(1.0, abs(own[1])), 1)[:, None],
    }
    out = trajectories(asked)
    named = {o.name: {"long_name": o.long_name, "symbol": o.symbol, "units": o.units} for o in outputs if o.name in out}
    data = {"t": ("t", t, {"long_name": "time", "symbol": "t", "units": "1"})}
    for name in ("phi", "w"):
        data[name], data[f"{name}_error"] = (
            ("t", out[name][0], named[name]),
            ("t", out[f"{name}_error"][0], named[name] | {"long_name": f"error bound of {name}"}),
        )
        data[f"{name}_nearby"] = (("start", "t"), out[name][1:], named[name])
    return Trajectory(data, panels)
