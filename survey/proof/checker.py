#!/usr/bin/env python3
"""survey-check OUT.cert: proves the stability map that a certificate states, or says what fails.

This file needs Python and python-flint (ball arithmetic, https://flintlib.org) alone: it can be copied, read in
an hour, and run, `python checker.py OUT.cert`. It believes no number of the certificate. What is proved is printed by
`Certificate.statement`; the lemmas below have their proofs in the documentation, on the page "Proved maps".

HILL'S EQUATION y'' + z(u, p) y = 0, with two real parameters p = (p1, p2) in a rectangle. A certificate gives z by
formulas on consecutive pieces of [0, S], and a kind:
    even      z is continued by z(-u) = z(u) and z(S + u) = z(S - u), with the period T = 2 S;
    periodic  z is continued with the period T = S.
y1, y2 are the solutions with y1 = 1, y1' = 0 and y2 = 0, y2' = 1 at u = 0, and D = y1(T) + y2'(T).

1. VERDICTS (`Panel.verdict`). If |D| < 2 all solutions are bounded, if |D| > 2 one grows exponentially (Magnus and
   Winkler, Hill's Equation, 1966, theorem 1.1). If z is even, D - 2 = 4 y1'(S) y2(S) and D + 2 = 4 y1(S) y2'(S): the
   signs of the four factors y1, y1', y2, y2' at S decide. If not, the factors are 2 - D and 2 + D.
2. A STEP (`Equation.steps`). Let z be analytic and |z| <= Z on the disc |u - u0| <= R, w^2 >= Z, w > 0, 0 < h < R, and
   x = h/R. On every ray from u0 the maximum norm of v = (w y, y') satisfies |v|' <= w |v|, so |w y| <= e^(wR) |v(u0)|
   on the disc, and by Cauchy the Taylor coefficients of y satisfy |a_n| <= M R^-n, M = e^(wR) max(|y|, |y'|/w) at u0.
   At u0 + h the sums up to degree N are off by at most M x^(N+1) / (1 - x), for y' by (M/R) (N+1) x^N / (1 - x)^2.
3. GROWTH (`growth`). For complex z and a constant w > 0, the Euclidean norm of (sqrt(w) y, y'/sqrt(w)) grows at most
   at the rate |w^2 - conj z| / (2 w), the logarithmic norm of [[0, w], [-z/w, 0]]. Where w is changed from v to w it
   grows at most by max(v/w, w/v)^(1/2). So with constants w on parts of [0, S] it grows at most by the product of all.
4. PARAMETERS (`Equation.truncation`). A panel is a rectangle of parameters, mapped to [-1, 1]^2. If a factor f is
   analytic, |f| <= M, for p1 in the Bernstein ellipse E_r (semi-axes (r +- 1/r)/2) and real p2, its interpolant I1 f
   at the n Chebyshev points of the first kind satisfies |f - I1 f| <= 4 M r^(1-n) / (r - 1): its coefficients are at
   most 2 M r^-k, and each T_k, k >= n, is interpolated by 0 or by some +-T_j (Trefethen, Approximation Theory and
   Approximation Practice, theorem 8.1 and chapter 4). In two variables |f - I1 I2 f| <= |f - I1 f| + L |f - I2 f|,
   where L = 1 + (2/pi) log n1 is at least the norm of I1 (Rivlin, The Chebyshev Polynomials, 1974).
5. CELLS (`Panel.check`). I1 I2 f is written in Bernstein's polynomials of a cell: its values there lie between the
   least and the largest coefficient. De Casteljau's matrices give the coefficients on halves. A factor is positive on a
   cell, its border included, if all coefficients (which are balls) exceed the bound of 4; negative likewise.
"""

import ast
import hashlib
import json
import sys
from argparse import ArgumentParser
from contextlib import nullcontext
from fractions import Fraction
from functools import lru_cache, partial, reduce
from itertools import pairwise, product
from math import ceil, comb, floor, prod
from multiprocessing import get_context
from operator import add, mul, sub, truediv

from flint import acb, arb, arb_mat, arb_series, ctx

FORMAT = "survey-certificate 1"
STABLE, UNSTABLE, OPEN, SPLIT = "s", "u", "o", "+"  # cells; "+" is followed by its four quarters
VERDICTS = {STABLE: "stable", UNSTABLE: "unstable", OPEN: "open"}
QUARTERS = ((1, 1), (1, 0), (0, 1), (0, 0))  # (upper half of p2?, of p1?): the last one is the first in the text
RATIO, FAR = arb(1) / 4, 8  # h / R of a step; a step is halved unless w R < FAR
SHORTEST, SMALLEST = Fraction(1, 2**20), Fraction(1, 2**11)  # step, and part that bounds growth, as parts of a piece
ARCS, BOXES, COVER = 24, 32, 4  # parts of half an ellipse, of a piece of [0, S] (at least), of a box's side
WIDE = arb(1) / 8  # a part of [0, S] is halved while the ball of z times its length exceeds this, relative to sqrt |z|
LARGEST = 2**23  # characters of a certificate
MALFORMED = (KeyError, TypeError, ValueError, IndexError, AttributeError, RecursionError, ArithmeticError)


class Failed(Exception):
    """The certificate proves nothing; says why."""


def need(condition, why):
    if not condition:
        raise Failed(why)


def exact(number):
    """The ball of a rational number."""
    return arb(number.numerator) / number.denominator


def rational(text):
    """The rational number that a text such as '0.99' or '-7/3' denotes."""
    need(isinstance(text, str) and len(text) < 80, "a number is not a short text")
    return Fraction(text)


def whole(value, least, most, what):
    need(type(value) is int and least <= value <= most, f"{what} is not a whole number from {least} to {most}")
    return value


def parts(n):
    """The balls of [0, 1/n], [1/n, 2/n], ..., [1 - 1/n, 1]."""
    return [(arb(k) / n).union(arb(k + 1) / n) for k in range(n)]


def power(x, n):
    """x^n by multiplication."""
    found = x if n % 2 else arb(1)
    return found if n < 2 else found * power(x * x, n // 2)


def with_branch_cut(name):
    """A function which is not a number for complex balls that meet its branch cut, where it is not analytic."""
    return lambda x: getattr(x, name)(analytic=True) if isinstance(x, acb) else getattr(x, name)()


FUNCTIONS = {
    "sin": lambda x: x.sin(), "cos": lambda x: x.cos(), "exp": lambda x: x.exp(),
    "log": with_branch_cut("log"), "sqrt": with_branch_cut("sqrt"),
}  # fmt: skip
OPERATIONS = {ast.Add: add, ast.Sub: sub, ast.Mult: mul, ast.Div: truediv}


class Formula:
    """An expression in `names` and pi: + - * /, ** with whole exponents, exact decimals, FUNCTIONS; nothing else."""

    def __init__(self, text, names):
        need(isinstance(text, str) and len(text) < 20_000, "a formula is not a text, or too long")
        self.text, self.names, self.parts = text, {*names, "pi"}, {}  # what stands in it twice is evaluated once
        try:
            self.whole = self._read(ast.parse(text, mode="eval").body)
        except (SyntaxError, ValueError, RecursionError, MemoryError):
            raise Failed(f"this is not a formula: {text[:80]!r}") from None

    def __call__(self, **values):
        """Its value for balls, complex balls, or power series of balls."""
        values["pi"] = arb.pi()
        for text, part in self.parts.items():
            values[text] = part(values)
        return values[self.whole]

    def _read(self, node):
        """The text of a node, whose value `parts` computes from those before it."""
        text = ast.get_source_segment(self.text, node)
        if not (isinstance(node, ast.Name) and node.id in self.names) and text not in self.parts:
            self.parts[text] = self._part(node, text)
        return text

    def _part(self, node, text):
        """The node as a function of {text: value}."""
        if isinstance(node, ast.Constant) and type(node.value) in (int, float):
            number = Fraction(text)
            return lambda values: exact(number)
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            operand = self._read(node.operand)
            return lambda values: -values[operand]
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
            need(isinstance(node.right, ast.Constant), "an exponent is not a number")
            base, exponent = self._read(node.left), whole(node.right.value, 0, 64, "an exponent")
            return lambda values: power(values[base], exponent)
        if isinstance(node, ast.BinOp) and type(node.op) in OPERATIONS:
            left, right, operation = self._read(node.left), self._read(node.right), OPERATIONS[type(node.op)]
            return lambda values: operation(values[left], values[right])
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in FUNCTIONS:
            need(len(node.args) == 1 and not node.keywords, f"{node.func.id} takes one argument")
            argument, function = self._read(node.args[0]), FUNCTIONS[node.func.id]
            return lambda values: function(values[argument])
        raise Failed(f"{text!r} is not allowed in a formula")


class Equation:
    """y'' + z(u, p) y = 0 on [0, S]; `pieces`: [(end, formula of z)] from 0 to S; `names` of the two parameters."""

    def __init__(self, kind, pieces, names):
        need(kind in ("even", "periodic"), "z is neither even nor periodic")
        need(0 < len(pieces) <= 100, "there must be 1 to 100 pieces of [0, S]")
        self.even, self.names, self.pieces, start = kind == "even", names, [], arb(0)
        for end, z in pieces:
            end = Formula(end, [])
            need(end() > start, "the ends of the pieces of [0, S] do not increase")
            self.pieces.append((start, end(), end.text, Formula(z, ["u", *names])))
            start = end()

    def steps(self, box, order):
        """[(u0, h, z, bounds of what is left out of (y1, y1') and of (y2, y2'))]; `box` covers the parameters."""

        def tried(u0, h, z):
            radius = h / RATIO
            size = acb(z(u=acb(u0 + radius * arb(0, 1), radius * arb(0, 1)), **box)).abs_upper()
            w = size.sqrt().upper() + exact(SHORTEST)
            y = (w * radius).exp() * RATIO ** (order + 1) / (1 - RATIO)
            dy = (w * radius).exp() / radius * (order + 1) * RATIO**order / (1 - RATIO) ** 2
            return (u0, h, z, ((y, dy), (y / w, dy / w))) if w * radius < FAR else None  # or z is not finite there

        return self.bisected(1, SHORTEST, tried, "z is too large, or singular too near to the real axis")

    def bisected(self, count, shortest, tried, why):
        """What `tried(start, length, z)` finds on parts of the pieces of [0, S], which are halved where it is None."""
        found = []
        for start, end, _, z in self.pieces:
            waiting = [(Fraction(k, count), Fraction(1, count)) for k in reversed(range(count))]
            while waiting:
                low, length = waiting.pop()
                need(length > shortest, why)
                value = tried(start + (end - start) * exact(low), (end - start) * exact(length), z)
                if value is None:
                    waiting += [(low + length / 2, length / 2), (low, length / 2)]
                else:
                    found.append(value)
        return found

    def factors(self, steps, order, point):
        """The factors for the parameters `point` (balls)."""
        ctx.cap = order + 1
        y1, dy1, y2, dy2 = arb(1), arb(0), arb(0), arb(1)
        for u0, h, z, ((y, dy), (other, dother)) in steps:
            series = arb_series(z(u=arb_series([u0, 1]), **point))
            z_n = [series[n] for n in range(order - 1)]
            a, da = step(z_n, h, order, arb(1), arb(0), y, dy)
            b, db = step(z_n, h, order, arb(0), arb(1), other, dother)
            y1, dy1, y2, dy2 = a * y1 + b * dy1, da * y1 + db * dy1, a * y2 + b * dy2, da * y2 + db * dy2
        return (y1, dy1, y2, dy2) if self.even else (2 - y1 - dy2, 2 + y1 + dy2)

    def truncation(self, sides, counts, ellipses, rates):
        """Bounds of |f - I1 I2 f| for each factor f; `sides`: (centre, half length) of both parameters."""
        parts = []
        for name, n, r, least in zip(self.names, counts, ellipses, rates, strict=True):
            grown = zip(*(growth(arc, least) for arc in self.on_ellipse(sides, name, r)), strict=True)
            y1, dy1, y2, dy2 = (4 * reduce(arb.max, sizes) * r ** (1 - n) / (r - 1) for sizes in grown)
            parts.append((y1, dy1, y2, dy2) if self.even else (y1 + dy2, y1 + dy2))
        norm = 1 + 2 / arb.pi() * arb(counts[0]).log()
        return [(first + norm * second).upper() for first, second in zip(*parts, strict=True)]

    def cover(self, sides, name, r):
        """Parameters that cover the upper half of E_r of one of them: (arcs of its border, boxes of its inside)."""
        real = {name: centre + half * arb(0, 1) for name, (centre, half) in zip(self.names, sides, strict=True)}
        centre, half = sides[self.names.index(name)]
        across, up = half * (r + 1 / r) / 2, half * (r - 1 / r) / 2
        arcs = [acb(centre + across * x.cos_pi(), up * x.sin_pi()) for x in parts(ARCS)]
        boxes = [acb(centre + across * (2 * x - 1), up * y) for x, y in product(parts(COVER), repeat=2)]
        return [[{**real, name: place} for place in places] for places in (arcs, boxes)]

    def on_ellipse(self, sides, name, r):
        """For arcs that cover the upper half of E_r of one parameter: [(length of a part of [0, S], z there)].

        The lower half is its mirror image, since z is real for real parameters. Raises Failed unless z is analytic in
        E_r, that is finite on boxes that cover its upper half.
        """
        arcs, boxes = self.cover(sides, name, r)

        def tried(start, length, z):
            u = start.union(start + length)
            values = [acb(z(u=u, **place)) for place in arcs]
            sharp = all(length * x.rad() < WIDE * (1 + x.abs_upper().sqrt()) for x in values)
            if sharp and all(acb(z(u=u, **place)).is_finite() for place in boxes):
                return [(length, value) for value in values]

        why = f"z is singular, or changes too fast, for complex {name} in an ellipse"
        return list(zip(*self.bisected(BOXES, SMALLEST, tried, why), strict=True))


def growth(arc, least):
    """Bounds of |y1|, |y1'|, |y2|, |y2'| at S, from [(length of a part of [0, S], z there)]; w is at least `least`."""
    steps = [(length, z, least.max(z.mid().abs_upper().sqrt().mid())) for length, z in arc]
    exponent = sum((length * (w * w - z.conjugate()).abs_upper() / (2 * w) for length, z, w in steps), arb(0))
    grown = exponent.exp() * prod((v / w).max(w / v).sqrt() for (*_, v), (*_, w) in pairwise(steps))
    first, last = steps[0][2].sqrt(), steps[-1][2].sqrt()
    return grown * first / last, grown * first * last, grown / (first * last), grown * last / first


def step(z_n, h, order, y, dy, y_missed, dy_missed):
    """y and y' after a step from the Taylor coefficients z_n of z, with what the sums leave out."""
    a = [y, dy]
    for n in range(order - 1):
        a.append(-sum((z_n[j] * a[n - j] for j in range(n + 1)), arb(0)) / ((n + 1) * (n + 2)))
    value, slope = arb(0), arb(0)
    for coefficient in reversed(a):
        value, slope = value * h + coefficient, slope * h + value
    return value + y_missed * arb(0, 1), slope + dy_missed * arb(0, 1)


class Panel:
    """A rectangle of parameters on which the factors are polynomials to within `truncation`; `sides`: its ends."""

    def __init__(self, equation, sides, data):
        self.equation, self.cells = equation, data["cells"]
        self.sides = [(exact((low + high) / 2), exact((high - low) / 2)) for low, high in sides]
        self.counts = [whole(n, 2, 40, "a number of nodes") for n in data["nodes"]]
        self.ellipses, self.rates = ([exact(rational(x)) for x in data[key]] for key in ("ellipses", "rates"))
        need(all(r > 1 for r in self.ellipses) and all(w > 0 for w in self.rates), "an r <= 1, or a w <= 0")
        self.order = whole(data["order"], 2, 400, "an order")
        need(set(self.cells) <= {*VERDICTS, SPLIT}, "unknown cells")

    def polynomials(self):
        """For each factor: its Bernstein coefficients on the panel, and the bound of what they leave out."""
        equation, names = self.equation, self.equation.names
        nodes = [[(arb.pi() * (2 * i + 1) / (2 * n)).cos() for i in range(n)] for n in self.counts]
        box = {name: centre + half * arb(0, 1) for name, (centre, half) in zip(names, self.sides, strict=True)}
        steps, values = equation.steps(box, self.order), []
        for at in product(*nodes):
            place = (centre + half * x for (centre, half), x in zip(self.sides, at, strict=True))
            values.append(equation.factors(steps, self.order, dict(zip(names, place, strict=True))))
        left, right = (bernstein(at).inv() for at in nodes)
        tables = [left * arb_mat(*self.counts, list(f)) * right.transpose() for f in zip(*values, strict=True)]
        return tables, equation.truncation(self.sides, self.counts, self.ellipses, self.rates)

    def check(self):
        """{verdict: its share of the panel}; raises Failed unless every cell has the verdict that it states."""
        shares = shares_of(self.cells)
        if self.cells == OPEN:
            return shares
        tables, bounds = self.polynomials()
        halves = [halving(n) for n in self.counts]
        waiting = [([0] * len(tables), [lambda t=t: t for t in tables])]  # tables are computed when they are needed
        for position, letter in enumerate(self.cells, 1):
            signs, tables = waiting.pop()
            if letter == OPEN:
                continue
            tables = [known or table() for known, table in zip(signs, tables, strict=True)]
            signs = [known or sign(*pair) for known, *pair in zip(signs, tables, bounds, strict=True)]
            if letter == SPLIT:
                waiting += [
                    (signs, [lambda t=t, x=halves[0][right], y=halves[1][upper]: x * t * y.transpose() for t in tables])
                    for upper, right in QUARTERS
                ]
            else:
                need(self.verdict(signs) == letter, f"cell {position} is not proved to be {VERDICTS[letter]}")
        return shares

    def verdict(self, signs):
        """What the signs of the factors prove (0: unknown)."""
        if self.equation.even:
            y1, dy1, y2, dy2 = signs
            signs = -dy1 * y2, y1 * dy2  # of 2 - D and of 2 + D
        below, above = signs
        return UNSTABLE if -1 in (below, above) else STABLE if below == above == 1 else OPEN


def bernstein(nodes):
    """The values of Bernstein's polynomials of degree n - 1 on [-1, 1] at n nodes."""
    d = len(nodes) - 1
    table = [[comb(d, j) * power((1 + x) / 2, j) * power((1 - x) / 2, d - j) for j in range(d + 1)] for x in nodes]
    return arb_mat(table)


def halving(n):
    """Bernstein coefficients on an interval -> on its lower and on its upper half (de Casteljau)."""
    lower = [[arb(comb(i, j)) / 2**i for j in range(n)] for i in range(n)]
    return arb_mat(lower), arb_mat([row[::-1] for row in lower[::-1]])


def sign(table, bound):
    """1 or -1 if the polynomial, and all that differs from it by at most `bound`, has this sign on the cell; else 0."""
    if table[0, 0] > bound:
        return int(all(x > bound for x in table.entries()))
    return -int(table[0, 0] < -bound and all(x < -bound for x in table.entries()))


def shares_of(cells):
    """{verdict: its share of the panel}; raises Failed unless the cells cover the panel."""
    shares, waiting = dict.fromkeys(VERDICTS, Fraction(0)), [0]
    for letter in cells:
        need(waiting, "there are more cells than cover the panel")
        depth = waiting.pop()
        if letter == SPLIT:
            waiting += [depth + 1] * 4
        else:
            shares[letter] += Fraction(1, 4**depth)
    need(not waiting, "the cells do not cover the panel")
    return shares


class Certificate:
    """What the text of a certificate states; raises Failed if it is not one."""

    def __init__(self, text):
        need(len(text) < LARGEST, "the certificate is too long")
        try:
            data = json.loads(text)
            need(data["format"] == FORMAT, f"the format is not {FORMAT!r}")
            need(digest(data) == data["sha256"], "it was changed: its digest is another")
            self._read(data)
        except MALFORMED as error:
            raise Failed(f"the certificate is malformed ({type(error).__name__}: {error})") from None

    def _read(self, data):
        ctx.prec = whole(data["bits"], 53, 4096, "the number of bits")
        self.names = names = [str(name) for name in data["parameters"]]
        good = all(name.isidentifier() and name not in {"u", "pi", *FUNCTIONS} for name in names)
        need(good and len(names) == len(set(names)) == 2, "there must be two parameters with names of their own")
        self.equation = Equation(data["equation"]["kind"], data["equation"]["pieces"], names)
        self.sides = [tuple(rational(end) for end in side) for side in data["rectangle"]]
        need(all(low < high for low, high in self.sides), "the rectangle must have sides of positive length")
        self.panels = data["panels"]["list"]
        across = [whole(n, 1, 4096, "a number of panels") for n in data["panels"]["across"]]
        self.places = places(across, data["panels"]["layout"])
        need(len(self.panels) == len(self.places), "the panels do not cover the rectangle")
        self.shares = {letter: rational(data["shares"][letter]) for letter in VERDICTS}

    def panel(self, number):
        """The Panel of this number."""
        return Panel(self.equation, within(self.sides, self.places[number]), self.panels[number])

    def statement(self, shares):
        """The theorem in words; `shares`: {verdict: its share of the rectangle}."""
        ((a, b), (c, d)), (first, second) = self.sides, self.names
        start, lines = "0", ["Consider y'' + z(u) y = 0, where"]
        for _, _, end, z in self.equation.pieces:
            lines.append(f"    z(u) = {z.text}    for {start} <= u <= {end},")
            start = end
        even = f"    z(-u) = z(u), z({start} + u) = z({start} - u), and the period T = 2 ({start})."
        cells = [f"{sum(panel['cells'].count(letter) for panel in self.panels):,}" for letter in VERDICTS]
        lines += [
            even if self.equation.even else f"    z(u + T) = z(u), and the period T = {start}.",
            f"The rectangle {a} <= {first} <= {b}, {c} <= {second} <= {d} is divided into cells.",
            f"In each of the {cells[0]} stable cells, borders included, |D| < 2: all solutions are bounded.",
            f"In each of the {cells[1]} unstable cells, borders included, |D| > 2: a solution grows exponentially.",
            f"Of the {cells[2]} open cells nothing is stated. (D is the trace of the monodromy matrix over T.)",
        ]
        for letter in (STABLE, UNSTABLE):
            bounds = (shares[letter], False), (shares[letter] + shares[OPEN], True)
            area = " to ".join(decimal((b - a) * (d - c) * part, 12, up) for part, up in bounds)
            percent = " to ".join(decimal(100 * part, 4, up) for part, up in bounds)
            lines.append(f"The {VERDICTS[letter]} points have an area of {area}: {percent} % of the rectangle.")
        return "\n".join(lines)


def places(across, layout):
    """The panels as parts of both sides, the second varying first; of a layout such as "..+....", "+" is quartered."""
    need(len(across) == 2 and across[0] * across[1] <= 2**16, "too many panels, or not across two sides")
    found, sides = [], ([(Fraction(k, n), Fraction(k + 1, n)) for k in range(n)] for n in across)
    waiting = list(product(*sides))[::-1]
    for letter in layout:
        need(waiting, "the layout has more panels than cover the rectangle")
        place = waiting.pop()
        if letter == SPLIT:
            waiting += quarters(place)
        else:
            found.append(place)
    need(not waiting, "the layout does not cover the rectangle")
    return found


def quarters(place):
    """The quarters of a part of the rectangle, the first one last."""
    halves = [((start, (start + end) / 2), ((start + end) / 2, end)) for start, end in place]
    return [(halves[0][right], halves[1][upper]) for upper, right in QUARTERS]


def within(sides, place):
    """Parts of the sides as numbers."""
    return [tuple(low + (high - low) * end for end in part) for (low, high), part in zip(sides, place, strict=True)]


def weighed(places, found):
    """{verdict: its share of the rectangle} from its shares of the panels."""
    pairs = [((b - a) * (d - c), shares) for ((a, b), (c, d)), shares in zip(places, found, strict=True)]
    return {letter: sum((area * shares[letter] for area, shares in pairs), Fraction(0)) for letter in VERDICTS}


def digest(data):
    """The SHA-256 of all but itself."""
    data = {key: value for key, value in data.items() if key != "sha256"}
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()


def decimal(number, digits, up):
    """A rational number with so many decimals, rounded up or down."""
    scaled = (ceil if up else floor)(number * 10**digits)
    return f"{scaled // 10**digits}.{scaled % 10**digits:0{digits}d}"


once_read = lru_cache(maxsize=1)(Certificate)


def proved(text, number):
    """The shares of the verdicts of one panel, or why they are not proved; perhaps in a process of its own."""
    try:
        return once_read(text).panel(number).check()
    except (Failed, *MALFORMED) as error:
        return f"panel {number + 1}: {str(error) or type(error).__name__}"


def check(text, processes=1):
    """The statement that the text of a certificate proves; raises Failed if it proves none."""
    certificate = once_read(text)
    with get_context("spawn").Pool(processes) if processes > 1 else nullcontext() as pool:
        found = list((pool.imap if pool else map)(partial(proved, text), range(len(certificate.panels))))
    for shares in found:
        need(isinstance(shares, dict), shares)
    total = weighed(certificate.places, found)
    need(total == certificate.shares, "the shares of the verdicts are not those that it states")
    return certificate.statement(total)


def main(arguments=None):
    """Print PROVED and the statement (exit 0), or NOT PROVED and the first thing that fails (exit 1)."""
    parser = ArgumentParser(prog="survey-check", description="Prove the stability map that a certificate states.")
    parser.add_argument("certificate", metavar="OUT.cert")
    parser.add_argument("-j", "--processes", type=int, default=1, metavar="N", help="processes; 1 by default")
    given = parser.parse_args(arguments)
    try:
        with open(given.certificate, encoding="utf-8") as file:
            statement = check(file.read(LARGEST), given.processes)
    except (Failed, OSError, UnicodeDecodeError) as failed:
        print(f"NOT PROVED: {given.certificate}: {failed}")
        return 1
    print(f"PROVED\n{statement}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
