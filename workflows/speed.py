"""Ratios of speed: the time of heyoka's batch integrator over that of survey, both interleaved in
one run on one core.

    python workflows/speed.py [PART ...]    prints `name ratio`, and to stderr times, errors and what is below its floor

Above 1 survey is faster. All is called as users call it, by `survey.evaluate`, `survey.edge` and
`survey.run`, labels and files included; "all" means every output of the scene, else the named ones. Both
sides meet |error| <= 1e-9 (1 + |value|), checked against heyoka at a tolerance of 1e-15. heyoka at its best:
batches of 16, fast_math, half periods by symmetry, elliptic and circular functions as states, points sorted
by effort; it gives the factors of Hill's equation alone.
Times are of the processor (`time.process_time`): medians of interleaved repetitions, at least REPEATS and for
at least SECONDS, as Python is slower in its first dozen calls and a row takes a millisecond. Ranges of parameters
move by a rounding from one to the next, so that no map is remembered. Needs heyoka; exit code 1 where a ratio is below
its floor or an error too large.

FLOORS are 0.7 of the ratios measured on one thread of an AMD EPYC (AVX-512), 2026-11-28 and 29; of rows, Danby's maps,
own equations and Brun's periods of those of an Intel Xeon (AVX-512), 2026-11-30 and 12-01.
"""

import os
import statistics
import sys
import tempfile
import time
from pathlib import Path

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

if hasattr(os, "sched_setaffinity"):  # one thread: two of one core take longer each
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})

import heyoka as hy  # noqa: E402
import numpy as np  # noqa: E402
import xarray as xr  # noqa: E402
from scipy.optimize.elementwise import find_root  # noqa: E402
from scipy.special import ellipkm1  # noqa: E402

import survey  # noqa: E402

FLOORS = {
    "hill_row": 5.1,
    "hill_row_all": 3.2,
    "hill_map_400x600": 35,
    "hill_map_400x600_all": 8.5,
    "hill_map_2000x2000": 105,
    "hill_scattered_30000": 4,
    "hill_scattered_30000_all": 1.8,
    "hill_scattered_300000": 7.7,
    "hill_scattered_300000_all": 1.8,
    "hill_amplitude_x_inertia_ratio": 10,
    "hill_amplitude_x_inertia_ratio_all": 4.2,
    "mathieu_scattered": 6,
    "own_hill_row": 3.5,
    "own_hill_map": 12.5,
    "own_hill_map_all": 4.7,
    "own_hill_scattered": 4.1,
    "own_square_wave": 0.45,
    "tongue_edges": 2.2,
    "tongue_edges_and_curves": 0.68,
    "gyrostat_trajectory": 1.5,
    "gyrostat_200_times": 1.15,
    "gyrostat_t_200": 2.2,
    "gyrostat_50_angles": 3.0,
    "gyrostat_50_angles_both_ways": 2.9,
    "danby_map": 30,
    "danby_map_1e-12": 28,
    "danby_scattered": 3.5,
    "brun_periods": 12.5,
}
REPEATS = 9
SECONDS = 0.5
WORST = 1e-9
LANES = 16
SAMPLE = 16_000  # points that heyoka solves of a map
PAR = [hy.par[i] for i in range(6)]
OWN = '''"""Mathieu's equation with a second harmonic."""
from math import cos, pi

PARAMETERS = ("a", "q", "r")
PERIOD = pi
EVEN = True


def z(u, p):
    return p[0] + p[1] * cos(2 * u) + p[2] * cos(4 * u)
'''
WAVE = '''"""Meissner's equation: a square wave."""
from math import cos, pi

PARAMETERS = ("a", "b")
PERIOD = 2 * pi
BREAKS = (pi / 2, 3 * pi / 2)
EVEN = True


def z(u, p):
    return p[0] + (p[1] if cos(u) > 0 else -p[1])
'''


class Batch:
    """heyoka's batch integrator over many points: `run(states, parameters, spans, order)`, states
    at the ends.
    """

    def __init__(self, equations, parameters, tolerance):
        n = len(equations)
        self.ta = hy.taylor_adaptive_batch(
            equations,
            np.zeros((n, LANES)),
            pars=np.zeros((parameters, LANES)),
            tol=tolerance,
            fast_math=True,
        )
        self.state, self.pars = self.ta.state, self.ta.pars

    def run(self, states, parameters, spans, order):
        pad = np.concatenate([order, np.repeat(order[-1:], -order.size % LANES)])
        states, parameters, spans = states[:, pad], parameters[:, pad], spans[pad]
        ends = np.empty_like(states)
        for i in range(0, pad.size, LANES):
            self.state[:], self.pars[:] = states[:, i : i + LANES], parameters[:, i : i + LANES]
            self.ta.set_time(0.0)
            self.ta.propagate_until(spans[i : i + LANES])
            ends[:, i : i + LANES] = self.state
        out = np.empty((len(states), order.size))
        out[:, order] = ends[:, : order.size]
        return out


class Harness:
    """Measured ratios, printed as they come; `failed` where one is below its floor or an error is
    too large.
    """

    def __init__(self):
        self.failed = False

    def compare(self, name, ours, points, theirs, their_points, check=None, worst=WORST):
        """Print the ratio of the medians of CPU time per point; `check()` gives the larger error of
        both sides, `worst` how large it may be.
        """
        ours(0), theirs()
        times = [], []
        while len(times[0]) < REPEATS or sum(map(sum, times)) < SECONDS:
            for kept, call in zip(times, (lambda: ours(1 + len(times[0])), theirs), strict=True):
                begin = time.process_time()
                call()
                kept.append(time.process_time() - begin)
        mine, other = (
            statistics.median(kept) / n
            for kept, n in zip(times, (points, their_points), strict=True)
        )
        ratio, error = other / mine, check() if check else 0.0
        low = ratio < FLOORS.get(name, 0.0)
        print(f"{name} {ratio:.3g}", flush=True)
        words = f"    {mine * 1e6:.4g} us against {other * 1e6:.4g} us a point, error {error:.1e}"
        print(
            words + (f"; BELOW ITS FLOOR {FLOORS[name]:.3g}" if low else ""),
            file=sys.stderr,
            flush=True,
        )
        self.failed |= low or not error <= worst


def relative(values, exact):
    return float(np.nanmax(abs(values - exact) / (1 + abs(exact))))


def moved(axis, i):
    """The axis, a rounding longer each time."""
    return axis * (1 + 2.0**-50 * i) if axis.size > 1 else axis


def some_of(size):
    return np.random.default_rng(3).permutation(size)[:SAMPLE]


def evaluated(scene, i, given, **options):
    return survey.evaluate(
        scene, **{name: moved(axis, i) for name, axis in given.items()}, **options
    )


DECIDED = ("discriminant", "verdict")


# ------------------------------------------------------------------------------------------------
# Hill, satellite
def satellite_equations():
    w, wp, y, v, z, u = hy.make_vars("w", "wp", "y", "v", "z", "u")
    square = w * w
    q = square + (PAR[1] * w + PAR[2])
    return [(w, wp), (wp, w * (PAR[0] - square)), (y, v), (v, -q * y), (z, u), (u, -q * z)]


def satellite_by(batch, k, rho, oblate=False):
    """The discriminant, and the factors y1, y1', y2, y2', from half a period."""
    zero, one, short = np.zeros(k.size), np.ones(k.size), (1 - k) * (1 + k)
    span = 2 * ellipkm1(short)
    states = np.stack([np.sqrt(2) * k, zero, one, zero, zero, one])
    parameters = np.stack(
        [2 * k * k - 1, np.sqrt(2) * rho, rho * rho + (-k * k if oblate else short)]
    )
    e = batch.run(states, parameters, span, np.argsort(span * (abs(rho) + k + 1)))
    return 2 * (e[2] * e[5] + e[3] * e[4]), e[2:]


def hill(harness):
    """Maps, a row and scattered points of the satellite; the discriminant and the verdict, or all outputs."""
    fast, exact = (Batch(satellite_equations(), 3, tol) for tol in (1e-9, 1e-15))
    rng = np.random.default_rng(1)

    def case(name, given, points, sample, **options):
        """`given` for survey; the sampled k, rho of it for heyoka."""
        k, rho = sample

        def theirs():
            return satellite_by(fast, k, rho)

        def against(what, variables):
            def ours(i):
                return evaluated("satellite", i, given, variables=variables, **options)

            def check():
                right, mine = (
                    satellite_by(exact, k, rho)[0],
                    ours(0).discriminant.values.ravel()[some_of(points)],
                )
                return max(relative(mine, right), relative(theirs()[0], right))

            harness.compare(name + what, ours, points, theirs, k.size, check)

        against("", DECIDED)
        if points < 1e6:
            against("_all", None)

    def grid(first, second):
        some = some_of(first.size * second.size)
        return tuple(v.ravel()[some] for v in np.meshgrid(first, second, indexing="ij"))

    row = np.linspace(0.6, 4, 10_000)
    half = np.array([0.5])
    case("hill_row", {"rho": row}, row.size, grid(half, row), k=0.5)
    for sizes in ((400, 600), (2000, 2000)):
        k, rho = np.linspace(0, 0.99, sizes[0]), np.linspace(0.6, 4, sizes[1])
        case("hill_map_{}x{}".format(*sizes), {"k": k, "rho": rho}, k.size * rho.size, grid(k, rho))
    for n in (30_000, 300_000):
        k, rho = rng.uniform(0.01, 0.99, n), rng.uniform(0.6, 4, n)
        scattered = {name: xr.DataArray(v, dims="point") for name, v in (("k", k), ("rho", rho))}
        case(f"hill_scattered_{n}", scattered, n, (k[some_of(n)], rho[some_of(n)]))
    amplitude, alpha = np.linspace(0.0, 1.5, 200), np.linspace(0.02, 0.97, 300)
    b, a = grid(amplitude, alpha)
    given = {"amplitude": amplitude, "inertia_ratio": alpha}
    case("hill_amplitude_x_inertia_ratio", given, 60_000, (np.sin(b), 1 / np.sqrt(3 * (1 - a))))


def mathieu(harness):
    """Scattered points of Mathieu's equation."""
    c, s, y, v, z, u = hy.make_vars("c", "s", "y", "v", "z", "u")
    q = PAR[0] + PAR[1] * c
    equations = [(c, -2.0 * s), (s, 2.0 * c), (y, v), (v, -q * y), (z, u), (u, -q * z)]
    fast, exact = (Batch(equations, 2, tol) for tol in (1e-9, 1e-15))
    n, rng = 30_000, np.random.default_rng(1)
    a, b = rng.uniform(0, 25, n), rng.uniform(0.1, 8, n)
    scattered = {name: xr.DataArray(v, dims="point") for name, v in (("a", a), ("q", b))}
    some = some_of(n)

    def theirs(batch=fast):
        one, zero = np.ones(some.size), np.zeros(some.size)
        parameters = np.stack([a[some], -2 * b[some]])
        e = batch.run(
            np.stack([one, zero, one, zero, zero, one]),
            parameters,
            0.5 * np.pi * one,
            np.argsort(a[some]),
        )
        return 2 * (e[2] * e[5] + e[3] * e[4])

    def ours(i):
        return evaluated("mathieu", i, scattered, variables=DECIDED)

    def check():
        right = theirs(exact)
        return max(relative(ours(0).discriminant.values[some], right), relative(theirs(), right))

    harness.compare("mathieu_scattered", ours, n, theirs, some.size, check)


# ---------------------------------------------------------------------------------------------- a
# user's equation
def own(harness):
    """A row, a map and scattered points of one's own equation with two harmonics."""
    path = Path(harness.folder) / "two_harmonics.py"
    path.write_text(OWN, encoding="utf-8")
    c, s, y, v, z, u = hy.make_vars("c", "s", "y", "v", "z", "u")
    q = (PAR[0] - PAR[2]) + PAR[1] * c + 2.0 * PAR[2] * (c * c)
    equations = [(c, -2.0 * s), (s, 2.0 * c), (y, v), (v, -q * y), (z, u), (u, -q * z)]
    fast, exact = (Batch(equations, 3, tol) for tol in (1e-9, 1e-15))
    rng = np.random.default_rng(2)

    def case(name, given, points, a, b, variables=DECIDED, **options):
        def theirs(batch=fast):
            one, zero = np.ones(a.size), np.zeros(a.size)
            parameters = np.stack([a, b, 1.3 * one])
            e = batch.run(
                np.stack([one, zero, one, zero, zero, one]),
                parameters,
                0.5 * np.pi * one,
                np.argsort(a),
            )
            return 2 * (e[2] * e[5] + e[3] * e[4])

        def ours(i):
            return evaluated(path, i, given, r=1.3, variables=variables, **options)

        def check():
            right, mine = theirs(exact), ours(0).discriminant.values.ravel()[some_of(points)]
            return max(relative(mine, right), relative(theirs(), right))

        harness.compare(name, ours, points, theirs, a.size, check)

    a, b = np.linspace(0, 25, 300), np.linspace(0, 15, 200)
    bs, as_ = (v.ravel()[some_of(60_000)] for v in np.meshgrid(b, a, indexing="ij"))
    row = np.linspace(0, 25, 10_000)
    case(
        "own_hill_row", {"a": row}, row.size, row[some_of(row.size)], np.full(row.size, 3.0), q=3.0
    )
    case("own_hill_map", {"q": b, "a": a}, 60_000, as_, bs)
    case("own_hill_map_all", {"q": b, "a": a}, 60_000, as_, bs, variables=None)
    n = 30_000
    ar, br = rng.uniform(0, 25, n), rng.uniform(0, 15, n)
    scattered = {name: xr.DataArray(v, dims="point") for name, v in (("a", ar), ("q", br))}
    case("own_hill_scattered", scattered, n, ar[some_of(n)], br[some_of(n)])


def wave(harness):
    """Meissner's equation as one's own, against its closed form in NumPy."""
    path = Path(harness.folder) / "square_wave.py"
    path.write_text(WAVE, encoding="utf-8")
    a, b = np.linspace(0.05, 8, 300), np.linspace(0, 4, 200)
    bs, as_ = (v.ravel() for v in np.meshgrid(b, a, indexing="ij"))

    def theirs():
        """M of half a period, from y = 1, y' = 0 and from y = 0, y' = 1: two lengths pi / 2."""
        first, second = (np.emath.sqrt(as_ + sign * bs) for sign in (1, -1))
        with np.errstate(all="ignore"):
            (c1, s1), (c2, s2) = (
                (np.cos(w * np.pi / 2), np.sin(w * np.pi / 2)) for w in (first, second)
            )
            y1, dy2 = c2 * c1 - s2 / second * first * s1, c2 * c1 - second * s2 * s1 / first
        return (2 * (2 * y1 * dy2 - 1)).real

    def ours(i):
        return evaluated(path, i, {"b": b, "a": a}, variables=DECIDED)

    def check():
        mine, right = ours(0).discriminant.transpose("b", "a").values.ravel(), theirs()
        known = np.isfinite(right)
        return relative(mine[known], right[known])

    harness.compare("own_square_wave", ours, as_.size, theirs, as_.size, check)


# --------------------------------------------------------------------------------------------------
# tongues' edges
def edges(harness):
    """Edges of tongues in 500 rows, against heyoka and SciPy's vectorised root finder; then with the
    curves through them and the file, of which these make none.
    """
    rows, batch = 500, Batch(satellite_equations(), 3, 1e-12)
    k, rho = np.linspace(0, 0.98, rows), np.linspace(0.57735, 3.2, 300)

    def factors(k, rho):
        return satellite_by(batch, k, rho, oblate=True)[1]

    def theirs():
        signs = np.sign(
            factors(*(v.ravel() for v in np.meshgrid(k, rho, indexing="ij"))).reshape(4, rows, -1)
        )
        kind, row, at = np.nonzero(signs[:, :, 1:] != signs[:, :, :-1])

        def f(x, kind, k):
            kind, k = (np.ravel(np.broadcast_to(v, x.shape)) for v in (kind, k))
            return factors(k, np.ravel(x))[kind.astype(int), np.arange(x.size)].reshape(x.shape)

        tolerances = {"xatol": 1e-12, "xrtol": 1e-12}
        return np.sort(
            find_root(f, (rho[at], rho[at + 1]), args=(kind, k[row]), tolerances=tolerances).x
        )

    def ours(i):
        ends = (0.57735, 3.2)
        return survey.edge("satellite", along="rho", body="oblate", k=moved(k, i), rho=ends)

    def with_curves(i):
        path = Path(harness.folder) / f"edges_{i}.nc"
        path.unlink(missing_ok=True)
        axes = {
            "k": {"values": list(moved(k, i))},
            "rho": {"start": 0.57735, "stop": 3.2, "num": 2},
        }
        return survey.run({
            "scene": "satellite", "options": {"body": "oblate"}, "boundaries": {"axis": "rho"}, "axes": axes,
            "output": {"path": str(path), "variables": ["verdict"]},
        })  # fmt: skip

    a, b = np.sort(ours(0).edge.values), theirs()
    print(f"    edges: {a.size} against {b.size}", file=sys.stderr)
    # narrow tongues are seen by us alone
    error = float(abs(a - b).max()) if a.size == b.size else 0.0
    harness.compare("tongue_edges", ours, a.size, theirs, b.size, lambda: error)
    harness.compare("tongue_edges_and_curves", with_curves, a.size, theirs, b.size, lambda: error)


# -------------------------------------------------------------------------------------------------------
# gyrostat
NAMES = ("b12", "b31", "d", "c23", "s2", "s3")


def abel(harness):
    """(phi, w) of a gyrostat at t = 20 and 200, and at 200 times up to 20; w at 50 angles."""
    n, rng = 8192, np.random.default_rng(1)
    p = rng.uniform(-0.5, 0.5, (6, n))
    start = np.stack([rng.uniform(0, 2 * np.pi, n), rng.uniform(0.5, 3, n)])
    phi, w = hy.make_vars("phi", "w")
    s, c = hy.sin(phi), hy.cos(phi)  # in axes turned so that c23 = 0: the cheapest for heyoka
    equations = [
        (phi, w),
        (w, (PAR[0] * c - PAR[1] * s) * w - PAR[2] * (c * s) + PAR[3] * c - PAR[4] * s),
    ]
    turn = -0.5 * np.arctan2(2 * p[3], p[2])
    ca, sa = np.cos(turn), np.sin(turn)
    turned = np.stack([p[0] * ca - p[1] * sa, p[0] * sa + p[1] * ca, np.hypot(p[2], 2 * p[3]),
                       p[4] * ca - p[5] * sa, p[4] * sa + p[5] * ca])  # fmt: skip
    states = np.stack([start[0] - turn, start[1]])
    order = np.argsort(abs(turned).sum(0) + abs(start[1]))
    fast, exact = Batch(equations, 5, 3e-13), Batch(equations, 5, 1e-17)
    given = {
        name: xr.DataArray(values, dims="p")
        for name, values in zip((*NAMES, "phi0", "w0"), (*p, *start), strict=True)
    }

    def theirs(batch=fast):
        ends = batch.run(states, turned, np.full(n, 20.0), order)
        return np.stack([ends[0] + turn, ends[1]])

    def ours(t=20.0, given=given, rtol=1e-7):
        return survey.evaluate(
            "gyrostat", question="trajectory", t=t, rtol=rtol, variables=["phi", "w"], **given
        )

    def check():
        right, ds = theirs(exact), ours()
        return max(
            relative(np.stack([ds.phi.values, ds.w.values]), right), relative(theirs(), right)
        )

    harness.compare("gyrostat_trajectory", lambda i: ours(), n, theirs, n, check)
    slow, part = order[:: n // 2048], 5e-7
    some = {name: values[slow] for name, values in given.items()}
    finer = Batch(equations, 5, 1e-14)

    def later(batch=finer):
        ends = batch.run(
            states[:, slow], turned[:, slow], np.full(slow.size, 200.0), np.arange(slow.size)
        )
        return np.stack([ends[0] + turn[slow], ends[1]])

    def check_later():
        right, ds = later(exact), ours(200.0, some, part)
        return max(
            relative(np.stack([ds.phi.values, ds.w.values]), right), relative(later(), right)
        )

    harness.compare(
        "gyrostat_t_200",
        lambda i: ours(200.0, some, part),
        slow.size,
        later,
        slow.size,
        check_later,
    )
    over_angles(harness, p, turned, turn)
    times, few = np.linspace(0, 20, 201), 1024
    grid = np.repeat(times[:, None], LANES, 1)
    chosen = order[:: n // few][:few]
    part = {name: values[chosen] for name, values in given.items()}

    def dense():
        out = np.empty((times.size, 2, few))
        for i in range(0, few, LANES):
            own_ = chosen[i : i + LANES]
            fast.state[:], fast.pars[:] = states[:, own_], turned[:, own_]
            fast.ta.set_time(0.0)
            reached = fast.ta.propagate_grid(grid)
            out[:, :, i : i + LANES] = reached[1] if isinstance(reached, tuple) else reached
        return out[1:, 0] + turn[chosen]

    def difference():
        return relative(ours(times[1:], part).phi.transpose("t", "p").values, dense())

    harness.compare(
        "gyrostat_200_times",
        lambda i: ours(times[1:], part),
        200 * few,
        dense,
        200 * few,
        difference,
    )


def over_angles(harness, p, turned, turn):
    """w at 50 angles over one turn, from phi = 0 and from starts all round the circle, both ways."""
    n, rng = 4096, np.random.default_rng(2)
    p, turned, turn, w0 = p[:, :n], turned[:, :n], turn[:n], rng.uniform(3.0, 6.0, n)
    angles = np.linspace(0, 2 * np.pi, 51)[1:]
    w, s, c = hy.make_vars("w", "s", "c")
    push = -PAR[2] * (c * s) + PAR[3] * c - PAR[4] * s
    equations = [(w, (PAR[0] * c - PAR[1] * s) + push / w), (s, c), (c, -s)]
    fast, exact = Batch(equations, 5, 1e-11), Batch(equations, 5, 1e-17)
    order = np.argsort(w0)

    def follow(batch, start, way, out):
        """w at the angles ahead of each start, or behind it, in `out` (50, n)."""
        ahead = way * (angles[:, None] - start) > 0
        still = 1e-9 * np.arange(1.0, angles.size + 1)[:, None]  # grids must ascend
        grids = np.sort(np.where(ahead, way * (angles[:, None] - start), still), axis=0)
        grids = way * np.concatenate([np.zeros((1, n)), grids])
        for i in range(0, n, LANES):
            k = order[i : i + LANES]
            at = start[k] - turn[k]
            batch.state[:], batch.pars[:] = np.stack([w0[k], np.sin(at), np.cos(at)]), turned[:, k]
            batch.ta.set_time(0.0)
            found = batch.ta.propagate_grid(grids[:, k])
            found = (found[1] if isinstance(found, tuple) else found)[:, 0]
            found = found[1:] if way > 0 else found[:0:-1]
            out[:, k] = np.where(ahead[:, k], found, out[:, k])

    for name, start in (
        ("gyrostat_50_angles", np.zeros(n)),
        ("gyrostat_50_angles_both_ways", rng.uniform(0, 2 * np.pi, n)),
    ):
        given = {
            key: xr.DataArray(values, dims="p")
            for key, values in zip((*NAMES, "phi0", "w0"), (*p, start, w0), strict=True)
        }

        def theirs(batch=fast, start=start):
            out = np.full((angles.size, n), np.nan)
            for way in (1.0, -1.0) if start.any() else (1.0,):
                follow(batch, start, way, out)
            return out

        def ours(i, given=given):
            return survey.evaluate(
                "gyrostat", question="abel", phi=angles, rtol=1e-7, variables=["w"], **given
            )

        def check(theirs=theirs, ours=ours):
            right, mine = theirs(exact), ours(0).w.transpose("phi", "p").values
            return max(relative(mine, right), relative(theirs(), right))

        harness.compare(name, ours, n * angles.size, theirs, n * angles.size, check)


# ----------------------------------------------------------------------------------------------------------
# Danby
def danby(harness):
    """A map of the elliptic restricted problem's triangular points, at 1e-10 and 1e-12, and scattered points."""
    mu, e = np.linspace(1e-4, 0.05, 600), np.linspace(1e-3, 0.7, 400)
    es, ms = (v.ravel() for v in np.meshgrid(e, mu, indexing="ij"))
    some = np.random.default_rng(0).permutation(es.size)[:SAMPLE]
    es, ms = es[some], ms[some]
    c, s, *y = hy.make_vars("c", "s", *(f"y{i}" for i in range(16)))
    r = 1.0 / (1.0 + PAR[0] * c)
    equations = [(c, -s), (s, c)]
    for x, q, p, m in (y[i : i + 4] for i in range(0, 16, 4)):
        equations += [
            (x, p - m),
            (q, m - p - PAR[2] * (r * m)),
            (p, PAR[1] * (r * x) - (x - q)),
            (m, x - q),
        ]
    fast, exact = (Batch(equations, 3, tol) for tol in (5e-10, 1e-16))
    root = np.sqrt(1 - 3 * ms * (1 - ms))
    parameters = np.stack([es, 1.5 * (1 + root), 1.5 * (3 * ms * (1 - ms)) / (1 + root)])
    states = np.repeat(np.concatenate([[1.0, 0.0], np.eye(4).ravel()])[:, None], es.size, 1)

    def theirs(batch=fast):
        ends = batch.run(states, parameters, np.full(es.size, np.pi), np.argsort(es))
        columns = np.moveaxis(ends[2:].reshape(4, 4, -1), 2, 0)
        first, last = columns[:, :2, :2], columns[:, 2:, 2:]
        t = (first * last).sum(axis=(1, 2))
        return 6 - 8 * t + 16 * np.linalg.det(first) * np.linalg.det(last)

    def ours(i, rtol=1e-10):
        given = {"mu": mu, "e": e}
        return evaluated("libration_elliptic", i, given, variables=["b", "verdict"], rtol=rtol)

    def check(batch=fast, rtol=1e-10):
        right, mine = theirs(exact), ours(0, rtol).b.transpose("e", "mu").values.ravel()[some]
        return max(relative(mine, right), relative(theirs(batch), right))

    harness.compare("danby_map", ours, mu.size * e.size, theirs, es.size, check)
    batch = Batch(equations, 3, 1e-13)
    harness.compare(
        "danby_map_1e-12",
        lambda i: ours(i, 1e-12),
        mu.size * e.size,
        lambda: theirs(batch),
        es.size,
        lambda: check(batch, 1e-12),
        1e-11,
    )
    points = {name: xr.DataArray(values, dims="p") for name, values in (("mu", ms), ("e", es))}

    def scattered(i=0):
        return survey.evaluate("libration_elliptic", variables=["b", "verdict"], **points)

    def check_scattered():
        right = theirs(exact)
        return max(relative(scattered().b.values, right), relative(theirs(), right))

    harness.compare("danby_scattered", scattered, es.size, theirs, es.size, check_scattered)


# -----------------------------------------------------------------------------------------------------------
# Brun
def brun(harness):
    """Period, precession and spin of Brun's problem; heyoka is given the period."""
    n, rng = 60_000, np.random.default_rng(1)
    size = 10.0 ** rng.uniform(-0.5, 0.5, n)
    body = {"A": size, "C": size * rng.uniform(0.05, 1.99, n)}
    body |= {"epsilon": rng.choice([-1.0, 1.0], n) * 10.0 ** rng.uniform(-2, 1, n)}
    body |= {"theta0": rng.uniform(0.3, 2.84, n)} | {
        name: rng.normal(size=n) for name in ("p_theta0", "p_psi", "p_phi")
    }
    given = {name: xr.DataArray(values, dims="p") for name, values in body.items()}

    def ours(i, variables=("period", "precession", "spin", "verdict")):
        return survey.evaluate("brun", variables=variables, **given)

    answer = {
        name: v.values for name, v in ours(0, ("period", "precession", "u_min", "u_max")).items()
    }
    u, v, psi, phi = hy.make_vars("u", "v", "psi", "phi")
    up, down = PAR[3] / (1.0 - u), PAR[4] / (1.0 + u)
    equations = [
        (u, v),
        (v, PAR[2] + u * (PAR[1] - PAR[0] * u * u)),
        (psi, up + down),
        (phi, down - up),
    ]
    a, b, p = (body[name] / body["A"] for name in ("p_phi", "p_psi", "p_theta0"))
    cosine, sine, k = (
        np.cos(body["theta0"]),
        np.sin(body["theta0"]),
        body["epsilon"] * (1 - body["C"] / body["A"]),
    )
    level = p * p + ((b - a * cosine) / sine) ** 2 - k * cosine**2 + a * a
    # heyoka loses its digits near the poles: it is given the states that stay off them
    off = np.isfinite(answer["period"]) & (answer["u_max"] < 0.97) & (answer["u_min"] > -0.97)
    off = np.flatnonzero(off)[:12_000]
    states = np.stack([cosine, -sine * p, 0 * a, 0 * a])[:, off]
    parameters = np.stack([2 * k, k - level, a * b, 0.5 * (b - a), 0.5 * (b + a)])[:, off]
    span = answer["period"][off]
    order = np.argsort(span * np.sqrt(abs(k) + abs(level))[off])
    fast = Batch(equations, 5, 1e-11)

    def theirs():
        return fast.run(states, parameters, span, order)

    def check():
        error = abs(theirs()[2] - answer["precession"][off]) / (1 + abs(answer["precession"][off]))
        return float(np.quantile(error, 0.99))

    harness.compare("brun_periods", ours, n, theirs, off.size, check)


PARTS = {part.__name__: part for part in (hill, mathieu, own, wave, edges, abel, danby, brun)}


def main():
    names = sys.argv[1:] or list(PARTS)
    if not set(names) <= set(PARTS):
        sys.exit(f"speed.py [{' | '.join(PARTS)}] ...")
    harness = Harness()
    with tempfile.TemporaryDirectory() as harness.folder:
        for name in names:
            PARTS[name](harness)
    sys.exit(harness.failed)


if __name__ == "__main__":
    main()
