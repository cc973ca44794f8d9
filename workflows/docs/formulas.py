"""Formulas of the public docstrings as TeX: in a terminal they are read as they stand, on the site they are typeset."""

import re

TYPESET = {
    "y'' + 2 c y' + z(u, p) y = 0": r"y'' + 2c\,y' + z(u, p)\,y = 0",
    "y'' + z(u, p) y = 0": r"y'' + z(u, p)\,y = 0",
    "0 <= u <= T": r"0 \le u \le T",
    "z(T - u) = z(u)": r"z(T - u) = z(u)",
    "[0, T]": r"[0, T]",
    "w w' = f(phi, p) w + g(phi, p)": r"w\,w' = f(\varphi, p)\,w + g(\varphi, p)",
    "phi' = w, w' = f(phi, p) w + g(phi, p)": r"\varphi' = w,\ w' = f(\varphi, p)\,w + g(\varphi, p)",
    "(w = 0)": r"(w = 0)",
    "2 pi": r"2\pi",
    "x' = A(t, p) x": r"x' = A(t, p)\,x",
    "M q'' + C q' + K q = 0": r"M q'' + C q' + K q = 0",
    "M q' + C q / 2": r"M q' + \tfrac12 C q",
    "R A(-t) R = -A(t)": r"R\,A(-t)\,R = -A(t)",
    "J A": r"JA",
    "n x n": r"n \times n",
    "q'": r"q'",
    "x' = f(t, x, p)": r"x' = f(t, x, p)",
    "x'": r"x'",
    "|error| <= rtol (1 + |value|)": r"\lvert\mathrm{error}\rvert \le \mathrm{rtol}\,(1 + \lvert\mathrm{value}\rvert)",
    "df/dx": r"\partial f / \partial x",
}
_FORMULA = re.compile("|".join(rf"(?<![\w`]){re.escape(text)}(?!\w)" for text in sorted(TYPESET, key=len)[::-1]))


def typeset(line):
    """A line of a docstring with its formulas as math roles; examples and what stands in backticks stay as they are."""
    if line.lstrip().startswith((">>>", "...")):
        return line
    parts = re.split(r"(`[^`]*`)", line)
    parts[::2] = [_FORMULA.sub(lambda found: f":math:`{TYPESET[found[0]]}`", part) for part in parts[::2]]
    return "".join(parts)
