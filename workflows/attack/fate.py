"""Fates and portraits of the gyrostat: long motions, return maps, exact symmetries."""

from fractions import Fraction

import numpy as np
import xarray as xr

import survey
from attack.compare import Batch
from attack.gyrostat import _separatrix, force, potential, system
from survey.truth import gyrostat_flow as gf
from survey.truth.gyrostat import SYSTEM
from survey.truth.hill import LONG, ULP

SPAN = 150.0
MIRROR = {2: 3, 3: 2, 5: 6, 6: 5}


def chunk(random, size):
    used = 0
    while used < size:
        portrait = random.random() < 0.4
        method = str(random.choice(["auto", "auto", "auto", "taylor", "dop853"]))
        rtol = float(10.0 ** -random.uniform(6, 11))
        number = 4 if method == "dop853" else 12
        kind, p = system(random, number)
        p.pop("k", None)
        if random.random() < 0.2:
            kind, p = "degenerate", _degenerate(random, number)
        if portrait:
            yield Batch(
                "gyrostat portrait",
                kind,
                p,
                _portrait,
                "gyrostat",
                {"question": "portrait"},
                method,
                rtol,
            )
        else:
            # one system, many starts
            p = {name: np.full(number, values[0]) for name, values in p.items()}
            phi, w = random.uniform(-7, 7, number), random.normal(size=number) * 2
            for i in range(0, number, 3):
                found = _separatrix({name: values[i] for name, values in p.items()}, random)
                if found is not None:
                    phi[i], w[i] = found
            w[1], phi[-1] = 0.0, 0.0
            given = p | {"phi0": phi, "w0": w}
            yield Batch(
                "gyrostat fate", kind, given, _fate, "gyrostat", {"question": "fate"}, method, rtol
            )
        used += number


def _degenerate(random, number):
    """Systems with an exact double equilibrium at phi = 0, a Hopf point there, or next to one."""
    p = {name: random.integers(-3, 4, number) * 0.5 for name in SYSTEM}
    p["c23"] = p["s2"].copy()  # g(0) = 0
    if random.random() < 0.5:
        p["s3"] = -p["d"]  # g'(0) = -d - s3 = 0
    else:
        p["b12"] = np.zeros(number)  # f(0) = 0
    if random.random() < 0.5:
        p["s3"] = p["s3"] + random.choice([-1, 0, 1], number) * 10 ** -random.uniform(1, 16, number)
    return p


def _section(p):
    """The saddle of highest V in [0, 2 pi), or 0."""
    x = np.linspace(0, 2 * np.pi, 1441)
    g = force(p, x)
    best, at = -np.inf, 0.0
    for i in np.flatnonzero((g[:-1] < 0) & (g[1:] >= 0)):
        a, b = x[i], x[i + 1]
        for _ in range(55):
            c = 0.5 * (a + b)
            a, b = (c, b) if force(p, c) < 0 else (a, c)
        if potential(p, a) > best:
            best, at = potential(p, a), a
    return at


def _sinks(p):
    """Attracting equilibria, clearly so."""
    x = np.linspace(0, 2 * np.pi, 1441)
    g = force(p, x)
    found = []
    for i in np.flatnonzero((g[:-1] > 0) & (g[1:] <= 0)):
        a, b = x[i], x[i + 1]
        for _ in range(55):
            c = 0.5 * (a + b)
            a, b = (c, b) if force(p, c) > 0 else (a, c)
        f, slope = (
            p["b12"] * np.cos(a) - p["b31"] * np.sin(a),
            (force(p, a + 1e-5) - force(p, a - 1e-5)) / 2e-5,
        )
        rate = max(abs(p[name]) for name in ("b12", "b31")) + np.sqrt(
            max(abs(p[name]) for name in SYSTEM[2:])
        )
        if f < -0.1 * rate and slope < -0.1 * rate**2:
            found.append(a)
    return found


def _fate(given, answer):
    n = len(answer["status"])
    p = {name: float(given[name][0]) for name in SYSTEM}
    points = np.ascontiguousarray(
        np.column_stack([given[name] for name in (*SYSTEM, "phi0", "w0")])
    )
    section, sinks = _section(p), _sinks(p)
    out = np.full((n, gf.SETTLED), np.nan)
    ok = answer["status"] == 0
    gf.settle(points[ok], np.full(ok.sum(), section), SPAN, 1e-20, part := out[ok])
    out[ok] = part
    said = answer["verdict"]
    wrong, checked = np.zeros(n, bool), np.zeros(n, bool)
    for i in np.flatnonzero(ok & (said >= 0) & (out[:, gf.DONE] == 1)):
        at = (out[i, gf.LAST_PHI] + np.pi) % (2 * np.pi) - np.pi
        rest = [
            s
            for s in sinks
            if abs((at - s + np.pi) % (2 * np.pi) - np.pi) < 1e-3 and abs(out[i, gf.LAST_W]) < 1e-3
        ]
        if rest:
            limit = answer["limit_phi"][i]
            here = said[i] == 0 and abs((limit - rest[0] + np.pi) % (2 * np.pi) - np.pi) < 1e-6
            wrong[i], checked[i] = not here, True
        elif said[i] in (2, 3):
            speed = out[i, gf.PASSAGE] * out[i, gf.RATE]
            checked[i] = np.isfinite(speed) and abs(speed - answer["limit_w"][i]) < 1e-3 * (
                1 + abs(speed)
            )
        elif said[i] in (5, 6):
            checked[i] = np.sign(out[i, gf.LAST_W]) == (1 if said[i] == 5 else -1)
        elif said[i] == 4:
            checked[i] = abs(out[i, gf.RIGHT] - out[i, gf.RIGHT_BEFORE]) < 1e-3
    mirrored = _same(given, answer, {"question": "fate"}, mirror=True)
    return {"wrong": {"fate": wrong, "mirror image": mirrored}, "checked": checked}


def _same(given, answer, options, mirror):
    """Where the exact mirror image (S2), scaled by powers of two (S5), has another fate, or
    portrait: a mask.

    Verdict 0 of a portrait, degenerate within its bars, contradicts no other: where both are 1,
    they have the same numbers of equilibria and of cycles.
    """
    image = {}
    for name, values in given.items():
        k = 4.0 if name in ("b12", "b31", "w0") else 16.0 if name in SYSTEM else 1.0
        sign = -1.0 if mirror and name in ("phi0", "w0", "b31", "c23", "s2") else 1.0
        image[name] = np.asarray(values) * (k * sign)
    solved, said = _solved(image, options), answer["verdict"]
    other = solved["verdict"].values
    if options["question"] == "portrait":
        two = np.array(
            [
                [x[name] for name in ("equilibria", "saddles", "librations")]
                for x in (answer, solved)
            ]
        )
        rotations = [x["rotations_plus"] + x["rotations_minus"] for x in (answer, solved)]
        return (
            (said == 1)
            & (other == 1)
            & ((two[0] != two[1]).any(axis=0) | (rotations[0] != np.array(rotations[1])))
        )
    turned = np.array([MIRROR.get(int(v), int(v)) for v in said])
    return (said >= 0) & (other >= 0) & (turned != other)


def _solved(given, options):
    return survey.evaluate(
        "gyrostat", **{k: xr.DataArray(v, dims="point") for k, v in given.items()}, **options
    )


def _portrait(given, answer):
    n = len(answer["status"])
    ok = answer["status"] == 0
    exact = {"K": np.full((2, n), np.nan), "L": np.full((2, n), np.nan)}
    angles = np.full(answer["equilibrium_phi"].shape, np.nan, LONG)
    doubts = np.full(angles.shape, np.nan)
    cycles = {
        name: np.full(answer["cycle_w"].shape, np.nan)
        for name in ("cycle_w", "cycle_period", "cycle_multiplier")
    }
    slack = {name: np.full(answer["cycle_w"].shape, np.nan) for name in cycles}
    wrong = {name: np.zeros(n, bool) for name in ("equilibria", "parity", "ends")}
    for i in np.flatnonzero(ok):
        p = {name: float(given[name][i]) for name in SYSTEM}
        q = {name: Fraction(value) for name, value in p.items()}
        K = q["b12"] * q["s3"] - q["b31"] * q["s2"]
        L = q["c23"] * (q["b12"] ** 2 - q["b31"] ** 2) - q["d"] * q["b12"] * q["b31"]
        exact["K"][:, i] = _two(K)
        high, low = _two(L)
        value = (LONG(high) + LONG(low)) * (LONG(1.5707963267948966) + LONG(6.123233995736766e-17))
        exact["L"][:, i] = float(value), float(value - float(value))
        decided = answer["verdict"][i] == 1
        x = np.linspace(0, 2 * np.pi, 2881)[:-1] + 1e-4
        signs = np.signbit(force(p, x))
        crossings = int((signs != np.roll(signs, 1)).sum())
        wrong["equilibria"][i] = (
            decided and any(p[name] for name in SYSTEM[2:]) and answer["equilibria"][i] < crossings
        )
        # within the rounding of the parameters K counts as 0, as the scene's text says
        if decided and abs(K) > 1e-15 * (abs(q["b12"] * q["s3"]) + abs(q["b31"] * q["s2"])):
            plus, minus = answer["end_plus"][i], answer["end_minus"][i]
            wrong["ends"][i] = (plus, minus) != ((2, 2) if K > 0 else (0, 0))
        e = answer["equilibrium_phi"][i]
        with np.errstate(all="ignore"):
            c, s = np.cos(e.astype(LONG)), np.sin(e.astype(LONG))
            d, c23, s2, s3 = (LONG(p[name]) for name in SYSTEM[2:])
            g = -d * c * s - c23 * (c * c - s * s) + s2 * c - s3 * s
            slope = -d * (c * c - s * s) + 4 * c23 * s * c - s2 * s - s3 * c
            size = abs(d) + abs(c23) + abs(s2) + abs(s3)
            good = np.abs(slope) > 1e-4 * size
            angles[i] = np.where(good, e - g / slope, np.nan)
            doubts[i] = np.where(
                good,
                16 * ULP * size / np.abs(slope) + 10 * (g / slope) ** 2 * size / np.abs(slope),
                np.nan,
            )
        if decided:
            _cycles(p, answer, i, cycles, slack)
    found = {
        name: (values[0], values[1], 1e-30 * np.abs(values[0])) for name, values in exact.items()
    }
    found["L"] = found["L"][0], found["L"][1], 8 * ULP * np.abs(found["L"][0])
    found["equilibrium_phi"] = angles, 0.0, doubts
    for name in cycles:
        found[name] = cycles[name], 0.0, slack[name]
    wrong["mirror image"] = _same(given, answer, {"question": "portrait"}, mirror=True)
    return found | {"wrong": wrong, "checked": ok}


def _two(x):
    high = float(x)
    return high, float(x - Fraction(high))


def _cycles(p, answer, i, cycles, slack):
    """Rotation cycles by one turn from their section: w* from the return map's defect, period, multiplier."""
    section = _section(p)
    for j in range(answer["cycle_w"].shape[1]):
        w, m = answer["cycle_w"][i, j], answer["cycle_multiplier"][i, j]
        if (
            answer["cycle_kind"][i, j] not in (1, 2)
            or not np.isfinite(w + m)
            or abs(m - 1) < 1e-3
            or m > 1e3
        ):
            continue
        step = 1e-7 * abs(w)
        goal = section + np.copysign(2 * np.pi, w)
        shifts = (-1, -0.5, 0, 0.5, 1)
        rows = np.array([[*p.values(), section, w + s * step, goal] for s in shifts])
        out = np.full((len(shifts), gf.COLUMNS), np.nan)
        gf.along(rows, 1e-28, out)
        if not (out[:, gf.TURNED] == 0).all():
            continue
        speeds, times = out[:, gf.VALUE], out[:, gf.TIME]
        coarse, slope = (speeds[4] - speeds[0]) / (2 * step), (speeds[3] - speeds[1]) / step
        curved = abs(slope - coarse)
        defect = (speeds[2] - w) + out[2, gf.VALUE + 1]
        cycles["cycle_w"][i, j] = w + defect / (1 - slope)
        slack["cycle_w"][i, j] = 1e-13 * (1 + abs(w)) / abs(1 - slope) + 1e-3 * abs(
            defect / (1 - slope)
        )
        cycles["cycle_multiplier"][i, j] = slope
        slack["cycle_multiplier"][i, j] = 1e-6 * (1 + slope) / min(1, abs(w)) + curved
        cycles["cycle_period"][i, j] = times[2] + (times[3] - times[1]) / step * (
            cycles["cycle_w"][i, j] - w
        )
        slack["cycle_period"][i, j] = 1e-13 * (1 + times[2]) * (1 + 1 / abs(w)) / abs(1 - slope)
