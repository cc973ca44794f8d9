"""Linear periodic systems that users define: A, or M, C and K, with mpmath's numbers; the flow by
extrapolated midpoint steps, the multipliers from its eigenvalues.

A is the user's own Python, run with mpmath's functions (as for the package's double-double); all
else is done here.

Source: W. B. Gragg, SIAM J. Numer. Anal. 2 (1965) 384: the error of the smoothed midpoint rule goes
with even powers of the step.
"""

from itertools import pairwise

import numpy as np

from survey.errors import BadInput
from survey.measures.hill import multiprecision
from survey.request import ranges
from survey.truth import remembered

ROWS = 11  # of the table of extrapolation: an error of order 2 ROWS + 1 in the step
SMALL = 1e-24  # of a step, over the size of the flow
LEAST = 2.0**-40  # of a piece: the shortest step
COLUMNS = 3  # the spectral radius, as a sum of two numbers, and a bound of what it may be off


def of_file(path):
    """(the Ranges, the truth) of a linear system in a file, or in a workflow; raises BadInput where
    A cannot be run with more digits.
    """
    found = ranges.of(path)
    truth = own(found.scene)
    try:
        truth({key: np.array([x]) for key, x in _inside(found).items()}, {"status": np.zeros(1)})
    except multiprecision.Unsupported as error:
        raise BadInput(
            f"{path}: its matrices cannot be run with more digits ({error}), so no true values are known"
        ) from None
    return found, truth


def _inside(found):
    """A point of the Ranges."""
    return {name: found.values(name, 3)[1] for name in found.axes} | dict(found.fixed)


def own(scene):
    """The truth of a user's linear system, an object that `survey.floquet` or a file makes.

    Raises `multiprecision.Unsupported` where A cannot be run with more digits.
    """
    mp = multiprecision.context()
    functions = {name: multiprecision.lift(of, mp) for name, of in scene.matrices.items()}

    def solve(points, out):
        with multiprecision.LOCK:
            for i, p in enumerate(points):
                out[i] = _radius(scene, functions, mp, p)

    def truth(given, answer):
        p = np.column_stack([given[parameter.name] for parameter in scene.PARAMETERS])
        out = np.full((len(p), COLUMNS), np.nan)
        ok = answer["status"] == 0
        out[ok] = remembered(scene.HASH, solve, p[ok], COLUMNS)
        return {"spectral_radius": tuple(out.T)}

    return truth


def _radius(scene, functions, mp, p):
    """The largest modulus of a multiplier that is judged, and its doubt, at a point."""
    numbers = [mp.mpf(float(x)) for x in p]
    period = float(scene.period(p) if callable(scene.period) else scene.period)
    breaks = np.ravel(scene.breaks(p) if callable(scene.breaks) else scene.breaks).astype(float)
    ends = [0.0, *sorted({x for x in breaks.tolist() if 0.0 < x < period}), period]
    n = len(scene.states)
    flow = [[mp.mpf(i == j) for j in range(n)] for i in range(n)]
    doubt = 0.0
    for low, high in pairwise(ends):
        flow, more = _piece(
            lambda t: _matrix(scene, functions, mp, t, numbers), mp, flow, mp.mpf(low), mp.mpf(high)
        )
        doubt += more
    values = sorted(mp.eig(mp.matrix(flow), left=False, right=False), key=lambda x: -abs(x))
    if scene.conserved is not None:
        values.remove(min(values, key=lambda x: abs(x - 1)))
    radius, size = abs(values[0]), max(abs(x) for row in flow for x in row)
    high, off = float(radius), float(doubt * size)
    # a multiplier of n that meet moves by the n-th root of what the matrix is off; else Bauer and Fike
    vectors = np.linalg.eig(np.array(flow, dtype=float))[1]
    return high, float(radius - high), min(off ** (1.0 / n), n * off * np.linalg.cond(vectors))


def _matrix(scene, functions, mp, t, p):
    """A at t, as rows; that of (q, q') where M, C and K are given, which has the same multipliers."""
    n = len(scene.states)
    if "A" in functions:
        return _filled(functions["A"], mp, t, p, n)
    m = n // 2
    given = {name: _filled(of, mp, t, p, m) for name, of in functions.items()}
    sides = mp.matrix(m, n)
    for i in range(m):
        for j in range(m):
            sides[i, j] = -given["K"][i][j] if "K" in given else 0
            sides[i, m + j] = -given["C"][i][j] if "C" in given else 0
    if "M" in given:
        sides = mp.inverse(mp.matrix(given["M"])) * sides
    upper = [[mp.mpf(j == m + i) for j in range(n)] for i in range(m)]
    return upper + [[sides[i, j] for j in range(n)] for i in range(m)]


def _filled(function, mp, t, p, size):
    """The matrix that a user's function fills, or returns, as rows."""
    out = np.zeros((size, size), dtype=object)
    try:
        value = function(t, p, out)
    except multiprecision.Unsupported:
        raise
    except Exception as error:
        raise multiprecision.Unsupported(f"{type(error).__name__}: {error}") from None
    out = out if value is None else np.array(value, dtype=object)
    return [[mp.mpf(x) for x in row] for row in out.tolist()]


def _piece(A, mp, flow, t, end):
    """The flow at the end of a smooth piece, and the sum of the local errors, relative to it."""
    length = h = end - t
    doubt = 0.0
    # a jump at an end of the piece belongs to the other side
    inside = length * mp.mpf(2) ** -110
    low, high = t + inside, end - inside
    while t < end:
        h = min(h, end - t)
        new, error = _step(lambda x: A(min(max(x, low), high)), mp, flow, t, h)
        size = float(max(abs(x) for row in new for x in row))
        if error > SMALL * size and h > LEAST * length:
            h = h * max(0.2, 0.8 * (SMALL * size / error) ** (1.0 / (2 * ROWS)))
            continue
        flow, t, doubt = new, t + h, doubt + 10.0 * error / size
        if error < 1e-4 * SMALL * size:
            h = h * 4 / 3
    return flow, doubt


def _step(A, mp, flow, t, h):
    """Smoothed midpoint rules with 2, 4, ..., 2 ROWS steps, extrapolated in the square of the step."""
    seen, table = {}, []
    for k in range(1, ROWS + 1):
        n = 2 * k
        for j in range(n + 1):
            if (j / n) not in seen:
                seen[j / n] = A(t + h * j / n)
        row = [_midpoint([seen[j / n] for j in range(n + 1)], mp, flow, h / n)]
        for i in range(1, k):
            ratio = mp.mpf(k * k) / ((k - i) * (k - i)) - 1
            row.append(
                [
                    [a + (a - b) / ratio for a, b in zip(*both, strict=True)]
                    for both in zip(row[i - 1], table[-1][i - 1], strict=True)
                ]
            )
        table.append(row)
    pairs = zip(table[-1][-1], table[-1][-2], strict=True)
    return table[-1][-1], float(
        max(abs(a - b) for both in pairs for a, b in zip(*both, strict=True))
    )


def _midpoint(A, mp, flow, h):
    """Steps of the midpoint rule with A at their ends, and half a step of smoothing."""
    before, now = flow, _sum(flow, h, _product(mp, A[0], flow))
    for matrix in A[1:-1]:
        before, now = now, _sum(before, 2 * h, _product(mp, matrix, now))
    after = _sum(before, h, _product(mp, A[-1], now))
    return [
        [(a + b) / 2 for a, b in zip(*both, strict=True)] for both in zip(now, after, strict=True)
    ]


def _product(mp, A, B):
    columns = list(zip(*B, strict=True))
    return [[mp.fdot(row, column) for column in columns] for row in A]


def _sum(A, h, B):
    return [[a + h * b for a, b in zip(*both, strict=True)] for both in zip(A, B, strict=True)]
