"""Bounds of a user's f, f', g, g' and g'', from balls (`balls`) of the program: over the whole
circle, and over the angles that a step may come to, where its series are to show all that f and g
have in them.
"""

import math

import numpy as np

from survey.kernels.cylinder.balls import LANES, balls, balls_of_one, largest
from survey.kernels.cylinder.program import (
    AT_REST,
    BOUND_DG,
    BOUND_F,
    BOUND_G,
    F_AT,
    G_AT,
    ON_CIRCLE,
    OPERATIONS,
    RADIUS,
    SLOTS,
    note,
    number_of,
    unchanged,
)
from survey.kernels.jit import inline, kernel, part
from survey.kernels.math.roundoff import ROUNDOFF_UP

# Bounds of |f| and |f'|, of |g|, of |g'|, of |g''|, as they stand in p from BOUND_F on; then the sizes
# of the series of f and of g, each before what it leaves out.
ON_F, ON_G, ON_DG, ON_DDG, SHOWN_F, MORE_F, SHOWN_G, MORE_G = range(8)
BOUNDS, KNOWN = 4, 8
LEAST_RADIUS = 1e-9
# f and g are bounded over an interval with DERIVATIVES of their derivatives; what their series leave
# out, as these bound it, may be HIDDEN of them, unless the interval is narrower than FINE.
DERIVATIVES, HIDDEN, FINE = 8, 1e-5, 1e-6
NEGLIGIBLE = 1e-18  # what changes w by such a share may be left out
WEAK = 1e-9  # of the largest on the circle, where steps have the same limit all round it
COARSEST, FINEST = 16, 65536  # pieces of the circle, over which f and g are bounded


@part
def raised(p, points, over, q, out):
    """Raise `out` (BOUNDS) to bounds of |f| and |f'|, of |g|, of |g'|, of |g''| in lane q of the
    balls `over`, of three orders or more.

    The first two also bound what rounds f and g at its middle, as the balls `points` of one order
    have it, in roundoffs: `steps` takes them for the sizes of their terms.
    """
    f, g, step = int(p[F_AT]), int(p[G_AT]), 2 * LANES
    rounded_f, rounded_g = points[step * f + LANES + q], points[step * g + LANES + q]
    orders = len(over) // len(points)
    at_f, at_g = orders * step * f + q, orders * step * g + q
    most_f = 1.0001 * max(largest(over, at_f), largest(over, at_f + step))
    out[ON_F] = max(out[ON_F], rounded_f / ROUNDOFF_UP, most_f)
    out[ON_G] = max(out[ON_G], rounded_g / ROUNDOFF_UP, 1.0001 * largest(over, at_g))
    out[ON_DG] = max(out[ON_DG], 1.0001 * largest(over, at_g + step))
    out[ON_DDG] = max(out[ON_DDG], 2.0001 * largest(over, at_g + 2 * step))


@kernel
def bounded(p, points, over, q, radius, w, out):
    """Fill `out` (KNOWN) with the bounds that hold within `radius` in lane q, see `raised`, and the
    size of the series of f and of g, the middles of `over`, each before what it leaves out at most;
    returns `hidden`.
    """
    for k in range(KNOWN):
        out[k] = 0.0
    raised(p, points, over, q, out)
    if not math.isfinite(out.sum()):
        return 0.0 if radius < LEAST_RADIUS else math.inf
    f, more_f = _shown(over, int(p[F_AT]), q, radius)
    g, more_g = _shown(over, int(p[G_AT]), q, radius)
    out[SHOWN_F], out[MORE_F], out[SHOWN_G], out[MORE_G] = f, more_f, g, more_g
    return hidden(f, more_f, g, more_g, radius, w)


@inline
def hidden(f, more_f, g, more_g, radius, w):
    """What series of these sizes leave out of f w + g within the radius, relative to what is
    allowed: up to 1 is little enough.
    """
    w = abs(w) + math.sqrt(radius * g)
    enough = HIDDEN * (f * w + g) + NEGLIGIBLE * w * w / radius + 1e-300
    share = (more_f * w + more_g) / enough
    return 0.0 if radius < FINE else (share if share >= 0.0 else math.inf)


@inline
def _shown(over, value, q, radius):
    """Sizes of the series of a value, and of what it leaves out, within the radius of lane q."""
    at, power, size = 2 * LANES * (DERIVATIVES + 1) * value + q, 1.0, 0.0
    for _ in range(DERIVATIVES):
        size += power * abs(over[at])
        at += 2 * LANES
        power *= radius
    return size, power * largest(over, at)


@inline
def _middles(pieces, out):
    """Fill out (pieces) with the middles of as many pieces of the circle; returns the radius of one."""
    half = math.pi / pieces
    for i in range(pieces):
        out[i] = (2 * i + 1) * half - math.pi
    return 1.0001 * half


@inline
def _agree(p, out, first):
    """Write the bounds `out` into p; are they finite, and near those that p had, if these are not
    the first?
    """
    near = not first
    for k in range(BOUNDS):
        near = near and math.isfinite(out[k]) and p[BOUND_F + k] <= 2.0 * out[k]
        p[BOUND_F + k] = out[k]
    return near


@inline
def _periodic(p, points, first, many):
    """Are f and g the same, within their rounding, at angles and 2 pi further on? In `points` these
    are the lanes of one batch and of the next.
    """
    for q in range(first, first + many):
        for at, steep in ((int(p[F_AT]), p[BOUND_F]), (int(p[G_AT]), p[BOUND_DG])):
            near = 2 * LANES * at + q
            far = near + many
            most = 2.0 * (points[near + LANES] + points[far + LANES]) + 4e-15 * steep
            if not abs(points[near] - points[far]) <= most:
                return False
    return True


@kernel
def complete(rows, angles):
    """Fill in AT_REST and, on a circle, the bounds of programs, all of one length; NaN where a number
    is not finite, or f and g have, by these angles, not the period 2 pi. Returns who is left to
    `bound_finely`.

    Bounds are those of 4 COARSEST pieces of the circle, within a factor of 2. What does not depend on
    parameters is found once for all rows.
    """
    left = np.zeros(len(rows), np.bool_)
    if len(rows) == 0:
        return left
    circle, count = rows[0, ON_CIRCLE] > 0.0, number_of(rows[0], SLOTS)
    # batches: 0; the angles; the pieces of the circle, COARSEST and 4 COARSEST of them
    batches, many, pieces = 5 if circle else 1, len(angles), 5 * COARSEST
    at, radii, none = np.zeros(5 * LANES), np.zeros(5 * LANES), np.zeros(LANES)
    lanes = np.array([1, 2 * many, LANES, LANES, pieces - 2 * LANES])
    points, over = np.zeros((5, count * 2 * LANES)), np.zeros((5, count * 6 * LANES))
    numbers, out = np.zeros((2 * count, LANES)), np.empty(BOUNDS)
    known, last = np.zeros(count, np.bool_), np.full(rows.shape[1], math.nan)
    for k in range(many):
        at[LANES + k], at[LANES + many + k] = angles[k], angles[k] + 2.0 * math.pi
    first, end = 2 * LANES + COARSEST, 2 * LANES + pieces
    radii[2 * LANES : first] = _middles(COARSEST, at[2 * LANES : first])
    radii[first:end] = _middles(4 * COARSEST, at[first:end])
    for r in range(len(rows)):
        p, good = rows[r], True  # the rows of `for p in rows` are of a type of their own
        for k in range(OPERATIONS, len(p)):
            good &= math.isfinite(p[k])
        if good:
            known[0] = True
            unchanged(p, last, known)
            note(p, numbers, 0, LANES)
            for k in range(batches):
                phi = at[k * LANES : k * LANES + lanes[k]]
                balls(p, numbers.ravel(), known, phi, none, points[k])
                if k > 1:
                    balls(p, numbers.ravel(), known, phi, radii[k * LANES :], over[k])
            g = 2 * LANES * int(p[G_AT])
            p[AT_REST] = 1.0 if points[0, g] == 0.0 and points[0, g + LANES] == 0.0 else 0.0
        if good and circle:
            near = False
            for first, end in ((0, COARSEST), (COARSEST, pieces)):
                out[:] = 0.0
                for q in range(first, end):
                    k = 2 + q // LANES
                    raised(p, points[k], over[k], q % LANES, out)
                near = _agree(p, out, first == 0)
            good = _periodic(p, points[1], 0, many)
            left[r] = good and not near
        if not good:
            p[:] = math.nan
    return left


@kernel
def bound_finely(p):
    """Lower the bounds over the whole circle in p, which are those of 4 COARSEST pieces: pieces with
    more than half of the largest are divided by four, until no bound falls to less than half by
    that; NaN where they are still infinite then.
    """
    count, near, left, size = number_of(p, SLOTS), False, 0, 4 * COARSEST
    points, over = np.zeros(count * 2 * LANES), np.zeros(count * 6 * LANES)
    numbers, known = np.zeros((2 * count, LANES)), np.zeros(count, np.bool_)
    note(p, numbers, 0, LANES)
    none, out = np.zeros(LANES), np.empty(BOUNDS)
    middles, radii, bounds = np.empty(size), np.empty(size), np.zeros((size, BOUNDS))
    narrowest = _middles(size, middles)
    radii[:] = narrowest
    while True:
        for first in range(left, size, LANES):
            phi = middles[first : first + LANES]
            balls(p, numbers.ravel(), known, phi, none, points)
            balls(p, numbers.ravel(), known, phi, radii[first : first + LANES], over)
            for q in range(len(phi)):
                raised(p, points, over, q, bounds[first + q])
        if size > 4 * COARSEST:
            for k in range(BOUNDS):
                out[k] = 0.0
                for i in range(size):
                    out[k] = max(out[k], bounds[i, k])
            near = _agree(p, out, False)
        if near or size > FINEST or narrowest <= 1.01 * math.pi / FINEST:
            break
        large, left = np.zeros(size, np.bool_), size
        for i in range(size):
            for k in range(BOUNDS):
                large[i] |= not bounds[i, k] <= 0.5 * p[BOUND_F + k] or bounds[i, k] == math.inf
            left -= large[i]
        finer = left + 4 * (size - left)
        at, narrower, lower = np.empty(finer), np.empty(finer), np.zeros((finer, BOUNDS))
        stays, part = 0, left  # what stays comes first
        for i in range(size):
            if large[i]:
                for j in range(4):
                    at[part + j] = middles[i] + (0.5 * j - 0.75) * radii[i]
                    narrower[part + j] = 0.250001 * radii[i]
                part += 4
            else:
                at[stays], narrower[stays] = middles[i], radii[i]
                for k in range(BOUNDS):
                    lower[stays, k] = bounds[i, k]
                stays += 1
        middles, radii, bounds, size = at, narrower, lower, finer
        for i in range(size):
            narrowest = min(narrowest, radii[i])
    good = True
    for k in range(BOUNDS):
        good &= math.isfinite(p[BOUND_F + k])
    if not good:
        p[:] = math.nan


@kernel
def limit_to_shown(rows, pieces):
    """Limit RADIUS of programs on the circle, all of one length, where their bounds are finite: it stays where
    equal `pieces` show all that f and g have in them; where some leave out more than HIDDEN, and than
    WEAK of the largest, these are halved until they do not, and it is their half-width at most.
    """
    if len(rows) == 0:
        return
    count, orders, batches = number_of(rows[0], SLOTS), DERIVATIVES + 1, (pieces - 1) // LANES + 1
    over, known = np.zeros((batches, count * orders * 2 * LANES)), np.zeros(count, np.bool_)
    finer, numbers = np.zeros(count * orders * 2 * LANES), np.zeros((2 * count, LANES))
    at, sizes, last = np.empty(pieces), np.empty((4, pieces)), np.full(rows.shape[1], math.nan)
    longest = _middles(pieces, at)
    wide = np.full(LANES, longest)
    for r in range(len(rows)):
        p = rows[r]
        if not math.isfinite(p[BOUND_F]):
            continue
        known[0] = True
        unchanged(p, last, known)
        note(p, numbers, 0, LANES)
        f, g, N = int(p[F_AT]), int(p[G_AT]), numbers.ravel()
        for k in range(batches):
            balls(p, N, known, at[k * LANES : (k + 1) * LANES], wide, over[k])
        for i in range(pieces):
            own, q = over[i // LANES], i % LANES
            sizes[0, i], sizes[1, i] = _shown(own, f, q, longest)
            sizes[2, i], sizes[3, i] = _shown(own, g, q, longest)
        weak_f, weak_g = WEAK * sizes[0].max(), WEAK * sizes[2].max()
        phi, left = at.copy(), 0
        for i in range(pieces):
            if not _all_shown(sizes[0, i], sizes[1, i], sizes[2, i], sizes[3, i], weak_f, weak_g):
                phi[left], left = at[i], left + 1
        radius, none = longest, np.zeros(count, np.bool_)
        while left > 0 and radius > FINE and left < FINEST:
            radius *= 0.5
            inner, narrow = np.empty(2 * left), np.full(LANES, 1.0001 * radius)
            for i in range(left):
                inner[2 * i], inner[2 * i + 1] = phi[i] - radius, phi[i] + radius
            phi, size, left = np.empty(len(inner)), len(inner), 0
            for first in range(0, size, LANES):
                some = inner[first : first + LANES]
                balls(p, N, none, some, narrow, finer)
                for q in range(len(some)):
                    own_f, more_f = _shown(finer, f, q, radius)
                    own_g, more_g = _shown(finer, g, q, radius)
                    if not _all_shown(own_f, more_f, own_g, more_g, weak_f, weak_g):
                        phi[left], left = some[q], left + 1
        if radius < longest:
            p[RADIUS] = min(p[RADIUS], radius)


@inline
def _all_shown(f, more_f, g, more_g, weak_f, weak_g):
    """Do series of these sizes leave out little enough of f and of g?"""
    return more_f <= HIDDEN * f + weak_f and more_g <= HIDDEN * g + weak_g


@inline
def wider(left_out):
    """The factor by which the radius may change after a share `left_out` (see `hidden`): 0.1 is
    aimed at.
    """
    return min(max((0.1 / (left_out + 1e-300)) ** (1.0 / DERIVATIVES), 0.25), 2.0)


@kernel
def bound_near(p, phi, w):
    """Write bounds near phi into p, and how near: p[RADIUS], twice the last one, or less where they
    do not show f w + g.
    """
    count, out = number_of(p, SLOTS), np.empty(KNOWN)
    numbers, known = np.empty((2 * count, LANES)), np.zeros(count, np.bool_)
    points = np.empty(count * 2 * LANES)
    over = np.empty(len(points) * (DERIVATIVES + 1))
    note(p, numbers, 0, 1)
    N, radius = numbers.ravel(), min(4.0 * p[RADIUS], 2.0 * (1.0 + abs(phi)))
    balls_of_one(p, N, known, phi, 0.0, points)
    left_out = math.inf
    while left_out > 1.0:
        radius *= 0.5
        balls_of_one(p, N, known, phi, radius, over)
        left_out = bounded(p, points, over, 0, radius, w, out)
    p[RADIUS] = radius
    for k in range(BOUNDS):
        p[BOUND_F + k] = out[k]


@inline
def leaving_at_most(factor, most_f, most_g, radius, w):
    """As `leaving`, where |w| grows to at most `factor` |w| + sqrt(radius g), and changes by at most
    (`factor` - 1) |w| + sqrt(radius g).
    """
    root = math.sqrt(radius * most_g) + 1e-300
    most = factor * w + root
    return max(most / radius, (most_f * most + most_g) / ((factor - 1.0) * w + root))


@inline
def leaving(most_f, most_g, radius, w):
    """A rate: for the time 1 / rate, phi stays within the radius where |f| and |g| are below these
    bounds, since |w| stays below a multiple of its first value and of sqrt(radius g).
    """
    return min(
        leaving_at_most(1.25, most_f, most_g, radius, w),
        leaving_at_most(2.0, most_f, most_g, radius, w),
    )


@kernel
def longest_step(p, w):
    """A step on which phi stays within p[RADIUS], where the bounds hold."""
    return 1.0 / leaving(p[BOUND_F], p[BOUND_G], p[RADIUS], abs(w))
