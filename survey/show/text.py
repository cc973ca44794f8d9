"""Text from a file for matplotlib: taken literally, or as a formula that it can draw; labels and titles."""

import re
import textwrap
from functools import lru_cache

import numpy as np
from matplotlib.mathtext import MathTextParser

from survey.wording import plain

MAX_TEXT, MAX_FORMULA = 300, 120  # characters of a text and of a formula in a file
WIDE = 80  # characters of a line below axes, where `layout.fit` breaks what is wider
OF_QUESTION = ("question", "branch", "motion")  # options that say nothing of the system
# what the values of other options mean, where they do not say it themselves
IN_WORDS = {
    "axis": "rotation about the axis of {}",
    "separatrix": "{} separatrix",
    "side": "{} side",
    "root": "{} root",
}
# what long names and titles spell in ASCII, and how it is printed; a symbol with an index is a formula
_SPELT = (
    (r"\bp_(theta|psi)\b", r"$p_\\\1$"),
    (r"\bp_phi\b", r"$p_\\varphi$"),
    (r"(?<!\\)\b(theta|phi|psi|epsilon)\b", lambda found: _GREEK[found[1]]),
    (r"\bsqrt(?=\|)", "√"),
    (r"\bsqrt\((\w+)\)", r"√\1"),
    (r"(?<=\w)\^(\d+)\b", lambda found: found[1].translate(_RAISED)),
    (r" -> ", " → "),
    (r"(?<=[-+])inf\b", "∞"),
    (r"(?<![\w.)])-(?=[\d∞])", "\N{MINUS SIGN}"),
)
_GREEK = {"theta": "θ", "phi": "φ", "psi": "ψ", "epsilon": "ε"}
_RAISED = str.maketrans("-0123456789", "\N{SUPERSCRIPT MINUS}⁰¹²³⁴⁵⁶⁷⁸⁹")
MAX_DEPTH = 6  # of nested braces in a formula
WITH_LENGTHS = ("\\hspace", "\\genfrac")  # TeX that takes lengths, which may be miles


def literal(text, most=MAX_TEXT):
    """Text from a file for matplotlib: no formulas, nothing invisible, and not endless."""
    return plain(str(text), most).replace("$", r"\$")


def printed(text):
    """Literal text of a long name or a title with Greek letters, roots, powers and arrows as they are printed."""
    for spelt, glyph in _SPELT:
        text = re.sub(spelt, glyph, text)
    return text


def formula(symbol, name):
    """`symbol` as a formula, if it is TeX that matplotlib can draw, and not the name, which would
    become subscripts; else the name as text.
    """
    return f"${symbol}$" if _is_formula(symbol) and not _is_name(symbol, name) else literal(name)


def _is_name(symbol, name):
    return symbol == name and len(symbol) > 2


@lru_cache(maxsize=512)
def _is_formula(symbol):
    if (
        not 0 < len(symbol) <= MAX_FORMULA
        or "$" in symbol
        or not symbol.isprintable()
        or _depth(symbol) > MAX_DEPTH
    ):
        return False
    if any(command in symbol for command in WITH_LENGTHS):
        return False
    try:
        MathTextParser("path").parse(f"${symbol}$")
    except (ValueError, RecursionError):
        return False
    return True


def _depth(symbol):
    """How deep braces are nested."""
    depth = np.cumsum([(c == "{") - (c == "}") for c in symbol])
    return int(depth.max(initial=0))


def label_of(variable, width=40):
    """`long name, symbol (unit)`, in lines of at most so many characters."""
    symbol, units = variable.attrs.get("symbol", ""), variable.attrs.get("units", "1")
    text = literal(variable.attrs.get("long_name", variable.name))
    shown = _is_formula(symbol) and "flag_values" not in variable.attrs
    shown = shown and not _is_name(symbol, variable.name)
    # TeX is longer than what it shows: inserted last; a name that only spells its symbol would
    # repeat it
    text = (
        "$$"
        if shown and text in (symbol, symbol.lstrip("\\"), _spelt(symbol))
        else f"{text},\N{NO-BREAK SPACE}$$"
        if shown
        else text
    )
    text += "" if units in ("1", "") else f"\N{NO-BREAK SPACE}({_with_powers(units)})"
    wrapped = textwrap.fill(text, width, break_long_words=False).replace("\N{NO-BREAK SPACE}", " ")
    wrapped = printed(wrapped)
    return wrapped.replace("$$", f"${symbol}$") if shown else wrapped


def _spelt(symbol):
    """The name in a symbol that is upright text, as those of a user's parameters are."""
    return symbol.removeprefix(r"\mathrm{").removesuffix("}").replace(r"\_", "_")


def _with_powers(units):
    """`rad s-1` as it is printed: powers raised, no line broken within."""
    raised = re.sub(
        r"(?<=[A-Za-z])(-?\d+)\b", lambda power: power[1].translate(_RAISED), literal(units)
    )
    return raised.replace(" ", "\N{NO-BREAK SPACE}")


def title_of(ds, variable):
    """The survey's title, what is drawn if no axis or colour bar says so, as of verdicts, the
    options that are words, and the numbers that are fixed and not zero.
    """
    title = literal(ds.attrs.get("title", ""))
    name = literal(variable.attrs.get("long_name", variable.name))
    fixed = fixed_numbers(ds, variable)
    position = {name: f" ({_position(ds[name], c)} of {ds.sizes[name]})"
                for name, c in variable.coords.items() if c.ndim == 0 and ds.sizes.get(name, 1) > 1}  # fmt: skip
    numbers = [f"{_equal(c)}{position.get(c.name, '')}" for c in fixed]
    labels = [c for c in variable.coords.values() if c.ndim == 0 and c.dtype.kind in "UO"]
    numbers = ", ".join(
        numbers
        + [f"{literal(c.name)} {literal(c.item())}{position.get(c.name, '')}" for c in labels]
    )
    words = options_in_words(ds)
    labelled = title and (
        "flag_values" not in variable.attrs
        or (variable.ndim == 1 and variable.dims[0] in ds.coords)
    )
    lines = [title] if labelled or name.lower() in title.lower() else [title, name]
    lines[-1] += f" ({words})" if words and words not in title else ""
    lines = [printed(line) for line in lines]
    return "\n".join([*lines, numbers] if numbers else lines)


def fixed_numbers(ds, variable):
    """The fixed parameters that a title names: those of axes, and others that are not zero."""
    fixed = [c for c in variable.coords.values() if c.ndim == 0 and c.dtype.kind in "fi"]
    return [c for c in fixed if c.name in ds.dims or (float(c) != 0 and not _is_default(c))]


def options_in_words(ds):
    """The options that say something in words, such as `prolate`; what is drawn says which question
    is asked.
    """
    pairs = [part.partition("=")[::2] for part in str(ds.attrs.get("options", "")).split(", ")]
    return ", ".join(
        IN_WORDS.get(key, "{}").format(spaced(value))
        for key, value in pairs
        if key not in OF_QUESTION and value[:1].isalpha()
    )


def _is_default(fixed):
    """Is it an orbit's number that means the last orbit, or the only one?"""
    return fixed.name == "branch" and float(fixed) < 0


def _position(axis, coordinate):
    """Where a value stands on its axis, counted from 1."""
    return int(np.argmax(axis.values == coordinate.item())) + 1


def _equal(coordinate):
    """`symbol = number` of a fixed parameter."""
    symbol, number = coordinate.attrs.get("symbol") or coordinate.name, f"{float(coordinate):.6g}"
    return (
        f"${symbol} = {number}$"
        if _is_formula(symbol)
        else f"{literal(coordinate.name)} = {number}"
    )


def spaced(name):
    return literal(name.replace("_", " ").strip())
