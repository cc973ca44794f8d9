"""Wording that messages share, and untrusted text made harmless."""

import html
import unicodedata

SHOWN = 60  # characters of a value in a message
LISTED = 200  # of a list of allowed names
LINE = 1200  # of a message: some name several paths
# Classes that Jupyter and Sphinx leave alone: dollars in untrusted text are not TeX.
NO_FORMULAS = "tex2jax_ignore mathjax_ignore"


def counted(number, noun):
    """'1 point', '1,200 points'."""
    return f"{number:,} {noun}{'' if number == 1 else 's'}"


def summary(docstring):
    """Its first paragraph, on one line."""
    return docstring.strip().split("\n\n")[0].replace("\n", " ")


def plain(text, most=LINE, lines=False):
    """The text with control and invisible characters escaped, such as \\x1b, and the middle of a
    long one left out.

    `most`: characters that are kept. `lines`: are line breaks kept?
    """
    if len(text) > most:
        half = most // 2
        text = f"{text[:half]} [... {len(text) - 2 * half:,} characters ...] {text[-half:]}"
    if text.isprintable():
        return text
    return "".join(
        c if _is_seen(c) or (lines and c == "\n") else c.encode("unicode_escape").decode()
        for c in text
    )


def short(text, most=SHOWN):
    """The text in one plain line of at most `most` characters, the middle of a longer one left out."""
    text = plain(str(text), LINE)
    end = most // 3
    return text if len(text) <= most else f"{text[: most - end - 5]} ... {text[-end:]}"


def shown(value, most=SHOWN):
    """The repr of a value in one short line, as messages show it."""
    try:
        if type(value).__module__ == "numpy" and getattr(value, "shape", None) == ():
            value = value.item()  # 0.5, not np.float64(0.5)
        return short(repr(value), most)
    except Exception:  # an integer of more than 4300 digits, or an object whose repr fails
        return f"a value of type {type(value).__name__} that cannot be shown"


def reason_of(error):
    """Why a file cannot be read or written, in a few words."""
    if isinstance(error, UnicodeDecodeError):
        return "it is not UTF-8 text"
    return getattr(error, "strerror", None) or short(error, 150)


def listed(names):
    """'a, b, c', or 'a, b, c and 17 more'."""
    names = [short(name) for name in names]
    first = len(names)
    while first > 1 and len(", ".join(names[:first])) > LISTED:
        first -= 1
    return ", ".join(names[:first]) + (
        f" and {len(names) - first} more" if first < len(names) else ""
    )


def html_table(title, rows):
    """An HTML table of rows of text, which may be untrusted."""
    body = "".join("<tr>" + "".join(_cell(text) for text in row) + "</tr>" for row in rows)
    return f"<div class='{NO_FORMULAS}'><table><caption>{html.escape(plain(title))}</caption>{body}</table></div>"


def _cell(text):
    return f"<td style='text-align:left;vertical-align:top'>{html.escape(plain(str(text)))}</td>"


def _is_seen(character):
    return character.isprintable() or unicodedata.category(character) == "Zs"
