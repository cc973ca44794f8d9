#!/usr/bin/env python3
"""survey-check OUT.cert: proves the stability map that a certificate states, or says what fails.

This file needs Python and python-flint (ball arithmetic: https://flintlib.org, https://arblib.org), and nothing else: it
can be copied, read in an hour, and run alone (`python checker.py OUT.cert`). It believes no number of the certificate.
What the certificate states, and what the word PROVED then means, is printed by `statement` below.

HILL'S EQUATION. y'' + z(u, p) y = 0 with two real parameters p = (p1, p2) in a rectangle. The certificate gives z by
formulas on consecutive pieces of [0, S], and a kind:
    even      z is continued by z(-u) = z(u) and z(S + u) = z(S - u); its period is T = 2 S;
    periodic  z is continued by z(u + S) = z(u); its period is T = S.
y1, y2 are the solutions with y1 = 1, y1' = 0 and y2 = 0, y2' = 1 at u = 0; a dash is d/du.

1. VERDICTS. All solutions are bounded for all u if |D| < 2, and one is unbounded if |D| > 2, D = y1(T) + y2'(T)
   (Magnus and Winkler, Hill's Equation, 1966, theorem 1.1). If z is even, D - 2 = 4 y1'(S) y2(S) and
   D + 2 = 4 y1(S) y2'(S): only the signs of the four factors are needed.
2. ONE STEP (`Equation.step`). Let |z| <= Z on the disc |u - u0| <= R of the complex plane, z analytic there, w >= sqrt(Z),
   w > 0, 0 < h < R, x = h/R. On every ray from u0, v = (w y, y') satisfies |v'| <= w |v| in the maximum norm, so
   |w y| <= e^(wR) |v(u0)| on the disc; by Cauchy the Taylor coefficients satisfy |a_n| <= M R^-n with
   M = e^(wR) max(|y(u0)|, |y'(u0)|/w). Cut after degree N, at u0 + h:
       |y - sum| <= M x^(N+1) / (1 - x),     |y' - sum'| <= (M/R) (N+1) x^N / (1 - x)^2.
3. THE PARAMETERS (`Equation.truncation`). A panel is a rectangle of parameters, mapped to [-1, 1]^2. Let f be one of the
   factors. If |f| <= M for p1 on the Bernstein ellipse E_r (semi-axes (r +- 1/r)/2), f analytic inside, p2 real, then
   the interpolant I1 f at the n Chebyshev points of the first kind satisfies |f - I1 f| <= 4 M r^(1-n) / (r - 1): the
   coefficients of f are at most 2 M r^-k, and T_k, k >= n, is interpolated by 0 or by some +-T_j (Trefethen,
   Approximation Theory and Approximation Practice, theorem 8.1 and chapter 4). In two variables
       |f - I1 I2 f| <= |f - I1 f| + L |f - I2 f|,     L = 1 + (2/pi) log n1 >= the norm of I1 (Rivlin, 1974).
4. GROWTH (`Equation.growth`). For complex z and a constant w > 0 the Euclidean norm of (w y, y') grows at a rate of at
   most the logarithmic norm |w^2 - conj(z)| / (2w) of [[0, w], [-z/w, 0]]; so |(w y, y')(S)| is at most
   exp(int_0^S |w^2 - conj(z)| / (2w) du) |(w y, y')(0)|. On the ellipse this gives M for all four factors.
5. CELLS (`Panel.check`). The interpolant is written in Bernstein's polynomials of a cell, whose coefficients enclose its
   values there; a cell is halved by de Casteljau's matrices. If all coefficients, which are balls, exceed the bound of 3,
   the factor is positive on the whole cell, its border included; negative likewise.
"""

import ast
import hashlib
import json
import sys
from argparse import ArgumentParser
from contextlib import nullcontext
from fractions import Fraction
from functools import lru_cache, partial
from itertools import product
from math import comb
from multiprocessing import get_context

from flint import acb, arb, arb_mat, arb_series, ctx

FORMAT = "survey-certificate 1"
PANEL = {"nodes", "ellipses", "rates", "steps", "order", "cells"}
KINDS = ("even", "periodic")
STABLE, UNSTABLE, OPEN, SPLIT = "s", "u", "o", "+"  # "+" is followed by its four quarters
VERDICTS = {STABLE: "stable", UNSTABLE: "unstable", OPEN: "open"}
QUARTERS = ((1, 1), (1, 0), (0, 1), (0, 0))  # (upper half of p2, of p1), the first in the text being the last here
DEEPEST = 24  # a panel's cells are halved at most so often
RATIO = arb(1) / 8  # h / R of a step
ARCS, BOXES, COVER = 24, 16, 4  # of an ellipse's upper half, of each piece of [0, S], of an ellipse's box: where z is bounded
LARGEST = 2**23  # characters of a certificate


class Failed(Exception):
    """The certificate proves nothing; says why."""


def need(condition, why):
    if not condition:
        raise Failed(why)


# ---------------------------------------------------------------------------------------------------------- formulas


class Formula:
    """An expression in u and the parameters: + - * / ** (whole exponents), numbers (exact decimals), pi, FUNCTIONS."""

    def __init__(self, text, names):
        need(isinstance(text, str) and len(text) < 20_000, "a formula is not a text, or too long")
        try:
            self.tree = ast.parse(text, mode="eval").body
        except (SyntaxError, ValueError, RecursionError, MemoryError):
            raise Failed(f"not a formula: {text[:80]!r}") from None
        self.text, self.numbers = text, {}
        self._admit(self.tree, {*names, "pi"}, 0)

    def _admit(self, node, names, depth):
        """Nothing but arithmetic may stand in a formula."""
        need(depth < 200, "a formula is nested too deeply")
        if isinstance(node, ast.Constant):
            text = ast.get_source_segment(self.text, node)
            need(type(node.value) in (int, float), f"{text!r} is not a number")
            self.numbers[node] = Fraction(text)
        elif isinstance(node, ast.Name):
            need(node.id in names, f"{node.id!r} is neither u, nor pi, nor a parameter")
        elif isinstance(node, ast.UnaryOp):
            need(isinstance(node.op, ast.USub), "an operation is not allowed")
            self._admit(node.operand, names, depth + 1)
        elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
            need(isinstance(node.right, ast.Constant) and type(node.right.value) is int, "an exponent is not whole")
            need(0 <= node.right.value <= 64, "an exponent is not between 0 and 64")
            self._admit(node.left, names, depth + 1)
        elif isinstance(node, ast.BinOp):
            need(isinstance(node.op, (ast.Add, ast.Sub, ast.Mult, ast.Div)), "an operation is not allowed")
            self._admit(node.left, names, depth + 1)
            self._admit(node.right, names, depth + 1)
        else:
            need(
                isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in FUNCTIONS
                and len(node.args) == 1 and not node.keywords,
                f"{ast.get_source_segment(self.text, node)!r} is not allowed",
            )  # fmt: skip
            self._admit(node.args[0], names, depth + 1)

    def __call__(self, **values):
        """Its value, or its power series, for balls, complex balls or series of balls."""
        return self._value(self.tree, values)

    def _value(self, node, values):
        if isinstance(node, ast.Constant):
            return exact(self.numbers[node])
        if isinstance(node, ast.Name):
            return arb.pi() if node.id == "pi" else values[node.id]
        if isinstance(node, ast.UnaryOp):
            return -self._value(node.operand, values)
        if isinstance(node, ast.Call):
            return FUNCTIONS[node.func.id](self._value(node.args[0], values))
        left = self._value(node.left, values)
        if isinstance(node.op, ast.Pow):
            return power(left, node.right.value)
        right = self._value(node.right, values)
        if isinstance(node.op, ast.Add):
            return left + right
        if isinstance(node.op, ast.Sub):
            return left - right
        return left * right if isinstance(node.op, ast.Mult) else left / right


def power(x, n):
    """x^n by repeated multiplication."""
    found = x if n % 2 else arb(1)
    return found if n < 2 else found * power(x * x, n // 2)


def _branch(name):
    """A function with a branch cut: of a complex ball that meets the cut it is not a number."""
    return lambda x: getattr(x, name)(analytic=True) if isinstance(x, acb) else getattr(x, name)()


def _even_part(x, sign):
    """(e^x + sign e^-x) / 2: arb's series know neither cosh nor sinh."""
    return (x.exp() + sign * (-x).exp()) / 2


FUNCTIONS = {
    "sin": lambda x: x.sin(),
    "cos": lambda x: x.cos(),
    "tan": lambda x: x.sin() / x.cos(),
    "exp": lambda x: x.exp(),
    "sinh": lambda x: _even_part(x, -1),
    "cosh": lambda x: _even_part(x, 1),
    "tanh": lambda x: _even_part(x, -1) / _even_part(x, 1),
    "log": _branch("log"),
    "sqrt": _branch("sqrt"),
}


def exact(number):
    """The ball of a rational number."""
    return arb(number.numerator) / number.denominator


def rational(text):
    """A rational number given as a text: '0.99', '-7/3'."""
    need(isinstance(text, str) and len(text) < 60, "a number is not a short text")
    try:
        return Fraction(text)
    except (ValueError, ZeroDivisionError):
        raise Failed(f"{text!r} is not a rational number") from None


def whole(value, least, most, what):
    need(type(value) is int and least <= value <= most, f"{what} is not a whole number from {least} to {most}")
    return value


# ------------------------------------------------------------------------------------------------------ the equation


class Equation:
    """y'' + z(u, p) y = 0 on [0, S], in pieces [(S_k, z_k)]; what it promises of its solutions, in balls."""

    def __init__(self, kind, pieces, names):
        need(kind in KINDS, f"the kind of z is neither {' nor '.join(KINDS)}")
        need(isinstance(pieces, list) and 0 < len(pieces) <= 100, "there must be 1 to 100 pieces of [0, S]")
        self.kind, self.names, self.pieces = kind, names, []
        start = arb(0)
        for end, z in pieces:
            end, text = Formula(end, [])(), end
            need(end > start, "the ends of the pieces of [0, S] do not increase")
            self.pieces.append((start, end, text, Formula(z, ["u", *names])))
            start = end
        self.span = start

    def steps(self, box, count, order, ratio):
        """[(u0, h, z, (y, y' of either solution left out))]: `count` steps a piece; `box`: balls of the parameters."""
        found = []
        for start, end, _, z in self.pieces:
            h = (end - start) / count
            radius = h / ratio
            for number in range(count):
                u0 = start + number * h
                disc = acb(u0 + radius * arb(0, 1), radius * arb(0, 1))
                size = acb(z(u=disc, **box)).abs_upper()
                need(size.is_finite(), f"z is not bounded on the disc of step {number}: shorter steps are needed")
                w = size.sqrt().upper() + exact(Fraction(1, 1024))
                growth = (w * radius).exp()
                y = growth * ratio ** (order + 1) / (1 - ratio)
                dy = growth / radius * (order + 1) * ratio**order / (1 - ratio) ** 2
                found.append((u0, h, z, ((y, dy), (y / w, dy / w))))
        return found

    def factors(self, steps, order, point):
        """y1, y1', y2, y2' at S for the parameters `point` (balls)."""
        ctx.cap = order + 1
        y1, dy1, y2, dy2 = arb(1), arb(0), arb(0), arb(1)
        for u0, h, z, left_out in steps:
            series = arb_series(z(u=arb_series([u0, 1]), **point))
            z_n = [series[n] for n in range(order - 1)]
            (a, da), (b, db) = (
                self._step(z_n, h, order, *start, *missed)
                for start, missed in zip(((arb(1), arb(0)), (arb(0), arb(1))), left_out, strict=True)
            )
            y1, dy1 = a * y1 + b * dy1, da * y1 + db * dy1
            y2, dy2 = a * y2 + b * dy2, da * y2 + db * dy2
        return y1, dy1, y2, dy2

    @staticmethod
    def _step(z_n, h, order, y, dy, y_missed, dy_missed):
        """y and y' after one step, from the Taylor series with the coefficients z_n of z; with what it leaves out."""
        a = [y, dy]
        for n in range(order - 1):
            total = sum((z_n[j] * a[n - j] for j in range(n + 1)), arb(0))
            a.append(-total / ((n + 1) * (n + 2)))
        value, slope = arb(0), arb(0)
        for n in range(order, -1, -1):
            slope = slope * h + value
            value = value * h + a[n]
        return value + y_missed * arb(0, 1), slope + dy_missed * arb(0, 1)

    def growth(self, box, w):
        """exp(int_0^S |w^2 - conj(z)| / (2w) du) for parameters in the complex balls of `box`."""
        total = arb(0)
        for start, end, _, z in self.pieces:
            part = (end - start) / BOXES
            for number in range(BOXES):
                u = start + (end - start) * share(number, BOXES)
                value = acb(z(u=u, **box))
                total += (w * w - value.conjugate()).abs_upper() / (2 * w) * part
        return total.exp()

    def truncation(self, sides, counts, ellipses, rates):
        """Bounds of |f - I1 I2 f| for each factor f; `sides`: (centre, half length) of both parameters."""
        real = {name: centre + half * arb(0, 1) for name, (centre, half) in zip(self.names, sides, strict=True)}
        parts = []
        for name, (centre, half), n, r, w in zip(self.names, sides, counts, ellipses, rates, strict=True):
            worst = self.on_ellipse(real, name, centre, half, r, w)
            part = 4 * r ** (1 - n) / (r - 1)
            y1, dy1, y2, dy2 = worst, worst * w, worst / w, worst
            parts.append([part * m for m in ((y1, dy1, y2, dy2) if self.kind == "even" else (y1 + dy2,) * 2)])
        norm = 1 + 2 / arb.pi() * arb(counts[0]).log()
        return [(first + norm * second).upper() for first, second in zip(*parts, strict=True)]

    def on_ellipse(self, real, name, centre, half, r, w):
        """The largest `growth` where this parameter lies on the ellipse: on its upper half, by reflection."""
        self._analytic(real, name, centre, half, r)
        worst = arb(0)
        for number in range(ARCS):
            turn = acb(0, arb.pi() * share(number, ARCS)).exp()
            arc = centre + half * (r * turn + 1 / (r * turn)) / 2
            worst = worst.max(self.growth({**real, name: arc}, w))
        need(worst.is_finite(), "z is not bounded on an ellipse")
        return worst

    def _analytic(self, real, name, centre, half, r):
        """z must be analytic in this parameter inside the ellipse: finite on boxes that cover it, for all u."""
        across, up = half * (r + 1 / r) / 2, half * (r - 1 / r) / 2
        for start, end, _, z in self.pieces:
            for part, i, j in product(range(BOXES), range(COVER), range(COVER)):
                u = start + (end - start) * share(part, BOXES)
                inside = acb(centre + across * (2 * share(i, COVER) - 1), up * (2 * share(j, COVER) - 1))
                need(acb(z(u=u, **{**real, name: inside})).is_finite(), f"z is singular in {name} inside an ellipse")


def share(number, of):
    """The ball of [number, number + 1] / of."""
    return (arb(number) / of).union(arb(number + 1) / of)


# --------------------------------------------------------------------------------------------------------------- cells


class Panel:
    """A rectangle of parameters on which the factors are polynomials to within `truncation`; its cells."""

    def __init__(self, equation, sides, data):
        need(isinstance(data, dict) and set(data) == PANEL, f"a panel must have {', '.join(sorted(PANEL))}")
        need(all(len(data[key]) == 2 for key in ("nodes", "ellipses", "rates")), "a panel has two of a kind")
        self.counts = [whole(n, 2, 40, "a number of nodes") for n in data["nodes"]]
        self.ellipses, self.rates = ([exact(rational(x)) for x in data[key]] for key in ("ellipses", "rates"))
        need(all(r > 1 for r in self.ellipses) and all(w > 0 for w in self.rates), "r <= 1 or w <= 0")
        self.order, self.steps = whole(data["order"], 2, 400, "an order"), whole(data["steps"], 1, 10_000, "steps")
        need(isinstance(data["cells"], str) and set(data["cells"]) <= set(VERDICTS) | {SPLIT}, "unknown cells")
        self.equation, self.cells = equation, data["cells"]
        self.sides = [(exact((low + high) / 2), exact((high - low) / 2)) for low, high in sides]

    def polynomials(self):
        """For each factor: its Bernstein coefficients on the panel, and the bound of what they leave out."""
        equation, names = self.equation, self.equation.names
        nodes = [[(arb.pi() * (2 * i + 1) / (2 * n)).cos() for i in range(n)] for n in self.counts]
        box = {name: centre + half * arb(0, 1) for name, (centre, half) in zip(names, self.sides, strict=True)}
        steps = equation.steps(box, self.steps, self.order, RATIO)
        values = []
        for x, y in product(*nodes):
            place = (centre + half * at for (centre, half), at in zip(self.sides, (x, y), strict=True))
            y1, dy1, y2, dy2 = equation.factors(steps, self.order, dict(zip(names, place, strict=True)))
            even = equation.kind == "even"
            values.append((y1, dy1, y2, dy2) if even else (2 - y1 - dy2, 2 + y1 + dy2))
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
        waiting = [([0] * len(tables), [lambda table=table: table for table in tables])]
        for position, letter in enumerate(self.cells, 1):
            signs, tables = waiting.pop()
            if letter == OPEN:
                continue
            tables = [known or table() for known, table in zip(signs, tables, strict=True)]
            signs = [known or sign(*pair) for known, *pair in zip(signs, tables, bounds, strict=True)]
            if letter == SPLIT:
                waiting += [
                    (signs, [quarter(table, halves[0][right], halves[1][upper]) for table in tables])
                    for upper, right in QUARTERS
                ]
            else:
                need(self.verdict(signs) == letter, f"cell {position} is not proved to be {VERDICTS[letter]}")
        return shares

    def verdict(self, signs):
        """What the signs of the factors prove."""
        if self.equation.kind == "even":
            y1, dy1, y2, dy2 = signs
            below, above = -dy1 * y2, y1 * dy2  # the signs of 2 - D and 2 + D
        else:
            below, above = signs
        return UNSTABLE if -1 in (below, above) else STABLE if below == above == 1 else OPEN


def bernstein(nodes):
    """The matrix of Bernstein's polynomials of degree n - 1 on [-1, 1] at n nodes."""
    n = len(nodes)
    rows = [[comb(n - 1, j) * power((1 + x) / 2, j) * power((1 - x) / 2, n - 1 - j) for j in range(n)] for x in nodes]
    return arb_mat(rows)


def halving(n):
    """Bernstein coefficients on an interval -> on its lower and on its upper half (de Casteljau)."""
    lower = [[arb(comb(i, j)) / 2**i for j in range(n)] for i in range(n)]
    upper = [[lower[n - 1 - i][n - 1 - j] for j in range(n)] for i in range(n)]
    return arb_mat(lower), arb_mat(upper)


def quarter(table, first, second):
    """The coefficients on a quarter of the cell, once they are needed."""
    return lambda: first * table * second.transpose()


def shares_of(cells):
    """{verdict: the share of the panel that its cells have}; raises Failed unless the cells cover the panel."""
    shares, waiting = dict.fromkeys(VERDICTS, Fraction(0)), [0]
    for letter in cells:
        need(waiting, "there are more cells than cover the panel")
        depth = waiting.pop()
        need(depth <= DEEPEST, "a cell is too small")
        if letter == SPLIT:
            waiting += [depth + 1] * 4
        else:
            shares[letter] += Fraction(1, 4**depth)
    need(not waiting, "the cells do not cover the panel")
    return shares


def open_panel():
    """The data of a panel of which nothing is stated."""
    return {"nodes": [2, 2], "ellipses": ["2", "2"], "rates": ["1", "1"], "steps": 1, "order": 2, "cells": OPEN}


def sign(table, bound):
    """1 or -1 if the polynomial, and all that differs from it by at most `bound`, has this sign on its cell; else 0."""
    corner = table[0, 0]
    if corner > bound:
        return 1 if all(x > bound for x in table.entries()) else 0
    return -1 if corner < -bound and all(x < -bound for x in table.entries()) else 0


# --------------------------------------------------------------------------------------------------------- certificate


class Certificate:
    """What the text of a certificate states; raises Failed if it is not one."""

    def __init__(self, text):
        need(len(text) < LARGEST, "the certificate is too long")
        try:
            data = json.loads(text)
        except (ValueError, RecursionError):
            raise Failed("the certificate is not JSON") from None
        need(isinstance(data, dict) and data.get("format") == FORMAT, f"the format is not {FORMAT!r}")
        try:
            need(digest(data) == data["sha256"], "it was changed: its digest is another")
            self._read(data)
        except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
            raise Failed(f"the certificate is malformed ({type(error).__name__}: {error})") from None

    def _read(self, data):
        ctx.prec = whole(data["bits"], 53, 4096, "the number of bits")
        self.names = names = [str(name) for name in data["parameters"]]
        good = all(name.isidentifier() and name not in {"u", "pi", *FUNCTIONS} for name in names)
        need(good and len(names) == len(set(names)) == 2, "there must be two parameters with names of their own")
        self.equation = Equation(data["equation"]["kind"], data["equation"]["pieces"], names)
        self.sides = [tuple(rational(end) for end in side) for side in data["rectangle"]]
        good = len(self.sides) == 2 and all(len(side) == 2 and side[0] < side[1] for side in self.sides)
        need(good, "the rectangle must have two sides of positive length")
        self.across = [whole(n, 1, 4096, "a number of panels") for n in data["panels"]["across"]]
        self.panels = data["panels"]["list"]
        number = self.across[0] * self.across[1] if len(self.across) == 2 else 0
        need(len(self.panels) == number, "the panels do not cover the rectangle")
        self.shares = {letter: rational(data["shares"][letter]) for letter in VERDICTS}

    def panel(self, number):
        """The Panel of this number: the second parameter varies first."""
        at = divmod(number, self.across[1])
        sides = [
            [low + (high - low) * Fraction(i + end, n) for end in (0, 1)]
            for (low, high), i, n in zip(self.sides, at, self.across, strict=True)
        ]
        return Panel(self.equation, sides, self.panels[number])

    def statement(self, shares):
        """The theorem in words; `shares`: {verdict: its share of the rectangle}."""
        (a, b), (c, d) = self.sides
        first, second = self.names
        start, lines = "0", []
        for _, _, end, z in self.equation.pieces:
            lines.append(f"    z(u) = {z.text}    for {start} <= u <= {end},")
            start = end
        even = f"    z(-u) = z(u), z({start} + u) = z({start} - u), and the period T = 2 ({start})."
        lines.append(even if self.equation.kind == "even" else f"    z(u + T) = z(u), the period T = {start}.")
        cells = [sum(panel["cells"].count(letter) for panel in self.panels) for letter in VERDICTS]
        lines = [
            "Consider y'' + z(u) y = 0, where", *lines,
            f"The rectangle {a} <= {first} <= {b}, {c} <= {second} <= {d} is divided into {sum(cells):,} cells.",
            f"In each of the {cells[0]:,} stable cells, borders included, |D| < 2: all solutions are bounded.",
            f"In each of the {cells[1]:,} unstable cells, borders included, |D| > 2: a solution grows exponentially.",
            f"Of {cells[2]:,} cells nothing is stated. (D is the trace of the monodromy matrix over T.)",
        ]  # fmt: skip
        for letter in (STABLE, UNSTABLE):
            low, high = shares[letter], shares[letter] + shares[OPEN]
            area = [decimal((b - a) * (d - c) * part, 12, part is high) for part in (low, high)]
            percent = [decimal(100 * part, 4, part is high) for part in (low, high)]
            lines.append(
                f"The {VERDICTS[letter]} points have an area from {area[0]} to {area[1]}, which is "
                f"{percent[0]} % to {percent[1]} % of the rectangle."
            )
        return "\n".join(lines)


def digest(data):
    """The SHA-256 of all but itself."""
    body = json.dumps({key: data[key] for key in sorted(set(data) - {"sha256"})}, sort_keys=True)
    return hashlib.sha256(body.encode()).hexdigest()


def decimal(number, digits, up):
    """A rational number with so many decimals, rounded up or down."""
    scaled = number * 10**digits
    scaled = -(-scaled.numerator // scaled.denominator) if up else scaled.numerator // scaled.denominator
    return f"{scaled // 10**digits}.{scaled % 10**digits:0{digits}d}"


def proved(text, number):
    """The shares of the verdicts of one panel, or why they are not proved; in a process of its own."""
    try:
        return once_read(text).panel(number).check()
    except Failed as failed:
        return f"panel {number + 1}: {failed}"
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        return f"panel {number + 1} is malformed ({type(error).__name__}: {error})"


once_read = lru_cache(maxsize=1)(Certificate)


def check(text, processes=1, report=lambda done, total: None):
    """The statement that the text of a certificate proves; raises Failed if it proves none."""
    certificate = once_read(text)
    total, number = dict.fromkeys(VERDICTS, Fraction(0)), len(certificate.panels)
    with get_context("spawn").Pool(processes) if processes > 1 else nullcontext() as pool:
        for done, found in enumerate((pool.imap if pool else map)(partial(proved, text), range(number)), 1):
            need(isinstance(found, dict), found)
            total = {letter: total[letter] + found[letter] / number for letter in VERDICTS}
            report(done, number)
    need(total == certificate.shares, "the shares of the verdicts are not those that it states")
    return certificate.statement(total)


def main(arguments=None):
    """Print PROVED and the statement (exit 0), or NOT PROVED and the first thing that fails (exit 1)."""
    parser = ArgumentParser(prog="survey-check", description="Prove the stability map that a certificate states.")
    parser.add_argument("certificate", metavar="OUT.cert")
    parser.add_argument("-j", "--processes", type=int, default=1, metavar="N", help="processes; 1 by default")
    given = parser.parse_args(arguments)

    def report(done, total):
        if sys.stderr.isatty():
            print(f"\r{done} of {total} panels", end="\n" if done == total else "", file=sys.stderr)

    try:
        with open(given.certificate, encoding="utf-8") as file:
            statement = check(file.read(LARGEST), given.processes, report)
    except (Failed, OSError, UnicodeDecodeError) as failed:
        print(f"NOT PROVED: {given.certificate}: {failed}")
        return 1
    print(f"PROVED\n{statement}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
