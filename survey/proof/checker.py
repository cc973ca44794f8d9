"""survey-check OUT.cert: proves the stability map that a certificate states, or says what fails.

It needs Python and python-flint (ball arithmetic, https://flintlib.org) alone: `python checker.py OUT.cert`. It takes
no number of the certificate on trust. The lemmas have their proofs in the documentation, on the page "Proved maps".

THE EQUATION is X' = K(u, p) Y, Y' = L(u, p) X with symmetric K, L of m rows, and one or two real parameters p in an
interval (a row) or a rectangle (a map). A certificate gives formulas on consecutive pieces of [0, S], and a kind:
    even, periodic  m = 1, K = 1, L = -z: Hill's equation y'' + z(u, p) y = 0, X = y, Y = y';
    reversible      m = 2, the entries k11, k12, k22 of K and l11, l12, l22 of L.
A periodic z is continued with the period T = S, all else by K(-u) = K(u) and K(S + u) = K(S - u), so that T = 2 S.
The matrices X1, Y1, X2, Y2 are the solutions at S with X = 1, Y = 0 and with X = 0, Y = 1 at u = 0.

1. VERDICTS (`verdict`) follow from the signs of *factors*. Periodic: 2 - D, 2 + D, D = X1 + Y2. Else multipliers have
   r + 1/r = 2 + 4 w, w the eigenvalues of W = X2* Y1 = Y2* X1 - 1 (* transposes), and the factors are the determinants
   of X1, Y1, X2, Y2 and, if m = 2, t = tr W + 2, 2 - t and c = t^2 - 4 det Y2* X1 = (w1 - w2)^2. Stable: -1 < w < 0,
   det Y2* X1 > 0, (-1)^m det W > 0 and, if m = 2, 0 < t < 2 and c > 0 or, for W is then similar to a symmetric matrix,
   det X1* Y1 > 0. Unstable: one of the same numbers, but for the last one, is negative.
2. A STEP (`Equation.steps`). If |K| <= a, |L| <= b for |u - u0| <= R, w > 0, q = max(w a, b/w), x = h/R < 1, then sums
   of v = (w X, Y) at u0 + h up to degree N are off by at most e^(qR) |v(u0)| x^(N+1)/(1 - x), in the maximum norm.
3. GROWTH (`growth`). For complex K, L, w > 0 and the diagonal matrix d of sqrt(w) and, if m = 2, 1/sqrt(w), Euclid's
   norm of (d X, Y/d) grows at most at the rate |d K d + conj(L/d)/d| / 2, and by max(v/w, w/v)^(1/2) where v becomes w.
4. PARAMETERS (`Panel`). If f is analytic, |f| <= M, for p1 in the ellipse E_r (semi-axes (r +- 1/r)/2) about a panel,
   mapped to [-1, 1]^2, and real p2, its interpolant I1 f at n Chebyshev points has |f - I1 f| <= 4 M sum r^-k and
   |f' - (I1 f)'| <= 4 M sum k^2 r^-k over k >= n; |f - I1 I2 f| <= |f - I1 f| + L1 |f - I2 f|, L = 1 + (2/pi) log n.
   Errors of d at the nodes change the interpolant by at most L1 d, or L1 L2 d, its derivative by (n - 1)^2 L1 d.
5. CELLS (`Panel.cell`). A factor is positive on a closed cell if all Bernstein coefficients of its interpolant there,
   by de Casteljau's matrices, exceed the bound of 4; negative likewise.
6. EDGES (`Panel.edge`). A factor of opposite signs at the ends of a row's cell, of width d, has one simple zero there
   if (n - 1)/d times the differences of neighbouring coefficients all exceed the bound of 4 for f', or all with -f.
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

FORMAT = "survey-certificate 2"
KINDS = {  # of equations: entries, factors, and in words the equation and its continuation beyond S, which is {0}
    "even": ("z", ["y1", "y1'", "y2", "y2'"], "y'' + z(u) y = 0", "z(-u) = z(u), z({0} + u) = z({0} - u), T = 2 ({0})"),
    "periodic": ("z", ["2 - D", "2 + D"], "y'' + z(u) y = 0", "z(u + T) = z(u), T = {0}"),
    "reversible": ("k11 k12 k22 l11 l12 l22", ["det X1", "det Y1", "det X2", "det Y2", "t", "2 - t", "c"],
                   "X' = K(u) Y, Y' = L(u) X with symmetric K, L of two rows",
                   "K(-u) = K(u), K({0} + u) = K({0} - u), L likewise, T = 2 ({0})")}  # fmt: skip
STABLE, UNSTABLE, OPEN, SPLIT = "s", "u", "o", "+"  # cells; "+" is followed by its halves or quarters
EDGES = "1234567"  # cells of a row: the factor of this number has exactly one zero in it, and no other factor has one
VERDICTS = {STABLE: "stable", UNSTABLE: "unstable", OPEN: "open"}
ZERO, UNIT = arb(0), arb(0, 1)  # UNIT: the ball [-1, 1]
RATIO, FAR = arb(1) / 4, 8  # h / R of a step; a step is halved unless w R < FAR
SHORTEST, SMALLEST = Fraction(1, 2**20), Fraction(1, 2**16)  # step, and part that bounds growth, as parts of a piece
ARCS, SIDE = ([(arb(k) / n).union(arb(k + 1) / n) for k in range(n)] for n in (24, 4))  # of half an ellipse, a box
WIDE = arb(1) / 8  # a part of [0, S] is halved while the ball of z times its length exceeds this, relative to sqrt |z|
BOXES, LARGEST = 32, 2**23  # parts of a piece of [0, S], at least; characters of a certificate
MALFORMED = (KeyError, TypeError, ValueError, IndexError, AttributeError, RecursionError, ArithmeticError)


class Failed(Exception):
    """The certificate proves nothing; says why."""


def need(condition, why):
    if not condition:
        raise Failed(why)


def exact(number):  # the ball of a rational number
    return arb(number.numerator) / number.denominator


def rational(text):  # the rational number that a text such as '0.99' or '-7/3' denotes
    need(isinstance(text, str) and len(text) < 80, "a number is not a short text")
    return Fraction(text)


def integer(value, least, most, what):
    need(type(value) is int and least <= value <= most, f"{what} is not a whole number from {least} to {most}")
    return value


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
            self.integer = self._read(ast.parse(text, mode="eval").body)
        except (SyntaxError, ValueError, RecursionError, MemoryError):
            raise Failed(f"this is not a formula: {text[:80]!r}") from None

    def __call__(self, **values):  # its value for balls, complex balls, or power series of balls
        return self.known(values)[self.integer]

    def known(self, values):  # these values, and those of all parts that follow from them
        values = {"pi": arb.pi(), **values}
        for text, (operands, operation) in self.parts.items():
            if text not in values and values.keys() >= {*operands}:
                values[text] = operation(*[values[operand] for operand in operands])
        return values

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
                exponent = integer(node.right.value, 0, 64, "an exponent")
                operands, operation = [node.left], lambda x: prod([x] * exponent, start=arb(1))
            case ast.BinOp() if type(node.op) in OPERATIONS:
                operands, operation = [node.left, node.right], OPERATIONS[type(node.op)]
            case ast.Call(func=ast.Name(id=name), args=[_], keywords=[]) if name in FUNCTIONS:
                operands, operation = node.args, FUNCTIONS[name]
            case _:
                raise Failed(f"{text!r} is not allowed in a formula")
        self.parts[text] = [self._read(operand) for operand in operands], operation
        return text


class Equation:
    """X' = K(u, p) Y, Y' = L(u, p) X on [0, S]; `pieces`: [(end, formulas of K and L)] from 0 to S; `names` of p."""

    def __init__(self, kind, pieces, names):
        need(kind in KINDS and 0 < len(pieces) <= 100, "an unknown kind of equation, or not 1 to 100 pieces of [0, S]")
        self.kind, self.names, self.pieces, start = kind, names, [], arb(0)
        for end, *entries in pieces:
            end = Formula(end, [])
            good = end() > start and len(entries) == len(KINDS[kind][0].split())
            need(good, "the ends of the pieces of [0, S] do not increase, or one has another number of formulas")
            self.pieces.append((start, end(), end.text, [Formula(entry, ["u", *names]) for entry in entries]))
            start = end()

    def steps(self, box, order):
        """[({entry: what u gives of it}, h, w, bound of what is left out if |v(u0)| = 1)] for parameters in `box`."""

        def tried(u0, h, entries):
            radius = h / RATIO  # boxes cover the upper half of the disc, and K and L are real on the real axis
            parts = [acb(u0 + radius * (2 * x - 1), radius * y) for x, y in product(SIDE, repeat=2)]
            found = [map(norm, blocks([acb(f(u=u, **box)) for f in entries])) for u in parts]
            upper, lower = (reduce(arb.max, bounds) for bounds in zip(*found, strict=True))
            w = (lower / upper).sqrt().upper() + exact(SHORTEST)
            rate = (w * upper).max(lower / w)
            missed = (rate * radius).exp() * RATIO ** (order + 1) / (1 - RATIO)
            return (u0, entries, h, w, missed) if rate * radius < FAR else None  # or one is not finite there

        found = self.bisected(1, SHORTEST, tried, "K or L is too large, or singular too near to the real axis")
        ctx.cap = order  # what depends on u alone is evaluated once
        return [({f: f.known({"u": arb_series([u0, 1])}) for f in entries}, *own) for u0, entries, *own in found]

    def bisected(self, count, shortest, tried, why):
        """What `tried(start, length, entries)` finds on parts of the pieces of [0, S], halved where it is None."""
        for start, end, _, entries in self.pieces:
            waiting = [(Fraction(k, count), Fraction(1, count)) for k in reversed(range(count))]
            while waiting:
                low, length = waiting.pop()
                need(length > shortest, why)
                value = tried(start + (end - start) * exact(low), (end - start) * exact(length), entries)
                if value is None:
                    waiting += [(low + length / 2, length / 2), (low, length / 2)]
                else:
                    yield value

    def factors(self, steps, order, point):
        """The factors for the parameters `point` (balls)."""
        ctx.cap, over = order, []
        fixed = {f: f.known(point) for *_, entries in self.pieces for f in entries}
        for known, *own in steps:
            series = [arb_series(0) + f.known(fixed[f] | values)[f.integer] for f, values in known.items()]
            over.append(step(blocks(series), order, *own))
        table = reduce(mul, reversed(over)).tolist()
        halves = product((slice(len(table) // 2), slice(len(table) // 2, None)), repeat=2)
        x1, y1, x2, y2 = (arb_mat([row[columns] for row in table[rows]]) for columns, rows in halves)
        dets, trace = [x.det() for x in (x1, y1, x2, y2)], (y2.transpose() * x1).trace()
        if self.kind == "periodic":
            return 2 - dets[0] - dets[3], 2 + dets[0] + dets[3]
        return dets if self.kind == "even" else (*dets, trace, 2 - trace, trace * trace - 4 * dets[0] * dets[3])

    def cover(self, sides, name, r):
        """Parameters that cover the upper half of E_r of one of them: (arcs of its border, boxes of its inside)."""
        real = {name: centre + half * UNIT for name, (centre, half) in zip(self.names, sides, strict=True)}
        centre, half = sides[self.names.index(name)]
        across, up = half * (r + 1 / r) / 2, half * (r - 1 / r) / 2
        arcs = [acb(centre + across * x.cos_pi(), up * x.sin_pi()) for x in ARCS]
        boxes = [acb(centre + across * (2 * x - 1), up * y) for x, y in product(SIDE, repeat=2)]
        return [[{**real, name: region} for region in regions] for regions in (arcs, boxes)]

    def sizes(self, sides, name, r, least):
        """Bounds of the factors (less constants, which I1 reproduces) for one parameter in E_r, if all is analytic."""
        arcs, boxes = self.cover(sides, name, r)

        def tried(start, length, entries):
            u = start.union(start + length)
            values = [[acb(f(u=u, **region)) for f in entries] for region in arcs]
            sharp = all(length * x.rad() < WIDE * (1 + x.abs_upper().sqrt()) for own in values for x in own)
            if sharp and all(acb(f(u=u, **region)).is_finite() for region in boxes for f in entries):
                return [(length, own) for own in values]

        found = self.bisected(BOXES, SMALLEST, tried, f"K or L is singular, or changes too fast, for complex {name}")
        grown = zip(*(growth(steps, least) for steps in zip(*found, strict=True)), strict=True)
        x1, _, _, y2 = norms = [reduce(arb.max, bounds) for bounds in grown]
        n = 2 * x1 * y2  # if m = 2, the first and the last d, of determinant 1, cancel in all factors
        return {"even": norms, "periodic": [x1 + y2] * 2, "reversible": [n / 2] * 4 + [n, n, n * n]}[self.kind]


def blocks(entries):
    """The symmetric matrices K and L, as lists of rows, from z or from their six entries on and above the diagonals."""
    if len(entries) == 1:
        return [[0 * entries[0] + 1]], [[-entries[0]]]
    a, b, c, d, e, f = entries
    return [[a, b], [b, c]], [[d, e], [e, f]]


def norm(matrix):
    """A bound of a symmetric matrix's norm, as an operator in the maximum norm and in the Euclidean one."""
    return reduce(arb.max, (sum((x.abs_upper() for x in row), arb(0)) for row in matrix))


def growth(steps, least):
    """Bounds of the norms of X1, Y1, X2, Y2, from [(length of a part of [0, S], entries there)]; w >= `least`."""
    found = []
    for length, entries in steps:
        upper, lower = blocks(entries)
        w = least.max(lower[0][0].mid().abs_upper().sqrt().mid())
        d, m = (w.sqrt(), 1 / w.sqrt()), range(len(lower))
        sums = [[d[i] * d[j] * upper[i][j] + lower[i][j].conjugate() / (d[i] * d[j]) for j in m] for i in m]
        found.append((length * norm(sums) / 2, w))
    grown = sum((exponent for exponent, _ in found), arb(0)).exp()
    grown *= prod((v / w).max(w / v).sqrt() for (_, v), (_, w) in pairwise(found))
    first, last = found[0][1].sqrt(), found[-1][1].sqrt()
    return grown * first / last, grown * first * last, grown / (first * last), grown * last / first


def step(matrices, order, h, w, missed):
    """The matrix that takes (X, Y) over a step, from Taylor series of K and L; see `Equation.steps`."""
    m, columns, terms = len(matrices[0]), [], []  # v_i' is the sum of a v_j for all (i, j, a) in `terms`
    for (first, second), part in zip(((0, m), (m, 0)), matrices, strict=True):
        terms += [(first + i, second + j, list(a)) for i, row in enumerate(part) for j, a in enumerate(row)]
    scales = [w] * m + [arb(1)] * m
    for column, scale in enumerate(scales):
        v = [[arb(i == column)] for i in range(2 * m)]  # coefficients, the last one first
        for n in range(1, order + 1):
            slopes = [ZERO] * (2 * m)
            for i, j, a in terms:
                slopes[i] = sum(map(mul, a, v[j]), slopes[i])
            v = [[slope / n, *x] for x, slope in zip(v, slopes, strict=True)]
        columns.append([arb_poly(x[::-1])(h) + missed * scale / own * UNIT for x, own in zip(v, scales, strict=True)])
    return arb_mat(columns).transpose()


class Panel:
    """A part of the rectangle on which the factors are nearly polynomials; `data`: how to prove that, and its cells."""

    def __init__(self, equation, sides, data):
        self.equation, self.cells = equation, data["cells"]
        self.sides = [(exact((low + high) / 2), exact((high - low) / 2)) for low, high in sides]
        self.counts = [integer(n, 2, 40, "a number of nodes") for n in data["nodes"]]
        self.ellipses, self.rates = ([exact(rational(x)) for x in data[key]] for key in ("ellipses", "rates"))
        need(all(r > 1 for r in self.ellipses) and all(w > 0 for w in self.rates), "each r must exceed 1, and each w 0")
        self.order = integer(data["order"], 2, 400, "an order")
        self.halves = [halving(n) for n in self.counts]

    @cached_property
    def factors(self):
        """[(Bernstein coefficients on the panel, how far it and, on a row, its slope are from them)] of each factor."""
        with ctx.workprec(3 * ctx.prec):  # inverses lose digits
            nodes = [[(arb.pi() * (2 * i + 1) / (2 * n)).cos() for i in range(n)] for n in self.counts]
            matrices = [bernstein(at).inv() for at in nodes]
        steps = self.equation.steps(self.region([UNIT] * len(nodes)), self.order)
        values = [self.equation.factors(steps, self.order, self.region(at)) for at in product(*nodes)]
        sizes = list(map(partial(self.equation.sizes, self.sides), self.equation.names, self.ellipses, self.rates))
        norms, found = [1 + 2 / arb.pi() * arb(n).log() for n in self.counts], []
        for own, *bounds in zip(zip(*values, strict=True), *sizes, strict=True):
            error, each = reduce(arb.max, (x.rad() for x in own)), zip(self.counts, self.ellipses, bounds, strict=True)
            first, *second = (4 * m * r ** (1 - n) / (r - 1) for n, r, m in each)
            bound = first + sum((norms[0] * other for other in second), prod(norms) * error)
            n, q = self.counts[0], 1 / (self.ellipses[0] - 1)  # the sum of k^2 r^-k over k >= n is that of r^-k, times:
            slope = first * (n * n + 2 * n * q + q * (1 + 2 * q)) + (n - 1) ** 2 * norms[0] * error
            table = arb_mat(n, len(own) // n, [x.mid() for x in own])
            found.append((transformed(table, matrices), bound.upper(), slope.upper()))
        return found

    def region(self, x):  # {name: parameter} at x in [-1, 1]^2
        return {name: c + half * at for name, (c, half), at in zip(self.equation.names, self.sides, x, strict=True)}

    def check(self):
        """Raises Failed unless every cell is what it is said to be."""
        for number, (letter, part) in enumerate(walk(self.cells, [()], self.parts), 1):
            cell = letter != OPEN and self.cell(*part)
            good = not cell or letter == verdict(cell[1]) or letter == self.edge(*cell)
            need(good, f"cell {number} is not proved to be {VERDICTS.get(letter, 'an edge')}")

    def parts(self, part):  # what `cell` takes for the halves or quarters of a cell, in the order of `halved`
        return list(product([self.cell(*part)], [half[::-1] for half in product((1, 0), repeat=len(self.counts))]))

    def cell(self, above=None, half=()):
        """({factor of unknown sign: coefficients}, {factor: sign or 0}, width) of the panel or a part of `above`."""
        if above is None:
            tables, signs, width = {i: table for i, (table, *_) in enumerate(self.factors)}, {}, arb(2)
        else:
            matrices = [halves[at] for halves, at in zip(self.halves, half, strict=True)]
            tables = {i: transformed(table, matrices) for i, table in above[0].items()}
            signs, width = above[1], above[2] / 2
        signs = signs | {i: sign(table.entries(), self.factors[i][1]) for i, table in tables.items()}
        return {i: table for i, table in tables.items() if not signs[i]}, signs, width

    def edge(self, tables, signs, width):
        """The letter of a row's cell in which one factor has a zero, one alone, and stability changes; or None."""
        if len(self.counts) > 1 or len(tables) != 1:
            return None
        [(i, table)] = tables.items()
        (_, bound, slope), values = self.factors[i], table.entries()
        rises = [(len(values) - 1) * (after - before) for before, after in pairwise(values)]
        once = sign(values[:1], bound) * sign(values[-1:], bound) == -1 and sign(rises, slope * width)
        return EDGES[i] if once and {verdict(signs | {i: side}) for side in (1, -1)} == {STABLE, UNSTABLE} else None


def verdict(signs):
    """What the signs {number of a factor: 1, -1, or 0 if it is unknown} prove."""
    signs = [signs[i] for i in range(len(signs))]
    if len(signs) > 2:
        x1, y1, x2, y2, *more = signs
        signs = [x1 * y2, x2 * y1, *more[:2], more[2] or int(x1 * y1 == 1)] if more else [x1 * y2, -x2 * y1]
    return UNSTABLE if -1 in signs else STABLE if 0 not in signs else OPEN


def sign(values, bound):  # 1 or -1 if all values, and all that differs from one by at most `bound`, have it; else 0
    return int(all(x > bound for x in values)) - int(all(x < -bound for x in values))


def transformed(table, matrices):  # a table with a matrix applied to each of its one or two sides
    return matrices[0] * table * (matrices[1].transpose() if len(matrices) > 1 else 1)


def bernstein(nodes):  # the values of Bernstein's polynomials of degree n - 1 on [-1, 1] at n nodes
    d, pairs = len(nodes) - 1, [((1 + x) / 2, (1 - x) / 2) for x in nodes]
    return arb_mat([[prod([x] * j + [y] * (d - j), start=arb(comb(d, j))) for j in range(d + 1)] for x, y in pairs])


def halving(n):  # bernstein coefficients on an interval -> on its lower and on its upper half (de Casteljau)
    lower = [[arb(comb(i, j)) / 2**i for j in range(n)] for i in range(n)]
    return arb_mat(lower), arb_mat([row[::-1] for row in lower[::-1]])


def walk(letters, parts, split):
    """(letter, part) of all parts that are not SPLIT into others; raises Failed unless there is a letter for each."""
    waiting = parts[::-1]
    for letter in letters:
        need(waiting, "there are more cells or panels than cover the rectangle")
        part = waiting.pop()
        if letter == SPLIT:
            waiting += split(part)
        else:
            yield letter, part
    need(not waiting, "the cells or panels do not cover the rectangle")


def halved(region):
    """The halves or quarters of a region, which is (start, end) of each side; the first one last."""
    halves = [[((start + end) / 2, end), (start, (start + end) / 2)] for start, end in region]
    return [part[::-1] for part in product(*halves[::-1])]


def size(region):  # its length or area
    return prod(end - start for start, end in region)


@lru_cache(maxsize=1)  # each process reads it once
class Certificate:
    """What the text of a certificate states; raises Failed, or one of MALFORMED, if it is not one."""

    def __init__(self, text):
        data = json.loads(text)
        need(data["format"] == FORMAT, f"the format is not {FORMAT!r}")
        need(digest(data) == data["sha256"], "it was changed: its digest differs")
        ctx.prec = integer(data["bits"], 53, 4096, "the number of bits")
        self.names = names = [str(name) for name in data["parameters"]]
        good = all(name.isidentifier() and name not in {"u", "pi", *FUNCTIONS} for name in names)
        need(good and len(names) == len(set(names)) in (1, 2), "there must be one or two distinct parameter names")
        self.equation = Equation(data["equation"]["kind"], data["equation"]["pieces"], names)
        self.sides = [(rational(low), rational(high)) for low, high in data["rectangle"]]
        good = len(self.sides) == len(names) and all(low < high for low, high in self.sides)
        need(good, "the rectangle must have a side of positive length for each parameter")
        pairs = list(zip(regions(self.sides, data["panels"]), data["panels"]["list"], strict=True))
        self.panels = [Panel(self.equation, *pair) for pair in pairs]
        self.cells = [cell for region, panel in pairs for cell in walk(panel["cells"], [region], halved)]
        self.letters = "".join(letter for letter, _ in self.cells)
        need(set(self.letters) <= {*VERDICTS, *(EDGES if len(names) == 1 else "")}, "there are unknown cells")
        self.shares = dict.fromkeys(VERDICTS, Fraction(0))
        for letter, region in self.cells:
            self.shares[letter if letter in VERDICTS else OPEN] += size(region) / size(self.sides)
        good = self.shares == {letter: rational(data["shares"][letter]) for letter in VERDICTS}
        need(good, "the shares of the verdicts are not those of its cells")

    def statement(self):  # the theorem in words
        names, factors, equation, beyond = KINDS[self.equation.kind]
        row, start, lines = len(self.sides) == 1, "0", [f"Consider {equation}, where"]
        for _, _, end, entries in self.equation.pieces:
            here = f"    for {start} <= u <= {end},"
            lines += [f"    {name}(u) = {entry.text}{here}" for name, entry in zip(names.split(), entries, strict=True)]
            start = end
        ends = ", ".join(f"{low} <= {name} <= {high}" for name, (low, high) in zip(self.names, self.sides, strict=True))
        counts = ", ".join(f"{self.letters.count(letter):,} {word}" for letter, word in VERDICTS.items())
        lines += [
            f"    {beyond.format(start)}, which is the period.",
            "Stable: all solutions are bounded, and no multiplier over T is 1 or -1.",
            "Unstable: a multiplier over T exceeds 1 in modulus: a solution grows exponentially. Open: no statement.",
            f"{ends} consists of cells, borders included: {counts}{', and edges:' if row else '.'}",
        ]
        number = sum(letter in EDGES for letter in self.letters)
        for (letter, region), after in zip(self.cells, self.letters[1:] + OPEN, strict=True):
            if letter in EDGES:
                where, factor = between(*region[0], 3 - floor(log10(size(region)))), factors[EDGES.index(letter)]
                lines.append(f"    {where}: {factor} at {start} is 0 once, {VERDICTS.get(after, 'an edge')} after it;")
        if row:
            where = f"{number} point{', in this edge' if number == 1 else 's, one in each of these edges'}."
            lines.append(f"stability changes at {'at least' if OPEN in self.letters else 'exactly'} {where}")
        for letter in (STABLE, UNSTABLE):
            low, high, area = self.shares[letter], self.shares[letter] + self.shares[OPEN], size(self.sides)
            what = f"{'a length' if row else 'an area'} of {between(low * area, high * area, 12)}"
            lines.append(f"The {VERDICTS[letter]} points have {what}: {between(100 * low, 100 * high, 4)} %.")
        return "\n".join(lines)


def regions(sides, panels):
    """Those of the panels, the last side varying first; in a layout such as "..+....", "+" is divided."""
    across = [integer(n, 1, 4096, "a number of panels") for n in panels["across"]]
    need(prod(across) <= 2**16, "there are too many panels")
    ends = [[a + (b - a) * Fraction(k, n) for k in range(n + 1)] for n, (a, b) in zip(across, sides, strict=True)]
    return [region for _, region in walk(panels["layout"], list(product(*map(pairwise, ends))), halved)]


def digest(data):  # the SHA-256 of all but itself
    others = json.dumps({key: value for key, value in data.items() if key != "sha256"}, sort_keys=True)
    return hashlib.sha256(others.encode()).hexdigest()


def between(low, high, digits):
    """Two rational numbers with so many decimals, the first one rounded down, the second one up."""
    ends = floor(low * 10**digits), ceil(high * 10**digits)
    return " to ".join(f"{'-' * (n < 0)}{abs(n) // 10**digits}.{abs(n) % 10**digits:0{digits}d}" for n in ends)


def proved(text, number):  # why a panel is not proved, if it is not; perhaps in a process of its own
    try:
        Certificate(text).panels[number].check()
    except (Failed, *MALFORMED) as error:
        return f"panel {number + 1}: {str(error) or type(error).__name__}"


def check(text, processes=1):
    """The statement that the text of a certificate proves; raises Failed, or one of MALFORMED, if it proves none."""
    certificate = Certificate(text)
    need(json.loads(text)["statement"] == certificate.statement().split("\n"), "it states another theorem")
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
            print(f"PROVED\n{check(file.read(LARGEST), given.processes)}", flush=True)
    except BrokenPipeError:
        sys.stdout = None  # its reader went away: what is left need not be written
    except (Failed, OSError, *MALFORMED) as failed:
        print(f"NOT PROVED: {given.certificate}: {type(failed).__name__}: {failed}")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
