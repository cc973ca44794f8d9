"""The motion at one point of a survey, among some of its neighbours, as a picture shows it.

On the cylinder, also what separates the motions: equilibria, cycles, and the branches of the
saddles.
"""

import numpy as np

from survey.kernels.cylinder import branches
from survey.kernels.cylinder import equilibria as eq
from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder import returns as rt
from survey.measures.cylinder.destinations import backward
from survey.measures.cylinder.fate import outline, remembered
from survey.methods import taylor
from survey.scene import Trajectory

AROUND = np.arange(0, 2 * np.pi, np.pi / 3)
POINTS = 2001
ON_CYLINDER = (("cylinder", "phi", "w"), ("lines", "t", "w"))
ON_PLANE = (("plane", "phi", "w"), ("lines", "t", "w"))
LINES = ("unstable_branch", "stable_branch", "unstable_cycle", "stable_cycle")
ALONG = 601  # points of a branch or a cycle
FURTHEST = 5.0 * np.pi  # rad, along a branch: what winds on would fill the picture


def solve(trajectories, outputs, system, point, time=None, panels=ON_CYLINDER, flow=None):
    """The Trajectory from `phi0`, `w0` of `point`, whose other parameters `system` names.

    `trajectories` gives {output: array} of a block, as a scene's `solve` does. With `flow`, six
    parameters or a program, the data hold equilibria, cycles and branches too.
    """
    time = 40.0 if time is None else float(time)
    own = point.get("phi0", 0.0), point.get("w0", 1.0)
    starts = np.array([own, *[(phi, w) for phi in AROUND for w in (-1.5, -0.5, 0.0, 0.5, 1.5)]])
    starts[1:, rc.START_W] *= max(1.0, abs(own[1]))
    t = np.linspace(0.0, time, POINTS)

    def followed(states, t):
        asked = {name: np.full((1, 1), point[name]) for name in system}
        return trajectories(
            asked | {"phi0": states[:, [rc.START_PHI]], "w0": states[:, [rc.START_W]], "t": t}
        )

    out = followed(starts, t[None])
    named = {
        o.name: {"long_name": o.long_name, "symbol": o.symbol, "units": o.units}
        for o in outputs
        if o.name in out
    }
    data = {"t": ("t", t, {"long_name": "time", "symbol": "t", "units": "1"})}
    for name in ("phi", "w"):
        data[name], data[f"{name}_error"] = (
            ("t", out[name][0], named[name]),
            ("t", out[f"{name}_error"][0], named[name] | {"long_name": f"error bound of {name}"}),
        )
        data[f"{name}_nearby"] = (("start", "t"), out[name][1:], named[name])
    return Trajectory(
        data if flow is None else data | _parting(flow, followed, 0.4 * time, named), panels
    )


def _parting(flow, followed, time, named):
    """Equilibria, cycles and branches: {variable: (dimensions, values, attributes)}."""
    s = outline(flow)
    data = {"equilibrium_phi": ("equilibrium", s.equilibria[:, eq.ANGLE], named["phi"]),
            "equilibrium_saddle": ("equilibrium", s.equilibria[:, eq.KIND] == eq.SADDLE, {}),
            "equilibrium_stable": ("equilibrium", s.equilibria[:, eq.STABLE] < 0.0, {})}  # fmt: skip
    if s.folded or s.unknown:
        return data
    s = remembered(taylor, flow)
    lines = [
        (states, times, kind)
        for states, times, kind in (*_branches(s, time), cycles(s))
        if len(states)
    ]
    if not lines:
        return data
    found = [followed(states, times) for states, times, _ in lines]
    phi, w = (np.concatenate([one[name] for one in found]) for name in ("phi", "w"))
    gone = np.abs(phi - phi[:, :1]) > FURTHEST
    kinds = np.concatenate([np.broadcast_to(kind, len(states)) for states, _, kind in lines])
    words = {"flag_values": list(range(len(LINES))), "flag_meanings": " ".join(LINES)}
    lost = np.logical_or.accumulate(gone, axis=1)
    return data | {
        "line_kind": ("line", kinds, words),
        "phi_line": (("line", "place"), np.where(lost, np.nan, phi), named["phi"]),
        "w_line": (("line", "place"), np.where(lost, np.nan, w), named["w"]),
    }


def _branches(s, time):
    """(states, times, kind) of the unstable and of the stable branches, each from a point next to
    its saddle.
    """
    for kind, flow, sign in ((0, s, 1.0), (1, backward(s), -1.0)):
        starts = np.zeros((2 * len(s.equilibria), rc.START))
        size = branches.of_saddles(flow.p, flow.equilibria, starts)
        states = starts[:size, [rc.START_PHI, rc.START_W]] * [1.0, sign]
        yield states, sign * np.linspace(0.0, time, ALONG)[None], kind


def cycles(s):
    """(states, times, kinds) of one turn of every cycle."""
    rows = [(s.section, row[rt.CYCLE_X], row) for row in s.plus]
    rows += [(s.section, -row[rt.CYCLE_X], row) for row in s.minus]
    rows += [(row[rt.CYCLE_X], 0.0, row) for row in s.librations]
    states = np.array([(phi, w) for phi, w, _ in rows]).reshape(-1, 2)
    times = np.array([row[rt.PERIOD] for *_, row in rows])[:, None] * np.linspace(0.0, 1.0, ALONG)
    return (
        states,
        times,
        np.array([2 + int(row[rt.MULTIPLIER] < 1.0) for *_, row in rows], dtype=int),
    )
