#!/usr/bin/env python3
"""survey-check OUT.cert: proves the stability map that a certificate states, or says what fails.

This file needs Python and python-flint (ball arithmetic, https://flintlib.org) alone: copy it, read it, and run
`python checker.py OUT.cert`. It believes no number of the certificate. What is proved is printed by
`Certificate.statement`; the lemmas have their proofs in the documentation, on the page "Proved maps".

HILL'S EQUATION y'' + z(u, p) y = 0, with one or two real parameters p in an interval (a row) or a rectangle (a map).
A certificate gives z by formulas on consecutive pieces of [0, S], and a kind:
    even      z is continued by z(-u) = z(u) and z(S + u) = z(S - u), with the period T = 2 S;
    periodic  z is continued with the period T = S.
y1, y2 are the solutions with y1 = 1, y1' = 0 and y2 = 0, y2' = 1 at u = 0, and D = y1(T) + y2'(T).

1. VERDICTS (`verdict`). If |D| < 2 all solutions are bounded, if |D| > 2 one grows exponentially (Magnus and Winkler,
   Hill's Equation, 1966, theorem 1.1). If z is even, D - 2 = 4 y1'(S) y2(S) and D + 2 = 4 y1(S) y2'(S): the signs of
   the four factors y1, y1', y2, y2' at S decide. If not, the factors are 2 - D and 2 + D.
2. A STEP (`Equation.steps`). Let z be analytic and |z| <= Z on the disc |u - u0| <= R, w^2 >= Z, w > 0, 0 < h < R, and
   x = h/R. On every ray from u0 the maximum norm of v = (w y, y') satisfies |v|' <= w |v|, so |w y| <= e^(wR) |v(u0)|
   on the disc, and by Cauchy the Taylor coefficients of y satisfy |a_n| <= M R^-n, M = e^(wR) max(|y|, |y'|/w) at u0.
   At u0 + h the sums up to degree N are off by at most M x^(N+1) / (1 - x), for y' by (M/R) (N+1) x^N / (1 - x)^2.
3. GROWTH (`growth`). For complex z and a constant w > 0, the Euclidean norm of (sqrt(w) y, y'/sqrt(w)) grows at most
   at the rate |w^2 - conj z| / (2 w), the logarithmic norm of [[0, w], [-z/w, 0]]. Where w is changed from v to w it
   grows at most by max(v/w, w/v)^(1/2). So with constants w on parts of [0, S] it grows at most by the product of all.
4. PARAMETERS (`Panel`). A panel is a part of the rectangle, mapped to [-1, 1]^2. If a factor f is analytic, |f| <= M,
   for p1 in the Bernstein ellipse E_r (semi-axes (r +- 1/r)/2) and real p2, its interpolant I1 f at the n Chebyshev
   points of the first kind satisfies |f - I1 f| <= 4 M sum r^-k, |f' - (I1 f)'| <= 4 M sum k^2 r^-k over k >= n: its
   coefficients are at most 2 M r^-k, and T_k is interpolated by 0 or some +-T_j, j < n (Trefethen, Approximation Theory
   and Approximation Practice, theorem 8.1, chapter 4). In two variables |f - I1 I2 f| <= |f - I1 f| + L1 |f - I2 f|,
   where L = 1 + (2/pi) log n is at least the norm of I (Rivlin, The Chebyshev Polynomials, 1974). Errors of d at most
   at the nodes change the interpolant by at most L1 d, or L1 L2 d, and its derivative by (n - 1)^2 L1 d (Markov).
5. CELLS (`Panel.cell`). An interpolant in Bernstein's polynomials of a cell lies there between its least and its
   largest coefficient. De Casteljau's matrices give the coefficients on halves. A factor is positive on a cell, its
   border included, if all coefficients (which are balls) exceed the bound of 4; negative likewise.
6. EDGES (`Panel.edge`). On a row's cell of width d the interpolant's derivative lies between the least and the largest
   (n - 1)/d times a difference of neighbouring coefficients. If they exceed the bound of 4, and the factor has opposite
   signs at the ends, where its interpolant is the first and the last coefficient, it has one simple zero there.
"""

import ast
import hashlib
import json
import sys
from argparse import ArgumentParser
from contextlib import nullcontext
from fractions import Fraction
from functools import cached_property, lru_cache, partial, reduce
from itertools import pairwise, product
from math import ceil, comb, floor, log10, prod
from multiprocessing import get_context
from operator import add, mul, neg, sub, truediv

from flint import acb, arb, arb_mat, arb_poly, arb_series, ctx

FORMAT = "survey-certificate 1"
STABLE, UNSTABLE, OPEN, SPLIT = "s", "u", "o", "+"  # cells; "+" is followed by its halves or quarters
EDGES = "1234"  # cells of a row: the factor of this number has exactly one zero in it, and no other factor has one
VERDICTS = {STABLE: "stable", UNSTABLE: "unstable", OPEN: "open"}
RATIO, FAR = arb(1) / 4, 8  # h / R of a step; a step is halved unless w R < FAR
SHORTEST, SMALLEST = Fraction(1, 2**20), Fraction(1, 2**16)  # step, and part that bounds growth, as parts of a piece
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
    if n < 2:
        return x if n else arb(1)
    return x * power(x * x, n // 2) if n % 2 else power(x * x, n // 2)


FUNCTIONS = {  # log and sqrt are not a number for complex balls that meet their branch cut, where they are not analytic
    "sin": lambda x: x.sin(), "cos": lambda x: x.cos(), "exp": lambda x: x.exp(),
    "log": lambda x: x.log(analytic=True) if isinstance(x, acb) else x.log(),
    "sqrt": lambda x: x.sqrt(analytic=True) if isinstance(x, acb) else x.sqrt(),
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
        for text, (operands, operation) in self.parts.items():
            values[text] = operation(*(values[operand] for operand in operands))
        return values[self.whole]

    def _read(self, node):
        """The text of a node; `parts` has its operands, of which those before it have the values, and its operation."""
        text = ast.get_source_segment(self.text, node)
        if text in self.names or text in self.parts:
            return text
        match node:
            case ast.Constant(value=int() | float()) if not isinstance(node.value, bool):
                operands, operation = [], partial(arb, exact(Fraction(text)))
            case ast.UnaryOp(op=ast.USub()):
                operands, operation = [node.operand], neg
            case ast.BinOp(op=ast.Pow(), right=ast.Constant()):
                operands, operation = [node.left], partial(power, n=whole(node.right.value, 0, 64, "an exponent"))
            case ast.BinOp() if type(node.op) in OPERATIONS:
                operands, operation = [node.left, node.right], OPERATIONS[type(node.op)]
            case ast.Call(func=ast.Name(id=name), args=[_], keywords=[]) if name in FUNCTIONS:
                operands, operation = node.args, FUNCTIONS[name]
            case _:
                raise Failed(f"{text!r} is not allowed in a formula")
        self.parts[text] = [self._read(operand) for operand in operands], operation
        return text


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

        return list(self.bisected(1, SHORTEST, tried, "z is too large, or singular too near to the real axis"))

    def bisected(self, count, shortest, tried, why):
        """What `tried(start, length, z)` finds on parts of the pieces of [0, S], which are halved where it is None."""
        for start, end, _, z in self.pieces:
            waiting = [(Fraction(k, count), Fraction(1, count)) for k in reversed(range(count))]
            while waiting:
                low, length = waiting.pop()
                need(length > shortest, why)
                value = tried(start + (end - start) * exact(low), (end - start) * exact(length), z)
                if value is None:
                    waiting += [(low + length / 2, length / 2), (low, length / 2)]
                else:
                    yield value

    def factors(self, steps, order, point):
        """The factors for the parameters `point` (balls)."""
        ctx.cap = order + 1
        reached = arb_mat([[1, 0], [0, 1]])  # (y1, y2) and (y1', y2')
        for u0, h, z, missed in steps:
            series = arb_series(z(u=arb_series([u0, 1]), **point))
            reached = step([series[n] for n in range(order - 1)], h, missed) * reached
        y1, y2, dy1, dy2 = reached.entries()
        return (y1, dy1, y2, dy2) if self.even else (2 - y1 - dy2, 2 + y1 + dy2)

    def cover(self, sides, name, r):
        """Parameters that cover the upper half of E_r of one of them: (arcs of its border, boxes of its inside)."""
        real = {name: centre + half * arb(0, 1) for name, (centre, half) in zip(self.names, sides, strict=True)}
        centre, half = sides[self.names.index(name)]
        across, up = half * (r + 1 / r) / 2, half * (r - 1 / r) / 2
        arcs = [acb(centre + across * x.cos_pi(), up * x.sin_pi()) for x in parts(ARCS)]
        boxes = [acb(centre + across * (2 * x - 1), up * y) for x, y in product(parts(COVER), repeat=2)]
        return [[{**real, name: place} for place in places] for places in (arcs, boxes)]

    def sizes(self, sides, name, r, least):
        """Bounds of the factors (without the 2 of 2 - D, which I1 reproduces) for one parameter in E_r, if z is finite,
        so that it is analytic, on boxes that cover the upper half of E_r. The lower half is its mirror image."""
        arcs, boxes = self.cover(sides, name, r)

        def tried(start, length, z):
            u = start.union(start + length)
            values = [acb(z(u=u, **place)) for place in arcs]
            sharp = all(length * x.rad() < WIDE * (1 + x.abs_upper().sqrt()) for x in values)
            if sharp and all(acb(z(u=u, **place)).is_finite() for place in boxes):
                return [(length, value) for value in values]

        found = self.bisected(BOXES, SMALLEST, tried, f"z is singular, or changes too fast, for complex {name}")
        grown = zip(*(growth(steps, least) for steps in zip(*found, strict=True)), strict=True)
        y1, dy1, y2, dy2 = (reduce(arb.max, bounds) for bounds in grown)
        return (y1, dy1, y2, dy2) if self.even else (y1 + dy2, y1 + dy2)


def growth(steps, least):
    """Bounds of |y1|, |y1'|, |y2|, |y2'| at S, from [(length of a part of [0, S], z there)]; w is at least `least`."""
    steps = [(length, z, least.max(z.mid().abs_upper().sqrt().mid())) for length, z in steps]
    exponent = sum((length * (w * w - z.conjugate()).abs_upper() / (2 * w) for length, z, w in steps), arb(0))
    grown = exponent.exp() * prod((v / w).max(w / v).sqrt() for (*_, v), (*_, w) in pairwise(steps))
    first, last = steps[0][2].sqrt(), steps[-1][2].sqrt()
    return grown * first / last, grown * first * last, grown / (first * last), grown * last / first


def step(z_n, h, missed):
    """The matrix that takes (y, y') over a step, from the Taylor coefficients of z and what the sums leave out."""
    columns = []
    for a, (y, dy) in zip(([arb(1), arb(0)], [arb(0), arb(1)]), missed, strict=True):
        for n in range(len(z_n)):
            a.append(-sum(map(mul, z_n, a[n::-1]), arb(0)) / ((n + 1) * (n + 2)))
        columns.append([arb_poly(a)(h) + y * arb(0, 1), arb_poly(a).derivative()(h) + dy * arb(0, 1)])
    return arb_mat(columns).transpose()


class Panel:
    """A part of the rectangle on which the factors are nearly polynomials; `data`: how to prove that, and its cells."""

    def __init__(self, equation, sides, data):
        self.equation, self.cells = equation, data["cells"]
        self.sides = [(exact((low + high) / 2), exact((high - low) / 2)) for low, high in sides]
        self.counts = [whole(n, 2, 40, "a number of nodes") for n in data["nodes"]]
        self.ellipses, self.rates = ([exact(rational(x)) for x in data[key]] for key in ("ellipses", "rates"))
        need(all(r > 1 for r in self.ellipses) and all(w > 0 for w in self.rates), "an r <= 1, or a w <= 0")
        self.order = whole(data["order"], 2, 400, "an order")
        self.halves = [halving(n) for n in self.counts]

    @cached_property
    def factors(self):
        """[(Bernstein coefficients on the panel, how far it and, on a row, its slope are from them)] of each factor."""
        with ctx.workprec(3 * ctx.prec):  # inverses lose digits
            nodes = [[(arb.pi() * (2 * i + 1) / (2 * n)).cos() for i in range(n)] for n in self.counts]
            matrices = [bernstein(at).inv() for at in nodes]
        steps = self.equation.steps(self.place([arb(0, 1)] * len(nodes)), self.order)
        values = [self.equation.factors(steps, self.order, self.place(at)) for at in product(*nodes)]
        sizes = list(map(partial(self.equation.sizes, self.sides), self.equation.names, self.ellipses, self.rates))
        return [self._factor(matrices, *own) for own in zip(zip(*values, strict=True), *sizes, strict=True)]

    def place(self, x):
        """{name: parameter} at x in [-1, 1]^2."""
        each = zip(self.equation.names, self.sides, x, strict=True)
        return {name: middle + half * at for name, (middle, half), at in each}

    def _factor(self, matrices, values, *sizes):
        """The same of one factor, from its values at the nodes and its sizes on the ellipses."""
        counts, norms = self.counts, [1 + 2 / arb.pi() * arb(n).log() for n in self.counts]
        error = reduce(arb.max, (x.rad() for x in values))
        first, *second = (4 * m * r ** (1 - n) / (r - 1) for n, r, m in zip(counts, self.ellipses, sizes, strict=True))
        bound = first + sum((norms[0] * other for other in second), prod(norms) * error)
        n, q = counts[0], 1 / (self.ellipses[0] - 1)  # the sum of k^2 r^-k over k >= n is that of r^-k, times:
        slope = first * (n * n + 2 * n * q + q * (1 + 2 * q)) + (n - 1) ** 2 * norms[0] * error
        table = arb_mat(n, len(values) // n, [x.mid() for x in values])
        return transformed(table, matrices), bound.upper(), slope.upper()

    def check(self):
        """Raises Failed unless every cell is what it is said to be."""
        for number, (letter, part) in enumerate(walk(self.cells, [()], self.parts), 1):
            cell = letter != OPEN and self.cell(*part)
            good = not cell or letter == verdict(cell[1]) or letter == self.edge(*cell)
            need(good, f"cell {number} is not proved to be {VERDICTS.get(letter, 'an edge')}")

    def parts(self, part):
        """What `cell` takes for the halves or quarters of a cell, in the order of `halved`."""
        above = self.cell(*part)
        return [(above, half[::-1]) for half in product((1, 0), repeat=len(self.counts))]

    def cell(self, above=None, half=()):
        """({factor: its coefficients, where its sign is unknown}, {factor: 1, -1 or 0, its sign everywhere}, width) of
        the panel, or of a part of the cell `above`: `half` of each of its sides."""
        if above is None:
            tables, signs, width = {i: table for i, (table, *_) in enumerate(self.factors)}, {}, arb(2)
        else:
            matrices = [halves[at] for halves, at in zip(self.halves, half, strict=True)]
            tables = {i: transformed(table, matrices) for i, table in above[0].items()}
            signs, width = above[1], above[2] / 2
        signs = signs | {i: sign(table.entries(), self.factors[i][1]) for i, table in tables.items()}
        return {i: table for i, table in tables.items() if not signs[i]}, signs, width

    def edge(self, tables, _, width):
        """The letter of a row's cell in which exactly one factor has a zero, and exactly one; else None."""
        if len(self.counts) > 1 or len(tables) != 1:
            return None
        [(i, table)] = tables.items()
        (_, bound, slope), values = self.factors[i], table.entries()
        rises = [(len(values) - 1) * (after - before) for before, after in pairwise(values)]
        return (
            EDGES[i]
            if sign(values[:1], bound) * sign(values[-1:], bound) == -1 and sign(rises, slope * width)
            else None
        )


def verdict(signs):
    """What the signs {number of a factor: 1, -1, or 0 if it is unknown} prove."""
    if len(signs) == 4:
        signs = {0: -signs[1] * signs[2], 1: signs[0] * signs[3]}  # of 2 - D and of 2 + D
    return UNSTABLE if -1 in signs.values() else STABLE if signs[0] == signs[1] == 1 else OPEN


def sign(values, bound):
    """1 or -1 if all values, and all that differs from one by at most `bound`, have this sign; else 0."""
    return int(all(x > bound for x in values)) - int(all(x < -bound for x in values))


def transformed(table, matrices):
    """A table with a matrix applied to each of its one or two sides."""
    table = matrices[0] * table
    return table * matrices[1].transpose() if len(matrices) > 1 else table


def bernstein(nodes):
    """The values of Bernstein's polynomials of degree n - 1 on [-1, 1] at n nodes."""
    d, pairs = len(nodes) - 1, [((1 + x) / 2, (1 - x) / 2) for x in nodes]
    return arb_mat([[comb(d, j) * power(x, j) * power(y, d - j) for j in range(d + 1)] for x, y in pairs])


def halving(n):
    """Bernstein coefficients on an interval -> on its lower and on its upper half (de Casteljau)."""
    lower = [[arb(comb(i, j)) / 2**i for j in range(n)] for i in range(n)]
    return arb_mat(lower), arb_mat([row[::-1] for row in lower[::-1]])


def walk(letters, parts, split):
    """(letter, part) of all parts that are not SPLIT into others; raises Failed unless there is a letter for each."""
    waiting = parts[::-1]
    for letter in letters:
        need(waiting, "there are more cells or panels than cover the whole")
        part = waiting.pop()
        if letter == SPLIT:
            waiting += split(part)
        else:
            yield letter, part
    need(not waiting, "the cells or panels do not cover the whole")


def halved(place):
    """The halves or quarters of a place, which is (start, end) of each side; the first one last."""
    halves = [[((start + end) / 2, end), (start, (start + end) / 2)] for start, end in place]
    return [part[::-1] for part in product(*halves[::-1])]


def size(place):
    """Its length or area."""
    return prod(end - start for start, end in place)


@lru_cache(maxsize=1)  # each process reads it once
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
        need(good and len(names) == len(set(names)) in (1, 2), "there must be one or two parameters, with own names")
        self.equation = Equation(data["equation"]["kind"], data["equation"]["pieces"], names)
        self.sides = [(rational(low), rational(high)) for low, high in data["rectangle"]]
        good = len(self.sides) == len(names) and all(low < high for low, high in self.sides)
        need(good, "the rectangle must have a side of positive length for each parameter")
        pairs = list(zip(places(self.sides, data["panels"]), data["panels"]["list"], strict=True))
        self.panels = [Panel(self.equation, *pair) for pair in pairs]
        self.cells = [cell for place, panel in pairs for cell in walk(panel["cells"], [place], halved)]
        self.letters = "".join(letter for letter, _ in self.cells)
        need(set(self.letters) <= {*VERDICTS, *(EDGES if len(names) == 1 else "")}, "there are unknown cells")
        self.shares = dict.fromkeys(VERDICTS, Fraction(0))
        for letter, place in self.cells:
            self.shares[letter if letter in VERDICTS else OPEN] += size(place) / size(self.sides)
        stated = {letter: rational(data["shares"][letter]) for letter in VERDICTS}
        need(stated == self.shares, "the shares of the verdicts are not those of its cells")

    def statement(self):
        """The theorem in words."""
        row, start, lines = len(self.sides) == 1, "0", ["Consider y'' + z(u) y = 0, where"]
        for _, _, end, z in self.equation.pieces:
            lines.append(f"    z(u) = {z.text}    for {start} <= u <= {end},")
            start = end
        even = f"    z(-u) = z(u), z({start} + u) = z({start} - u), and the period T = 2 ({start})."
        ends = ", ".join(f"{low} <= {name} <= {high}" for name, (low, high) in zip(self.names, self.sides, strict=True))
        counts = ", ".join(f"{self.letters.count(letter):,} {word}" for letter, word in VERDICTS.items())
        lines += [
            even if self.equation.even else f"    z(u + T) = z(u), and the period T = {start}.",
            "D is the trace of the monodromy matrix over T. Stable: |D| < 2, all solutions are bounded.",
            "Unstable: |D| > 2, a solution grows exponentially. Open: nothing is stated.",
            f"{ends} consists of cells, borders included: {counts}{', and edges:' if row else '.'}",
            *(self._edges(start) if row else ()),
        ]
        for letter in (STABLE, UNSTABLE):
            low, high, area = self.shares[letter], self.shares[letter] + self.shares[OPEN], size(self.sides)
            what = f"{'a length' if row else 'an area'} of {between(low * area, high * area, 12)}"
            lines.append(f"The {VERDICTS[letter]} points have {what}: {between(100 * low, 100 * high, 4)} %.")
        return "\n".join(lines)

    def _edges(self, end):
        """What is stated of the edges of a row."""
        factors = [f"{f}({end})" for f in ("y1", "y1'", "y2", "y2'")] if self.equation.even else ["2 - D", "2 + D"]
        lines = []
        for (letter, place), after in zip(self.cells, self.letters[1:] + OPEN, strict=True):
            if letter in EDGES:
                where, f = between(*place[0], 3 - floor(log10(size(place)))), factors[EDGES.index(letter)]
                lines.append(f"    {where}: {f} = 0 at one point, {VERDICTS.get(after, 'an edge')} after it;")
        most = "at least" if OPEN in self.letters else "exactly"
        return [*lines, f"so that stability changes at {most} {len(lines)} points, one in each of these edges."]


def places(sides, panels):
    """Those of the panels, the last side varying first; in a layout such as "..+....", "+" is divided."""
    across = [whole(n, 1, 4096, "a number of panels") for n in panels["across"]]
    need(prod(across) <= 2**16, "there are too many panels")
    ends = [[a + (b - a) * Fraction(k, n) for k in range(n + 1)] for n, (a, b) in zip(across, sides, strict=True)]
    return [place for _, place in walk(panels["layout"], list(product(*map(pairwise, ends))), halved)]


def digest(data):
    """The SHA-256 of all but itself."""
    others = json.dumps({key: value for key, value in data.items() if key != "sha256"}, sort_keys=True)
    return hashlib.sha256(others.encode()).hexdigest()


def between(low, high, digits):
    """Two rational numbers with so many decimals, the first one rounded down, the second one up."""
    ends = floor(low * 10**digits), ceil(high * 10**digits)
    return " to ".join(f"{'-' * (n < 0)}{abs(n) // 10**digits}.{abs(n) % 10**digits:0{digits}d}" for n in ends)


def proved(text, number):
    """Why a panel is not proved, if it is not; perhaps in a process of its own."""
    try:
        Certificate(text).panels[number].check()
    except (Failed, *MALFORMED) as error:
        return f"panel {number + 1}: {str(error) or type(error).__name__}"


def check(text, processes=1):
    """The statement that the text of a certificate proves; raises Failed if it proves none."""
    certificate = Certificate(text)
    with get_context("spawn").Pool(processes) if processes > 1 else nullcontext() as pool:
        for why in (pool.imap if pool else map)(partial(proved, text), range(len(certificate.panels))):
            need(why is None, why)
    return certificate.statement()


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
