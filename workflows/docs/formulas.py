"""Formulas of the public docstrings and of the scenes' tables as TeX: in a terminal they are read
as they stand, on the site they are typeset.
"""

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
_FORMULA = re.compile(
    "|".join(rf"(?<![\w`]){re.escape(text)}(?!\w)" for text in sorted(TYPESET, key=len)[::-1])
)


def typeset(line):
    """A line of a docstring with its formulas as math roles; examples and what stands in backticks
    stay as they are.
    """
    if line.lstrip().startswith((">>>", "...")):
        return line
    parts = re.split(r"(`[^`]*`)", line)
    parts[::2] = [
        _FORMULA.sub(lambda found: f":math:`{TYPESET[found[0]]}`", part) for part in parts[::2]
    ]
    return "".join(parts)


GREEK = "Delta|alpha|beta|gamma|delta|epsilon|theta|lambda|mu|nu|rho|sigma|phi|psi|omega|Omega|pi|zeta|eta|kappa|tau"
FUNCTIONS = {name: rf"\operatorname{{{name}}}" for name in ("sech", "asin", "sin", "cos", "ln")} | {
    "sqrt": r"\sqrt"
}
RELATIONS = {"<=": r"\le", ">=": r"\ge", "!=": r"\ne", "->": r"\to", "=": "=", "<": "<", ">": ">"}
BINARY = {*RELATIONS, "+", "-", "/"}
OTHER_NAMES = {"Iz": "I_z", "inf": r"\infty", "mu**": r"\mu^{**}"}
_TOKEN = re.compile(
    r"(?P<number>\d+(?:\.\d+)?(?:e[+-]?\d+)?(?:\.\.\.)?)"
    r"|(?P<name>[A-Za-z]+\d*(?:_[A-Za-z\d]+)*\*{0,2}'{0,2})"
    r"|(?P<power>\^[-+]?\w+)|(?P<modulus>\|[^\s|]+\|)|(?P<sign><=|>=|!=|->|[-+/=<>()])|(?P<space>\s+)|."
)
# to an equation, or a condition: apart from what precedes
_REFERENCE = re.compile(r"(?<= )\((?:[\w.]+|\w+ = -?\w+)\)")
_NAME = re.compile(rf"({GREEK}|[A-Za-z])(\d*)(?:_({GREEK}|[A-Za-z]|\d+))?")


def in_words(text, symbols):
    """Words of a table with their formulas as TeX between dollars, as [(is it a formula?, piece),
    ...].

    A formula is a run of numbers, signs and names, those of `symbols` {name: TeX}, Greek and single
    letters, in which something is related, divided, added, raised to a power or Greek.
    """
    pieces, run = [], []
    for token in [*_TOKEN.finditer(text), None]:
        tex = (
            _tex(token, symbols)
            if token and not (run and _REFERENCE.match(text, token.start()))
            else None
        )
        if tex is not None:
            run.append((token[0], tex))
            continue
        pieces += _pieces(run)
        run = []
        pieces += [(False, token[0])] if token else []
    return pieces


def _tex(token, symbols):
    """The TeX of a token that may belong to a formula; None for others."""
    text, kind = token[0], token.lastgroup
    if kind == "number":
        base, _, power = text.removesuffix("...").partition("e")
        times = (
            f"10^{{{int(power)}}}"
            if base == "1" and power
            else base + (rf"\cdot 10^{{{int(power)}}}" if power else "")
        )
        return times + (r"\ldots" if text.endswith("...") else "")
    if kind == "name":
        before, after = token.string[: token.start()].rstrip(), token.string[token.end() :].lstrip()
        bounded = text in symbols and (
            before.endswith(("<", "<=")) or after.startswith(("<", "!="))
        )
        return symbols[text] if bounded else _of_name(text, symbols)
    if kind == "power":
        return f"^{{{_of_name(text[1:], symbols) or text[1:]}}}"
    if kind == "modulus":
        return rf"\lvert {_inside(text[1:-1], symbols)}\rvert"
    return " " if kind == "space" else RELATIONS.get(text, text) if kind == "sign" else None


def _inside(text, symbols):
    """The TeX of what stands between bars, in one word."""
    return " ".join(_tex(token, symbols) or token[0] for token in _TOKEN.finditer(text))


def _of_name(text, symbols):
    name = text.rstrip("'")
    primes = text[len(name) :]
    if name in FUNCTIONS or name in OTHER_NAMES:
        return FUNCTIONS.get(name) or OTHER_NAMES[name]
    stars = len(name) - len(name.rstrip("*"))
    match = _NAME.fullmatch(name.rstrip("*"))
    if name in symbols and (match or "_" in name) and "(" not in symbols[name]:
        return symbols[name] + primes
    if not match:
        return None
    letter, number, index = (
        rf"\{part}" if part and re.fullmatch(GREEK, part) else part for part in match.groups()
    )
    below = ", ".join(part for part in (number, index) if part)
    return (
        letter
        + (f"_{{{below}}}" if below else "")
        + ("^{" + "*" * stars + "}" if stars else "")
        + primes
    )


def _pieces(run):
    """The pieces of a run of (text, TeX): a formula, without what does not belong to it at its
    ends, or text.
    """
    first, last = 0, len(run)
    while first < last and (run[first][0].isspace() or _stray(run[first:last], 0)):
        first += 1
    while first < last and (run[last - 1][0].isspace() or _stray(run[first:last], -1)):
        last -= 1
    inner = run[first:last]
    if not _is_formula(inner):
        return [(False, "".join(text for text, _ in run))] if run else []
    before, after = (
        "".join(text for text, _ in run[:first]),
        "".join(text for text, _ in run[last:]),
    )
    formula = re.sub("  +", " ", "".join(tex for _, tex in _spaced(inner)))
    formula = re.sub(r"\\sqrt\s*(\S.*?rvert|\S+)", r"\\sqrt{\1}", formula)
    return [(False, before), (True, f"${formula}$"), (False, after)]


def _spaced(run):
    return [(text, f" {tex} " if text in RELATIONS else tex) for text, tex in run]


def _stray(run, end):
    """Is the token at this end a sign that needs another one beyond it, or a bracket without its
    counterpart?
    """
    text, texts = run[end][0], [text for text, _ in run]
    if text in "()":
        outward = (text == "(") == (end == 0)
        return not outward or texts.count("(") != texts.count(")")
    if end == 0 and text[0] == "^":
        return True
    of_next = end == 0 and text in "+-" and len(run) > 1 and not run[1][0].isspace()
    return text in BINARY and not of_next


def _is_formula(run):
    texts = [text for text, _ in run]
    named = any(re.search(r"[A-Za-z]", text) for text in texts)
    marked = any(text in BINARY or text[:1] in "^|" or text in FUNCTIONS for text in texts)
    return (named and marked) or any(re.match(rf"(?:{GREEK})(?![a-z])", text) for text in texts)
