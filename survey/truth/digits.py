"""Hill equations that users define: z with mpmath's numbers, the flow by extrapolated leapfrog
steps of order 20.

z is the user's own Python, run with mpmath's functions (as for the package's double-double); all
else is done here.
"""

from itertools import pairwise

import numpy as np

from survey.errors import BadInput
from survey.measures.hill import multiprecision
from survey.request import ranges
from survey.request.hill_scene import HillScene
from survey.truth import remembered
from survey.truth.hill import FACTOR_COLUMNS, hill_outputs
from survey.truth.hill_flow import COLUMNS, DOUBT, END, STEPS

ORDER = 10
SMALL = 1e-26  # of a step, over the size of the flow
DIGITS = 1e-36  # of the arithmetic


def of_file(path):
    """(the Ranges, the truth) of a Hill equation in a file, or in a workflow; raises BadInput where
    none is known.
    """
    found = ranges.of(path)
    if not isinstance(found.scene, HillScene):
        raise BadInput(
            f"{path}: true values are known only of Hill equations y'' + z(u, p) y = 0; name a file with z"
        )
    try:
        return found, own(found.scene)
    except multiprecision.Unsupported as error:
        raise BadInput(
            f"{path}: z cannot be run with more digits ({error}), so no true values are known"
        ) from None


def own(scene):
    """The truth of a user's Hill equation, an object that `survey.hill` or a file makes.

    Raises `multiprecision.Unsupported` where z cannot be run with more digits.
    """
    z = multiprecision.lifted(scene.z)

    def solve(points, out):
        with multiprecision.LOCK:
            for i, p in enumerate(points):
                out[i] = _factors(scene, z, p)

    def truth(given, answer):
        p = np.column_stack([given[parameter.name] for parameter in scene.PARAMETERS])
        out = np.full((len(p), COLUMNS), np.nan)
        ok = answer["status"] == 0
        out[ok] = remembered(scene.HASH, solve, p[ok], COLUMNS)
        found = hill_outputs(out, answer, scene.EVEN)
        found.pop("unstable")
        return found

    return truth


def _factors(scene, z, p):
    """A row (COLUMNS) of `hill_flow`: at T/2 if z is even, else at T."""
    mp = multiprecision.context()
    exact = [mp.mpf(float(x)) for x in p]
    period = float(scene.period(p) if callable(scene.period) else scene.period)
    breaks = np.atleast_1d(scene.breaks(p) if callable(scene.breaks) else scene.breaks).astype(
        float
    )
    end = period / 2 if scene.EVEN else period
    ends = [0.0, *sorted({x for x in breaks.tolist() if 0.0 < x < end}), end]
    flow = mp.mpf(1), mp.mpf(0), mp.mpf(0), mp.mpf(1)
    doubt, steps, largest = 0.0, 0, 1.0
    for low, high in pairwise(ends):
        flow, error, more, size = _piece(lambda u: z(u, exact), mp, flow, mp.mpf(low), mp.mpf(high))
        doubt, steps, largest = doubt + error, steps + more, max(largest, size)
    row = np.zeros(COLUMNS)
    for column, value in zip(FACTOR_COLUMNS.values(), flow, strict=True):
        row[column] = float(value)
        row[column + 1] = float(value - float(value))
    row[END] = end
    row[DOUBT] = (doubt + DIGITS * steps) * largest * largest
    row[STEPS] = steps
    return row


def _piece(z, mp, flow, u, end):
    """The flow y1, y2, y1', y2' at the end of a smooth piece, the local errors' sum, steps, the
    largest entry.
    """
    h = end - u
    doubt, steps, largest = 0.0, 0, 1.0
    # a jump at an end of the piece belongs to the other side
    inside = (end - u) * mp.mpf(2) ** -110
    low, high = u + inside, end - inside
    while u < end:
        h = min(h, end - u)
        new, error = _step(lambda x: z(min(max(x, low), high)), mp, flow, u, h)
        size = float(max(abs(x) for x in new))
        if error > SMALL * size and h > (end - low) * mp.mpf(2) ** -40:
            h = h / 2
            continue
        flow, u, doubt, steps = new, u + h, doubt + 10.0 * error / max(size, 1.0), steps + 1
        largest = max(largest, size)
        if error < 1e-8 * SMALL * size:
            h = h * 3 / 2
    return flow, doubt, steps, largest


def _step(z, mp, flow, u, h):
    """Leapfrog with 1, 2, ..., ORDER + 2 steps, extrapolated in the square of the step (Gragg,
    Aitken, Neville).
    """
    seen, table = {}, []
    for n in range(1, ORDER + 3):
        at = []
        for j in range(n + 1):
            key = (j * 27720) // n if 27720 % n == 0 else (j, n)
            if key not in seen:
                seen[key] = z(u + h * j / n)
            at.append(seen[key])
        row = [_leapfrog(at, flow, h / n)]
        for k in range(1, n):
            ratio = mp.mpf(n * n) / ((n - k) * (n - k)) - 1
            row.append(
                tuple(
                    a + (a - b) / ratio for a, b in zip(row[k - 1], table[-1][k - 1], strict=True)
                )
            )
        table.append(row)
    error = max(abs(a - b) for a, b in zip(table[-1][-1], table[-1][-2], strict=True))
    return table[-1][-1], float(error)


def _leapfrog(z, flow, h):
    """n steps of length h with z at their n + 1 ends: a half kick, drifts and kicks, a half kick."""
    y1, y2, d1, d2 = flow
    half = h / 2
    d1, d2 = d1 - half * z[0] * y1, d2 - half * z[0] * y2
    for j in range(1, len(z)):
        y1, y2 = y1 + h * d1, y2 + h * d2
        kick = (h if j < len(z) - 1 else half) * z[j]
        d1, d2 = d1 - kick * y1, d2 - kick * y2
    return y1, y2, d1, d2
